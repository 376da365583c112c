"""Pallet angles that one check point forbids to one cutter, exactly."""
