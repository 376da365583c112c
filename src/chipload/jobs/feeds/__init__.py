"""New feeds for a program that exists: its own text with other F words, simulated again."""
