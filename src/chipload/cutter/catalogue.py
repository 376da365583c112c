"""Catalogues of cutters: dimensions, and the shank and holder above the cutting part.

Notation: from the tip upwards the cutting part (diameter, corner radius, cutting length), a neck up to the neck length,
the shank up to the lower end of the holder (reach), the holder above. A part that is not stated does not exist: without
a cutting length the cutting part has no end, without a reach there is no holder.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, ValidationError

from chipload.cutter.table import BARREL_NAMES
from chipload.errors import InputError
from chipload.tables import Labelled, nearest, read_table, shipped_table


@dataclass(frozen=True)
class CatalogueCutter:
    """One cutter of a catalogue.

    Parameters
    ----------
    diameter : [mm], > 0
    corner_radius : r [mm], 0 <= r <= diameter / 2
    cutting_length : [mm], >= r; None: without end
    neck_diameter, neck_length : of the part above, and the height of its end above the tip [mm]; both or none
    shank_diameter : of the part above that [mm]; None: as the diameter
    reach : height above the tip at which the holder begins [mm]; None: no holder
    holder_diameter : [mm], required with the reach
    name : as the shop calls it

    Raises
    ------
    InputError
        A number is out of range, or another number that it requires is missing.
    """

    diameter: float
    corner_radius: float
    cutting_length: float | None = None
    neck_diameter: float | None = None
    neck_length: float | None = None
    shank_diameter: float | None = None
    reach: float | None = None
    holder_diameter: float | None = None
    name: str = ""

    def __post_init__(self) -> None:
        what = f"cutter {self.name or f'D {self.diameter:g} r {self.corner_radius:g}'}"

        def need(ok: bool, key: str, value: float | None, limit: str) -> None:
            if not ok:
                shown = "missing" if value is None else f"= {value:g}"
                raise InputError(f"{what}: {key} {shown}: {limit}")

        keys = ("diameter", "cutting_length", "neck_diameter", "neck_length", "shank_diameter", "reach")
        for key in (*keys, "holder_diameter"):
            value = getattr(self, key)
            need(value is None or 0.0 < value < math.inf, f"{key}_mm", value, "must be above 0 and finite")
        half = 0.5 * self.diameter
        r = self.corner_radius
        need(0.0 <= r <= half, "corner_radius_mm", r, f"must be from 0 to diameter_mm / 2 = {half:g}")
        above = (("neck_diameter", "neck_length"), ("neck_length", "neck_diameter"), ("holder_diameter", "reach"))
        for key, other in (*above, ("reach", "holder_diameter")):
            has = getattr(self, other) is not None
            need(not has or getattr(self, key) is not None, f"{key}_mm", None, f"give it with {other}_mm")
        bounded = self.cutting_length is not None
        need(bounded or self.neck_length is None, "cutting_length_mm", None, "give it with a neck")
        need(bounded or self.shank_diameter is None, "cutting_length_mm", None, "give it with a shank")
        last, least = r, "corner_radius_mm"
        for key in ("cutting_length", "neck_length", "reach"):
            value = getattr(self, key)
            if value is not None:
                need(value >= last, f"{key}_mm", value, f"must be at least {least} = {last:g}")
                last, least = value, f"{key}_mm"

    @property
    def rho(self) -> float:
        """R - r [mm]: distance of the corner's centre from the axis."""
        return 0.5 * self.diameter - self.corner_radius

    def stages(self, clearance: float) -> NDArray[np.float64]:
        """Rows (k, 2): height above the corner's centres where a cylinder begins, its radius [mm].

        The first is the cutting part; ``clearance`` [mm] is added to the radius of every other.

        >>> CatalogueCutter(10.0, 1.0, 20.0, shank_diameter=8.0, reach=50.0, holder_diameter=40.0).stages(0.5).tolist()
        [[0.0, 5.0], [19.0, 4.5], [49.0, 20.5]]
        """
        rows = [(0.0, 0.5 * self.diameter)]
        if self.cutting_length is not None:
            shank = 0.5 * (self.diameter if self.shank_diameter is None else self.shank_diameter)
            if self.neck_length is not None and self.neck_diameter is not None:
                rows.append((self.cutting_length - self.corner_radius, 0.5 * self.neck_diameter + clearance))
                rows.append((self.neck_length - self.corner_radius, shank + clearance))
            else:
                rows.append((self.cutting_length - self.corner_radius, shank + clearance))
        if self.reach is not None and self.holder_diameter is not None:
            rows.append((self.reach - self.corner_radius, 0.5 * self.holder_diameter + clearance))
        return np.array(rows)


