"""Loads over a revolution, all rotations of a step at once."""
