"""Catalogues of cutters: dimensions, and the shank and holder above the cutting part.

Notation: from the tip upwards the cutting part (diameter, corner radius, cutting length), a neck up to the neck length,
the shank up to the lower end of the holder (reach), the holder above. A part that is not stated does not exist: without
a cutting length the cutting part has no end, without a reach there is no holder.

A straight cutter is a flat, bull-nose or ball cutter. The cutting part of a tapered or a barrel cutter has the profile
of :mod:`chipload.cutter.cutter`: its diameter is that where flank line and bottom meet. It must have an end.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, ValidationError

from chipload.cutter.cutter import Cutter
from chipload.cutter.table import BARREL_NAMES
from chipload.errors import InputError
from chipload.tables import Labelled, nearest, read_table, shipped_table
from chipload.units import rad_s_from_rpm, rpm_from_rad_s

#: cylinders round a cone: length of the lowest [mm], of their height by how much they are longer
_SLICE, _GROWS = 0.4, 0.3
#: modulus [MPa] of a shape whose stiffness is not used
_MODULUS = 2e5


@dataclass(frozen=True)
class CatalogueCutter:
    """One cutter of a catalogue.

    Parameters
    ----------
    diameter : [mm], > 0
    corner_radius : r [mm], 0 <= r <= diameter / 2; of a tapered or barrel cutter above 0
    cutting_length : [mm], >= r; None: without end
    neck_diameter, neck_length : of the part above, and the height of its end above the tip [mm]; both or none
    shank_diameter : of the part above that [mm]; None: as the cutting part at its top
    reach : height above the tip at which the holder begins [mm]; None: no holder
    holder_diameter : [mm], required with the reach
    name : as the shop calls it
    taper : half angle of the flank [rad]
    barrel_radius : of the flank arc of a barrel cutter [mm], whose corner's centre is on the axis; None: no such arc
    max_speed : greatest spindle speed [rad/s]; None: not known
    length : from the nose of the spindle to the tip [mm], above the reach; None: not known

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
    taper: float = 0.0
    barrel_radius: float | None = None
    max_speed: float | None = None
    length: float | None = None

    def __post_init__(self) -> None:
        what = f"cutter {self.name or self.label}"

        def need(ok: bool, key: str, value: float | None, limit: str) -> None:
            if not ok:
                shown = "missing" if value is None else f"= {value:g}"
                raise InputError(f"{what}: {key} {shown}: {limit}")

        keys = ("diameter", "cutting_length", "neck_diameter", "neck_length", "shank_diameter", "reach")
        for key in (*keys, "holder_diameter", "length"):
            value = getattr(self, key)
            need(value is None or 0.0 < value < math.inf, f"{key}_mm", value, "must be above 0 and finite")
        rpm = None if self.max_speed is None else rpm_from_rad_s(self.max_speed)
        need(rpm is None or 0.0 < rpm < math.inf, "max_rpm", rpm, "must be above 0 and finite")
        half = 0.5 * self.diameter
        r = self.corner_radius
        if self.straight:
            need(0.0 <= r <= half, "corner_radius_mm", r, f"must be from 0 to diameter_mm / 2 = {half:g}")
        else:
            need(r > 0.0, "corner_radius_mm", r, "must be above 0 with taper_deg or barrel_radius_mm")
            limit = "must be given with taper_deg or barrel_radius_mm: how far up the cutter has that shape"
            need(self.cutting_length is not None, "cutting_length_mm", None, limit)
        above = (("neck_diameter", "neck_length"), ("neck_length", "neck_diameter"), ("holder_diameter", "reach"))
        for key, other in (*above, ("reach", "holder_diameter")):
            has = getattr(self, other) is not None
            need(not has or getattr(self, key) is not None, f"{key}_mm", None, f"give it with {other}_mm")
        bounded = self.cutting_length is not None
        need(bounded or self.neck_length is None, "cutting_length_mm", None, "give it with a neck")
        need(bounded or self.shank_diameter is None, "cutting_length_mm", None, "give it with a shank")
        last, least = r, "corner_radius_mm"
        for key in ("cutting_length", "neck_length", "reach", "length"):
            value = getattr(self, key)
            if value is not None:
                need(value >= last, f"{key}_mm", value, f"must be at least {least} = {last:g}")
                last, least = value, f"{key}_mm"
        if not self.straight:
            try:
                self.shape  # noqa: B018
            except InputError as err:
                raise InputError(f"{what}: {str(err).removeprefix('cutter.')}") from None

    @property
    def straight(self) -> bool:
        """Whether it is a flat, bull-nose or ball cutter: neither tapered nor a barrel."""
        return self.taper == 0.0 and self.barrel_radius is None

    @property
    def label(self) -> str:
        """Its size in words, in mm.

        >>> CatalogueCutter(14.0, 1.5).label, CatalogueCutter(4.5, 2.0, 20.0, taper=math.radians(4.0)).label
        ('D 14 r 1.5', 'taper 4 deg D 4.5 r 2')
        """
        if self.straight:
            return f"D {self.diameter:g} r {self.corner_radius:g}"
        kind = f"barrel {self.barrel_radius:g} " if self.barrel_radius is not None else ""
        kind += f"taper {math.degrees(self.taper):.6g} deg " if self.taper > 0.0 else ""
        return f"{kind}D {self.diameter:.4g} r {self.corner_radius:g}"

    @property
    def stem(self) -> str:
        """Its size in the name of a file.

        >>> CatalogueCutter(14.0, 1.5).stem, CatalogueCutter(4.5, 2.0, 20.0, taper=math.radians(4.0)).stem
        ('D14r1.5', 'taper4D4.5r2')
        """
        return self.label.replace(" deg", "").replace(" ", "")

    @cached_property
    def shape(self) -> Cutter:
        """The cutting part of a cutter that has an end, its stiffness not known."""
        if self.cutting_length is None:
            raise InputError(f"cutter {self.label}: cutting_length_mm is missing: the cutting part has no end")
        return Cutter(
            self.diameter, 1, 0.0, self.cutting_length, self.cutting_length, _MODULUS,
            corner_radius=self.corner_radius, taper=self.taper, barrel_radius=self.barrel_radius,
        )  # fmt: skip

    def assembled(self, number: int, length: float) -> Cutter:
        """The tool with neck, shank and holder, its stiffness not known; what has no end ends ``length`` mm above.

        A neck stands as the shank of the cutter, the shank over it as the lowest part of the holder.

        >>> cutter = CatalogueCutter(10.0, 1.0, 20.0, shank_diameter=8.0, reach=50.0, holder_diameter=40.0)
        >>> cutter.assembled(3, 90).holder
        ((90, 40.0),)
        """
        flutes = self.cutting_length or self.reach or length
        ends = self.reach or (flutes if self.cutting_length is None else max(flutes, self.neck_length or 0.0) + length)
        shank = self.top_diameter if self.shank_diameter is None else self.shank_diameter
        holder = () if self.holder_diameter is None else ((length, self.holder_diameter),)
        neck = self.neck_diameter
        if neck is not None and self.neck_length is not None:
            parts = ((ends - self.neck_length, shank),) if ends > self.neck_length else ()
            shank, ends, holder = neck, self.neck_length, (*parts, *holder)
        return Cutter(
            self.diameter, 1, 0.0, flutes, ends, _MODULUS, corner_radius=self.corner_radius, taper=self.taper,
            barrel_radius=self.barrel_radius, shank_diameter=shank, holder=holder, number=number, name=self.name,
            max_speed=self.max_speed,
        )  # fmt: skip

    @property
    def rho(self) -> float:
        """Distance e of the corner's centre from the axis [mm], R - r of a straight cutter; 0 of a tapered ball."""
        if self.straight:
            return 0.5 * self.diameter - self.corner_radius
        e = self.shape.apt[2]
        # what rounding leaves of a ball: the exact arcs of B are those of a ball or of a corner well off the axis
        return e if e > 1e-7 * self.diameter else 0.0

    @property
    def contact_arc(self) -> tuple[float, float, float]:
        """(r, e, f) [mm] of the arc of the profile that mills by points: a barrel's flank arc, else the corner.

        >>> CatalogueCutter(10.0, 1.0).contact_arc, CatalogueCutter(12.0, 2.0, 25.0, barrel_radius=85.0).contact_arc[:2]
        ((1.0, 4.0, 1.0), (85.0, -79.0))
        """
        r = self.corner_radius
        return (r, self.rho, r) if self.barrel_radius is None else self.shape.finishing_arc

    @property
    def top_diameter(self) -> float:
        """Diameter [mm] of the cutting part at its top."""
        if self.straight or self.cutting_length is None:
            return self.diameter
        return 2.0 * float(self.shape.radius_at(self.cutting_length))

    def stages(self, clearance: float) -> NDArray[np.float64]:
        """Rows (k, 2): height above the corner's centres where a cylinder begins, its radius [mm].

        The first is the cutting part, of a tapered or barrel cutter as wide as at its top; ``clearance`` [mm] is added
        to the radius of every other.

        >>> CatalogueCutter(10.0, 1.0, 20.0, shank_diameter=8.0, reach=50.0, holder_diameter=40.0).stages(0.5).tolist()
        [[0.0, 5.0], [19.0, 4.5], [49.0, 20.5]]
        """
        rows = [(0.0, 0.5 * self.top_diameter)]
        if self.cutting_length is not None:
            shank = 0.5 * (self.top_diameter if self.shank_diameter is None else self.shank_diameter)
            if self.neck_length is not None and self.neck_diameter is not None:
                rows.append((self.cutting_length - self.corner_radius, 0.5 * self.neck_diameter + clearance))
                rows.append((self.neck_length - self.corner_radius, shank + clearance))
            else:
                rows.append((self.cutting_length - self.corner_radius, shank + clearance))
        if self.reach is not None and self.holder_diameter is not None:
            rows.append((self.reach - self.corner_radius, 0.5 * self.holder_diameter + clearance))
        return np.array(rows)

    @property
    def not_enclosed(self) -> float:
        """By how much a tapered cutter stands out of its cylinders at most [mm]: r (1 / cos(taper) - 1)."""
        return self.corner_radius * (1.0 / math.cos(self.taper) - 1.0)

    def enclosing(self, clearance: float) -> NDArray[np.float64]:
        """As :meth:`stages`, the cone of a tapered cutter by cylinders round it: first its corner and what is as wide.

        Each cylinder is as wide as the cone at its upper end, :data:`_SLICE` and :data:`_GROWS` of its height above the
        corner's centre long: its lower rim stands out of the cone by so much times tan(taper). Below the corner's
        centre the cone stands out of the corner, by at most :attr:`not_enclosed`.

        >>> CatalogueCutter(8.0, 4.0, 12.0).enclosing(0.5).tolist()
        [[0.0, 4.0], [8.0, 4.5]]
        """
        upper = self.stages(clearance)
        if self.straight:
            return upper
        if self.barrel_radius is not None:
            raise InputError(f"cutter {self.label}: a barrel is not enclosed by cylinders: mill by points with it")
        r, cb, tb = self.corner_radius, math.cos(self.taper), math.tan(self.taper)
        top = float(upper[1, 0])
        ends = [0.0]
        while ends[-1] < top:
            ends.append(min(ends[-1] + _SLICE + _GROWS * ends[-1], top))
        cone = [(low, self.rho + r / cb + high * tb) for low, high in pairwise(ends)]
        return np.vstack([[[0.0, self.rho + r]], np.array(cone).reshape(-1, 2), upper[1:]])


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
        ordered = tuple(sorted(
            self.cutters, key=lambda c: (c.diameter, c.corner_radius, c.taper, c.barrel_radius or 0.0,
                                         c.reach or math.inf, c.name)
        ))  # fmt: skip
        for a, b in pairwise(ordered):
            if a == b:
                raise InputError(f"catalogue {self.name}: {a.label} appears twice: keep one")
        object.__setattr__(self, "cutters", ordered)

    @property
    def straight(self) -> tuple[CatalogueCutter, ...]:
        """Its flat, bull-nose and ball cutters without taper."""
        return tuple(c for c in self.cutters if c.straight)

    def of(self, cutters: Sequence[CatalogueCutter]) -> Catalogue:
        """The same catalogue with these of its cutters alone."""
        return self if len(cutters) == len(self.cutters) else Catalogue(self.name, tuple(cutters), self.note)

    @property
    def alike(self) -> tuple[tuple[CatalogueCutter, ...], ...]:
        """Cutters of one corner radius, taper and barrel radius, each by diameter; straight ones by their families."""
        kinds = sorted({(not c.straight, c.corner_radius, c.taper, c.barrel_radius or 0.0) for c in self.cutters})
        return tuple(
            tuple(
                c for c in self.cutters
                if (not c.straight, c.corner_radius, c.taper, c.barrel_radius or 0.0) == kind
            )
            for kind in kinds
        )  # fmt: skip

    @property
    def families(self) -> tuple[float, ...]:
        """Corner radii [mm], ascending: only within one does a smaller straight cutter lie inside a larger one."""
        return tuple(sorted({c.corner_radius for c in self.cutters}))

    def family(self, corner_radius: float) -> tuple[CatalogueCutter, ...]:
        """Return the cutters of one corner radius, by diameter."""
        return tuple(c for c in self.cutters if c.corner_radius == corner_radius)


