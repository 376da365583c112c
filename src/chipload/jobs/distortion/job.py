"""The job that predicts distortion: its tables checked against one another, and its stress profile."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from chipload.errors import InputError
from chipload.files import read_regular
from chipload.jobs.distortion.tables import DistortionJobTable, ResidualStressTable
from chipload.jobs.messages import Errors
from chipload.jobs.sources import Limited
from chipload.number_text import number_text
from chipload.structure.stress_profile import (
    BALANCED,
    StressProfile,
    m_shape,
    odd_shape,
    profile_of_points,
    require_balance,
)
from chipload.tables import LARGEST_FILE

#: columns of a file of points
COLUMNS = ("height_mm", "along_mpa", "across_mpa")
#: height of the last point over the thickness of the plate, at most apart by
NEAR = 1e-3


@dataclass(frozen=True, eq=False)
class DistortionJob(Limited):
    """A job that was read; paths are absolute.

    Parameters
    ----------
    path : the job file
    table : its values
    profile : stress of the plate along x and y, in equilibrium
    odd : a stress that differs from face to face, of the size that the job states
    unbalance : share of the stated stress that was not in equilibrium
    overrides : the `--set` texts that were applied
    """

    path: Path
    table: DistortionJobTable
    profile: StressProfile
    odd: StressProfile
    unbalance: float
    overrides: tuple[str, ...]

    @property
    def part_file(self) -> Path:
        """The finished part."""
        return self.path.parent / self.table.part.file


def load(path: Path, table: DistortionJobTable, overrides: Sequence[str]) -> DistortionJob:
    """Return the job of a table that was read.

    Raises
    ------
    InputError
        Keys do not go together, or the stress is not that of the plate.
    """
    errors = Errors()
    errors.texts += missing_keys(table.model_dump(exclude_none=True))
    for axis, low, high in zip("xyz", table.stock.low_mm, table.stock.high_mm, strict=True):
        if not low < high:
            errors.add(f"stock.high_mm: {axis} = {high:g} must be above that of low_mm, {low:g}")
    for k, setup in enumerate(table.setup):
        if setup.hold == "flat" and not setup.clamp:
            errors.add(f"setup.{k}.hold = flat: state the clamps that press the part flat, as [[setup.clamp]]")
    errors.refuse()
    stress = table.residual_stress
    with errors.collect():
        profile, off = require_balance(stated_profile(stress, path.parent, _thickness(table)))
    errors.refuse()
    across = stress.across_share if stress.across_share is not None else _across(profile)
    odd = odd_shape(_thickness(table), 0.01 * stress.odd_percent * profile.greatest, across)
    if stress.rolling == "y":
        profile, odd = profile.turned(), odd.turned()
    return DistortionJob(path, table, profile, odd, off if off > BALANCED else 0.0, tuple(overrides))


def _thickness(table: DistortionJobTable) -> float:
    return table.stock.high_mm[2] - table.stock.low_mm[2]


def _across(profile: StressProfile) -> float:
    along = float(abs(profile.along_x).max())
    return float(abs(profile.along_y).max()) / along if along > 0.0 else 1.0


def missing_keys(values: Mapping[str, Any]) -> list[str]:
    """Return missing keys that no single table can detect; ``values`` are those of the file."""
    stress, found = values.get("residual_stress"), list[str]()
    if not isinstance(stress, Mapping):
        return found
    stated = [key for key in ("shape", "points_mpa", "file") if key in stress]
    if len(stated) != 1:
        both = " and ".join(stated) + " are" if stated else "none is"
        found.append(f"residual_stress: {both} stated: state one of shape, points_mpa and file")
    for key in ("amplitude_mpa", "across_share"):
        if ("shape" in stress) != (key in stress):
            needed = (
                "missing: state it with the shape" if "shape" in stress else "leave it out: points state the stress"
            )
            found.append(f"residual_stress.{key}: {needed}")
    return found


def stated_profile(stress: ResidualStressTable, folder: Path, thickness: float) -> StressProfile:
    """The stress that a table states, along the rolling direction as x, not yet balanced.

    Raises
    ------
    InputError
        The file cannot be read, or the points do not run from face to face of the plate.
    """
    if stress.shape is not None and stress.amplitude_mpa is not None and stress.across_share is not None:
        return m_shape(thickness, stress.amplitude_mpa, stress.across_share)
    points: Sequence[Sequence[float]] = stress.points_mpa or ()
    if stress.file is not None:
        points = read_points(folder / stress.file)
    profile = profile_of_points(points)
    if abs(profile.thickness - thickness) > NEAR * thickness:
        raise InputError(
            f"residual_stress: its points end at a height of {profile.thickness:g} mm: must be at the upper side of "
            f"the plate, {number_text(thickness, 6)} mm above its underside, as [stock] states it"
        )
    return profile


def read_points(file: Path) -> list[list[float]]:
    """Points of a table (CSV) with the columns :data:`COLUMNS`.

    Raises
    ------
    InputError
        It cannot be read, or a column or a number is missing.
    """
    key = f"residual_stress.file = {file.name}"
    text = read_regular(file, key, LARGEST_FILE, "not a table of points").decode("utf-8", "replace")
    rows = csv.DictReader(io.StringIO(text.lstrip("\ufeff")))
    names = [name.strip() for name in rows.fieldnames or ()]
    lost = [name for name in COLUMNS if name not in names]
    if lost:
        raise InputError(f"{key}: no column {', '.join(lost)}: name the columns {', '.join(COLUMNS)}")
    out = []
    for number, row in enumerate(rows, start=2):
        values = {str(name).strip(): value for name, value in row.items()}
        try:
            out.append([float(values[name]) for name in COLUMNS])
        except (TypeError, ValueError):
            raise InputError(f"{key}: line {number}: must be three numbers, {', '.join(COLUMNS)}") from None
    return out
