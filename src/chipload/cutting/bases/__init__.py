"""Loads for 1 of each coefficient of a linear law."""
