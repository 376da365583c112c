"""The map of a revolution of a cutter whose teeth are not evenly spaced."""
