"""Compiled loops over the faces of the initial body."""