class _Cutter(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False, frozen=True)

    diameter_mm: float | None = None
    corner_radius_mm: float
    taper_deg: float = 0.0
    barrel_radius_mm: float | None = None
    cutting_length_mm: float | None = None
    neck_diameter_mm: float | None = None
    neck_length_mm: float | None = None
    shank_diameter_mm: float | None = None
    reach_mm: float | None = None
    holder_diameter_mm: float | None = None
    max_rpm: float | None = None
    length_mm: float | None = None
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
    for names, key in ((BARREL_NAMES, "barrel_radius_mm"), (_TAPER, "taper_deg")):
        other = next((name for name in row if name in names), None)
        if other is not None:
            raise InputError(f"cutter {k}: {other}: unknown key: state {key}")
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
    beta = math.radians(given.pop("taper_deg"))
    d, r = given["diameter_mm"], given["corner_radius_mm"]
    if not 0.0 <= beta < math.radians(_STEEPEST):
        raise InputError(f"cutter {k}: taper_deg = {row['taper_deg']}: must be from 0 to below {_STEEPEST:g}")
    ball = 2.0 * r * (1.0 - math.sin(beta)) / math.cos(beta)
    if d is None:
        if beta == 0.0 or given["barrel_radius_mm"] is not None:
            raise InputError(f"cutter {k}: diameter_mm is missing: must be given")
        given["diameter_mm"] = ball
    elif beta > 0.0 and d == 2.0 * r:
        raise InputError(
            f"cutter {k}: diameter_mm = {d:g}: with taper_deg it is the diameter where flank line and bottom meet, "
            f"{ball:.6g} of a tapered ball: leave it out"
        )
    rpm = given.pop("max_rpm")
    speed = None if rpm is None else rad_s_from_rpm(rpm)
    return CatalogueCutter(
        taper=beta, max_speed=speed, **{key.removesuffix("_mm"): value for key, value in given.items()}
    )


_WANTED = {"name": "text"}
#: keys by which shops and tool libraries state the angle of a tapered cutter; the greatest one [deg]
_TAPER, _STEEPEST = ("taper_angle_deg", "half_angle_deg", "taper"), 60.0
