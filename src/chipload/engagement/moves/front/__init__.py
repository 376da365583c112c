"""Compiled search of the engaged part of the cutting edge."""
