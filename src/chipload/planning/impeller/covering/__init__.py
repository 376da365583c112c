"""Which of the ranges of a cutter hold between the check points too."""
