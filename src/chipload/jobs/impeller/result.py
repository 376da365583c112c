"""Result of an impeller job: a track for the search and one for each program, limits, findings."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from chipload.cutter.catalogue import CatalogueCutter
from chipload.errors import Finding, Severity
from chipload.jobs.impeller.five_axis_outcome import CheckedFlank, CheckedPoints, FiveAxisProgram
from chipload.jobs.impeller.machine_check import CONTACT
from chipload.jobs.impeller.maps import maps_of
from chipload.jobs.impeller.names import ALL, finish_names, flank_names, points_names, rough_names
from chipload.jobs.impeller.numbers import operation_numbers
from chipload.jobs.impeller.outcome import (
    Checked,
    Covered,
    ImpellerResult,
    Searched,
    certified_text,
    for_all,
    uncertified_text,
    unmilled_messages,
    unreached_text,
)
from chipload.jobs.impeller.paths import walls_of
from chipload.jobs.impeller.program_removal import ProgramRemoval
from chipload.jobs.impeller.read_program import ReadProgram
from chipload.jobs.impeller.roughing_check import CheckedRough
from chipload.jobs.impeller.surfaces_without_program import surfaces_without_program
from chipload.jobs.impeller.tool_clearance import clearance_blocks
from chipload.number_text import number_text
from chipload.report.bodies import MACHINE_TABLE
from chipload.report.programs import ENDINGS
from chipload.result import LimitCheck, Result, Track, TrackKind, Verdict, in_memory, state_of
from chipload.result.motions import motion_columns
from chipload.simulation.channel.channel import SurfacePoints

#: name of the track of the search, which has no program
SEARCH = "search"
#: walls of the channels as points, made at their first use
Walls = Callable[[], Sequence[SurfacePoints]]


def result_of(milled: ImpellerResult) -> Result:
    """The result of an impeller: the search, roughing programs, finishing programs."""
    walls = cache(lambda: walls_of(milled.impeller, milled.stated.ahead))
    return Result(
        capability="impeller",
        title=milled.title,
        tracks=(
            _search(milled),
            *_roughing_tracks(milled, walls),
            *_finishing_tracks(milled, walls),
            *_five_axis(milled),
        ),
        operations=(operation_numbers(milled),),
        findings=tuple(f for c in milled.covered or () for f in _rest_findings(c)),
        unchecked=_unchecked_texts(milled),
        provenance=milled.provenance,
        maps=maps_of(milled),
        note=f"{for_all(milled)[:1].upper()}{for_all(milled)[1:]}, {certified_text(milled)}.",
    )


def failures_of(op: Searched) -> tuple[str, ...]:
    """Reasons why the search of a surface does not hold."""
    return tuple(f.text for f in _surface_findings(op))


def _search(milled: ImpellerResult) -> Track:
    unreached = sum(len(op.answer.unreachable) for op in milled.surfaces)
    unproved = sum(int((~op.answer.certified).sum()) for op in milled.surfaces)
    findings = [f for op in milled.surfaces for f in _surface_findings(op)]
    findings += [Finding("impeller-partition", 0, text, Severity.EXCEEDS) for text in unmilled_messages(milled)]
    why = next((t for op in milled.surfaces if (t := uncertified_text(op))), "")
    limits = (
        _count("unreached_points", unreached, Verdict.EXCEEDS),
        _count("uncertified_points", unproved, Verdict.UNPROVEN, why),
    )
    return Track(SEARCH, TrackKind.PROGRAM, True, None, limits, tuple(findings))


def _count(name: str, count: int, state: Verdict, reason: str = "") -> LimitCheck:
    return LimitCheck(name, 0.0, float(count), state if count else Verdict.HOLDS, SEARCH, reason=reason)


def _surface_findings(op: Searched) -> tuple[Finding, ...]:
    """Contact points that no cutter reaches, and those whose largest cutter is not certified."""
    out = []
    missed = op.answer.unreachable
    if missed:
        share = op.surface.area[[u.point for u in missed]].sum() / op.surface.area.sum()
        text = (
            f"{op.surface.name}: {len(missed)} of {len(op.place)} contact points, "
            f"{number_text(100.0 * share, 3)} % of the area, "
            f"are not reached; {unreached_text(op, missed[0])}"
        )
        x, y, z = (float(v) for v in op.place[missed[0].point])
        out.append(Finding("impeller-unreached", 0, text, Severity.EXCEEDS, (x, y, z)))
    text = uncertified_text(op)
    if text:
        out.append(Finding("impeller-uncertified", 0, text, Severity.UNPROVEN))
    return tuple(out)


def _roughing_tracks(milled: ImpellerResult, walls: Walls) -> list[Track]:
    names = rough_names(milled)
    return [
        _track(
            milled,
            name,
            r.read,
            (_gouge(name, r),),
            _rough_findings(r),
            not r.rough.machined,
            r.repeat is not None,
            r.rough.cutter,
            walls,
            removal=r.removal,
        )
        for name, r in zip(names, milled.roughs or (), strict=True)
    ]


def _finishing_tracks(milled: ImpellerResult, walls: Walls) -> list[Track]:
    out, used = [], {id(p) for p in milled.programs or ()}
    for name, p in finish_names(milled):
        findings = p.machine_check.findings
        limits = (_gouge(name, p), *_scallops(name, p), *_loads(name, p))
        in_use = id(p) in used and not name.startswith("way-")
        out.append(
            _track(
                milled,
                name,
                p.read,
                limits,
                findings,
                not p.setting.machined,
                p.repeat is not None,
                p.setting.cutter,
                walls,
                in_use,
                p.removal,
            )
        )
    return out


def _five_axis(milled: ImpellerResult) -> list[Track]:
    """Flank passes and point milling: beside the programs that are in use, on machines of their own."""
    out = []
    named: list[tuple[str, CheckedFlank | CheckedPoints]] = [*flank_names(milled), *points_names(milled)]
    for name, p in named:
        limits = (_gouge(name, p), _excess(name, p))
        findings = p.machine_check.findings
        ending = ENDINGS[p.machine.dialect]
        every = () if isinstance(p.every, str) else (f"{name}{ALL}.{ending}",)
        files = (f"{name}.{ending}", f"{name}.apt", *every)
        rows, lined, removal = motion_columns(p.read.program, p.read.times), _with_lines(limits, p.read), p.removal
        if removal is None:
            findings = (*findings, _not_simulated(milled))
        else:
            rows, lined = removal.columns or rows, _with_steps(lined, removal)
            findings = (*findings, *removal.findings)
        out.append(Track(
            name, TrackKind.PROGRAM, False, p.seconds, lined, findings, files, blocks=in_memory(rows),
            energy_balance={} if removal is None else removal.energy_balance,
        ))  # fmt: skip
    return out


def _track(
    milled: ImpellerResult,
    name: str,
    read: ReadProgram,
    limits: tuple[LimitCheck, ...],
    findings: tuple[Finding, ...],
    empty: bool,
    repeats: bool,
    cutter: CatalogueCutter,
    walls: Walls,
    in_use: bool = True,
    removal: ProgramRemoval | None = None,
) -> Track:
    ending = ENDINGS[milled.machine.dialect]
    files = () if empty else (f"{name}.{ending}", f"{name}.apt", *((f"{name}{ALL}.{ending}",) if repeats else ()))
    limits = _with_lines(limits, read)
    rows = motion_columns(read.program, read.times) if len(read.program) else {}
    balance: Mapping[int, float] = {}
    if removal is not None:
        if removal.columns:
            rows = removal.columns
        limits = _with_steps(limits, removal)
        findings, balance = (*findings, *removal.findings), removal.energy_balance
    elif in_use and not empty:
        findings = (*findings, _not_simulated(milled))
    blocks = clearance_blocks(rows, cutter, walls)
    return Track(
        name, TrackKind.PROGRAM, in_use, read.seconds, limits, findings, files, blocks=blocks, energy_balance=balance
    )


def _with_steps(limits: tuple[LimitCheck, ...], removal: ProgramRemoval) -> tuple[LimitCheck, ...]:
    """Return limits on the rows of the history of the removal, with its own."""
    if removal.columns:
        limits = tuple(c if c.row is None else replace(c, row=int(removal.step[c.row])) for c in limits)
    return (*limits, *removal.limits)


def _not_simulated(milled: ImpellerResult) -> Finding:
    """What is not proven of a program whose stock is not known."""
    why = "is not stated: state [operation.rough], or that stock as [stock]"
    if milled.roughs is not None:
        why = "is not known: roughing has no program"
    text = f"what it removes, and rapids, neck and holder in material, are not simulated: the stock before it {why}"
    return Finding("not-simulated", 0, text, Severity.UNPROVEN)


def _with_lines(limits: Sequence[LimitCheck], read: ReadProgram) -> tuple[LimitCheck, ...]:
    """Return limits with the line of the text that their row was read from."""
    lines = read.program.line
    return tuple(check if check.row is None else replace(check, line=int(lines[check.row])) for check in limits)


def _gouge(track: str, checked: Checked | CheckedRough | FiveAxisProgram) -> LimitCheck:
    """The bound of the deepest gouge; its error is down to what was found."""
    gouge, limit = checked.gouge, checked.allowed
    if math.isinf(gouge.bound):
        why = "a sharp corner or rim of the tool may gouge between the points that are checked"
        state = Verdict.EXCEEDS if gouge.found > limit else Verdict.UNPROVEN
        return LimitCheck("gouge_mm", limit, gouge.found, state, track, reason="" if gouge.found > limit else why)
    if gouge.bound <= limit or gouge.found > limit:
        state, why = Verdict.HOLDS if gouge.bound <= limit else Verdict.EXCEEDS, ""
    else:
        state, why = Verdict.UNPROVEN, f"between {gouge.found:.4f} and {gouge.bound:.4f} mm: the limit lies in between"
    error = 1.0 - gouge.found / gouge.bound if gouge.bound > 0.0 else 0.0
    row = gouge.row if gouge.row >= 0 else None
    place = gouge.place if gouge.row >= 0 else None
    return LimitCheck(
        "gouge_mm", limit, gouge.bound, state, track, row=row, place=place, resolution_error=error, reason=why
    )


def _scallops(track: str, p: Checked) -> tuple[LimitCheck, ...]:
    """The patch with the highest scallop."""
    if not p.scallops:
        return ()
    k = int(np.argmax([s.greatest / s.limit for s in p.scallops]))
    s = p.scallops[k]
    state = state_of(s.greatest, s.limit, 0.0)[0]
    row = s.row if s.place is not None and s.row >= 0 else None
    return (LimitCheck("scallop_mm", s.limit, s.greatest, state, track, row=row, place=s.place, resolution_error=0.0),)


def _excess(track: str, p: FiveAxisProgram) -> LimitCheck:
    """The point of a surface on which most is left."""
    k = int(p.left.rest.argmax())
    x, y, z = p.left.wall.points[k].tolist()
    row = int(p.left.rest_row[k])
    state = state_of(p.excess, p.most, 0.0)[0]
    return LimitCheck(
        p.limit, p.most, p.excess, state, track, row if row >= 0 else None, 0, (x, y, z), resolution_error=0.0
    )


def _loads(track: str, p: Checked) -> tuple[LimitCheck, ...]:
    """The places of the passes with the greatest deflection and stress of the cutter, where its stock is not stated."""
    loads = p.setting.loads
    if loads is None or not len(loads.feed) or (p.removal is not None and p.removal.loads):
        return ()
    out = []
    for name, (_, values, limit, _) in zip(("deflection_cutter_um", "cutter_stress_mpa"), loads.columns, strict=True):
        k = int(values.argmax())
        x, y, z = loads.place[k].tolist()
        state, why = state_of(float(values[k]), limit, loads.error)
        out.append(
            LimitCheck(
                name, limit, float(values[k]), state, track, place=(x, y, z), resolution_error=loads.error, reason=why
            )
        )
    return tuple(out)


def _rough_findings(r: CheckedRough) -> tuple[Finding, ...]:
    texts = [*(f"{p}: touch_mm3 = {r.touch:g} is allowed" for p in r.taken.problems(r.touch))]
    if not r.rough.machined:
        texts.append("no row can be milled")
    return (*(Finding("impeller-roughing", 0, text, Severity.EXCEEDS) for text in texts), *r.machine_check.findings)


def _rest_findings(c: Covered) -> tuple[Finding, ...]:
    """More material than the scallop height after all programs."""
    k = c.greatest[1]
    x, y, z = (float(v) for v in c.left.wall.points[k])
    return tuple(Finding("impeller-left", 0, text, Severity.EXCEEDS, (x, y, z)) for text in c.fails)


def _unchecked_texts(milled: ImpellerResult) -> tuple[str, ...]:
    fed = any(p.setting.loads is not None for p in milled.programs or ())
    removals = [*(r.removal for r in milled.roughs or ()), *(p.removal for p in milled.programs or ())]
    found = [r for r in removals if r is not None]
    bent = any("deflection_workpiece_um" in r.columns for r in found)
    blades = "deflection of the blades in roughing, of the hub under them" if bent else "deflection of the blades"
    out = [
        f"chatter; {'' if found else 'forces of roughing; '}{blades}: not calculated"
        if fed
        else "forces, torque, deflection and chatter: not calculated",
        *(_unchecked_removal(found) if milled.programs is not None else ()),
        *(_unchecked_machine(milled) if milled.programs is not None else ()),
    ]
    if milled.programs is not None:
        out.append(surfaces_without_program(milled))
    out += milled.not_on_five_axes
    if milled.programs is None:
        out.append("programs: the job states no [operation.paths]")
        out += [f"{name}: without a program nothing is held against it" for name in milled.stated.around]
    return tuple(out)


def _unchecked_removal(found: Sequence[ProgramRemoval]) -> Iterator[str]:
    """What the removal step by step does not show."""
    if not found:
        return
    ramps = [float(np.max(r.columns["ramp_deg"], initial=0.0)) for r in found if r.columns]
    if max(ramps, default=0.0) > 0.0:
        yield (
            f"plunges and ramps into material, of up to {number_text(max(ramps), 3)} deg: how steep the cutters may "
            "ramp is not stated"
        )
    yield (
        "removal in the other channels: the first is simulated, with roughing of the one before it; the others have "
        "the same motions in the same stock, turned, less what was cut before"
    )
    yield "programs that are not in use: not simulated in the stock"


def _unchecked_machine(milled: ImpellerResult) -> Iterator[str]:
    """What is around the part and is not stated; lengths of tools on which the travel depends."""
    if not any(name.startswith("fixture") for name in milled.stated.around):
        yield "fixtures: none is stated"
    if MACHINE_TABLE not in milled.stated.around:
        yield "pallet and machine table: none is stated"
    if milled.stated.around:
        yield (
            "fixtures and table: what is thinner than their spacing_mm, and a contact less deep, may be missed; one of "
            f"less than {CONTACT:g} mm is none"
        )
    used = [(p.setting.cutter, p.machine_check) for p in milled.programs or ()]
    used += [(r.rough.cutter, r.machine_check) for r in milled.roughs or ()]
    bare = dict.fromkeys(cutter.label for cutter, _ in used if cutter.reach is None)
    if bare:
        yield f"holders of {', '.join(bare)}: not stated"
    for label in dict.fromkeys(cutter.label for cutter, check in used if check.lengths is not None):
        each = [c.lengths for cutter, c in used if cutter.label == label and c.lengths is not None]
        low, high = max(a for a, _ in each), min(b for _, b in each)
        within = f"a length from {low:.4g} to {high:.4g} mm" if low <= high else "no one length"
        yield f"travel along the tool: length_mm of {label} is not stated: with {within} it stays within its travel"
