"""Pallet angles at which one whole cutter, with neck, shank and holder, is clear of every check point."""
