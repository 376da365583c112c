"""Crossings of the boundaries of two areas, compiled."""
