"""Loads of the teeth times a lever that depends on the height, over a revolution."""
