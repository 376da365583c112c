"""Files beside the page: the proof, and a program for each cutter at each table angle."""

from __future__ import annotations

import numpy as np

from chipload.program.apt.writer import write_apt
from chipload.program.gcode.writer import write_gcode
from chipload.report.impeller.outcome import Checked, Milled
from chipload.report.impeller.summary import proof_bytes
from chipload.report.programs import ENDINGS


def program_files(milled: Milled) -> dict[str, bytes]:
    """Every further file by name."""
    out = {"proof.npz": proof_bytes(milled)}
    for k, checked in enumerate(milled.programs or (), 1):
        setting = checked.setting
        if not len(setting.linked.moves.tip) or not any(m.tracks.tracks for m in setting.millings):
            continue
        text = write_gcode(
            setting.program, milled.machine, title=f"{milled.title}, {checked.name}", verified=checked.verified,
            comments=_comments(milled, checked, k), number=100 + k,
        )  # fmt: skip
        stem = program_name(checked, k)
        out[f"{stem}.{ENDINGS[milled.machine.dialect]}"] = text.encode("ascii")
        cl = write_apt(setting.program, None, title=f"{milled.title}, {checked.name}", verified=checked.verified)
        out[f"{stem}.apt"] = cl.encode("ascii")
    return out


def program_name(checked: Checked, number: int) -> str:
    """File name of a program without its ending."""
    c = checked.setting.cutter
    return f"{number}-D{c.diameter:g}r{c.corner_radius:g}-{np.degrees(checked.setting.table):.6g}deg"


def _comments(milled: Milled, checked: Checked, number: int) -> list[str]:
    """What the man at the machine must know."""
    table, c = milled.surfaces[0].table, checked.setting.cutter
    position = float(table.position[np.abs(table.angle - checked.setting.table).argmin()])
    out = [f"does not hold: {f}" for f in checked.fails[:3]]
    out.append(f"T{number}: D {c.diameter:g} r {c.corner_radius:g} mm, tool length 0: positions of the tip")
    out.append(
        f"index table {table.index} {np.degrees(position):.6g} deg before the start, table angle of {checked.name}"
    )
    turn = np.degrees(milled.impeller.pitch)
    out.append(f"one channel: the others by a pallet offset of {turn:.6f} deg each, {milled.impeller.blades} in all")
    return out
