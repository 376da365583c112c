"""What the feed override does while the program runs: spindle, controller, plant."""
