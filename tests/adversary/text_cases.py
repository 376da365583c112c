"""Texts of programs with one thing wrong, on their own or against the machine and the tools that are stated."""

from __future__ import annotations

from adversary.base import Case, changes, cutter, file, replaced, stated

CASES = (
    Case(
        "rapid-down", "a rapid goes down into the block", replaced("G0 Z-2", "G0 X30\nG0 Z-2"), "exceeds", "rapid-cuts"
    ),
    Case("no-spindle", "the spindle is never started", replaced("S6000 M3\n", ""), "refused", "spindle at rest"),
    Case("spindle-backwards", "M4 with a right-hand cutter", replaced("M3", "M4"), "exceeds", "spindle-reversed"),
    Case("left-hand", "M3 with a left-hand cutter", cutter(left_hand=True), "exceeds", "spindle-reversed"),
    Case("no-feed", "no feed is stated", replaced(" F900", ""), "unproven", "nc-not-read"),
    Case(
        "feed-of-machine",
        "a feed that the machine does not reach",
        replaced("F900", "F20000"),
        "exceeds",
        "machine-feed",
    ),
    Case(
        "speed-of-machine",
        "a speed that the spindle does not reach",
        replaced("S6000", "S20000"),
        "exceeds",
        "machine-spindle",
    ),
    Case("slow-spindle", "a speed below that of the spindle", replaced("S6000", "S20"), "exceeds", "machine-spindle"),
    Case(
        "wrong-tool",
        "the program calls a tool that has no cutter",
        replaced("T1 M6\nG43 H1", "T2 M6\nG43 H2"),
        "refused",
        "no [[cutter]]",
    ),
    Case(
        "comment-diameter",
        "the comment of the tool states 12 mm",
        replaced("T1 M6", "(T1 D=12. FLAT END MILL)\nT1 M6"),
        "refused",
        "must agree",
    ),
    Case(
        "table-diameter",
        "the tool table states 12 mm",
        changes(stated("program", tools="t.tbl"), file("t.tbl", "T1 P1 Z50 D12\n")),
        "refused",
        "must agree",
    ),
    Case("zero-point", "the zero is elsewhere: nothing is cut", replaced("Y20", "Y200"), "unproven", "nothing-cut"),
    Case(
        "feed-too-high",
        "F9000 for F900: above the torque that is allowed",
        changes(replaced("F900", "F9000"), stated("limits", torque_nm=2.0)),
        "exceeds",
        "torque_nm",
    ),
    Case(
        "inches",
        "a text in mm read in inches: the machine is too small",
        replaced("G21", "G20"),
        "exceeds",
        "machine-limit",
    ),
    Case(
        "second-offset",
        "a second work offset whose place is not stated",
        replaced("G0 Z10\nM5", "G0 Z10\nG55 G0 X0\nM5"),
        "unproven",
        "nc-offset-unset",
    ),
    Case(
        "machine-coordinates",
        "G53 without a stated work offset",
        replaced("G0 Z10\nM5", "G53 G0 Z10\nM5"),
        "unproven",
        "nc-machine-coordinates",
    ),
    Case("probing", "the program probes", replaced("G0 Z-2", "G38.2 Z5 F100\nG0 Z-2"), "unproven", "nc-probe"),
    Case(
        "unknown-code",
        "a code that the control does not have",
        replaced("G0 Z-2", "G987\nG0 Z-2"),
        "unproven",
        "nc-unknown-word",
    ),
    Case(
        "other-length",
        "the length of another tool",
        replaced("G43 H1", "G43 H2"),
        "unproven",
        "nc-length-of-another-tool",
    ),
    Case(
        "short-flutes",
        "a slot deeper than the flutes",
        changes(cutter(flute_length_mm=1.5), replaced("F900", "F600")),
        "exceeds",
        "axial_overrun_mm",
    ),
    Case(
        "thin-cutter",
        "a cutter of 2 mm in a slot for 10 mm",
        cutter(diameter_mm=2.0, flute_length_mm=8.0),
        "exceeds",
        "cutter_stress_mpa",
    ),
    Case(
        "incremental-start",
        "G91 before a position is stated",
        replaced("G21 G90", "G21 G91"),
        "unproven",
        "nc-start-unknown",
    ),
)
