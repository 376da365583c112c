"""What the cutter touches: contact arcs of the rim."""
