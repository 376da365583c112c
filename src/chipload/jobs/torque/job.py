"""A job that holds the torque on a thin tube or cone."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from chipload.control.spindle_file import IDENTIFIED
from chipload.cutter.cutter import Cutter
from chipload.jobs.messages import Errors
from chipload.jobs.sources import entries_of, sources_and_cutters, unknown_cutter
from chipload.jobs.torque.tables import RoundTable, ShellTable, SurpriseTable, TorqueJobTable

ONE_PROGRAM = "state a [program] with a file, or a [round] that is made"
#: keys that each kind of surprise needs beside `share`
SURPRISES: Mapping[str, tuple[str, ...]] = {
    "thicker-side": ("at_deg",),
    "hard-spot": ("at_deg", "width_mm", "ramp_mm"),
    "worn-cutter": ("edge_share",),
    "thinner-wall": (),
}


@dataclass(frozen=True)
class TorqueJob:
    """A job on a thin tube or cone; paths are absolute.

    Parameters
    ----------
    path : the job file
    table : its values
    program_file : NC text or CL data; None: the program is made
    machine, material : a shipped name or a file
    control_file : sets and rules; None: the standard ones
    spindle_file : what `chipload spindle` wrote; None: the job states its values
    cutters : by number
    overrides : the `--set` texts that were applied
    """

    path: Path
    table: TorqueJobTable
    program_file: Path | None
    machine: str | Path
    material: str | Path
    control_file: Path | None
    spindle_file: Path | None
    cutters: Mapping[int, Cutter]
    overrides: tuple[str, ...]

    @property
    def shell(self) -> ShellTable:
        """The finished wall."""
        return self.table.torque_control.shell


def load(path: Path, table: TorqueJobTable, overrides: Sequence[str]) -> TorqueJob:
    """The job of a table that was read.

    Raises
    ------
    InputError
        Keys do not go together.
    """
    folder, errors = path.parent, Errors()
    errors.texts += missing(table.model_dump(exclude_none=True))
    if table.program is not None and table.round is not None:
        errors.add(f"program, round: both are stated: {ONE_PROGRAM}")
    sources, tools = sources_and_cutters(table, folder, errors, "machine", "material")
    errors.texts += _wrong_shell(table)
    if table.round is not None and tools:
        errors.texts += _wrong_round(table, table.round, tools)
    for k, surprise in enumerate(table.surprise):
        errors.texts += _wrong_surprise(f"surprise.{k}", surprise, table.torque_control.shell.wall_mm)
    errors.refuse()
    control, spindle = table.torque_control.file, table.spindle.file
    return TorqueJob(
        path, table, None if table.program is None else folder / table.program.file, sources["machine"],
        sources["material"], None if control is None else folder / control,
        None if spindle is None else folder / spindle, tools, tuple(overrides),
    )  # fmt: skip


def missing(values: Mapping[str, Any]) -> list[str]:
    """What a job lacks that one of its tables alone cannot see; ``values`` are those of the file."""
    found = [f"program, round: neither is stated: {ONE_PROGRAM}"] if not {"program", "round"} & set(values) else []
    spindle = values.get("spindle")
    if isinstance(spindle, dict) and "file" not in spindle:
        found += [
            f"spindle.{key}: missing: state it, or a file of chipload spindle"
            for key in IDENTIFIED
            if key not in spindle
        ]
    for k, surprise in entries_of(values, "surprise"):
        needs = SURPRISES.get(str(surprise.get("kind")), ())
        found += [f"surprise.{k}.{key}: missing: state it" for key in needs if key not in surprise]
    return found


def _wrong_shell(table: TorqueJobTable) -> Iterator[str]:
    shell, at = table.torque_control.shell, "torque_control.shell"
    f = math.radians(shell.angle_deg)
    least = min(shell.mean_radius_mm, shell.mean_radius_mm + shell.length_mm * math.sin(f))
    if shell.wall_mm > 0.2 * least:
        yield (
            f"{at}.wall_mm = {shell.wall_mm:g}: must be at most a fifth of the least radius {least:g}: this job is "
            "for thin walls"
        )
    if shell.wall_tolerance_mm >= 0.5 * shell.wall_mm:
        yield (
            f"{at}.wall_tolerance_mm = {shell.wall_tolerance_mm:g}: must be below half of wall_mm = {shell.wall_mm:g}"
        )
    for k, boss in enumerate(shell.boss):
        if not boss.from_deg < boss.to_deg <= boss.from_deg + 360.0:
            yield (
                f"{at}.boss.{k}.to_deg = {boss.to_deg:g}: must be above from_deg = {boss.from_deg:g} and at most "
                f"{boss.from_deg + 360.0:g}"
            )


def _wrong_round(table: TorqueJobTable, ask: RoundTable, tools: Mapping[int, Cutter]) -> Iterator[str]:
    if ask.cutter not in tools:
        yield from unknown_cutter("round.cutter", ask.cutter, tools)
        return
    if not ask.bottom_mm < ask.top_mm:
        yield f"round.bottom_mm = {ask.bottom_mm:g}: must be below top_mm = {ask.top_mm:g}"
    taper = math.degrees(tools[ask.cutter].taper)
    # a flank that is wider upwards leaves a wall that is narrower upwards
    upwards = table.torque_control.shell.angle_deg * (1.0 if table.torque_control.shell.clamped == "low" else -1.0)
    if abs(upwards + taper) > 1e-6:
        yield (
            f"round.cutter = {ask.cutter}: taper_deg = {taper:g}: must be {max(-upwards, 0.0):g}, that of the wall: "
            "an upright cutter leaves its own angle"
            + ("; this wall is wider upwards: clamp its other end" if upwards > 0.0 else "")
        )


def _wrong_surprise(at: str, surprise: SurpriseTable, wall: float) -> Iterator[str]:
    needs = SURPRISES[surprise.kind]
    for key in ("at_deg", "width_mm", "ramp_mm", "edge_share"):
        if getattr(surprise, key) is not None and key not in needs:
            yield f"{at}.{key}: not used by kind = {surprise.kind}: leave it out"
    if surprise.kind == "thinner-wall" and surprise.share >= 0.5:
        yield f"{at}.share = {surprise.share:g}: must be below 0.5 of the wall of {wall:g} mm"
