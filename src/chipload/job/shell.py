"""A job that holds the torque on a thin tube or cone."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from chipload.cutter.cutter import Cutter
from chipload.errors import InputError
from chipload.job.shell_tables import ShellJobTable, SurpriseTable
from chipload.job.sources import cutters, source

#: keys that each kind of surprise needs beside `share`
SURPRISES: Mapping[str, tuple[str, ...]] = {
    "thicker-side": ("at_deg",),
    "hard-spot": ("at_deg", "width_mm", "ramp_mm"),
    "worn-cutter": ("edge_share",),
    "thinner-wall": (),
}


@dataclass(frozen=True)
class ShellJob:
    """A job on a thin tube or cone; paths are absolute.

    Parameters
    ----------
    path : the job file
    table : its values
    program_file : NC text or CL data; None: the program is made
    machine, material : a shipped name or a file
    control_file : sets and rules; None: the standard ones
    cutters : by number
    overrides : the `--set` texts that were applied
    """

    path: Path
    table: ShellJobTable
    program_file: Path | None
    machine: str | Path
    material: str | Path
    control_file: Path | None
    cutters: Mapping[int, Cutter]
    overrides: tuple[str, ...]


def shell_job(path: Path, table: ShellJobTable, overrides: Sequence[str]) -> ShellJob:
    """The job of a table that was read.

    Raises
    ------
    InputError
        Keys do not go together.
    """
    folder = path.parent
    if (table.program is None) == (table.round is None):
        said = "neither is" if table.program is None else "both are"
        raise InputError(f"program, round: {said} stated: state a [program] with a file, or a [round] that is made")
    tools = cutters(table.cutter, folder)
    _check_shell(table)
    if table.round is not None:
        _check_round(table, tools)
    for k, surprise in enumerate(table.surprise):
        _check_surprise(f"surprise.{k}", surprise, table.shell.wall_mm)
    control = table.control.file
    return ShellJob(
        path, table, None if table.program is None else folder / table.program.file,
        source("machine", table.machine, folder), source("material", table.material, folder),
        None if control is None else folder / control, tools, tuple(overrides),
    )  # fmt: skip


def _check_shell(table: ShellJobTable) -> None:
    shell = table.shell
    f = math.radians(shell.angle_deg)
    least = min(shell.mean_radius_mm, shell.mean_radius_mm + shell.length_mm * math.sin(f))
    if shell.wall_mm > 0.2 * least:
        raise InputError(
            f"shell.wall_mm = {shell.wall_mm:g}: must be at most a fifth of the least radius {least:g}: a thin wall is "
            "meant"
        )
    if shell.wall_tolerance_mm >= 0.5 * shell.wall_mm:
        raise InputError(
            f"shell.wall_tolerance_mm = {shell.wall_tolerance_mm:g}: must be below half of wall_mm = {shell.wall_mm:g}"
        )
    for k, boss in enumerate(shell.boss):
        if not boss.from_deg < boss.to_deg <= boss.from_deg + 360.0:
            raise InputError(
                f"shell.boss.{k}.to_deg = {boss.to_deg:g}: must be above from_deg = {boss.from_deg:g} and at most "
                f"{boss.from_deg + 360.0:g}"
            )


def _check_round(table: ShellJobTable, tools: Mapping[int, Cutter]) -> None:
    ask = table.round
    assert ask is not None
    if ask.cutter not in tools:
        known = ", ".join(str(n) for n in sorted(tools))
        raise InputError(f"round.cutter = {ask.cutter}: no [[cutter]] has this number: state one of {known}")
    if not ask.bottom_mm < ask.top_mm:
        raise InputError(f"round.bottom_mm = {ask.bottom_mm:g}: must be below top_mm = {ask.top_mm:g}")
    taper = math.degrees(tools[ask.cutter].taper)
    # a flank that is wider upwards leaves a wall that is narrower upwards
    upwards = table.shell.angle_deg * (1.0 if table.shell.clamped == "low" else -1.0)
    if abs(upwards + taper) > 1e-6:
        raise InputError(
            f"round.cutter = {ask.cutter}: taper_deg = {taper:g}: must be {max(-upwards, 0.0):g}, that of the wall: "
            "an upright cutter leaves its own angle"
            + ("; this wall is wider upwards: clamp its other end" if upwards > 0.0 else "")
        )


def _check_surprise(at: str, surprise: SurpriseTable, wall: float) -> None:
    needs = SURPRISES[surprise.kind]
    for key in ("at_deg", "width_mm", "ramp_mm", "edge_share"):
        stated = getattr(surprise, key) is not None
        if stated != (key in needs):
            need = f"not used by kind = {surprise.kind}: leave it out" if stated else "missing: state it"
            raise InputError(f"{at}.{key}: {need}")
    if surprise.kind == "thinner-wall" and surprise.share >= 0.5:
        raise InputError(f"{at}.share = {surprise.share:g}: must be below 0.5 of the wall of {wall:g} mm")
