"""The cutter of jobs that tests write, as TOML."""

MILL = """[[cutter]]
number = 1
diameter_mm = 10.0
flutes = 2
helix_deg = 30.0
flute_length_mm = 20.0
overhang_mm = 30.0
modulus_gpa = 580.0
"""
