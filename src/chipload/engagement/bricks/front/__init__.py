"""Compiled search of the engaged part of the edge of a cutter whose axis leans or turns."""
