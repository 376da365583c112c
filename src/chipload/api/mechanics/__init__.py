"""The mechanics of milling as functions on values: chip, forces, stability, surface error, compliance, modes and fit.

Each function takes a cutter, a material, the engagement of a cut, its feed and its speed, and returns arrays of float64
with their units in the names. They call the functions with which the simulation of a program works.
"""
