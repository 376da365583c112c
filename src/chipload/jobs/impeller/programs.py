"""Output files of an impeller: the proof, the contact points, and a program for each cutter at each table angle."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from chipload.cutter.catalogue import CatalogueCutter
from chipload.jobs.impeller.five_axis_outcome import CheckedFlank, CheckedPoints
from chipload.jobs.impeller.names import ALL, finish_names, flank_names, points_names, rough_names
from chipload.jobs.impeller.outcome import Checked, ImpellerResult
from chipload.jobs.impeller.proof import contact_points_bytes, proof_bytes
from chipload.jobs.impeller.read_program import ReadProgram
from chipload.jobs.impeller.roughing_check import CheckedRough
from chipload.program.apt.writer import write_apt
from chipload.program.gcode.writer import Repeat, write_gcode
from chipload.program.program import Program
from chipload.program.release import Release, release_of_text
from chipload.report.programs import ENDINGS
from chipload.result import Result, release_of


def program_files(milled: ImpellerResult, result: Result) -> dict[str, bytes]:
    """All further files by name."""
    out = {"proof.npz": proof_bytes(milled), "contact_points.parquet": contact_points_bytes(milled)}
    for stem, checked in table_programs(milled):
        program = program_of(checked)
        for name, repeat in ((stem, None), (f"{stem}{ALL}", checked.repeat)):
            if name == stem or repeat is not None:
                file = f"{name}.{ENDINGS[milled.machine.dialect]}"
                out[file] = _release_text(
                    partial(table_text, milled, checked, repeat), release_of(result, file),
                    checked.read if repeat is None else None,
                )  # fmt: skip
        cl = write_apt(program, None, title=_title(milled, checked), release=release_of(result, f"{stem}.apt"))
        out[f"{stem}.apt"] = cl.encode("ascii")
    for stem, p in five_axis_programs(milled):
        ending = ENDINGS[p.machine.dialect]
        for more in ("", *(() if isinstance(p.every, str) else (ALL,))):
            file = f"{stem}{more}.{ending}"
            out[file] = _release_text(
                partial(five_axis_text, milled, p, bool(more)), release_of(result, file), None if more else p.read
            )
        release = release_of(result, f"{stem}.apt")
        out[f"{stem}.apt"] = write_apt(p.program, None, title=_five_axis_title(milled, p), release=release).encode(
            "ascii"
        )
    return out


def _release_text(text_of: Callable[[Release], str], release: Release, read: ReadProgram | None) -> bytes:
    """The text of a program, which is not released if its blocks are not those that were read and simulated."""
    text = text_of(release)
    given = release if read is None else release_of_text(text, read.text, release)
    return (text if given is release else text_of(given)).encode("ascii")


def table_text(milled: ImpellerResult, checked: Checked | CheckedRough, repeat: Repeat | None, release: Release) -> str:
    """The text of a program of the index table: of one channel, or with ``repeat`` of all; its lines do not depend on
    ``release``.
    """
    program = program_of(checked)
    number = int(program.tool[0])
    return write_gcode(
        program, milled.machine, title=_title(milled, checked), release=release,
        comments=_comments(milled, checked, number, repeat), number=100 + number, repeat=repeat,
    )  # fmt: skip


def five_axis_text(milled: ImpellerResult, p: CheckedFlank | CheckedPoints, whole: bool, release: Release) -> str:
    """The text of a program on five axes: of one channel, or of all where there is such a program."""
    n, turn = milled.impeller.blades, f"{np.degrees(milled.impeller.pitch):.6f} deg each"
    what = (
        f"deviation of the flank {p.deviation:.4f} mm"
        if isinstance(p, CheckedFlank)
        else f"{p.path.lines} lines, scallop at most {p.excess:.4f} mm"
    )
    number, first = int(p.program.tool[0]), 200 if isinstance(p, CheckedFlank) else 300
    program, repeat = p.program, None
    line = f"one channel: the others with the part turned by {turn}, {n} in all"
    if whole and not isinstance(p.every, str):
        program, repeat = p.every.program, p.every.repeat
        by = "row by row" if repeat is None else f"axis {repeat.letter} advanced by {turn}"
        line = f"all {n} channels: {by}"
    comments = [
        f"T{number}: {p.cutter.label} mm, tool length 0: positions of the tip", f"five axes at once, {what}", line,
    ]  # fmt: skip
    return write_gcode(
        program, p.machine, title=_five_axis_title(milled, p), release=release, number=first + number,
        comments=comments, repeat=repeat,
    )  # fmt: skip


def program_of(checked: Checked | CheckedRough) -> Program:
    """The program of one channel."""
    return checked.rough.program if isinstance(checked, CheckedRough) else checked.setting.program


def cutter_of(checked: Checked | CheckedRough) -> CatalogueCutter:
    """The cutter of a program."""
    return checked.rough.cutter if isinstance(checked, CheckedRough) else checked.setting.cutter


def table_programs(milled: ImpellerResult) -> Iterator[tuple[str, Checked | CheckedRough]]:
    """File names without endings and programs of the index table that have rows: roughing first, then the partition
    that is milled, then all others.
    """
    for name, rough in zip(rough_names(milled), milled.roughs or (), strict=True):
        if rough.rough.machined:
            yield name, rough
    for name, p in finish_names(milled):
        if p.setting.machined:
            yield name, p


def five_axis_programs(milled: ImpellerResult) -> Iterator[tuple[str, CheckedFlank | CheckedPoints]]:
    """File names without endings and programs on five axes."""
    yield from flank_names(milled)
    yield from points_names(milled)


def _title(milled: ImpellerResult, checked: Checked | CheckedRough) -> str:
    return f"{milled.title}, {checked.name}"


def _five_axis_title(milled: ImpellerResult, p: CheckedFlank | CheckedPoints) -> str:
    of = "flank pass" if isinstance(p, CheckedFlank) else "point milling"
    return f"{milled.title}, {of} of {p.name}"


def _comments(milled: ImpellerResult, checked: Checked | CheckedRough, number: int, repeat: Repeat | None) -> list[str]:
    """Comments for the machine operator."""
    table, c = milled.surfaces[0].table, cutter_of(checked)
    alpha = checked.rough.table if isinstance(checked, CheckedRough) else checked.setting.table
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
