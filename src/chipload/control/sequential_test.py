"""Page's test of the blocks of a stream, and what an alarm of a watch is: how many are false, and from which load on.

A sum c of log-likelihood ratios l of the blocks, c = max(0, c + min(l, t / 3)), alarms where it reaches t. Where
E[exp(l)] <= 1 without a fault the mean number of blocks between two false alarms is at least exp(t) [Lorden1971].
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from chipload.errors import InputError

#: tests that share the false alarms of an hour
TESTS = 3


@dataclass(frozen=True)
class WatchSettings:
    """What an alarm is.

    Parameters
    ----------
    false_alarms : that are allowed in an hour in the cut, above 0
    wear : load over that of the sharp tool, above 1.1
    block_s : length of a block [s]
    lag_s : how far the line of a sample may be wrong in time [s]

    Raises
    ------
    InputError
        A number is out of range.
    """

    false_alarms: float = 0.1
    wear: float = 1.3
    block_s: float = 0.5
    lag_s: float = 0.2

    def __post_init__(self) -> None:
        if not 0.0 < self.false_alarms <= 100.0:
            raise InputError(f"false_alarms = {self.false_alarms:g}: must be above 0 and at most 100 an hour")
        if not 1.1 < self.wear <= 5.0:
            raise InputError(f"wear = {self.wear:g}: must be above 1.1 and at most 5 times the load of the sharp tool")
        for name, value in (("block_s", self.block_s), ("lag_s", self.lag_s)):
            if not 0.0 < value <= 60.0:
                raise InputError(f"{name} = {value:g}: must be above 0 and at most 60 s")

    @property
    def threshold(self) -> float:
        """H of each test.

        >>> round(WatchSettings(false_alarms=3.0, block_s=1.0).threshold, 3), round(math.log(3600.0), 3)
        (8.189, 8.189)
        """
        return math.log(TESTS * 3600.0 / (self.block_s * self.false_alarms))


@dataclass(eq=False)
class SequentialTest:
    """The sum c of a test, and the block with which it left 0."""

    threshold: float
    sum: float = 0.0
    begin: int = -1

    def add(self, ratio: float, block: int, length: float = 1.0) -> bool:
        """Add the log-likelihood ratio of a block; whether it raises the alarm, after which the sum is 0.

        Parameters
        ----------
        length : of the block over the usual one, at least 1: a longer one counts for up to three
        """
        if self.sum == 0.0:
            self.begin = block
        self.sum = max(0.0, self.sum + min(ratio, self.threshold / 3.0 * min(length, 3.0)))
        if self.sum < self.threshold * (1.0 - 1e-12):
            return False
        self.sum = 0.0
        return True
