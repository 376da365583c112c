"""Difference and intersection of areas in the plane, and their use on the tiles of a layered stock, compiled."""
