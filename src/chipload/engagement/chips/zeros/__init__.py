"""Grazing points of a section."""
