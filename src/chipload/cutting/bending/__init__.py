"""The loops of the cutter that bends and of the wall that it leaves."""
