"""Slices of a cutter's profile that are in contact at an instant."""
