"""Compiled loops of the dexels."""
