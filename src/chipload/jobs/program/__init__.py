"""A program that exists: read, simulated, given new spindle speeds."""
