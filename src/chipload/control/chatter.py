"""Detection of chatter in the signal of a spindle, and choice of a quiet speed.

Notation: y samples of torque or current at f_s [Hz]; n speed of the spindle [rev/s]; a window of N samples, without its
mean, under a Hann window; P power of a line of its spectrum. A steady cut repeats itself with each revolution, so that
its lines stand at k n; those within two lines of a harmonic are left out. The root mean square of what is left is
``level``, its share of the whole alternating power ``share``, the frequency of its greatest line ``hertz``. Chatter
has a frequency of its own between the harmonics. Harmonics above f_s / 2 fold back into the spectrum: as many as are
stated are left out there too, and a frequency above f_s / 2 appears folded; the signal should have a filter before it
is sampled.

A window in which the speed changes is not judged. Chatter is reported after several consecutive windows in which
``level`` and ``share`` are above what is stated. The answer is another speed: that of a quiet window of the program's
simulation (``stability.windows`` of its summary) which the override reaches, nearest to the present one, but none in
which chatter was heard; where there is none, or after so many changes, a stop. Nothing is judged on the way to it; a
spindle that does not come there is stopped.

Reference: [Altintas2012] ch. 4 for chatter next to the tooth passing frequency.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.errors import InputError
from chipload.number_text import number_text

Floats = NDArray[np.float64]

#: lines on either side of a harmonic that belong to it, by the Hann window
BESIDE = 2
#: a speed that moves by more than this share within a window is not steady
STEADY = 0.01
#: fewest revolutions of a window, so that harmonics can be distinguished
FEWEST_TURNS = 8.0
#: a speed is reached within this share, after so many windows at most
REACHED, WAITED = 0.02, 12
#: share of a quiet window at its ends that is not used
EDGE = 0.1


class WindowKind(StrEnum):
    """Judgement of a window of samples."""

    QUIET = "quiet"
    CHATTER = "chatter"
    UNSTEADY = "unsteady"


class ChatterAnswer(StrEnum):
    """Action after a window of samples."""

    KEEP = "keep"
    SPEED = "speed"
    STOP = "stop"


@dataclass(frozen=True)
class ListeningRules:
    """Thresholds for chatter in a signal, and the permitted actions.

    Parameters
    ----------
    rate : f_s [Hz]
    floor : least ``level`` of chatter, in units of the signal: above what stands there when the spindle cuts air
    share : least share of the alternating power, from 0 to 1
    window : [s]
    hold : windows one behind the other
    folded : harmonics of the speed above f_s / 2 that are left out where they fold back
    least, most : spindle override, of the programmed speed
    changes : of the speed, before chatter stops the program
    """

    rate: float
    floor: float
    share: float = 0.2
    window: float = 0.25
    hold: int = 2
    folded: int = 0
    least: float = 0.5
    most: float = 1.2
    changes: int = 3

    def __post_init__(self) -> None:
        for key, value, good, limit in (
            ("rate_hz", self.rate, 0.0 < self.rate < math.inf, "must be above 0"),
            ("floor", self.floor, 0.0 < self.floor < math.inf, "must be above 0: measure the signal in air"),
            ("share", self.share, 0.0 < self.share < 1.0, "must be above 0 and below 1"),
            ("window_s", self.window, self.window * self.rate >= 64.0, "must hold 64 samples or more"),
            ("hold", self.hold, self.hold >= 1, "must be at least 1"),
            ("folded", self.folded, self.folded >= 0, "must be at least 0"),
            ("least_override", self.least, 0.0 < self.least <= 1.0, "must be above 0 and at most 1"),
            ("most_override", self.most, 1.0 <= self.most < math.inf, "must be at least 1"),
            ("changes", self.changes, self.changes >= 0, "must be at least 0"),
        ):
            if not good:
                raise InputError(f"chatter.{key} = {value:g}: {limit}")

    @property
    def samples(self) -> int:
        """Number of samples N of a window."""
        return round(self.window * self.rate)


@dataclass(frozen=True)
class SignalWindow:
    """Content of a window of the signal outside the harmonics of the spindle speed.

    ``level`` is in units of the signal, ``hertz`` the frequency of its greatest line [Hz].
    """

    kind: WindowKind
    level: float = 0.0
    share: float = 0.0
    hertz: float = 0.0


def listen(signal: ArrayLike, speed: ArrayLike, rules: ListeningRules) -> SignalWindow:
    """Analyse one window of a signal.

    Parameters
    ----------
    signal : (N,) float
    speed : (N,) or () float [rev/s] of the spindle

    Raises
    ------
    InputError
        There are not N finite samples.

    Examples
    --------
    A line at 333 Hz between the harmonics of 50 rev/s:

    >>> t = np.arange(500) / 2000.0
    >>> rules = ListeningRules(2000.0, 0.05)
    >>> window = listen(np.sin(math.tau * 150.0 * t) + 0.6 * np.sin(math.tau * 333.0 * t), 50.0, rules)
    >>> window.kind.value, round(window.hertz), round(window.level, 2), round(window.share, 2)
    ('chatter', 332, 0.42, 0.26)
    """
    y = np.asarray(signal, dtype=np.float64)
    n = np.asarray(speed, dtype=np.float64)
    if y.shape != (rules.samples,) or not np.isfinite(y).all():
        raise InputError(f"chatter: a window of {y.size} samples: need {rules.samples} finite ones")
    mean = float(n.mean())
    if not (np.isfinite(n).all() and mean > 0.0 and float(np.ptp(n)) <= STEADY * mean):
        return SignalWindow(WindowKind.UNSTEADY)
    if mean * rules.window < FEWEST_TURNS:
        return SignalWindow(WindowKind.UNSTEADY)
    hann = np.hanning(len(y) + 1)[:-1]
    lines = np.fft.rfft((y - y.mean()) * hann)
    # one-sided power of each line, so that the sum is the mean square of the signal
    power = 2.0 * np.abs(lines) ** 2 / (len(y) * (hann**2).sum())
    power[: BESIDE + 1] = 0.0
    width = rules.rate / len(y)
    hertz = np.arange(len(power)) * width
    count = math.floor(0.5 * rules.rate / mean) + rules.folded
    harmonics = np.arange(1, count + 1) * mean
    harmonics = np.abs(harmonics - rules.rate * np.round(harmonics / rules.rate))
    near = np.abs(hertz[:, None] - harmonics[None, :]).min(axis=1) <= (BESIDE + 0.5) * width
    free = np.where(near, 0.0, power)
    whole, own = float(power.sum()), float(free.sum())
    level, share = math.sqrt(own), own / whole if whole > 0.0 else 0.0
    loud = level >= rules.floor and share >= rules.share
    return SignalWindow(
        WindowKind.CHATTER if loud else WindowKind.QUIET, level, share, float(hertz[int(free.argmax())])
    )


@dataclass(frozen=True)
class SpeedAnswer:
    """Action after a window: the ``override`` of the programmed speed, 0 for a stop, and the reason."""

    kind: ChatterAnswer
    override: float
    window: SignalWindow
    text: str = ""


@dataclass(eq=False)
class ChatterGuard:
    """Detector of chatter, window by window, that answers with another speed or a stop.

    Parameters
    ----------
    rules : of the signal and the override
    programmed : speed of the program [rev/s]
    windows : (from, to) [rev/s], quiet speeds
    """

    rules: ListeningRules
    programmed: float
    windows: Sequence[tuple[float, float]]
    override: float = 1.0
    _loud: int = 0
    _changes: int = 0
    _waited: int = 0
    _bad: list[float] = field(default_factory=list)

    def __post_init__(self) -> None:
        if not 0.0 < self.programmed < math.inf:
            raise InputError(f"chatter: a programmed speed of {self.programmed:g} rev/s: must be above 0")
        if not all(0.0 < a <= b for a, b in self.windows):
            raise InputError("chatter: a quiet window must rise from above 0")

    def answer(self, signal: ArrayLike, speed: ArrayLike) -> SpeedAnswer:
        """Return the answer to one window of samples; parameters as for :func:`listen`."""
        window = listen(signal, speed, self.rules)
        wanted = self.override * self.programmed
        if self._changes and abs(float(np.mean(np.asarray(speed))) - wanted) > REACHED * wanted:
            # on the way to the speed that was answered
            self._waited += 1
            if self._waited <= WAITED:
                return SpeedAnswer(ChatterAnswer.KEEP, self.override, window)
            self.override = 0.0
            return SpeedAnswer(ChatterAnswer.STOP, 0.0, window, "the speed does not follow the override: stopped")
        self._waited = 0
        if window.kind is not WindowKind.CHATTER:
            self._loud = 0 if window.kind is WindowKind.QUIET else self._loud
            return SpeedAnswer(ChatterAnswer.KEEP, self.override, window)
        self._loud += 1
        if self._loud < self.rules.hold:
            return SpeedAnswer(ChatterAnswer.KEEP, self.override, window)
        self._loud = 0
        self._bad.append(float(np.mean(np.asarray(speed, dtype=np.float64))))
        found = self._quiet() if self._changes < self.rules.changes else None
        message = f"chatter at {number_text(window.hertz)} Hz, level {window.level:.3g} outside the harmonics"
        if found is None:
            why = "no quiet speed within the override" if self._changes < self.rules.changes else "after all changes"
            self.override = 0.0
            return SpeedAnswer(ChatterAnswer.STOP, 0.0, window, f"{message}: stopped, {why}")
        self._changes += 1
        self.override = found / self.programmed
        return SpeedAnswer(ChatterAnswer.SPEED, self.override, window, f"{message}: {60.0 * found:.0f} rpm")

    def _quiet(self) -> float | None:
        """Return the quiet speed to take [rev/s]; None if there is none."""
        low, high = self.rules.least * self.programmed, self.rules.most * self.programmed
        now = self._bad[-1]
        found = []
        for a, b in self.windows:
            if any(a <= x <= b for x in self._bad):
                continue
            inner = EDGE * (b - a)
            first, last = max(a + inner, low), min(b - inner, high)
            if first <= last:
                found.append(min(max(now, first), last))
        return min(found, key=lambda x: abs(x - now)) if found else None
