"""The file of measured walls that ``chipload learn-wall`` reads: cutter, cuts, and the form error over the height."""

from __future__ import annotations

import math
from hashlib import sha256
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, ValidationError

from chipload.cutter.cutter import Cutter
from chipload.cutter.table import CutterTable
from chipload.cutting.material import Material, material_named, need_directions, read_material
from chipload.cutting.wall_error import wall_profile
from chipload.cutting.wall_evidence import MeasuredWall, WallKnowledge, learn_from_walls
from chipload.engagement.tooth_engagement import engagement_of_arcs
from chipload.engagement.tooth_surfaces import chips_of_teeth
from chipload.errors import InputError
from chipload.files import read_regular
from chipload.jobs.messages import table_errors
from chipload.jobs.tables import Number, Positive, Table, Text
from chipload.tables import parse_toml

#: largest file of walls [bytes]
LARGEST_FILE = 1_000_000


class MeasuredWallTable(Table):
    """A wall that was cut by a steady cut, and its measured form error."""

    name: Text | None = Field(None, description="name in messages; default: its number")
    milling: Literal["up", "down"] = Field(description="kind of cut that made the wall")
    axial_depth_mm: Positive = Field(description="axial depth of cut")
    radial_depth_mm: Positive = Field(description="radial depth of cut")
    feed_per_tooth_mm: Positive = Field(description="feed per tooth")
    work_um_n: Number = Field(0.0, ge=0.0, description="compliance of the work normal to the wall; 0: rigid")
    noise_um: Positive = Field(description="standard deviation of a measured value")
    place_um: Number = Field(ge=0.0, description="standard deviation of the place of the whole wall: radius, offset")
    height_mm: list[Number] = Field(min_length=1, description="heights of the values above the tip of the cutter")
    error_um: list[Number] = Field(min_length=1, description="measured form error there, positive: material is left")


class WallFileTable(Table):
    """Walls that were cut with one tool in one holder, and measured."""

    material: Text = Field(description="name of a shipped material, or a file (.toml)")
    compliance_error: Number = Field(
        ge=0.0, lt=1.0, description="relative standard deviation of the compliance of cutter and holder, as 0.1"
    )
    cutter: CutterTable = Field(description="the cutter")
    wall: list[MeasuredWallTable] = Field(min_length=1, description="the walls")


def learn_from_wall_file(path: Path, name: str = "") -> WallKnowledge:
    """Return the material of a file of walls after they were measured.

    Parameters
    ----------
    name : of the new material; empty: that of the old one with ``-learned``

    Raises
    ------
    InputError
        As :func:`read_wall_file` and :func:`chipload.cutting.wall_evidence.learn_from_walls`.
    """
    walls, prior, error, digest = read_wall_file(path)
    return learn_from_walls(walls, prior, error, name, (path.name, digest))


def read_wall_file(path: Path) -> tuple[list[MeasuredWall], Material, float, str]:
    """Return the walls of a file, the material before they were measured, the relative standard deviation of the
    compliance, and the SHA-256 of the file.

    Raises
    ------
    InputError
        The file cannot be read, or a key is unknown, missing or out of range.
    """
    data = read_regular(path, path.name, LARGEST_FILE)
    try:
        table = WallFileTable.model_validate(parse_toml(path.name, data))
    except ValidationError as err:
        raise InputError(f"{path.name}: {next(iter(table_errors(err, WallFileTable)))}") from None
    is_file = table.material.lower().endswith(".toml")
    prior = read_material(path.parent / table.material) if is_file else material_named(table.material)
    need_directions(prior, "the error of a wall")
    cutter = table.cutter.model_copy(update={"number": table.cutter.number or 0}).cutter(path.parent)
    walls = [_wall_of(f"wall.{k}" if own.name is None else own.name, own, cutter) for k, own in enumerate(table.wall)]
    if len({wall.name for wall in walls}) < len(walls):
        raise InputError(f"{path.name}: wall: two have one name")
    return walls, prior, table.compliance_error, sha256(data).hexdigest()


def _wall_of(label: str, table: MeasuredWallTable, cutter: Cutter) -> MeasuredWall:
    """Return a wall with the prediction of its form error."""
    if table.axial_depth_mm > cutter.flute_length:
        raise InputError(
            f"{label}: axial_depth_mm = {table.axial_depth_mm:g}: must be at most cutter.flute_length_mm = "
            f"{cutter.flute_length:g}"
        )
    if table.radial_depth_mm >= 2.0 * cutter.radius:
        raise InputError(
            f"{label}: radial_depth_mm = {table.radial_depth_mm:g}: must be below cutter.diameter_mm = "
            f"{2.0 * cutter.radius:g}: a slot makes two walls"
        )
    arc = math.acos(1.0 - table.radial_depth_mm / cutter.radius)
    first, last = (0.0, arc) if table.milling == "up" else (math.pi - arc, math.pi)
    engagement = engagement_of_arcs([first], [last], table.feed_per_tooth_mm, cutter, table.axial_depth_mm)
    chips = chips_of_teeth(engagement, cutter)
    height = np.array(table.height_mm)
    if not ((height >= 0.0) & (height <= table.axial_depth_mm)).all():
        wrong = height[(height < 0.0) | (height > table.axial_depth_mm)][0]
        raise InputError(
            f"{label}: height_mm = {wrong:g}: must be from 0 to axial_depth_mm = {table.axial_depth_mm:g}, above the "
            "tip of the cutter"
        )

    def predict(material: Material) -> NDArray[np.float64]:
        profile = wall_profile(
            chips, cutter, material, height, milling=table.milling, work_compliance=table.work_um_n / 1000.0
        )
        return np.asarray(1000.0 * profile[0])

    return MeasuredWall(label, height, np.array(table.error_um), predict, table.noise_um, table.place_um)
