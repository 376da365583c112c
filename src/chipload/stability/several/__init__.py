"""The map of a period with several delays, in two or three directions."""
