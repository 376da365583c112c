"""Pockets with one thing wrong that the simulation of their written text, or the machine, shows."""

from __future__ import annotations

import io

import ezdxf

from adversary.base import Case, Job, changes, cutter, stated

OUTLINE = [(0.0, 0.0), (18.0, 0.0), (18.0, 14.0), (0.0, 13.0)]
MACHINE = """name = "small"
dialect = "linuxcnc"
decimals = 6
rapid_mm_min = 24000.0
feed_max_mm_min = 12000.0
corner_tolerance_mm = 0.005
[axis.x]
min_mm = -400.0
max_mm = 400.0
acceleration_mm_s2 = 3000.0
[axis.y]
min_mm = -250.0
max_mm = 250.0
acceleration_mm_s2 = 3000.0
[axis.z]
min_mm = -250.0
max_mm = 250.0
acceleration_mm_s2 = 2500.0
[spindle]
min_rpm = 60.0
max_rpm = 15000.0
"""
END_MILL = {
    "number": 1, "diameter_mm": 8.0, "flutes": 3, "helix_deg": 30.0, "flute_length_mm": 20.0, "overhang_mm": 28.0,
    "modulus_gpa": 580.0, "centre_cutting": True,
}  # fmt: skip


def pocket_job() -> Job:
    """A pocket of 18 x 14 mm, 4 mm deep, entered by a helix; it holds."""
    drawing, text = ezdxf.new(), io.StringIO()
    drawing.modelspace().add_lwpolyline(OUTLINE, close=True)
    drawing.write(text)
    tables = {
        "part": {"file": "part.dxf", "units": "mm"},
        "stock": {"top_mm": 0.0},
        "machine": {"file": "m.toml"},
        "material": {"name": "al7075-t6"},
        "cutter": [dict(END_MILL)],
        "operation": [
            {
                "kind": "pocket", "cutter": 1, "milling": "down", "radial_depth_mm": 1.2, "axial_depth_mm": 4.0,
                "feed_mm_min": 955.0, "speed_rpm": 7960.0, "step_mm": 0.4, "clearance_mm": 5.0,
            }
        ],
        "limits": {"engagement_deg": 60.0},
    }  # fmt: skip
    return Job(tables, {"part.dxf": text.getvalue(), "m.toml": MACHINE})


def spindle(line: str):
    """State a key of the spindle of the machine."""
    return lambda job: job.files.update({"m.toml": f"{job.files['m.toml']}{line}\n"})


def case(name: str, wrong: str, change, state, found: str = "") -> Case:
    """A case of the pocket."""
    return Case(name, wrong, change, state, found, pocket_job)


CASES = (
    case("pocket", "nothing: a pocket that holds", lambda job: None, "holds"),
    case("pocket-left-hand", "a left-hand cutter, started by M4", cutter(left_hand=True), "holds"),
    case(
        "pocket-left-hand-without-m4",
        "a left-hand cutter on a spindle that turns clockwise only",
        changes(cutter(left_hand=True), spindle("counter_clockwise = false")),
        "refused",
        "cuts under M4",
    ),
    case(
        "pocket-weak-spindle",
        "a spindle too weak for the bottom edges of the entry at any feed",
        spindle("power_w = 400.0"),
        "exceeds",
        "spindle_power_w",
    ),
    case(
        "pocket-above-limit-of-engagement",
        "passes with more engagement than allowed",
        stated("limits", engagement_deg=40.0),
        "exceeds",
        "engagement_deg",
    ),
    case(
        "pocket-cutter-too-fast", "a spindle speed above that of the cutter", cutter(max_rpm=6000.0), "refused",
        "max_rpm",
    ),
    case(
        "pocket-helix-without-centre-teeth",
        "a helical entry of a cutter without teeth at its centre and without a stated ramp angle",
        cutter(centre_cutting=False),
        "unproven",
        "plunge",
    ),
)  # fmt: skip
