"""Files of an impeller: the proof, the contact points, and a program for each cutter at each table angle."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from chipload.cutter.catalogue import CatalogueCutter
from chipload.jobs.impeller.names import ALL, finish_names, flank_names, rough_names
from chipload.jobs.impeller.outcome import Checked, ImpellerResult
from chipload.jobs.impeller.proof import contact_points_bytes, proof_bytes
from chipload.jobs.impeller.roughing_check import CheckedRough
from chipload.program.apt.writer import write_apt
from chipload.program.gcode.writer import Repeat, write_gcode
from chipload.program.program import Program
from chipload.report.programs import ENDINGS


def program_files(milled: ImpellerResult) -> dict[str, bytes]:
    """Every further file by name."""
    out = {"proof.npz": proof_bytes(milled), "contact_points.parquet": contact_points_bytes(milled)}
    for stem, cutter, table, checked, program, empty in _programs(milled):
        if empty:
            continue
        number, title = int(program.tool[0]), f"{milled.title}, {checked.name}"
        for name, repeat in ((stem, None), (f"{stem}{ALL}", checked.repeat)):
            if name != stem and repeat is None:
                continue
            text = write_gcode(
                program, milled.machine, title=title, verified=checked.verified,
                comments=_comments(milled, checked, cutter, table, number, repeat), number=100 + number, repeat=repeat,
            )  # fmt: skip
            out[f"{name}.{ENDINGS[milled.machine.dialect]}"] = text.encode("ascii")
        cl = write_apt(program, None, title=title, verified=checked.verified)
        out[f"{stem}.apt"] = cl.encode("ascii")
    for stem, p in flank_names(milled):
        size = f"D {p.cutter.diameter:g} r {p.cutter.corner_radius:g} mm"
        title = f"{milled.title}, flank pass of {p.name}"
        number = int(p.program.tool[0])
        text = write_gcode(
            p.program, p.machine, title=title, verified=p.verified, number=200 + number,
            comments=[
                *(f"not verified: {f}" for f in p.fails[:3]),
                f"T{number}: {size}, tool length 0: positions of the tip",
                f"five axes at once, deviation of the flank {p.deviation:.4f} mm",
                f"one channel: the others with the part turned by {np.degrees(milled.impeller.pitch):.6f} deg each, "
                f"{milled.impeller.blades} in all",
            ],
        )  # fmt: skip
        out[f"{stem}.{ENDINGS[p.machine.dialect]}"] = text.encode("ascii")
        out[f"{stem}.apt"] = write_apt(p.program, None, title=title, verified=p.verified).encode("ascii")
    return out


def _programs(
    milled: ImpellerResult,
) -> Iterator[tuple[str, CatalogueCutter, float, Checked | CheckedRough, Program, bool]]:
    """Name, cutter, table angle, check and program of all; whether there is nothing in it.

    Roughing first, then the way that is milled, then every other one.
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
    """What the man at the machine must know."""
    table = milled.surfaces[0].table
    position = float(table.position[np.abs(table.angle - alpha).argmin()])
    out = [f"not verified: {f}" for f in checked.fails[:3]]
    out.append(f"T{number}: D {c.diameter:g} r {c.corner_radius:g} mm, tool length 0: positions of the tip")
    out.append(
        f"index table {table.index} {np.degrees(position):.6g} deg before the start, table angle of {checked.name}"
    )
    turn = np.degrees(milled.impeller.pitch)
    if repeat is None:
        out.append(
            f"one channel: the others by a pallet offset of {turn:.6f} deg each, {milled.impeller.blades} in all"
        )
    else:
        out.append(f"all {milled.impeller.blades} channels: axis {repeat.letter} turned on by {turn:.6f} deg each")
    return out
