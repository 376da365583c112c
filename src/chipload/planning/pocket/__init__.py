"""Pockets cleared at constant engagement by a front."""
