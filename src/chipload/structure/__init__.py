"""What gives way under the force: the cutter as a beam."""
