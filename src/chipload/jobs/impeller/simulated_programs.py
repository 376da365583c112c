"""The written programs of an impeller simulated in its stock: which run one after the other, and what each removes.

The programs that are in use, roughing first, run one after the other as their texts were read: each begins with the
stock that the one before leaves. The stock is the blank of roughing, or what the job states. All channels are roughed
before one is finished, and the minus sides are finished in the channel before the first one: its roughing is simulated
too, the others are uncut. Flank passes and point milling on five axes stand in for the finishing programs: each kind is
simulated after roughing, on its own machine.

The other channels have the same motions, turned, in the same stock, turned, less what the channels before have cut.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from chipload.checking.workpiece import Stock
from chipload.jobs.impeller.channels import turn_channel
from chipload.jobs.impeller.five_axis_outcome import CheckedFlank, CheckedPoints
from chipload.jobs.impeller.names import flank_names, points_names
from chipload.jobs.impeller.outcome import Checked, ImpellerResult
from chipload.jobs.impeller.program_removal import ProgramRemoval
from chipload.jobs.impeller.programs import cutter_of, table_programs
from chipload.jobs.impeller.removal import ImpellerProgram, removal_of_programs
from chipload.jobs.impeller.roughing import blank_of
from chipload.jobs.impeller.roughing_check import CheckedRough
from chipload.planning.impeller.feeds import ForceTerms
from chipload.planning.impeller.roughing import RoughingSettings
from chipload.progress import Progress, part_of, silent


def with_removal(
    outcome: ImpellerResult,
    stock: Stock,
    terms: ForceTerms | None,
    progress: Progress = silent,
    *,
    contacts: bool = False,
) -> ImpellerResult:
    """Return a result whose programs in use, and those on five axes, have what they remove of the stock.

    Parameters
    ----------
    stock : before the first program
    terms : teeth, material and limits of `forces`; None: not stated
    contacts : whether the contact lines of the steps are kept
    """
    used = {id(p) for p in outcome.programs or ()} | {id(r) for r in outcome.roughs or ()}
    named: dict[int, tuple[str, Checked | CheckedRough]] = {}
    for name, one in table_programs(outcome):
        if id(one) in used:
            named.setdefault(id(one), (name, one))
    parts = [ImpellerProgram(name, checked.read, cutter_of(checked)) for name, checked in named.values()]
    on_five = [
        [(n, p) for n, p in each if len(p.read.program)] for each in (flank_names(outcome), points_names(outcome))
    ]
    kinds = [each for each in on_five if each]
    before, touch = _channel_before(outcome), max((r.touch for r in outcome.roughs or ()), default=0.0)
    of: dict[int, ProgramRemoval] = {}
    if parts:
        own = part_of(progress, 0.0, 1.0 / (1 + len(kinds)))
        found = removal_of_programs(parts, stock, outcome.machine, terms, touch, own, contacts=contacts, earlier=before)
        of |= {id(checked): removal for (_, checked), removal in zip(named.values(), found, strict=True)}
    roughing = [p for p, (_, checked) in zip(parts, named.values(), strict=True) if isinstance(checked, CheckedRough)]
    for k, kind in enumerate(kinds, 1):
        own = part_of(progress, k / (1 + len(kinds)), (k + 1) / (1 + len(kinds)))
        first = [*(one.numbered_from(len(kind)) for one in (*before, *roughing))]
        finishing = [ImpellerProgram(name, p.read, p.cutter) for name, p in kind]
        found = removal_of_programs(
            finishing, stock, kind[0][1].machine, terms, touch, own, contacts=contacts, earlier=first
        )
        of |= {id(p): removal for (_, p), removal in zip(kind, found, strict=True)}
    return replace_removals(outcome, of)


def blank_of_roughing(outcome: ImpellerResult, how: RoughingSettings) -> Stock:
    """Return the blank of the channels that are roughed, and of the one before them, where minus sides are finished."""
    channels = sorted({-1, *(r.rough.index for r in outcome.roughs or ())})
    return Stock(blank_of(outcome.impeller, channels, how, outcome.stated.ahead))


def replace_removals(outcome: ImpellerResult, of: Mapping[int, ProgramRemoval]) -> ImpellerResult:
    """Return a result whose programs have the removal that was found for each."""
    used_checked = outcome.used_checked
    roughs = None if outcome.roughs is None else tuple(replace(r, removal=of.get(id(r))) for r in outcome.roughs)
    checked = None if outcome.checked is None else tuple(
        replace(one, programs=tuple(replace(p, removal=of.get(id(p))) for p in one.programs))
        if one is used_checked else one
        for one in outcome.checked
    )  # fmt: skip
    flanks = None if outcome.flanks is None else tuple(
        replace(p, removal=of.get(id(p))) if isinstance(p, CheckedFlank) else p for p in outcome.flanks
    )  # fmt: skip
    points = None if outcome.points is None else tuple(
        replace(p, removal=of.get(id(p))) if isinstance(p, CheckedPoints) else p for p in outcome.points
    )  # fmt: skip
    return replace(outcome, roughs=roughs, checked=checked, flanks=flanks, points=points)


def _channel_before(outcome: ImpellerResult) -> list[ImpellerProgram]:
    """Roughing of the channel before the first one, in which the minus sides are finished: all channels are roughed
    before one is finished.
    """
    roughs = [r for r in outcome.roughs or () if r.rough.machined]
    last = max((r.rough.index for r in roughs), default=0)
    pitch = outcome.impeller.pitch
    return [
        ImpellerProgram("", replace(r.read, program=turn_channel(r.read.program, -pitch)), r.rough.cutter)
        for r in roughs
        if r.rough.index == last
    ]
