"""What a text does as a control reads it, for the tests of the controls."""

from __future__ import annotations

import cmath
import math

import numpy as np

from chipload.errors import Severity
from chipload.program.commands import ARC, DWELL, LINE
from chipload.program.control import ControlSettings, control_named
from chipload.program.control_findings import programmed_minutes
from chipload.program.gcode.reader import read_gcode

#: modes and a first position, so that what a test adds is all that it is about
HEAD = "G21 G17 G90 G94 G54\nT1 M6\nS1000 M3\nG0 X0. Y0. Z10.\n"


def read(body, control="fanuc", *, settings=None, head=HEAD, **options):
    """The commands of a text, from HEAD on, and its findings above notes, but for those on tools that nobody states."""
    profile = control_named(control).with_settings(ControlSettings(**(settings or {})))
    end = "" if "M30" in body else "\nM30\n"
    commands, findings = read_gcode(f"{head}{body}{end}", control=profile, lenient=True, **options)
    return commands, [f for f in findings if f.severity > Severity.NOTE]


def ends(commands):
    """(n, 3) ends of the motions [mm], without dwells."""
    return np.round(commands.position[commands.motion != DWELL, :3], 9) + 0.0


def dwells(commands):
    """Times of the dwells [s]."""
    return commands.feed[commands.motion == DWELL].tolist()


def minutes(commands):
    """Time of all cuts and dwells at the programmed feeds [min]."""
    return programmed_minutes(commands)


def codes(findings):
    """The codes of findings."""
    return [f.code for f in findings]


def places(commands):
    """(place, z) where the tool stands on its cuts, 0.1 mm apart."""
    for k in range(1, len(commands.motion)):
        a, b = (complex(*commands.position[j, :2]) for j in (k - 1, k))
        if commands.motion[k] == LINE:
            n = max(2, math.ceil(abs(b - a) / 0.1))
            yield from ((a + (b - a) * i / (n - 1), commands.position[k, 2]) for i in range(n))
        elif commands.motion[k] == ARC:
            m, turns = complex(*commands.centre[k]), int(commands.turns[k])
            sweep = (
                cmath.phase((b - m) / (a - m)) % math.tau if turns > 0 else -(cmath.phase((a - m) / (b - m)) % math.tau)
            )
            if abs(sweep) < 1e-9:
                sweep = math.copysign(math.tau, turns)
            n = max(3, math.ceil(abs(sweep) * abs(a - m) / 0.1))
            yield from ((m + (a - m) * cmath.exp(1j * sweep * i / (n - 1)), commands.position[k, 2]) for i in range(n))
