"""Pieces of boundary of any move, and whether a point is covered at some time: what noding needs."""
