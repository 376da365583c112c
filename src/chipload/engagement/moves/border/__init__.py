"""Where the material ends on a circle of the cutter."""
