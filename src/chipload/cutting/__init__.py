"""What a cut costs: material coefficients, force, torque, power, and the wall it leaves."""
