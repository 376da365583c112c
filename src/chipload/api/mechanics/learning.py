"""Force coefficients learned from logs of the spindle, as values."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.control.learning import LearnedMaterial, learn_from_logs, signal_of_logs
from chipload.control.log_alignment import PredictedTorque, predicted_torque
from chipload.control.logs import SpindleLog
from chipload.cutting.material import Material
from chipload.errors import InputError

if TYPE_CHECKING:
    from chipload.result import Result


def spindle_log(
    time_s: ArrayLike,
    *,
    power_w: ArrayLike | None = None,
    torque_nm: ArrayLike | None = None,
    line: ArrayLike | None = None,
    override: ArrayLike | None = None,
) -> SpindleLog:
    """Return a log of the spindle while a program ran.

    Parameters
    ----------
    time_s : (n,) float, rising
    power_w, torque_nm : (n,) float; one of them
    line : (n,) line of the program, if it was logged
    override : (n,) feed over programmed feed, if it was logged

    Raises
    ------
    InputError
        Neither or both of power and torque, a column of another length, a number that is not finite, time that falls.

    Examples
    --------
    >>> spindle_log([0.0, 0.1], power_w=[300.0, 310.0]).power.tolist()
    [300000.0, 310000.0]
    """
    if (power_w is None) == (torque_nm is None):
        raise InputError("power_w, torque_nm: state one of them")
    time = np.asarray(time_s, dtype=np.float64)
    if time.ndim != 1 or len(time) < 2 or not np.isfinite(time).all() or not (np.diff(time) > 0.0).all():
        raise InputError("time_s: must be two or more finite numbers that rise")
    return SpindleLog(
        time,
        power=_column("power_w", power_w, 1e3, len(time)),
        torque=_column("torque_nm", torque_nm, 1e3, len(time)),
        line=_column("line", line, 1.0, len(time)),
        override=_column("override", override, 1.0, len(time)),
    )


def _column(name: str, values: ArrayLike | None, factor: float, n: int) -> NDArray[np.float64] | None:
    """Return a column of n numbers in the unit inside; None: it was not logged."""
    if values is None:
        return None
    out = np.asarray(values, dtype=np.float64) * factor
    if out.shape != (n,) or not np.isfinite(out).all():
        raise InputError(f"{name}: must be {n} finite numbers, like time_s")
    return out


def learn(
    logs: Mapping[str, SpindleLog],
    result: Result,
    material: Material,
    *,
    efficiency: float | None = None,
    efficiency_error: float | None = None,
    name: str = "",
    worn: bool = False,
) -> LearnedMaterial:
    """Learn the tangential coefficients of a material from logs of a program that was simulated.

    A Gaussian posterior of Ktc, Kte, the wear of each tool, the idle power of each log, the efficiency and the error of
    the simulated torque; ``material`` with its spread is the prior (docs/how-to/learn.md).

    Parameters
    ----------
    logs : of :func:`spindle_log` by name, in the order in which they ran with the same tools; all of power or of torque
    result : of :func:`chipload.simulate` for the program that ran, with ``material``
    efficiency : power of the cut over the logged power, above 0 to 1; None: 0.8
    efficiency_error : its relative standard deviation, from 0 to below 1; None: 0.1, or 0.05 of a stated efficiency
    name : of the new material; empty: that of the old one with ``-learned``
    worn : Kte of the edge as it is after the logs, for a tool that stays; else of a sharp one

    Returns
    -------
    LearnedMaterial

    Raises
    ------
    InputError
        No log, or one is not of this program; the unit is wrong; logs contradict one another; the material states no
        spread.

    Examples
    --------
    A log of the torque that was simulated leaves the coefficient where it was, and more certain.

    >>> import chipload
    >>> from chipload.program.build import plunge, rapid
    >>> mill = chipload.Cutter(number=1, diameter_mm=10, flutes=2, helix_deg=30, flute_length_mm=20, overhang_mm=30,
    ...                        modulus_gpa=580)
    >>> path = [rapid([-6, 0, -1], 300.0, 1, "link"), plunge([30, 0, -1], 8.0, 300.0, 1, "cut")]
    >>> block, metal = chipload.Stock.block((0, -9, -5), (20, 9, 0)), chipload.read_material("al7075-t6")
    >>> slot = chipload.simulate(chipload.Program.join(path), block, mill, metal, "vmc", chipload.Limits(), step_mm=2.0)
    >>> steps = slot.in_use[0].columns
    >>> time = np.arange(0.0, steps["t_s"][-1], 0.05)
    >>> torque = steps["torque_mean_nm"][np.searchsorted(steps["t_s"], time)]
    >>> found = learn({"monday": spindle_log(time, torque_nm=torque)}, slot, metal)
    >>> round(found.material.Ktc / metal.Ktc, 2), bool(found.material.variances[0, 0] < metal.variances[0, 0])
    (1.0, True)

    References
    ----------
    docs/how-to/learn.md, derived there.
    """
    if not logs:
        raise InputError("logs: none is given")
    signal = signal_of_logs(logs.values(), efficiency, efficiency_error)
    return learn_from_logs(logs, torque_of_result(result, "result"), signal, material, 0.0, name, worn=worn)[0]


def torque_of_result(result: Result, name: str) -> PredictedTorque:
    """Return the torque of the program of a result; ``name`` is of the result, for messages.

    Raises
    ------
    InputError
        It has no simulated program, or several.
    """
    if len(result.in_use) != 1:
        raise InputError(
            f"{name}: {len(result.in_use)} programs are in use, one is needed: learn from each setup apart"
        )
    return predicted_torque(result.in_use[0].columns, name)
