"""The machine: its limits and how fast it can follow a path."""
