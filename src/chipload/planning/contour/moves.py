"""Speed that the machine reaches along a pass, and the program of a pass.

Notation: v speed that the machine reaches. It keeps the machine's acceleration along the path and across it,
v^2 |kappa| <= a_max, and passes a kink as the machine's corner tolerance allows. The programmed feeds are those of
:mod:`.compare`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.machine.feed import corner_speed, curvature_speed, limited_speed
from chipload.machine.machine import Machine
from chipload.planning.contour.passes import ContourPass
from chipload.planning.contour.sampled import SampledPass
from chipload.program.build import follow, plunge, rapid, retract
from chipload.program.program import Program

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Speeds:
    """Speeds of a pass: ``programmed`` (n,) and ``reached`` by the machine (n,) [mm/s], ``time`` (n,) [s]."""

    programmed: Floats
    reached: Floats
    time: Floats


def speeds(steps: SampledPass, programmed: Floats, machine: Machine) -> Speeds:
    """Speed that the machine reaches at the ``programmed`` feeds (n,) [mm/s]; the pass begins and ends at rest."""
    acceleration = machine.acceleration_xy
    curve = curvature_speed(steps.curvature, acceleration)
    limit = np.minimum(programmed, curve)
    limit = np.minimum(limit, corner_speed(_kinks(steps), acceleration, machine.corner_tolerance))
    within = np.minimum(np.minimum(programmed[:-1], programmed[1:]), curve[:-1])
    reached, time = limited_speed(steps.s, limit, acceleration, between=within)
    return Speeds(programmed, reached, time)


def _kinks(steps: SampledPass) -> Floats:
    """(n,) change of direction [rad] at each step that the curvature of the path does not account for."""
    t, ds = steps.heading, np.diff(steps.s)
    turn = np.arctan2(t[:-1, 0] * t[1:, 1] - t[:-1, 1] * t[1:, 0], (t[:-1] * t[1:]).sum(axis=1))
    rest = np.abs(turn - steps.curvature[:-1] * ds)
    return np.concatenate([[0.0], np.where(rest > 1e-6, rest, 0.0)])


def pass_program(
    run: ContourPass, steps: SampledPass, programmed: Floats, z: float, safe_z: float, spindle: float, tool: int
) -> Program:
    """Rapid over the start, down in the clear, lead-in, path, lead-out, up.

    Parameters
    ----------
    programmed : (n,) feed at each step [mm/s]; the path is cut where it changes
    z, safe_z : height of the tip in the cut, and of rapids [mm]
    """
    parts = [p for p in (run.lead_in, run.path, run.lead_out) if p is not None]
    x, y = parts[0].start
    feed = float(programmed[0])
    moves = [
        rapid(np.array([[x, y, safe_z]]), spindle, tool, "link"),
        plunge(np.array([x, y, z]), feed, spindle, tool, "entry"),
    ]
    begin = 0.0
    for part in parts:
        label = run.name if part is run.path else "lead"
        inside = (steps.s >= begin - 1e-9) & (steps.s <= begin + part.length + 1e-9)
        s, f = steps.s[inside] - begin, programmed[inside]
        change = np.concatenate([[0], np.flatnonzero(np.diff(f)) + 1])
        moves.append(follow(part, z, (np.clip(s[change], 0.0, part.length), f[change]), spindle, tool, label))
        begin += part.length
    x, y = parts[-1].end
    moves.append(retract(np.array([x, y, safe_z]), spindle, tool, "link"))
    return Program.join(moves)
