"""The simulation of a program in its stock, as the jobs ``program`` and ``feeds`` both state it."""
