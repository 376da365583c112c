"""Side of a line on which a point lies, compiled."""
