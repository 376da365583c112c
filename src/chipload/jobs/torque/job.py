"""The job that limits the torque on a thin tube, a cone or a clamped workpiece: checks of its tables."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from chipload.checking.clamped import wrong_clamps
from chipload.control.spindle_file import IDENTIFIED
from chipload.cutter.cutter import Cutter
from chipload.jobs.messages import Errors
from chipload.jobs.simulation.tables import WorkpieceTable
from chipload.jobs.simulation.values import clamps_of
from chipload.jobs.sources import entries_of, sources_and_cutters, unknown_cutter
from chipload.jobs.tables import require_stated
from chipload.jobs.torque.tables import RoundTable, ShellTable, SurpriseTable, TorqueJobTable

ONE_PROGRAM = "state a [program] with a file, or a [round] to generate one"
ONE_WALL = "state [torque_control.shell] of a wall, or [stock] and [workpiece] of any part"
#: tables that go with a workpiece and not with a shell
OF_WORKPIECE = ("stock", "real_stock", "workpiece")
#: keys that each kind of surprise needs besides `share`
SURPRISES: Mapping[str, tuple[str, ...]] = {
    "thicker-side": ("at_deg",),
    "hard-spot": ("at_deg", "width_mm", "ramp_mm"),
    "worn-cutter": ("edge_share",),
    "thinner-wall": (),
}
#: the same on a workpiece; what the stock really is stands in [real_stock]
WORKPIECE_SURPRISES: Mapping[str, tuple[str, ...]] = {
    "hard-spot": ("at_mm", "width_mm", "ramp_mm"),
    "worn-cutter": ("edge_share",),
}


@dataclass(frozen=True)
class TorqueJob:
    """A job on a thin tube, a cone or a workpiece; paths are absolute.

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
        """The finished wall of a thin tube or cone."""
        return require_stated(self.table.torque_control.shell, "torque_control.shell")

    @property
    def workpiece(self) -> WorkpieceTable | None:
        """Workpiece that limits the torque; None: the shell does."""
        return self.table.workpiece


def load(path: Path, table: TorqueJobTable, overrides: Sequence[str]) -> TorqueJob:
    """The job of a table that was read.

    Raises
    ------
    InputError
        Keys do not go together.
    """
    folder, errors = path.parent, Errors()
    errors.texts += missing_keys(table.model_dump(exclude_none=True))
    if table.program is not None and table.round is not None:
        errors.add(f"program, round: both are stated: {ONE_PROGRAM}")
    sources, tools = sources_and_cutters(table, folder, errors, "machine", "material")
    shell = table.torque_control.shell
    errors.texts += _wrong_workpiece(table) if shell is None else _wrong_shell(table, shell)
    if table.round is not None and tools and shell is not None:
        errors.texts += _wrong_round(shell, table.round, tools)
    for k, surprise in enumerate(table.surprise):
        errors.texts += _wrong_surprise(f"surprise.{k}", surprise, shell)
    errors.refuse()
    control, spindle = table.torque_control.file, table.spindle.file
    return TorqueJob(
        path, table, None if table.program is None else folder / table.program.file, sources["machine"],
        sources["material"], None if control is None else folder / control,
        None if spindle is None else folder / spindle, tools, tuple(overrides),
    )  # fmt: skip


def missing_keys(values: Mapping[str, Any]) -> list[str]:
    """What a job lacks that one of its tables alone cannot see; ``values`` are those of the file."""
    found = [f"program, round: neither is stated: {ONE_PROGRAM}"] if not {"program", "round"} & set(values) else []
    control = values.get("torque_control")
    on_shell = isinstance(control, dict) and "shell" in control
    if not on_shell and "workpiece" not in values:
        found.append(f"torque_control.shell, workpiece: neither is stated: {ONE_WALL}")
    elif not on_shell and "stock" not in values:
        found.append("stock: missing: state it ([workpiece] needs it)")
    spindle = values.get("spindle")
    if isinstance(spindle, dict) and "file" not in spindle:
        found += [
            f"spindle.{key}: missing: state it, or a file of chipload spindle"
            for key in IDENTIFIED
            if key not in spindle
        ]
    for k, surprise in entries_of(values, "surprise"):
        needs = (SURPRISES if on_shell else WORKPIECE_SURPRISES).get(str(surprise.get("kind")), ())
        found += [f"surprise.{k}.{key}: missing: state it" for key in needs if key not in surprise]
    return found