@dataclass(frozen=True)
class Catalogue:
    """Cutters, by diameter, then corner radius.

    Raises
    ------
    InputError
        It is empty, or a size appears twice.
    """

    name: str
    cutters: tuple[CatalogueCutter, ...]
    note: str = ""

    def __post_init__(self) -> None:
        if not self.cutters:
            raise InputError(f"catalogue {self.name}: no cutter: must have at least one")
        ordered = tuple(sorted(self.cutters, key=lambda c: (c.diameter, c.corner_radius, c.reach or math.inf, c.name)))
        for a, b in pairwise(ordered):
            if a == b:
                raise InputError(
                    f"catalogue {self.name}: D {a.diameter:g} r {a.corner_radius:g} appears twice: keep one"
                )
        object.__setattr__(self, "cutters", ordered)

    @property
    def families(self) -> tuple[float, ...]:
        """Corner radii [mm], ascending: only within one does a smaller cutter lie inside a larger one."""
        return tuple(sorted({c.corner_radius for c in self.cutters}))

    def family(self, corner_radius: float) -> tuple[CatalogueCutter, ...]:
        """Return the cutters of one corner radius, by diameter."""
        return tuple(c for c in self.cutters if c.corner_radius == corner_radius)


class _Cutter(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False, frozen=True)

    diameter_mm: float
    corner_radius_mm: float
    cutting_length_mm: float | None = None
    neck_diameter_mm: float | None = None
    neck_length_mm: float | None = None
    shank_diameter_mm: float | None = None
    reach_mm: float | None = None
    holder_diameter_mm: float | None = None
    name: str = ""


def read_catalogue(path: str | Path) -> Catalogue:
    """Read a catalogue from a TOML file.

    Raises
    ------
    InputError
        The file cannot be read, is not TOML, a key is unknown or missing, a number out of range.
    """
    return _from_table(read_table("catalogue", path))


def catalogue_named(name: str) -> Catalogue:
    """Return a shipped catalogue.

    >>> len(catalogue_named("wu2019").family(2.0))
    36
    """
    return _from_table(shipped_table("catalogue", name))


def _from_table(labelled: Labelled) -> Catalogue:
    label, table = labelled
    known = ("name", "note", "cutter")
    for key in table:
        if key not in known:
            raise InputError(f"{label}: {key}: unknown key: the nearest known one is {nearest(key, list(known))}")
    name, note, rows = table.get("name"), table.get("note", ""), table.get("cutter")
    if not isinstance(name, str) or not isinstance(note, str):
        raise InputError(f"{label}: name: must be a text")
    if not isinstance(rows, list):
        raise InputError(f"{label}: cutter is missing: must be a list of cutters")
    try:
        return Catalogue(name, tuple(_cutter(k, row) for k, row in enumerate(rows, 1)), note)
    except InputError as err:
        raise InputError(f"{label}: {err}") from None


def _cutter(k: int, row: Any) -> CatalogueCutter:
    if not isinstance(row, dict):
        raise InputError(f"cutter {k}: must be a table")
    known = ("barrel_radius_mm", *BARREL_NAMES)
    barrel = next((key for key in row if key in known or row[key] == "barrel"), None)
    if barrel is not None:
        raise InputError(
            f"cutter {k}: {barrel} = {row[barrel]!r}: the search of table angles and the gouge check model cutters by "
            "cylinders and one corner circle: state flat, bull-nose or ball cutters by diameter_mm and "
            "corner_radius_mm, and simulate a program for the barrel cutter with kind = program"
        )
    taper = next((key for key in row if key in _TAPER or row[key] == "tapered"), None)
    if taper is not None:
        raise InputError(
            f"cutter {k}: {taper} = {row[taper]!r}: tapered cutters are not planned with: state the straight one "
            "that fits into it by diameter_mm and corner_radius_mm, and its thicker part by shank_diameter_mm"
        )
    try:
        given = _Cutter.model_validate(row).model_dump()
    except ValidationError as err:
        first = err.errors()[0]
        key = ".".join(str(x) for x in first["loc"])
        if first["type"] == "extra_forbidden":
            near = nearest(key, list(_Cutter.model_fields))
            raise InputError(f"cutter {k}: {key}: unknown key: the nearest known one is {near}") from None
        if first["type"] == "missing":
            raise InputError(f"cutter {k}: {key} is missing: must be given") from None
        raise InputError(
            f"cutter {k}: {key} = {first['input']!r}: must be a {_WANTED.get(key, 'finite number')}"
        ) from None
    return CatalogueCutter(**{key.removesuffix("_mm"): value for key, value in given.items()})


_WANTED = {"name": "text"}
#: keys by which shops and tool libraries state the angle of a tapered cutter
_TAPER = ("taper_deg", "taper_angle_deg", "half_angle_deg", "taper")
