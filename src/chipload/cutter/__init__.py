"""Cutters: their shape, and the files that describe them."""
