"""Lines and arcs, offsets, drawings."""
