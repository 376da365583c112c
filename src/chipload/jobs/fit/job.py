"""The job that identifies force coefficients: checks of its tables against one another, and its files."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from chipload.cutter.cutter import Cutter
from chipload.errors import InputError
from chipload.jobs.fit.tables import EngagementTable, FitJobTable
from chipload.jobs.messages import Errors
from chipload.jobs.sources import Limited, entries_of

#: the channels, in the order of the components
CHANNELS = ("feed", "across", "axis")


@dataclass(frozen=True)
class FitJob(Limited):
    """A fit that was read; paths are absolute.

    Parameters
    ----------
    path : the job file
    table : its values
    cutter : that was used
    arc : engaged immersion [rad]
    files : of the measurements, in their order
    overrides : the `--set` texts that were applied
    """

    path: Path
    table: FitJobTable
    cutter: Cutter
    arc: tuple[float, float]
    files: tuple[Path, ...]
    overrides: tuple[str, ...]


def load(path: Path, table: FitJobTable, overrides: Sequence[str]) -> FitJob:
    """Return the job of a table that was read.

    Raises
    ------
    InputError
        Keys do not go together.
    """
    errors = Errors()
    errors.texts += missing_keys(table.model_dump(exclude_none=True))
    for k, m in enumerate(table.measurement):
        if m.window_s is not None and not m.window_s[0] < m.window_s[1]:
            errors.add(f"measurement.{k}.window_s = {list(m.window_s)}: must rise")
    with errors.collect():
        cutter = table.cutter.cutter(path.parent)
        arc = _arc(table.engagement, cutter)
    errors.refuse()
    files = tuple(path.parent / m.file for m in table.measurement)
    return FitJob(path, table, cutter, arc, files, tuple(overrides))


def missing_keys(values: Mapping[str, Any]) -> list[str]:
    """Return missing keys that no single table can detect; ``values`` are those of the file."""
    found, channels = [], values.get("channels")
    if isinstance(channels, Mapping) and not set(CHANNELS) & set(channels):
        found.append('channels: name at least one of feed, across, axis, as feed = "-Fy"')
    if values.get("method") == "instantaneous" and "band_hz" not in values:
        found.append(
            "band_hz: missing: state up to which frequency harmonics are used, below the resonance of the dynamometer"
        )
    uses = [m.get("use") for _, m in entries_of(values, "measurement")]
    if uses and "fit" not in uses:
        found.append("measurement: none has use = fit: set it for those that the coefficients are fitted to")
    return found


def _arc(engagement: EngagementTable, cutter: Cutter) -> tuple[float, float]:
    """Return the engaged immersion [rad]."""
    depth = engagement.radial_depth_mm
    if engagement.milling == "slot":
        if depth is not None and abs(depth - cutter.diameter) > 1e-6:
            raise InputError(
                f"engagement.radial_depth_mm = {depth:g}: a slot is as wide as the cutter, "
                f"{cutter.diameter:g}: leave it out"
            )
        return 0.0, math.pi
    if depth is None:
        raise InputError("engagement.radial_depth_mm: missing: state it for up and down milling")
    if not depth <= cutter.diameter:
        raise InputError(
            f"engagement.radial_depth_mm = {depth:g}: must be at most cutter.diameter_mm = {cutter.diameter:g}"
        )
    a = math.acos(1.0 - depth / cutter.radius)
    return (0.0, a) if engagement.milling == "up" else (math.pi - a, math.pi)
