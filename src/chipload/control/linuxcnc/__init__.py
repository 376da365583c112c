"""The side of the machine: its path, its spindle, its pins."""
