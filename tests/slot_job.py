"""A slot of 6 mm in a block of 20 x 10 x 6 mm of aluminium: a program job that takes a tenth of a second."""

from __future__ import annotations

from pathlib import Path

JOB = """[program]
file = "slot.ngc"
[machine]
name = "vmc"
[stock]
low_mm = [0.0, 0.0, -6.0]
high_mm = [20.0, 10.0, 0.0]
[material]
name = "al7075-t6"
[[cutter]]
number = 1
diameter_mm = 6.0
flutes = 2
helix_deg = 30.0
flute_length_mm = 18.0
overhang_mm = 25.0
modulus_gpa = 580.0
[[operation]]
kind = "simulate"
step_mm = {step_mm}
[limits]
torque_nm = 5.0
"""


def slot_program(end: float = 8.0) -> str:
    """The program: a line 2 mm deep from X-8 to ``end`` [mm]."""
    return f"G21 G90 G94\nT1 M6\nS3000 M3\nG0 X-8 Y5 Z5\nG1 Z-2 F300\nX{end:g}\nG0 Z5\nM5\nM2\n"


def slot_text(step: float = 2.0) -> str:
    """The job as TOML; ``step`` is the longest step [mm]."""
    return JOB.format(step_mm=step)


def slot_job(folder: Path, step: float = 2.0, end: float = 8.0) -> Path:
    """The job file in a folder, beside its program."""
    folder.mkdir(exist_ok=True)
    (folder / "slot.ngc").write_text(slot_program(end))
    (folder / "job.toml").write_text(slot_text(step))
    return folder / "job.toml"
