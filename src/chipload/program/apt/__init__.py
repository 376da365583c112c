"""APT cutter location data at the edge of a Program."""
