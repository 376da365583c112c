"""Strategies as they are written: each text is simulated, and entries are slowed where limits ask for it."""

from __future__ import annotations

from dataclasses import dataclass, replace

from chipload.cutting.wall_error import Milling
from chipload.jobs.contour.entry_feed import entry_rows, entry_share, with_entry_feed
from chipload.jobs.contour.outcome import Operation
from chipload.jobs.contour.programs import program_text
from chipload.jobs.contour.result import limits_of
from chipload.jobs.contour.text_simulation import CutColumns, PlaneStock, simulate_text, simulated_strategy
from chipload.machine.machine import Machine
from chipload.planning.result import StrategyResult
from chipload.program.release import NOT_SIMULATED
from chipload.progress import Progress
from chipload.report.programs import program_name
from chipload.result import LimitCheck


@dataclass(frozen=True)
class WrittenOperation:
    """What the texts of an operation are written and simulated with.

    Parameters
    ----------
    title : of the job
    machine : that the texts are for
    number : of the operation
    milling : as the job states it
    step_mm : longest step of the simulation
    """

    title: str
    machine: Machine
    number: int
    milling: Milling
    step_mm: float

    def with_strategy(self, made: Operation, strategy: StrategyResult, progress: Progress) -> Operation:
        """The operation with a planned strategy whose history is that of its text.

        A pocket whose entries exceed limits of loads gets entries at a lower feed, if they hold there.
        """
        done = self._simulate_text(made, strategy, progress)
        if made.result.kind != "pocket":
            return done
        share = entry_share(
            self._entry_checks(done, strategy.name),
            lambda x: self._entry_checks(
                self._simulate_text(made, with_entry_feed(strategy, x), progress), strategy.name
            ),
        )  # fmt: skip
        return done if share == 1.0 else self._simulate_text(made, with_entry_feed(strategy, share), progress)

    def _simulate_text(self, made: Operation, strategy: StrategyResult, progress: Progress) -> Operation:
        name, top = strategy.name, made.top
        result = replace(made.result, strategies={**made.result.strategies, name: strategy})
        text = program_text(self.title, self.machine, self.number, result, name, made.cutter, top, NOT_SIMULATED)
        if made.checks is None:
            raise ValueError("an operation without checks cannot be simulated")
        found = simulate_text(
            text, program_name(self.number, name), self.machine, made.cutter,
            PlaneStock.of(strategy.drawn.get("stock before", ()), top - made.depth, top),
            CutColumns(made.checks, self.milling, made.depth, strategy.drawn.get("wall", ())),
            strategy.program.labels, self.step_mm, progress,
        )  # fmt: skip
        strategies = {**result.strategies, name: simulated_strategy(strategy, found)}
        return replace(
            made,
            result=replace(result, strategies=strategies),
            simulations={**made.simulations, name: found},
        )

    def _entry_checks(self, made: Operation, name: str) -> tuple[LimitCheck, ...]:
        return limits_of(self.machine, made, entry_rows(made.result.strategies[name]), name)
