"""From a ``[[fixture]]`` to its bodies: of a file, or of the numbers of a vise, a clamp or a block."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from chipload.checking.workholding import Corner, StrapClamp, Vise, block, fixtures
from chipload.checking.workpiece import Fixture, Stock, stock_box
from chipload.errors import InputError
from chipload.jobs.simulation.tables import WorkholdingTable
from chipload.stock.layers import LayeredStock

if TYPE_CHECKING:
    import trimesh

#: spacing of bodies that are stated by numbers [mm]
SPACING_MM = 2.0
#: keys that each kind needs, and those that it may have
KEYS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "file": (("file", "spacing_mm"), ("units", "chord_mm")),
    "vise": (("jaw_mm", "grip_mm"), ("closes", "fixed", "opening_mm", "step_mm", "parallels_mm", "at_mm")),
    "clamp": (("point_mm", "strap_mm"), ("angle_deg", "bolt_mm")),
    "block": (("low_mm", "high_mm"), ()),
}


def fixture_errors(table: WorkholdingTable, key: str) -> list[str]:
    """What is wrong with the keys of a fixture: one that its kind needs is missing, or one of another kind is there."""
    needed, may = KEYS[table.kind]
    out = [f"{key}.{name} is missing: a {table.kind} needs it" for name in needed if getattr(table, name) is None]
    allowed = {*needed, *may, "kind", "spacing_mm"}
    others = sorted(name for name in table.model_fields_set - allowed if getattr(table, name) is not None)
    return [*out, *(f'{key}.{name}: not used with kind = "{table.kind}": leave it out' for name in others)]


def fixtures_of(table: WorkholdingTable, number: int, folder: Path, stock: Stock | None) -> tuple[Fixture, ...]:
    """Return the bodies of a fixture; its file is read.

    Parameters
    ----------
    stock : that a vise holds; None: of a part that a vise cannot hold

    Raises
    ------
    InputError
        The file cannot be read, or the numbers contradict one another or the stock.
    """
    key, name = f"fixture.{number}", f"fixture {number}"
    spacing = table.spacing_mm or SPACING_MM
    bodies: dict[str, trimesh.Trimesh]
    if table.kind == "file":
        file = folder / str(table.file)
        return (Fixture.read(file, spacing, units=table.units, chord_mm=table.chord_mm, key=f"{key}.file"),)
    if table.kind == "vise":
        if stock is None:
            raise InputError(f"{key}.kind: a vise holds a block of stock, which this job has not: state clamp or block")
        vise = Vise(
            cast(Any, table.jaw_mm), cast(float, table.grip_mm), table.closes or "y", table.fixed,
            table.opening_mm, table.step_mm, table.parallels_mm, table.at_mm,
        )  # fmt: skip
        bodies = {part: block(*corners, key) for part, corners in vise.boxes(*_box(stock, key), key).items()}
        return fixtures(bodies, spacing, f"{name}, vise")
    if table.kind == "clamp":
        angle = math.radians(table.angle_deg or 0.0)
        clamp = StrapClamp(cast(Any, table.point_mm), cast(Any, table.strap_mm), angle, table.bolt_mm)
        return fixtures(clamp.meshes(key), spacing, f"{name}, clamp")
    return fixtures({"": block(cast(Any, table.low_mm), cast(Any, table.high_mm), key)}, spacing, f"{name}, block")


def _box(stock: Stock, key: str) -> tuple[Corner, Corner]:
    """Corners of the box around a stock [mm]."""
    body = stock.body
    if isinstance(body, tuple):
        return body
    low, high = stock_box(body) if isinstance(body, LayeredStock) else np.asarray(body.bounds)
    if not np.isfinite([*low, *high]).all():
        raise InputError(f"{key}: the stock has no size: a vise needs one")
    (a, b, c), (d, e, f) = low.tolist(), high.tolist()
    return (a, b, c), (d, e, f)
