"""What gives way under the force: the workpiece while it is cut, the cutter as a beam, holder and spindle."""
