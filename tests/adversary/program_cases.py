"""Programs with one thing wrong that their machine, cutter and stock show."""

from __future__ import annotations

from adversary.base import Case, changes, cutter, file, replaced, stated

#: a LinuxCNC mill with its zero in a corner of the travel
INI = """[EMC]
MACHINE = mill
[RS274NGC]
PARAMETER_FILE = mill.var
[TRAJ]
COORDINATES = X Y Z
LINEAR_UNITS = mm
MAX_LINEAR_VELOCITY = 200
[KINS]
KINEMATICS = trivkins
JOINTS = 3
[AXIS_X]
MIN_LIMIT = -5
MAX_LIMIT = 400
MAX_VELOCITY = 200
MAX_ACCELERATION = 3000
[AXIS_Y]
MIN_LIMIT = -5
MAX_LIMIT = 250
MAX_VELOCITY = 200
MAX_ACCELERATION = 3000
[AXIS_Z]
MIN_LIMIT = -120
MAX_LIMIT = 1
MAX_VELOCITY = 200
MAX_ACCELERATION = 3000
[SPINDLE_0]
MAX_FORWARD_VELOCITY = 15000
"""
LINUXCNC = changes(lambda job: job.tables.update(machine={"file": "mill.ini"}), file("mill.ini", INI))
TABLE_OF_TOOLS = changes(stated("program", tools="t.tbl"), file("t.tbl", "T1 P1 Z50 D10\n"))

CASES = (
    Case("slot", "nothing: the base job", lambda job: None, "holds", ""),
    Case("rapid-through", "a rapid goes through the block", replaced("G1 X70 F900", "G0 X70"), "exceeds", "rapid-cuts"),
    Case(
        "plunge-not-centre-cutting",
        "an end mill without teeth at its centre plunges into solid material",
        changes(cutter(centre_cutting=False), replaced("G0 Z-2", "G0 X30 Z1\nG1 Z-2 F100\nX-10 F900")),
        "exceeds",
        "plunge",
    ),
    Case(
        "no-length-offset",
        "the tool table states a length, and the program has no G43",
        changes(TABLE_OF_TOOLS, replaced("G43 H1\n", "")),
        "unproven",
        "nc-length-missing",
    ),
    Case(
        "length-cancelled",
        "G49 takes the length away before the cut",
        changes(TABLE_OF_TOOLS, replaced("G0 Z-2", "G49\nG0 Z-2")),
        "unproven",
        "nc-length-missing",
    ),
    Case(
        "length-too-late",
        "a rapid goes down before G43",
        changes(TABLE_OF_TOOLS, replaced("G43 H1\n", ""), replaced("G0 Z-2", "G0 Z5\nG43 H1\nG0 Z-2")),
        "unproven",
        "nc-length-missing",
    ),
    Case("length-given", "nothing: G43 and a tool table", TABLE_OF_TOOLS, "holds", ""),
    Case(
        "travel-of-work-offset",
        "the work offset takes X to 450 of 400 mm",
        stated("program", work_offsets={"G54": (380.0, 0.0, 0.0)}),
        "exceeds",
        "machine-limit",
    ),
    Case(
        "travel-of-g10",
        "G10 puts the work offset where Y reaches 270 of 250 mm",
        replaced("G54\n", "G10 L2 P1 X0 Y250 Z0\nG54\n"),
        "exceeds",
        "machine-limit",
    ),
    Case(
        "travel-span",
        "X goes over 801 mm, more than the machine travels, wherever the work lies",
        replaced("G1 X70 F900\nG0 Z10", "G1 X70 F900\nG0 Z10\nX791"),
        "exceeds",
        "machine-limit",
    ),
    Case("travel-not-stated", "no work offset is stated", lambda job: None, "unchecked", "work offset not stated"),
    Case(
        "linuxcnc-offset",
        "nothing: the offset brings all axes into the travel of a LinuxCNC mill",
        changes(LINUXCNC, stated("program", work_offsets={"G54": (100.0, 100.0, -60.0)})),
        "holds",
        "",
    ),
    Case(
        "linuxcnc-saved-offset",
        "the work offset that LinuxCNC saved takes X to 420 of 400 mm",
        changes(LINUXCNC, file("mill.var", "5221 350\n5222 100\n5223 -60\n5230 0\n")),
        "exceeds",
        "machine-limit",
    ),
)
