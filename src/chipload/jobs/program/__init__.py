"""A program that exists: read, simulated, its feeds optimised."""
