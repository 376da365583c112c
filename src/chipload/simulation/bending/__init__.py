"""Compiled loops of :mod:`chipload.simulation.deflection`."""
