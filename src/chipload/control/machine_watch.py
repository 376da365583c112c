"""The watch of a running LinuxCNC by its pins, and the feed hold that an alarm asks for.

    pins (signal of the spindle, line, velocity, override in effect)  ->  LoadWatch  ->  alarm  ->  pin `feed` is 0

The pins, the watchdog and the override are those of ``chipload hal`` (docs/design/linuxcnc.md): each exchange of pins
changes `beat`, so that HAL takes the feed away from a watch that hangs or is gone. A hold stays until the command ends,
and outlasts it. While the machine stands, no sample is judged.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Collection, Iterator

from chipload.control.learning import SignalKind
from chipload.control.linuxcnc.hal_client import ControlledMachine
from chipload.control.log_stream import LoadSample
from chipload.control.override import STATUS, Status
from chipload.errors import Finding, InputError, Severity
from chipload.number_text import number_text

#: kinds of alarm that may hold the feed: `watch-` before each is the code of the alarm
HOLDS = ("air", "metal", "more", "tool", "signal")
#: between two exchanges of pins [s]
PERIOD_S = 0.02
#: without a number of the signal for so long nothing is watched [s]
LOST_S = 2.0
#: a machine that stands for so long is not moved by the program; and the program has ended [s]
STANDS_S, ENDED_S = 0.1, 1.0
#: signal in the units inside over that of the pin: W, A, N m
FACTORS = {SignalKind.POWER: 1e3, SignalKind.CURRENT: 1.0, SignalKind.TORQUE: 1e3}
#: in pin -> pin of LinuxCNC that it is read from
SOURCES = {"line-in": "motion.program-line", "velocity": "motion.current-vel"}


class FeedHold:
    """Which alarms hold the feed, and whether one did.

    Parameters
    ----------
    kinds : of :data:`HOLDS`, or ``all``

    Raises
    ------
    InputError
        A kind is unknown.

    Examples
    --------
    >>> hold = FeedHold(["air"])
    >>> hold.take(Finding("watch-more", 9, "", Severity.UNPROVEN)), hold.is_stopped
    (False, False)
    >>> hold.take(Finding("watch-air", 9, "", Severity.UNPROVEN)), hold.is_stopped
    (True, True)
    """

    def __init__(self, kinds: Collection[str] = ()) -> None:
        for kind in kinds:
            if kind not in (*HOLDS, "all"):
                raise InputError(f"--hold = {kind}: must be one of all, {', '.join(HOLDS)}")
        self.kinds = frozenset(HOLDS if "all" in kinds else kinds)
        self.status = Status.RUN
        #: the program has come to its end
        self.is_finished = False

    @property
    def is_stopped(self) -> bool:
        """Whether an alarm holds the feed."""
        return self.status is not Status.RUN

    def take(self, alarm: Finding) -> bool:
        """Hold the feed if an alarm asks for it; return whether this one did."""
        kind = alarm.code.removeprefix("watch-")
        if self.is_stopped or kind not in self.kinds:
            return False
        self.status = {"air": Status.LOW_READING, "signal": Status.NO_READING}.get(kind, Status.OVERLOAD)
        return True


def machine_samples(
    machine: ControlledMachine,
    kind: SignalKind,
    hold: FeedHold,
    *,
    notice: Callable[[Finding], None],
    clock: Callable[[], float] = time.monotonic,
    sleep: Callable[[float], None] = time.sleep,
) -> Iterator[LoadSample | None]:
    """Yield the samples of the pins of a machine, None where its signal is no number; send the feed after each.

    It ends when the machine is gone, and when ``hold.is_finished`` and the machine has stood for ENDED_S.

    Parameters
    ----------
    machine : its pins; the signal is `current-in`, the line `line-in`
    kind : of the signal: of power the pin is in W, of current in A, of torque in N m
    hold : decides the feed: 1, or 0 once an alarm holds it
    notice : takes the alarm that the signal is lost
    clock, sleep : of the period
    """
    beat, due, line = False, clock(), 0
    moved = read = None
    is_lost = False
    while True:
        status = STATUS.index(hold.status)
        seen = machine.exchange(0.0 if hold.is_stopped else 1.0, beat, 0.0, status, 0.0, 0.0)
        if seen is None:
            return
        beat = not beat
        moved = seen.time if moved is None or seen.velocity != 0.0 else moved
        if hold.is_finished and seen.time - moved > ENDED_S:
            return
        read = seen.time if read is None or math.isfinite(seen.current) else read
        if not is_lost and seen.time - read > LOST_S:
            text = f"no number of the {kind} for {number_text(LOST_S)} s: nothing is watched"
            notice(Finding("watch-signal", line, text, Severity.UNPROVEN))
            is_lost = True
        if math.isfinite(seen.current):
            line = int(seen.line)
            stands = hold.is_stopped or seen.time - moved > STANDS_S
            yield LoadSample(seen.time, FACTORS[kind] * seen.current, line, 0.0 if stands else max(seen.feed, 0.0))
        else:
            yield None
        due += PERIOD_S
        late = due - clock()
        if late > 0.0:
            sleep(late)
        else:
            due -= late
