"""Undeformed chips on layers: what a cutter covers during a move, and what of it is new."""
