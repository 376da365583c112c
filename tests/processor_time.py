"""How much processor time the tests of each folder take, and how much of it is compiling: told at the end of a run."""

from __future__ import annotations

import gc
import os
import time
from collections import defaultdict
from collections.abc import Iterable
from typing import Any

from numba.core import event

#: of a whole run; a few tests say nothing
LEAST_S = 60.0
NAME = "processor_s"


class Compiling(event.Listener):
    """Processor time of what numba compiles in this process; a function that is compiled for another counts with it.

    Garbage is not collected meanwhile: numba makes many objects of which few go, and looking through them again and
    again is a tenth of the time.
    """

    def __init__(self) -> None:
        self.spent, self.depth, self.begin, self.collects = 0.0, 0, 0.0, False

    def on_start(self, event: Any) -> None:
        if self.depth == 0:
            self.begin, self.collects = time.process_time(), gc.isenabled()
            gc.disable()
        self.depth += 1

    def on_end(self, event: Any) -> None:
        self.depth -= 1
        if self.depth == 0:
            self.spent += time.process_time() - self.begin
            if self.collects:
                gc.enable()


COMPILING = Compiling()
event.register("numba:compile", COMPILING)


class Spent:
    """Processor time since it was asked last, with that of processes that ended, and of it what was compiling [s]."""

    def __init__(self) -> None:
        self.last = self._now()

    def since(self) -> tuple[float, float]:
        before, self.last = self.last, self._now()
        return self.last[0] - before[0], self.last[1] - before[1]

    @staticmethod
    def _now() -> tuple[float, float]:
        return sum(os.times()[:4]), COMPILING.spent


def folder_of(test: str) -> str:
    """The folder of a test below tests/, its file there, or src.

    >>> folder_of("tests/jobs/test_feeds.py::test_a"), folder_of("tests/test_api.py::test_b"), folder_of("src/a.py::b")
    ('tests/jobs', 'tests', 'src')
    """
    parts = test.split("::")[0].split("/")
    return "/".join(parts[:2]) if parts[0] == "tests" and len(parts) > 2 else parts[0]


def table(reports: Iterable[Any]) -> list[str]:
    """Lines: processor time of each folder, of it compiling, and tests; none of a short run."""
    sums: dict[str, list[float]] = defaultdict(lambda: [0.0, 0.0, 0])
    for report in reports:
        for name, value in getattr(report, "user_properties", ()):
            if name == NAME:
                row = sums[folder_of(report.nodeid)]
                row[0] += value[0]
                row[1] += value[1]
                row[2] += report.when == "call"
    total = [sum(row[k] for row in sums.values()) for k in range(3)]
    if total[0] < LEAST_S:
        return []
    rows = sorted(sums.items(), key=lambda item: -item[1][0])
    return [f"{a:7.0f} s, compiling {b:5.0f} s, {n:5.0f} tests  {name}" for name, (a, b, n) in [*rows, ("all", total)]]
