"""The feed override: the output of a controller, within rules that protect the part and the cutter.

Notation: T measured torque [N mm]; T_ref torque set point; o override (actual over programmed feed); q trim, which
the controller changes; e = (T_ref - T) / T_ref relative error, d its change since the last step;
f in [-1, 1] output of the fuzzy controller for e / error_span and d / change_span; dt time since the last step [s]. The
fuzzy controller changes q by q f gain dt.

Without a model, q is the override. With a model (feed-forward), the override is the one that the model allows along the
path, (q T_ref - edge) / cut, in time for what lies ahead. Then q is the share of T_ref that the model may use, and
e = 1 - q T / T_model, so that q settles where measured and modelled torque agree, in light and in heavy cuts. A torque
above T_ref takes effect at once.

The rules, in the order in which they apply:

1. A stop is final until the controller is started again. The status names the reason.
2. A reading is invalid if it is not a number, below -light, above `torque_most`, or the same value for `stuck_steps`
   steps; a reading of exactly 0 counts as such a value while the machine moves and no cut is predicted. An invalid
   reading lowers the override to `lost_override`, and stops the machine after `lost_s`: ``no-reading``.
3. A torque above `overload` for `overload_steps` steps stops the machine: ``overload``.
4. Off the path the override does not rise, and falls to `start`. A torque above `light` there while the machine moves,
   in excess of the decay after a cut, stops the machine after `off_path_steps` steps: ``off-path``.
5. Where the model predicts a cut, a reading below `low_share` of the prediction, by more than `light`, is rejected.
   After `air_steps` of them the override does not rise, after `stuck_steps` it falls to `lost_override`, after
   `low_steps` the machine stops: ``low-reading``. Only a valid reading in the cut resets a count above `stuck_steps`.
6. The override rises only at a known load: a valid reading above `light` (or below it, if the model predicts that),
   `settle_steps` readings after a start or a loss of the reading.
7. It falls at `slew_down` and rises at `slew_up`, which is at most a third of it.
8. It stays between `floor` and `cap`; `cap` is at most 1 unless `above_programmed`.
9. The value that is sent is rounded down to a multiple of `quantum`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from enum import StrEnum
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from chipload.control import _override
from chipload.control._override import Observation, Rules, Sets
from chipload.control.fuzzy import FuzzyTable
from chipload.errors import InputError

Floats = NDArray[np.float64]

KINDS = ("fixed", "pi", "mamdani", "product-sum")
#: greatest timeout_s, after which the simulated spindle starts again [s]
LONGEST_TIMEOUT_S = 10.0
#: least ratio of the rate of fall to the rate of rise
FALL_OVER_RISE = 3.0


class Status(StrEnum):
    """Status of the controller after a step, in the order of the codes; from OVERLOAD on it has stopped."""

    RUN = "run"
    SETTLING = "settling"
    AIR = "air"
    UNKNOWN = "unknown"
    LOST = "lost"
    OVERLOAD = "overload"
    NO_READING = "no-reading"
    LOW_READING = "low-reading"
    OFF_PATH = "off-path"
    MACHINE_DATA = "machine-data"


STATUS = tuple(Status)
#: statuses that are final
STOPS = frozenset(STATUS[_override.OVERLOAD :])


@dataclass(frozen=True)
class Override:
    """A feed controller with its rules and parameters.

    Parameters
    ----------
    kind : ``fixed`` (start, or the model alone), ``pi``, ``mamdani``, ``product-sum``
    torque_ref : T_ref [N mm]
    overload : torque that stops [N mm]
    torque_most : greatest torque that the spindle can give; a reading above it is invalid [N mm]
    light : torque below which the estimate is not trusted [N mm]
    floor, cap : least and greatest override while it runs
    start : override after a start, from floor to cap
    air_override : greatest override in the air, without a model (``fixed`` keeps its own)
    lost_override : greatest override without a reading; 0: stop
    lost_s : time without a reading after which the machine stops [s]
    above_programmed : whether the cap may be above 1
    slew_up, slew_down : greatest change of the override [1/s]
    gain_up, gain_down : greatest relative change of the trim [1/s]
    error_span, change_span : e and d at which the fuzzy sets end
    pi_gain, pi_rate : dq = pi_gain d + pi_rate e dt; pi_rate [1/s]
    overload_steps, stuck_steps, air_steps, settle_steps : in steps
    low_share, low_steps : share of the prediction below which a reading is rejected; rejected readings that stop
    off_path_steps : steps under load off the path that stop
    timeout_s : a longer time between steps counts as a start [s], at most 10
    quantum : step of the override that the controller takes; 0: any value
    trim_least, trim_most : limits of q with a model

    Raises
    ------
    InputError
        A value is out of its range.
    """

    kind: Literal["fixed", "pi", "mamdani", "product-sum"]
    torque_ref: float
    overload: float
    torque_most: float
    light: float
    floor: float
    cap: float
    start: float
    air_override: float
    lost_override: float
    lost_s: float
    above_programmed: bool = False
    slew_up: float = 1.0
    slew_down: float = 5.0
    gain_up: float = 1.5
    gain_down: float = 6.0
    error_span: float = 1.0
    change_span: float = 0.5
    pi_gain: float = 0.3
    pi_rate: float = 1.5
    overload_steps: int = 3
    stuck_steps: int = 10
    air_steps: int = 3
    settle_steps: int = 5
    low_share: float = 0.5
    low_steps: int = 50
    off_path_steps: int = 10
    timeout_s: float = 0.5
    quantum: float = 0.01
    trim_least: float = 0.2
    trim_most: float = 1.5

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise InputError(f"override.kind = {self.kind!r}: must be one of {', '.join(KINDS)}")
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, float) and not math.isfinite(value):
                raise InputError(f"override.{field.name} = {value:g}: must be a number")
        top = math.inf if self.above_programmed else 1.0
        limits = (
            ("torque_ref", 0.0, math.inf, False),
            ("overload", self.torque_ref, math.inf, False),
            ("torque_most", self.overload, math.inf, False),
            ("light", 0.0, self.torque_ref, False),
            ("floor", 0.0, 1.0, False),
            ("cap", self.floor, top, True),
            ("start", self.floor, self.cap, True),
            ("air_override", self.floor, self.cap, True),
            ("lost_override", 0.0, self.cap, True),
            ("lost_s", 0.0, math.inf, False),
            ("slew_up", 0.0, math.inf, False),
            ("slew_down", FALL_OVER_RISE * self.slew_up, math.inf, True),
            ("gain_up", 0.0, math.inf, False),
            ("gain_down", FALL_OVER_RISE * self.gain_up, math.inf, True),
            ("error_span", 0.0, math.inf, False),
            ("change_span", 0.0, math.inf, False),
            ("pi_gain", 0.0, math.inf, True),
            ("pi_rate", 0.0, math.inf, True),
            ("overload_steps", 1, math.inf, True),
            ("stuck_steps", 2, math.inf, True),
            ("air_steps", 1, math.inf, True),
            ("settle_steps", 1, math.inf, True),
            ("low_share", 0.0, 1.0 / self.trim_most, True),
            ("low_steps", self.stuck_steps, math.inf, False),
            ("off_path_steps", 1, math.inf, True),
            ("timeout_s", 0.0, LONGEST_TIMEOUT_S, False),
            ("quantum", 0.0, self.floor, True),
            ("trim_least", 0.0, 1.0, False),
            ("trim_most", 1.0, math.inf, True),
        )
        for name, low, high, inclusive in limits:
            value = getattr(self, name)
            if not ((low <= value if inclusive else low < value) and value <= high):
                bound = f"{'at least' if inclusive else 'above'} {low:g}"
                upper = "" if high == math.inf else f" and at most {high:g}"
                why = {
                    "cap": " (above_programmed = true allows more)" if not self.above_programmed else "",
                    "slew_down": f" ({FALL_OVER_RISE:g} slew_up: it must fall faster than it rises)",
                    "gain_down": f" ({FALL_OVER_RISE:g} gain_up: it must fall faster than it rises)",
                }.get(name, "")
                raise InputError(f"override.{name} = {value:g}: must be {bound}{upper}{why}")

    @property
    def numbers(self) -> Rules:
        """Values for the compiled step."""
        values = {name: float(getattr(self, name)) for name in Rules._fields if name != "kind"}
        return Rules(kind=KINDS.index(self.kind), **values)


@dataclass(frozen=True)
class Reading:
    """Inputs of a step of the controller.

    Parameters
    ----------
    torque : measured [N mm]; not a number: there is none
    dt : time since the last step [s]
    trusted : the estimator believes it (speed in its range, ...)
    actual : override at which the axes move
    predicted : what is expected to be measured now [N mm]; not a number: nothing is known
    model : override that the model allows here with the trim of the state (:func:`trim`); None: no feed-forward
    off_path : the machine is not on the path
    """

    torque: float
    dt: float
    trusted: bool = True
    actual: float = 1.0
    predicted: float = math.nan
    model: float | None = None
    off_path: bool = False


def begin(config: Override, modelled: bool = False) -> Floats:
    """Return the state before the first step, and after every stop."""
    state = np.zeros(_override.STATE)
    state[_override.OVERRIDE] = state[_override.WANTED] = state[_override.SENT] = config.start
    state[_override.TRIM] = 1.0 if modelled else config.start
    return state


def stop_state(state: Floats, reason: Status) -> Floats:
    """Return the state after a stop for a reason that is not in the readings.

    Raises
    ------
    InputError
        ``reason`` is not one of ``STOPS``.
    """
    if reason not in STOPS:
        raise InputError(f"override.stopped: reason = {reason}: must be one of {', '.join(sorted(STOPS))}")
    new = state.copy()
    new[_override.FINAL] = STATUS.index(reason)
    new[_override.OVERRIDE] = new[_override.SENT] = 0.0
    return new


def trim(state: Floats) -> float:
    """Return the trim q of a state: with a model the share of torque_ref that the model may plan with."""
    return float(state[_override.TRIM])


def allowed_override(
    config: Override,
    state: Floats,
    profile: tuple[Floats, Floats, Floats, Floats],
    s: float,
    actual: float,
    latency: float,
    acceleration: float,
    first: int = 0,
) -> tuple[float, int]:
    """Return the override that the model allows, for ``Reading.model``: reduced as late as the path ahead permits.

    Parameters
    ----------
    config, state : the controller
    profile : s [mm], programmed feed [mm/s], edge and cut part of the torque [N mm], (n,) float each
    s : place along the path [mm]
    actual : override at which the axes move
    latency : until an override acts [s], the period included
    acceleration : of the axes [mm/s^2]
    first : a row at or before s, from the last call; 0: the first

    Returns
    -------
    The override, and the row at or before s.

    Raises
    ------
    InputError
        At rest, with an override of 0 and no latency: the time until what lies ahead is not known.
    """
    at, feed, edge, cut = profile
    programmed = float(np.interp(s, at, feed))
    soon = max(actual, min(config.cap, float(state[_override.OVERRIDE]) + config.slew_up * latency))
    if not soon > 0.0:
        raise InputError(f"override.allowed: latency = {latency:g} s: must be above 0 while nothing moves")
    most, row = _override.allowed_override(
        s, at, feed, edge, cut, config.torque_ref * trim(state), latency, soon,
        min(config.slew_down, acceleration / programmed), config.cap, first,
    )  # fmt: skip
    return float(most), int(row)


def sets_of(table: FuzzyTable) -> Sets:
    """Return the arrays of a table for the compiled step, with space for its sums."""
    return Sets(table.error, table.change, table.output, table.rules, table.whole_ends, np.empty(len(table.output)))


def step(config: Override, table: FuzzyTable, state: Floats, reading: Reading) -> tuple[float, Status, Floats]:
    """Do one step of the controller.

    Parameters
    ----------
    config, table : the controller; the table is used by the fuzzy kinds only
    state : from :func:`begin` or the last step
    reading : what was measured

    Returns
    -------
    The override to send, its status and the new state.
    """
    new = state.copy()
    seen = Observation(
        torque=float(reading.torque),
        dt=float(reading.dt),
        trusted=reading.trusted,
        actual=float(reading.actual),
        predicted=float(reading.predicted),
        model=-1.0 if reading.model is None else float(reading.model),
        off_path=reading.off_path,
    )
    sent, status = _override.step(config.numbers, sets_of(table), new, seen)
    return float(sent), STATUS[status], new
