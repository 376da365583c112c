"""Area of a layer that a cutter covers on a straight way with a fixed axis, compiled."""
