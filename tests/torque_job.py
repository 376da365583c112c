"""Tables of torque jobs that tests write, as TOML: spindle, override and loop."""

SPINDLE = """[spindle]
inertia_kg_m2 = 0.003
torque_constant_nm_a = 0.15
torque_constant_error_share = 0.01
idle_a = [2.0, 0.004]
stiffness_a_s = 0.5
reset_a = 5.0
most_current_a = 40.0
sensor_lag_s = 0.01
smoothing_s = 0.02
noise_a = 0.03
current_step_a = 0.005
idle_error_share = 0.01
"""
#: the loop goes on behind it
OVERRIDE_AND_LOOP = """[torque_control.override]
hold = 0.9
overload_nm = 2.0
torque_most_nm = 6.0
light_nm = 0.03
floor = 0.05
cap = 1.0
start = 0.3
air_override = 1.0
lost_override = 0.2
lost_s = 1.0
[loop]
period_ms = 10.0
latency_ms = 50.0
override_step = 0.01
"""
#: rounds of a thin tube with three surprises, planned by the nominal loads
TUBE_JOB = (
    """
[round]
cutter = 1
milling = "down"
top_mm = -1.0
bottom_mm = -2.0
pitch_mm = 1.0
feed_mm_min = 1800.0
speed_rpm = 6000.0
clearance_mm = 5.0
lead_mm = 9.0
[machine]
name = "vmc"
[material]
name = "al6082-t6"
[[cutter]]
number = 1
diameter_mm = 10.0
flutes = 3
helix_deg = 30.0
flute_length_mm = 22.0
overhang_mm = 30.0
modulus_gpa = 580.0
[torque_control.shell]
mean_radius_mm = 12.0
length_mm = 30.0
wall_mm = 1.5
clamped = "low"
clamp_z_mm = -30.0
modulus_gpa = 70.0
poisson = 0.33
strength_mpa = 250.0
stock_mm = 1.5
wall_tolerance_mm = 0.1
[[surprise]]
kind = "thicker-side"
share = 0.3
at_deg = -90.0
[[surprise]]
kind = "hard-spot"
share = 0.2
at_deg = 180.0
width_mm = 10.0
ramp_mm = 4.0
[[surprise]]
kind = "thinner-wall"
share = 0.02
"""
    + SPINDLE
    + """[spindle.deviation]
torque_constant_percent = 0.5
idle_percent = 0.5
"""
    + OVERRIDE_AND_LOOP
    + """acceleration_mm_s2 = 1000.0
[simulation]
step_mm = 2.0
layer_mm = 0.5
tolerance_mm = 0.02
[checks]
confidence = 0.5
[limits]
form_error_um = 30.0
strength_share = 0.9
torque_over_percent = 5.0
"""
)
