"""A clock of samples that rises, made of one that may jump: set again, begun again with a new file, or with a gap."""

from __future__ import annotations

from dataclasses import dataclass

#: a longer step is a jump or a gap [s]; so far back, and so many samples in a row, is a clock that was set
MOST_STEP_S, LEAST_BACK_S, LEAST_BACK = 5.0, 1.0, 3


@dataclass(eq=False)
class SampleClock:
    """Time of samples without jumps.

    Parameters
    ----------
    now : of the last sample [s], since the first one
    jumps : steps of the stated time that were jumps or gaps
    first_jump : its size [s], and when it was

    Examples
    --------
    >>> clock = SampleClock()
    >>> [clock.take(t) for t in (5.0, 5.5, 5.2, 6.0, 1e9, 1e9 + 0.5)]
    [True, True, False, True, True, True]
    >>> clock.now, clock.jumps, clock.first_jump[0] > 9e8
    (2.0, 1, True)
    """

    now: float = 0.0
    jumps: int = 0
    first_jump: tuple[float, float] = (0.0, 0.0)
    _stated: float | None = None
    _back: int = 0
    _step: float = 0.0

    def take(self, time: float) -> bool:
        """Take the stated time [s] of a sample; False: the sample is of before, and to be left out."""
        if self._stated is None:
            self._stated = time
            return True
        step = time - self._stated
        if step <= 0.0:
            self._back = self._back + 1 if step < -LEAST_BACK_S else 0
            if self._back < LEAST_BACK:
                return False
        self._back = 0
        if 0.0 < step <= MOST_STEP_S:
            self._step = step
        else:
            self.first_jump = self.first_jump if self.jumps else (step, self.now)
            self.jumps += 1
        self.now += self._step
        self._stated = time
        return True
