"""Harmonics of the cutting force."""
