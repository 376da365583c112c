"""Which part of each slice of a cutter is in the layered workpiece, and how thick it cuts there."""
