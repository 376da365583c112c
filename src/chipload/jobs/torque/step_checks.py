"""The data of each step for the default checks of a torque job, and their columns for a controller.

Notation: k a step of the path; r the feed over the programmed one, with the droop of the spindle. The loads of the
teeth are convex in r, so between two feeds the straight line lies above the stress of the cutter. The chip thickness
is r h + b, b what runout adds. Where a surprise multiplies the torque of a step, the stress is multiplied by as much.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.checking.settings import CheckSettings
from chipload.control.plant import Outcome, TorqueProfile
from chipload.control.wall import Loads
from chipload.cutting.material import Material
from chipload.cutting.strength import cutter_stress
from chipload.engagement.extent import radial_depth, tooth_feed
from chipload.jobs.torque.cut import CutSteps
from chipload.simulation.chip_space import flute_fill
from chipload.simulation.loads import at_feeds

Floats = NDArray[np.float64]

#: the lower of the two feeds at which the stress is calculated, over the programmed one: the edge alone
LEAST = 1e-3


@dataclass(frozen=True, eq=False)
class StepChecks:
    """Data of n steps of the path for the default checks.

    Parameters
    ----------
    most : the upper of the two feeds over the programmed one
    tool : (n,) int
    stress : (n, 2) float [MPa], of the cutter at :data:`LEAST` and ``most``
    chip, runout : (n,) float [mm], greatest chip thickness without runout, and what runout adds
    fill : (n,) float, chip space that is filled; None: no gullet is stated
    feed, depth : (n,) float [mm], feed per tooth and radial depth
    overrun : (n,) float [mm], shank in material above the flutes
    """

    most: float
    tool: NDArray[np.int64]
    stress: Floats
    chip: Floats
    runout: Floats
    fill: Floats | None
    feed: Floats
    depth: Floats
    overrun: Floats


def step_checks(real: CutSteps, loads: Loads, material: Material, most: float) -> StepChecks:
    """Data of the real steps.

    Parameters
    ----------
    real : cut with its cuts kept
    loads : with surprises
    most : greatest feed over the programmed one
    """
    c, n = real.removal.columns, len(real.feed)
    first = int(np.flatnonzero(~c["rapid"])[0])
    own = slice(first, first + n)
    stress, chip, runout, feed, depth = np.zeros((n, 2)), *(np.zeros(n) for _ in range(4))
    fill = np.zeros(n) if any(x.cutter.gullet is not None for x in real.removal.cuts) else None
    for cuts in real.removal.cuts:
        row = cuts.step - first
        for k, factor in enumerate((LEAST, most)):
            stress[row, k] = cutter_stress(at_feeds(cuts, np.full(len(cuts), factor)).engagement, cuts.cutter, material)
        chip[row] = cuts.plain.chip_max()
        runout[row] = cuts.engagement.chip_max() - chip[row]
        feed[row], depth[row] = tooth_feed(cuts.plain), radial_depth(cuts.plain)
        if fill is not None and cuts.cutter.gullet is not None:
            fill[row] = flute_fill(cuts)
    stress *= _surprise(loads, real.loads)[:, None]
    return StepChecks(most, c["tool"][own], stress, chip, runout, fill, feed, depth, c["axial_overrun_mm"][own])


def feed_ratio(programmed: TorqueProfile, outcome: Outcome, speed: float) -> Floats:
    """Feed per tooth of the rows of an outcome over the programmed one, (k,); ``speed`` that of the free spindle."""
    return np.asarray(outcome.feed / np.interp(outcome.s, programmed.s, programmed.feed) * (speed / outcome.speed))


def check_columns(
    steps: StepChecks, s: Floats, outcome: Outcome, ratio: Floats, deflection_um: Floats, checks: CheckSettings
) -> dict[str, NDArray[np.float64]]:
    """Columns of the default checks, (k,) each, one row for each row of the outcome.

    Parameters
    ----------
    s : (n + 1,) float [mm], ends of the steps along the path
    ratio : :func:`feed_ratio` of the outcome
    deflection_um : (k,) float, of wall and cutter
    """
    at = np.clip(np.searchsorted(s, outcome.s, "right") - 1, 0, len(steps.tool) - 1)
    moves = (outcome.feed > 0.0) & (steps.chip[at] > 0.0)
    share = (ratio - LEAST) / (steps.most - LEAST)
    low, high = steps.stress[at].T
    room = np.minimum(checks.deflection_of_feed * steps.feed[at] * ratio, checks.deflection_of_depth * steps.depth[at])
    out = {
        "tool": steps.tool[at],
        "torque_mean_nm": 1e-3 * outcome.torque,
        "power_w": 1e-3 * outcome.torque * outcome.speed,
        "chip_max_mm": np.where(moves, ratio * steps.chip[at] + steps.runout[at], 0.0),
        "cutter_stress_mpa": np.where(moves, low + np.maximum(share, 0.0) * (high - low), 0.0),
        "deflection_um": deflection_um,
        "deflection_share": np.divide(deflection_um, 1e3 * room, out=np.zeros(len(room)), where=moves & (room > 0.0)),
        "axial_overrun_mm": steps.overrun[at],
    }
    return out if steps.fill is None else out | {"flute_fill": np.where(moves, ratio * steps.fill[at], 0.0)}


def _surprise(true: Loads, real: Loads) -> Floats:
    """(n,) greatest factor by which surprises multiply a load."""
    factors = [
        np.divide(a, b, out=np.ones(len(b)), where=b > 0.0)
        for a, b in ((true.torque_cut, real.torque_cut), (true.torque_edge, real.torque_edge))
    ]
    return np.maximum(*factors)
