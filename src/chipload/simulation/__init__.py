"""What a Program does, found without knowing how it was planned."""
