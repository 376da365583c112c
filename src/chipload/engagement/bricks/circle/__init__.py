"""Contact on a circle of a cutter in any direction."""
