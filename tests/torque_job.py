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