def _wrong_workpiece(table: TorqueJobTable) -> Iterator[str]:
    """What keys of a job on a workpiece contradict."""
    if table.round is not None:
        yield "round: needs [torque_control.shell]: state a [program] with a file for a workpiece"
    for key in ("stock", "real_stock"):
        solid = getattr(table, key)
        if solid is None:
            continue
        block = (solid.low_mm is not None, solid.high_mm is not None)
        if any(block) == (solid.file is not None) or any(block) != all(block):
            yield f"{key}: state either low_mm and high_mm of a block, or a file"
        if solid.layer_mm is not None:
            yield f"{key}.layer_mm: leave it out: simulation.layer_mm states it"
    if table.workpiece is not None:
        yield from wrong_clamps(clamps_of(table.workpiece.clamp))
        if table.workpiece.yield_mpa is None:
            yield "workpiece.yield_mpa: missing: state it (limits.strength_share needs it)"
        for key in ("density_kg_m3", "damping_ratio"):
            if getattr(table.workpiece, key) is not None:
                yield f"workpiece.{key}: not used by a torque job: leave it out"


def _wrong_shell(table: TorqueJobTable, shell: ShellTable) -> Iterator[str]:
    at = "torque_control.shell"
    for key in OF_WORKPIECE:
        if getattr(table, key) is not None:
            yield f"{key}: cannot be used with [torque_control.shell]: {ONE_WALL}"
    if table.limits.deflection_workpiece_um is not None:
        yield "limits.deflection_workpiece_um: needs [workpiece]: state form_error_um, or [workpiece] for the shell"
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


def _wrong_round(shell: ShellTable, table: RoundTable, tools: Mapping[int, Cutter]) -> Iterator[str]:
    if table.cutter not in tools:
        yield from unknown_cutter("round.cutter", table.cutter, tools)
        return
    if not table.bottom_mm < table.top_mm:
        yield f"round.bottom_mm = {table.bottom_mm:g}: must be below top_mm = {table.top_mm:g}"
    if (barrel := tools[table.cutter].barrel_radius) is not None:
        yield (
            f"round.cutter = {table.cutter}: barrel_radius_mm = {barrel:g}: its flank is an arc and leaves no straight "
            "wall: state a cutter with a straight flank"
        )
        return
    taper = math.degrees(tools[table.cutter].taper)
    # a flank that is wider upwards leaves a wall that is narrower upwards
    upwards = shell.angle_deg * (1.0 if shell.clamped == "low" else -1.0)
    if abs(upwards + taper) > 1e-6:
        yield (
            f"round.cutter = {table.cutter}: taper_deg = {taper:g}: must be {max(-upwards, 0.0):g}, that of the wall: "
            "an upright cutter leaves its own angle"
            + ("; this wall is wider upwards: clamp its other end" if upwards > 0.0 else "")
        )


def _wrong_surprise(at: str, surprise: SurpriseTable, shell: ShellTable | None) -> Iterator[str]:
    """What keys of a surprise contradict; ``shell`` None: on a workpiece."""
    if shell is None and surprise.kind not in WORKPIECE_SURPRISES:
        yield f"{at}.kind = {surprise.kind}: applies to [torque_control.shell]: state [real_stock] for a workpiece"
        return
    needs = (WORKPIECE_SURPRISES if shell is None else SURPRISES)[surprise.kind]
    for key in ("at_deg", "at_mm", "width_mm", "ramp_mm", "edge_share"):
        if getattr(surprise, key) is not None and key not in needs:
            where = " of a workpiece" if shell is None else ""
            yield f"{at}.{key}: not used by kind = {surprise.kind}{where}: leave it out"
    if shell is not None and surprise.kind == "thinner-wall" and surprise.share >= 0.5:
        yield f"{at}.share = {surprise.share:g}: must be below 0.5 of the wall of {shell.wall_mm:g} mm"
