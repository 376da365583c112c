"""Programs with one thing wrong that their machine, cutter and stock show."""

from __future__ import annotations

from adversary.base import DRILL, TABLE, Case, Change, Job, changes, cutter, file, program, replaced, slot_job, stated

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
HEAD = "G21 G90 G17 G94\nG54\nT1 M6\nG43 H1\nS{speed} M3\nG0 X30 Y20 Z10\n"
DRILL_IN_BLOCK = changes(lambda job: job.tables.update(cutter=[dict(DRILL)]), stated("stock", layer_mm=2.0))
DRILLING = changes(
    lambda job: job.tables.update(
        cutter=[dict(DRILL)], stock={"low_mm": (0.0, 0.0, -80.0), "high_mm": (60.0, 40.0, 0.0), "layer_mm": 2.0}
    ),
    stated("machine_table", low_mm=(-200.0, -200.0, -120.0), high_mm=(200.0, 200.0, -90.0)),
)
SHORT_DRILL = cutter(bottom_deg=31.0, flutes=2)
TAP = {"number": 1, "body_mm": ((2.5, 0.0), (2.5, 20.0)), "overhang_mm": 40.0, "name": "M6 tap"}


def hole(words: str, speed: int = 3000) -> Change:
    """A program that makes one hole by the words of its cycle."""
    return program(HEAD.format(speed=speed) + f"{words}\nG80\nG0 Z10\nM5\nM2\n")


def tap(words: str, speed: int = 500, **keys: object) -> Change:
    """A tap of M6 in the spindle, and a program of one thread."""
    return changes(lambda job: job.tables.update(cutter=[{**TAP, **keys}]), hole(words, speed))


def modes(*directions: str) -> Change:
    """Modes of the cutter, each in a direction."""
    mode = {"tool": 1, "of": "cutter", "frequency_hz": 1200.0, "damping_ratio": 0.03, "stiffness_n_um": 40.0}
    return stated("dynamics", mode=[{**mode, "direction": d} for d in directions])


def feeds_job() -> Job:
    """The base job with new feeds, which holds."""
    job = slot_job()
    job.tables["operation"][0]["feeds"] = {"slowest_percent": 50.0, "fastest_percent": 120.0}
    return job


