"""Which cut to measure next: how far a log of the spindle in each of several cuts would narrow a load.

Notation: x (6,) relative errors of the coefficients (Ktc, Krc, Kac, Kte, Kre, Kae), R their covariance; e (6,)
elasticities of the load (:class:`chipload.cutting.load_parts.LoadParts`), so that v = e R e' is the variance of the
load by the coefficients. A log of a cut has blocks of BLOCK_S with the signal

    y = idle + w (C (1 + x_1) + E (1 + x_4)) (1 + g) (1 + u) + noise

w 1 for torque and current and the speed for power; C, E [N mm] mean torques with the cutting and the edge coefficients;
g error of the gain, u that of the simulated torque. To first order y = H x + N z, z the other unknowns with covariance
Q, and after the log

    R' = R - R H' (H R H' + N Q N' + s^2 I)^-1 H R,    v' = e R' e'
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.control.learning import TORQUE_ERROR
from chipload.control.log_alignment import PredictedTorque
from chipload.cutting.material import Material
from chipload.errors import InputError

Floats = NDArray[np.float64]

#: length of a block [s], blocks of air that tell the idle load, seconds of a cut that is proposed
BLOCK_S, AIR_BLOCKS, CUT_S = 1.0, 5, 20.0
#: noise of a block over the greatest signal of the program, assumed before a log is there
NOISE = 0.02
#: idle signal over the greatest signal of the program, as the standard deviation of what is not known of it
IDLE = 10.0
#: coefficients that the spindle does not feel
SILENT = (1, 2, 4, 5)
#: depths over the diameter and widths over it, of test cuts that are compared
DEPTHS, WIDTHS = (0.25, 0.5, 1.0), (0.1, 0.25, 0.5, 1.0)


@dataclass(frozen=True, eq=False)
class CandidateCut:
    """A cut that could be logged, (k,) blocks.

    Parameters
    ----------
    name : in words
    seconds : in the cut
    weight : w of each block
    cutting, edge : C and E of each block [N mm]
    """

    name: str
    seconds: float
    weight: Floats
    cutting: Floats
    edge: Floats


def variance_shares(elasticity: Sequence[float], covariance: Floats) -> Floats:
    """Return the share (6,) of each coefficient in the variance of a load: e_i (R e)_i / v, whose sum is 1.

    >>> variance_shares((0.75, 0.0, 0.0, 0.25, 0.0, 0.0), 0.01 * np.eye(6)).round(12).tolist()
    [0.9, 0.0, 0.0, 0.1, 0.0, 0.0]
    """
    e = np.asarray(elasticity, dtype=np.float64)
    each = e * (covariance @ e)
    whole = float(each.sum())
    return each / whole if whole > 0.0 else np.zeros(6)


def covariance_after(covariance: Floats, cut: CandidateCut, greatest: float, gain_error: float) -> Floats:
    """Return R' (6, 6) after a log of a cut.

    Parameters
    ----------
    covariance : R (6, 6)
    greatest : signal of the program, which noise and idle load are stated over
    gain_error : standard deviation of g

    Examples
    --------
    A torque by Ktc alone, whose gain is exact: 1 / (1 / 0.25^2 + 1 / (0.02^2 + noise)) is left.

    >>> one = CandidateCut("slot", 20.0, np.ones(20), np.full(20, 100.0), np.zeros(20))
    >>> left = covariance_after(0.25**2 * np.eye(6), one, 100.0, 0.0)[0, 0]
    >>> round(float(left), 7), round(1.0 / (1.0 / 0.25**2 + 1.0 / (0.02**2 + 0.02**2 / 20 + 0.02**2 / 5)), 7)
    (0.000496, 0.000496)
    """
    air = np.zeros(AIR_BLOCKS)
    cutting, edge = (np.concatenate([air, cut.weight * part]) / greatest for part in (cut.cutting, cut.edge))
    known = np.zeros((len(cutting), 6))
    known[:, 0], known[:, 3] = cutting, edge
    others = np.column_stack([(cutting + edge) * math.hypot(gain_error, TORQUE_ERROR), np.full(len(cutting), IDLE)])
    noise = others @ others.T + NOISE**2 * np.eye(len(cutting))
    # gain = R H' S^-1
    gain = np.linalg.solve(known @ covariance @ known.T + noise, known @ covariance).T
    return np.asarray(covariance - gain @ known @ covariance)


def relative_covariance(material: Material) -> Floats:
    """Return R (6, 6) of a material; 0 for a coefficient of 0.

    >>> plain = Material("plain", 1000.0, 0.0, 0.0, 0.0, 0.0, 0.0, source="made up for this example", spread=0.1)
    >>> relative_covariance(plain)[:2, :2].round(9).tolist()
    [[0.01, 0.0], [0.0, 0.0]]
    """
    values = np.array(material.coefficients)
    size = np.outer(values, values)
    return np.divide(material.variances, size, out=np.zeros((6, 6)), where=size != 0.0)


def cuts_of_program(predicted: PredictedTorque, power: bool) -> tuple[CandidateCut, list[CandidateCut]]:
    """Return the whole program as a cut, and its ranges of lines that last up to CUT_S, one for each line.

    Parameters
    ----------
    power : whether power is logged; else torque or current

    Raises
    ------
    InputError
        The program cuts for less than a block.
    """
    start = np.concatenate([[0.0], predicted.time[:-1]])
    edges = np.arange(0.0, float(predicted.time[-1]) + BLOCK_S, BLOCK_S)
    times = np.concatenate([[0.0], predicted.time])

    def means(values: Floats) -> Floats:
        work = np.concatenate([[0.0], np.cumsum(values * (predicted.time - start))])
        return np.asarray(np.diff(np.interp(edges, times, work)) / BLOCK_S)

    cutting, edge = means(predicted.cutting), means(predicted.edge)
    row = np.minimum(np.searchsorted(predicted.time, edges[:-1] + 0.5 * BLOCK_S), len(predicted.time) - 1)
    line, weight = predicted.line[row], predicted.speed[row] if power else np.ones(len(row))
    cuts = np.flatnonzero(cutting + edge > 0.0)
    if not len(cuts):
        raise InputError(f"the program cuts for less than {BLOCK_S:g} s: too short to learn from")

    def part(own: NDArray[np.int64], name: str) -> CandidateCut:
        return CandidateCut(name, BLOCK_S * len(own), weight[own], cutting[own], edge[own])

    count, out, seen = int(CUT_S / BLOCK_S), [], set()
    for k in range(len(cuts)):
        own = cuts[k : k + count]
        ends = int(line[own[0]]), int(line[own[-1]])
        if ends not in seen and (k == 0 or line[cuts[k - 1]] != ends[0]):
            seen.add(ends)
            text = f"line {ends[0]}" if ends[0] == ends[1] else f"lines {ends[0]} to {ends[1]}"
            out.append(part(own, text))
    return part(cuts, "the whole program"), out


@dataclass(frozen=True)
class CalibrationTool:
    """The tool of test cuts, and what it may do.

    Parameters
    ----------
    number, diameter, flutes : of the cutter [mm]
    flute_length : greatest depth [mm]
    speed : [rad/s]
    chip : (least, greatest) feed per tooth [mm]
    torque : greatest mean torque [N mm]
    """

    number: int
    diameter: float
    flutes: int
    flute_length: float
    speed: float
    chip: tuple[float, float]
    torque: float


def calibration_cuts(tool: CalibrationTool, material: Material, power: bool) -> list[CandidateCut]:
    """Return cuts along a wall or slots of CUT_S, half of it at the least feed per tooth and half at the greatest, none
    of which has more torque than the tool may.

    The mean torque is N R ap / (2 pi) times the integral of Ktc h^(1 - m) + Kte over the engagement, h = fz sin(phi).
    """
    out, half = [], int(0.5 * CUT_S / BLOCK_S)
    weight = np.full(2 * half, tool.speed if power else 1.0)
    for depth in (tool.diameter * d for d in DEPTHS if tool.diameter * d <= tool.flute_length):
        for width in (tool.diameter * w for w in WIDTHS):
            phi = (np.arange(200) + 0.5) / 200 * math.acos(1.0 - 2.0 * width / tool.diameter)
            arc = tool.flutes * 0.5 * tool.diameter * depth * float(phi[-1] + phi[0]) / math.tau
            chips = [float(np.mean((fz * np.sin(phi)) ** (1.0 - material.exponents[0]))) for fz in tool.chip]
            cutting = np.repeat([material.Ktc * arc * h for h in chips], half)
            edge = np.full(2 * half, material.Kte * arc)
            if float((cutting + edge).max()) > tool.torque:
                continue
            name = (
                f"test cut with tool {tool.number}, {depth:g} mm deep and {width:g} mm wide, half of the time each at "
                f"{tool.chip[0]:.3g} and {tool.chip[1]:.3g} mm per tooth"
            )
            out.append(CandidateCut(name, CUT_S, weight, cutting, edge))
    return out


def best_cut(
    cuts: Sequence[CandidateCut], elasticity: Sequence[float], covariance: Floats, greatest: float, gain_error: float
) -> tuple[CandidateCut, float] | None:
    """Return the cut whose log leaves the least variance of a load, and that variance; None: there is no cut."""
    e = np.asarray(elasticity, dtype=np.float64)
    left = [float(e @ covariance_after(covariance, cut, greatest, gain_error) @ e) for cut in cuts]
    k = int(np.argmin(left)) if left else -1
    return (cuts[k], left[k]) if left else None
