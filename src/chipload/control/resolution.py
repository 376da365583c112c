"""The least torque that a spindle resolves, and the least torque limit that it can hold.

Notation: K_T torque constant [N mm/A]; n [A] standard deviation of a reading of the current, q [A] its step; p time
between two readings [s], t time constant of the filter [s], g = min(p / t, 1) its gain; I_0 [A] current of the free
spindle at its speed, c the share by which it may differ from its map. The error of an estimate is

    R = K_T (2 n sqrt(g / (2 - g)) + q / 2 + c I_0),

two standard deviations of the noise behind the filter, half a step and the error of the idle map. A reading below R
cannot be distinguished from air. With a relative error k of the torque constant, a held torque h T may in fact be
(1 + k) h T + R, so a limit T with a permitted excess of x requires R <= (1 + x - (1 + k) h) T.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from chipload.control.spindle_model import Spindle
from chipload.errors import InputError
from chipload.number_text import number_text

#: standard deviations of the noise that an estimate is granted
DEVIATIONS = 2.0


@dataclass(frozen=True)
class TorqueResolution:
    """Torque resolution: the parts of R [N mm] from noise, quantisation and idle map."""

    noise: float
    quantisation: float
    idle: float

    @property
    def total(self) -> float:
        """R [N mm]."""
        return self.noise + self.quantisation + self.idle

    def __str__(self) -> str:
        return (
            f"{number_text(1e-3 * self.total, 3)} N m (noise {1e-3 * self.noise:.2g}, quantisation "
            f"{1e-3 * self.quantisation:.2g}, "
            f"idle map {1e-3 * self.idle:.2g})"
        )


def torque_resolution(spindle: Spindle, period: float) -> TorqueResolution:
    """Return R of a spindle whose current is read every ``period`` [s].

    Examples
    --------
    0.3 N m/A, 0.05 A of noise behind a gain of 1/2 is 2 x 15 x 0.577 N mm; a step of 0.02 A is 3 N mm; 2 % of the
    4.5 A that run it free are 27 N mm.

    >>> spindle = Spindle(625.0, 5.0, 300.0, (2.0, 0.004), 0.5, 5.0, 60.0, 0.01, 0.02, 0.05, 0.02, 0.02)
    >>> print(torque_resolution(spindle, 0.01))
    0.0473 N m (noise 0.017, quantisation 0.003, idle map 0.027)
    """
    if not 0.0 < period < math.inf:
        raise InputError(f"torque_resolution: period = {period:g} s: must be above 0")
    gain = min(period / spindle.smoothing, 1.0) if spindle.smoothing > 0.0 else 1.0
    idle = abs(spindle.idle[0] + spindle.idle[1] * spindle.speed)
    return TorqueResolution(
        noise=DEVIATIONS * spindle.torque_constant * spindle.noise * math.sqrt(gain / (2.0 - gain)),
        quantisation=0.5 * spindle.torque_constant * spindle.current_step,
        idle=spindle.torque_constant * spindle.idle_error * idle,
    )


def check_light(spindle: Spindle, period: float, light: float) -> None:
    """Refuse a torque below which readings count as air [N mm] that the spindle does not resolve.

    Raises
    ------
    InputError
        ``light`` is below R.
    """
    found = torque_resolution(spindle, period)
    if light < found.total:
        raise InputError(
            f"override.light = {1e-3 * light:g} N m: below the resolution of the spindle, {found}: air cannot be "
            f"distinguished from a cut: {_remedy(found)}, or light at least {number_text(1e-3 * found.total, 3)} N m"
        )


def check_limit(spindle: Spindle, period: float, limit: float, hold: float, excess: float) -> None:
    """Refuse a limit of torque [N mm] that the spindle cannot hold.

    Parameters
    ----------
    spindle, period : that measure it
    limit : T [N mm]
    hold : h, share of it that is held
    excess : x, share of it by which it may be exceeded

    Raises
    ------
    InputError
        The resolution is above (1 + x - (1 + k) h) T.
    """
    found, wrong = torque_resolution(spindle, period), 1.0 + spindle.torque_constant_error
    granted = 1.0 + excess - wrong * hold
    if granted <= 0.0:
        raise InputError(
            f"spindle: its torque constant may be wrong by {number_text(100.0 * (wrong - 1.0), 3)} %: a "
            f"share of {hold:g} of the "
            f"limit cannot be held: log more cuts of known torque, or hold at most {(1.0 + excess) / wrong:.3g}"
        )
    if found.total > granted * limit:
        lower = (1.0 + excess - found.total / limit) / wrong
        alternative = f", or hold at most {lower:.2g}" if lower > 0.5 else ""
        error = f", torque constant {number_text(100.0 * (wrong - 1.0), 2)} % wrong," if wrong > 1.0 else ""
        raise InputError(
            f"spindle: it resolves {found}, the limit is {number_text(1e-3 * limit)} N m: must be at most "
            f"{number_text(1e-3 * granted * limit, 3)} N m, the share of the limit that is neither held{error} nor "
            "allowed in excess: "
            f"{_remedy(found)}{alternative}; this spindle holds limits from "
            f"{number_text(1e-3 * found.total / granted, 3)} N m"
        )


def _remedy(found: TorqueResolution) -> str:
    worst = max(
        (found.noise, "less noise_a or a longer smoothing_s"),
        (found.quantisation, "a smaller current_step_a"),
        (found.idle, "a smaller idle_error_share (an air run before each job) or a smaller spindle"),
    )[1]
    return f"state a spindle with {worst}"
