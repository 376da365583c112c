"""Tiles of a layered stock as arrays of numbers, from which compiled loops remove areas."""
