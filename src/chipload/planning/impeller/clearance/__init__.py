"""How far a whole cutter stands from the check points."""
