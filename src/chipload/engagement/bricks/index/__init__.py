"""The index of moves in bricks."""
