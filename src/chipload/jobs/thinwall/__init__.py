"""The result of cutting a thin wall: three variants, simulated."""
