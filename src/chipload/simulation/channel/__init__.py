"""What a program of a turning pallet leaves on the walls and the floor of a channel."""
