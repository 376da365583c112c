"""Contours and pockets in the plane: planned, written and checked."""
