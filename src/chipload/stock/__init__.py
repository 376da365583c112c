"""What is left of the stock."""
