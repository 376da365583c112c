"""The text of a job that takes its finish path from a program."""

JOB = """
[part]
file = "{file}"
lines = [{first}, {last}]
[stock]
top_mm = 0.0
[machine]
name = "{machine}"
[material]
name = "al7075-t6"
[[cutter]]
number = 1
diameter_mm = 10.0
flutes = 4
helix_deg = 30.0
flute_length_mm = 22.0
overhang_mm = 35.0
modulus_gpa = 580.0
[[operation]]
kind = "contour"
cutter = 1
side = "{side}"
milling = "down"
strategies = ["plain", "backward"]
use = "backward"
joint = "sharp"
radial_depth_mm = 0.1
semifinish_depth_mm = 0.5
axial_depth_mm = 5.0
feed_mm_min = 600.0
speed_rpm = 3000.0
tolerance_mm = 0.05
step_mm = 0.1
lead_mm = 3.0
clearance_mm = 5.0
[limits]
engagement_deg = 13.0
"""
