"""Output files of an impeller: the proof, the contact points, and a program for each cutter at each table angle."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from chipload.cutter.catalogue import CatalogueCutter
from chipload.jobs.impeller.five_axis_outcome import CheckedFlank, CheckedPoints
from chipload.jobs.impeller.names import ALL, finish_names, flank_names, points_names, rough_names
from chipload.jobs.impeller.outcome import Checked, ImpellerResult
from chipload.jobs.impeller.proof import contact_points_bytes, proof_bytes
from chipload.jobs.impeller.roughing_check import CheckedRough
from chipload.program.apt.writer import write_apt
from chipload.program.gcode.writer import Repeat, write_gcode
from chipload.program.program import Program
from chipload.report.programs import ENDINGS
from chipload.result import Result, release_of


def program_files(milled: ImpellerResult, result: Result) -> dict[str, bytes]:
    """All further files by name."""
    out = {"proof.npz": proof_bytes(milled), "contact_points.parquet": contact_points_bytes(milled)}
    for stem, cutter, table, checked, program, empty in _programs(milled):
        if empty:
            continue
        number, title = int(program.tool[0]), f"{milled.title}, {checked.name}"
        for name, repeat in ((stem, None), (f"{stem}{ALL}", checked.repeat)):
            if name != stem and repeat is None:
                continue
            file = f"{name}.{ENDINGS[milled.machine.dialect]}"
            text = write_gcode(
                program, milled.machine, title=title, release=release_of(result, file),
                comments=_comments(milled, checked, cutter, table, number, repeat), number=100 + number, repeat=repeat,
            )  # fmt: skip
            out[file] = text.encode("ascii")
        cl = write_apt(program, None, title=title, release=release_of(result, f"{stem}.apt"))
        out[f"{stem}.apt"] = cl.encode("ascii")
    for first, named in ((200, flank_names(milled)), (300, points_names(milled))):
        for stem, p in named:
            out |= _five_axis_files(milled, result, stem, p, first)
    return out


def _five_axis_files(
    milled: ImpellerResult, result: Result, stem: str, p: CheckedFlank | CheckedPoints, first: int
) -> dict[str, bytes]:
    """The texts of a program on five axes: one channel, all channels, APT."""
    number, n = int(p.program.tool[0]), milled.impeller.blades
    if isinstance(p, CheckedFlank):
        what, of = f"deviation of the flank {p.deviation:.4f} mm", "flank pass"
    else:
        what, of = f"{p.path.lines} lines, scallop at most {p.excess:.4f} mm", "point milling"
    title = f"{milled.title}, {of} of {p.name}"
    head = [
        f"T{number}: {p.cutter.label} mm, tool length 0: positions of the tip",
        f"five axes at once, {what}",
    ]
    turn = f"{np.degrees(milled.impeller.pitch):.6f} deg each"
    one = f"one channel: the others with the part turned by {turn}, {n} in all"
    texts: list[tuple[str, Program, Repeat | None, str]] = [("", p.program, None, one)]
    if not isinstance(p.every, str):
        repeat = p.every.repeat
        by = "row by row" if repeat is None else f"axis {repeat.letter} advanced by {turn}"
        texts.append((ALL, p.every.program, repeat, f"all {n} channels: {by}"))
    ending, out = ENDINGS[p.machine.dialect], {}
    for more, program, repeat, line in texts:
        file = f"{stem}{more}.{ending}"
        text = write_gcode(
            program, p.machine, title=title, release=release_of(result, file), number=first + number,
            comments=[*head, line], repeat=repeat,
        )  # fmt: skip
        out[file] = text.encode("ascii")
    release = release_of(result, f"{stem}.apt")
    out[f"{stem}.apt"] = write_apt(p.program, None, title=title, release=release).encode("ascii")
    return out


def _programs(
    milled: ImpellerResult,
) -> Iterator[tuple[str, CatalogueCutter, float, Checked | CheckedRough, Program, bool]]:
    """Name, cutter, table angle, check and program of all; whether there is nothing in it.

    Roughing first, then the partition that is milled, then all others.
    """
    for name, rough in zip(rough_names(milled), milled.roughs or (), strict=True):
        yield name, rough.rough.cutter, rough.rough.table, rough, rough.rough.program, not rough.rough.machined
    for name, p in finish_names(milled):
        s = p.setting
        yield name, s.cutter, s.table, p, s.program, not s.machined


def _comments(
    milled: ImpellerResult, checked: Checked | CheckedRough, c: CatalogueCutter, alpha: float, number: int,
    repeat: Repeat | None,
) -> list[str]:  # fmt: skip
    """Comments for the machine operator."""
    table = milled.surfaces[0].table
    position = float(table.position[np.abs(table.angle - alpha).argmin()])
    out = [
        f"T{number}: {c.label} mm, tool length 0: positions of the tip",
        f"index table {table.index} {np.degrees(position):.6g} deg before the start, table angle of {checked.name}",
    ]
    turn = np.degrees(milled.impeller.pitch)
    if repeat is None:
        out.append(
            f"one channel: the others by a pallet offset of {turn:.6f} deg each, {milled.impeller.blades} in all"
        )
    else:
        out.append(f"all {milled.impeller.blades} channels: axis {repeat.letter} advanced by {turn:.6f} deg each")
    return out
