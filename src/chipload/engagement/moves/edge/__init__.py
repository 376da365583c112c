"""Slices of the part of the edge that may be in material."""
