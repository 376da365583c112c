"""Edges of the rings of a layered workpiece, as rows of numbers."""