FANUC: Change = lambda job: job.tables.update(machine={"name": "vmc-fanuc"})  # noqa: E731

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
        "length-h0-fanuc",
        "H0 takes the length away on a Fanuc",
        changes(
            TABLE_OF_TOOLS,
            stated("program", control="fanuc"),
            replaced("G43 H1", "G43 H0"),
            replaced("X-10 Y20 Z10", "X-10. Y20. Z10."),
            replaced("Z-2\nG1 X70", "Z-2.\nG1 X70."),
            replaced("G0 Z10\nM5", "G0 Z10.\nM5"),
        ),
        "unproven",
        "nc-length-missing",
    ),
    Case(
        "spindle-oriented-in-cut",
        "M19 stops the spindle in the material, then the cutter goes up",
        replaced("G1 X70 F900", "G1 X30 F900\nM19"),
        "exceeds",
        "spindle-stopped-in-cut",
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
    Case(
        "approach-in-stock",
        "the first rapid ends 2 mm inside the block",
        replaced("G0 X-10 Y20 Z10\nG0 Z-2", "G0 X30 Y20 Z-2"),
        "exceeds",
        "approach-through-stock",
    ),
    Case(
        "approach-plunge",
        "X and Y first, then a rapid down into the block",
        replaced("G0 X-10 Y20 Z10\nG0 Z-2", "G0 X30 Y20\nG0 Z-2"),
        "exceeds",
        "approach-through-stock",
    ),
    Case(
        "approach-low",
        "the first rapid ends beside the block below its top: its way may go through the block",
        replaced("G0 X-10 Y20 Z10\nG0 Z-2", "G0 X-10 Y20 Z-2"),
        "unproven",
        "approach-unknown",
    ),
    Case(
        "approach-feed-in-stock",
        "the first motion is a cut that ends in the block",
        replaced("G0 X-10 Y20 Z10\nG0 Z-2\nG1 X70 F900", "G1 X30 Y20 Z-2 F900\nX70"),
        "unproven",
        "approach-unknown",
    ),
    Case(
        "approach-feed-above",
        "nothing: the first motion is a cut that ends above the block",
        replaced("G0 X-10 Y20 Z10", "G1 X-10 Y20 Z10 F2000"),
        "holds",
        "",
    ),
    Case(
        "approach-down-beside",
        "nothing: X and Y first, then straight down beside the block",
        replaced("G0 X-10 Y20 Z10\nG0 Z-2", "G0 X-10 Y20\nG0 Z-2"),
        "holds",
        "",
    ),
    Case(
        "drill-through",
        "a drill goes 4 mm through the bottom; what lies below is not stated",
        changes(DRILL_IN_BLOCK, hole("G81 X30 Y20 Z-24 R2 F600", 6000)),
        "unproven",
        "below-stock",
    ),
    Case(
        "drill-through-table",
        "a drill goes 4 mm through the bottom into the table",
        changes(
            DRILL_IN_BLOCK,
            stated("machine_table", low_mm=(-200.0, -200.0, -60.0), high_mm=(200.0, 200.0, -22.0)),
            hole("G81 X30 Y20 Z-24 R2 F600", 6000),
        ),
        "exceeds",
        "collision",
    ),
    Case(
        "drill-through-above-table",
        "nothing: the table lies 10 mm below the block",
        changes(
            DRILL_IN_BLOCK,
            stated("machine_table", **TABLE),
            hole("G81 X30 Y20 Z-24 R2 F600", 6000),
        ),
        "holds",
        "",
    ),
    Case(
        "slot-through",
        "an end mill cuts 1 mm below the bottom of the block",
        changes(replaced("Y20", "Y-4.5"), replaced("G0 Z-2", "G0 Z-21")),
        "unproven",
        "below-stock",
    ),
    Case("tap-end-mill", "an end mill taps", hole("G84 X30 Y20 Z-15 R2 F100", 6000), "exceeds", "tap-cutter"),
    Case(
        "tap-feed",
        "the feed is not the pitch of the tap times the spindle speed",
        tap("G84 X30 Y20 Z-15 R2 F400", thread_pitch_mm=1.0),
        "exceeds",
        "tap-pitch",
    ),
    Case(
        "tap-feed-rigid",
        "G33.1 taps with another pitch than that of the tap",
        tap("G0 Z2\nG33.1 Z-15 K0.8", thread_pitch_mm=1.0),
        "exceeds",
        "tap-pitch",
    ),
    Case(
        "tap-feed-comment",
        "the feed is not the pitch that the comment of the tool states",
        changes(tap("G84 X30 Y20 Z-15 R2 F400"), replaced("T1 M6\n", "(T1 M6X1 TAP)\nT1 M6\n")),
        "exceeds",
        "tap-pitch",
    ),
    Case(
        "tap-no-pitch",
        "a tap whose pitch is not stated",
        tap("G84 X30 Y20 Z-15 R2 F500"),
        "unproven",
        "tap-pitch-unknown",
    ),
    Case(
        "end-in-cut",
        "the program ends with the cutter in the material",
        replaced("G1 X70 F900\nG0 Z10\nM5\n", "G1 X30 F900\n"),
        "exceeds",
        "ends-in-cut",
    ),
    Case(
        "end-in-stock",
        "the program ends with the cutter in the slot that it has cut",
        replaced("G1 X70 F900\nG0 Z10\n", "G1 X70 F900\nG0 X30\n"),
        "unproven",
        "ends-in-stock",
    ),
    Case(
        "spindle-stop-in-cut",
        "the spindle is stopped in the material, then the cutter goes up",
        replaced("G1 X70 F900\n", "G1 X30 F900\nM5\n"),
        "exceeds",
        "spindle-stopped-in-cut",
    ),
    Case(
        "spindle-stop-after-plunge",
        "the spindle is stopped at the bottom of a plunge",
        replaced("G0 Z-2\nG1 X70 F900\n", "G0 X30 Z1\nG1 Z-2 F100\nM5\n"),
        "exceeds",
        "spindle-stopped-in-cut",
    ),
    Case(
        "spindle-stop-in-slot",
        "nothing: the spindle is stopped where the slot is open",
        replaced("G0 Z10\nM5", "M5\nG0 Z10"),
        "holds",
        "",
    ),
    Case(
        "dwell-in-cut",
        "a dwell in the slot",
        replaced("G1 X70 F900", "G1 X30 F900\nG4 P2\nG1 X70"),
        "unproven",
        "dwell-in-cut",
    ),
    Case(
        "dwell-on-bottom",
        "a dwell of 5 s at the bottom of a plunge",
        replaced("G1 X70 F900", "G0 Z1\nX30\nG1 Z-2 F100\nG4 P5\nG0 Z10\nX70"),
        "unproven",
        "dwell-in-cut",
    ),
    Case(
        "dwell-in-air",
        "nothing: a dwell beside the block",
        replaced("G1 X70 F900", "G4 P2\nG1 X70 F900"),
        "holds",
        "",
    ),
    Case(
        "stop-in-cut",
        "the program waits for its operator in the slot",
        replaced("G1 X70 F900", "G1 X30 F900\nM0\nG1 X70"),
        "unproven",
        "stop-in-cut",
    ),
    Case(
        "optional-stop-in-cut",
        "M1 in the slot",
        replaced("G1 X70 F900", "G1 X30 F900\nM1\nG1 X70"),
        "unproven",
        "stop-in-cut",
    ),
    Case(
        "change-in-cut",
        "the tool is changed where it stands in the slot",
        changes(
            lambda job: job.tables["cutter"].append({**job.cutter, "number": 2}),
            replaced("G1 X70 F900", "G1 X30 F900\nT2 M6\nG43 H2\nS6000 M3\nG1 X70"),
        ),
        "unproven",
        "tool-change-in-stock",
    ),
    Case(
        "drill-long-step",
        "a drill pushes by 486 N at a limit of 420 N, over the last quarter of a step of 100 mm",
        changes(
            DRILLING,
            stated("stock", low_mm=(0.0, 0.0, -5.0)),
            stated("limits", force_n=420.0),
            hole("G81 X30 Y20 Z-10 R20 F600", 3000),
            lambda job: job.tables["operation"][0].update(step_mm=100.0),
        ),
        "exceeds",
        "force_n",
    ),
    Case(
        "deep-hole",
        "a hole of 12.7 diameters in one motion",
        changes(DRILLING, hole("G81 X30 Y20 Z-76 R2 F600", 6000), cutter(flute_length_mm=80.0, overhang_mm=100.0)),
        "unproven",
        "deep-hole",
    ),
    Case(
        "deep-hole-one-peck",
        "G83 with a peck as deep as the hole",
        changes(DRILLING, hole("G83 X30 Y20 Z-40 R2 Q50 F600", 6000)),
        "unproven",
        "deep-hole",
    ),
    Case(
        "deep-hole-stated",
        "a hole deeper than the drill may go without a retraction",
        changes(DRILLING, cutter(hole_depth_mm=15.0), hole("G81 X30 Y20 Z-20 R2 F600", 6000)),
        "exceeds",
        "deep-hole",
    ),
    Case(
        "drill-sideways",
        "a tool with the point of a drill mills a groove",
        changes(SHORT_DRILL, replaced("G0 Z-2", "G0 Z-0.5")),
        "unproven",
        "drill-sideways",
    ),
    Case(
        "drill-sideways-stated",
        "a drill whose web is stated mills a groove",
        changes(SHORT_DRILL, cutter(web_mm=1.5), replaced("G0 Z-2", "G0 Z-0.5")),
        "exceeds",
        "drill-sideways",
    ),
    Case(
        "mill-with-a-point",
        "nothing: a mill with a point and a stated ramp angle mills a groove",
        changes(SHORT_DRILL, cutter(ramp_angle_deg=3.0), replaced("G0 Z-2", "G0 Z-0.5")),
        "holds",
        "",
    ),
    Case(
        "deep-hole-pecks",
        "nothing: the hole is drilled in pecks",
        changes(DRILLING, hole("G83 X30 Y20 Z-40 R2 Q10 F600", 6000)),
        "holds",
        "",
    ),
    Case(
        "cutter-speed",
        "the spindle turns faster than the cutter may",
        cutter(max_rpm=5000.0),
        "exceeds",
        "cutter-speed",
    ),
    Case("modes-z", "a mode of the cutter along its axis alone", modes("z"), "unproven", "stability_margin"),
    Case("modes-x", "modes of the cutter along X alone", modes("x", "x"), "unproven", "stability_margin"),
    Case("modes-xy", "nothing: modes of the cutter along X and Y", modes("x", "y"), "holds", ""),
    Case(
        "block-delete-retract",
        "with block delete on, the retract is skipped and a rapid goes through the block",
        replaced("G1 X70 F900\nG0 Z10", "G1 X-4 F900\n/G0 Z10\nG0 X70\nG0 Z10"),
        "exceeds",
        "rapid-cuts",
    ),
    Case(
        "block-delete-off",
        "with block delete off, a rapid goes through the block",
        replaced("G1 X70 F900", "/G0 X20\nG1 X70 F900"),
        "exceeds",
        "rapid-cuts",
    ),
    Case(
        "block-delete-load",
        "with block delete on, the first of two levels is skipped and the force exceeds its limit",
        changes(
            replaced("G0 Z-2\nG1 X70 F900", "G0 Z-2\n/G1 X70 F900\n/G0 Z10\n/X-10\nG0 Z-4\nG1 X70 F900"),
            stated("limits", force_n=200.0),
        ),
        "exceeds",
        "block-delete",
    ),
    Case("block-delete-coolant", "nothing: a block without motions", replaced("M5\n", "/M9\nM5\n"), "holds", ""),
    Case(
        "feeds-end-in-cut",
        "a program that is given new feeds ends in the material",
        replaced("G1 X70 F900\nG0 Z10\nM5\n", "G1 X30 F900\n"),
        "exceeds",
        "ends-in-cut",
        base=feeds_job,
    ),
    Case(
        "feeds-below",
        "a program that is given new feeds cuts below the bottom of the block",
        changes(replaced("Y20", "Y-4.5"), replaced("G0 Z-2", "G0 Z-21")),
        "unproven",
        "below-stock",
        base=feeds_job,
    ),
    Case(
        "fanuc-spindle-stop",
        "the spindle is stopped in the material, on a Fanuc",
        changes(
            FANUC,
            program(
                "O1\nG21 G90 G17 G94\nG28 G91 Z0.\nG90 G54\nT1 M6\nS6000 M3\nG0 X-10. Y20.\nG43 H1 Z10.\n"
                "Z-2.\nG1 X30. F900.\nM5\nG0 Z10.\nM30\n"
            ),
        ),
        "exceeds",
        "spindle-stopped-in-cut",
    ),
    Case(
        "fanuc-home-from-cut",
        "nothing: the cutter is retracted by G28 from the slot before the spindle stops",
        changes(
            FANUC,
            program(
                "O1\nG21 G90 G17 G94\nG90 G54\nT1 M6\nS6000 M3\nG0 X-10. Y20.\nG43 H1 Z10.\n"
                "Z-2.\nG1 X30. F900.\nG28 G91 Z0.\nM5\nM30\n"
            ),
        ),
        "holds",
        "",
    ),
    Case(
        "heidenhain-stop-in-cut",
        "STOP in the slot, in conversational language",
        changes(
            stated("program", dialect="heidenhain"),
            program(
                "BEGIN PGM P MM\nTOOL CALL 1 Z S6000\nL Z+10 R0 FMAX M3\nL X-10 Y+20 R0 FMAX\n"
                "L Z-2 R0 FMAX\nL X+30 R0 F900\nSTOP\nL X+70 R0 F900\nL Z+10 R0 FMAX M5\nEND PGM P MM\n"
            ),
        ),
        "unproven",
        "stop-in-cut",
    ),
)
