"""Plans: where the part lies in its plate, which way up, and the setups in their order.

A plan with its part released before its faces are finished has every side milled twice: with stock left, then without.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from chipload.checking.clamped import WorkpieceClamp
from chipload.jobs.distortion.job import DistortionJob
from chipload.jobs.distortion.shapes import SideCut
from chipload.jobs.simulation.values import clamps_of
from chipload.number_text import number_text


@dataclass(frozen=True)
class Clamping:
    """One clamping.

    Parameters
    ----------
    cut : what is milled
    clamps : none: no surface moves until the release
    flat : whether the clamps press the part into its undeformed shape
    """

    cut: SideCut
    clamps: tuple[WorkpieceClamp, ...] = ()
    flat: bool = False


@dataclass(frozen=True)
class MillingPlan:
    """One way to mill the part.

    Parameters
    ----------
    offset : height [mm] of the underside of the part above that of the plate
    flipped : whether the plate is turned upside down
    setups : in their order
    """

    offset: float
    flipped: bool
    setups: tuple[Clamping, ...]

    @property
    def name(self) -> str:
        """The plan in words, which differ from those of every other plan of a job."""
        order = ", ".join(f"{s.cut.side} to {number_text(s.cut.stock)} mm" for s in self.setups)
        turned = ", plate upside down" if self.flipped else ""
        return f"part {number_text(self.offset)} mm up in the plate{turned}: {order}"

    def sides(self) -> tuple[str, ...]:
        """The sides that are milled, in the order in which they come first."""
        return tuple(dict.fromkeys(s.cut.side for s in self.setups))


def stated_plan(job: DistortionJob, bottom: float) -> MillingPlan:
    """The plan that a job states; ``bottom`` [mm] is the height of the underside of the part."""
    setups = tuple(Clamping(SideCut(s.side, s.stock_mm), clamps_of(s.clamp), s.hold == "flat") for s in job.table.setup)
    return MillingPlan(bottom - job.table.stock.low_mm[2], False, setups)


def plans_of(job: DistortionJob, bottom: float, height: float) -> tuple[MillingPlan, ...]:
    """The stated plan, and all others that the job may choose; each once.

    Parameters
    ----------
    bottom, height : of the part [mm]
    """
    stated, choices = stated_plan(job, bottom), job.table.choices
    found = {stated: None}
    if choices is not None:
        room = job.profile.thickness - height
        offsets = [x for x in choices.offset_mm if x <= room + 1e-9] or [stated.offset]
        for offset in offsets:
            for flipped in (False, True) if choices.flip else (False,):
                for setups in _orders(stated, choices.first_side, choices.stock_mm):
                    found[MillingPlan(offset, flipped, setups)] = None
    return tuple(found)


def _orders(stated: MillingPlan, first_side: bool, stocks: Sequence[float]) -> Iterator[tuple[Clamping, ...]]:
    """The stated setups; each side finished at once; each roughed first, with each of some stocks left."""
    yield stated.setups
    sides = stated.sides()
    for order in (sides, sides[::-1]) if first_side and len(sides) > 1 else (sides,):
        yield tuple(_setup(stated, side, 0.0) for side in order)
        for stock in stocks:
            rough = tuple(_setup(stated, side, stock) for side in order)
            for finish in (order, order[::-1]) if first_side and len(sides) > 1 else (order,):
                yield (*rough, *(_setup(stated, side, 0.0) for side in finish))


def _setup(stated: MillingPlan, side: str, stock: float) -> Clamping:
    """A setup of a side, clamped as the last one that is stated for it."""
    own = [s for s in stated.setups if s.cut.side == side][-1]
    return Clamping(SideCut(side, stock), own.clamps, own.flat)
