"""Blade sections: reading of point files, checks, and lofting to the two sides of a blade.

Notation: a section is a closed profile (n, 3) float [mm] in the part's frame, z the axis of rotation; sections go from
hub to shroud. A blade has a side that faces increasing theta (`plus`) and one that faces decreasing theta (`minus`).
u in 0..1 runs along a section from its leading to its trailing edge, v from the first section to the last.

Formats: tables of three columns, one section per file, whose first line names the columns `X R*THETA R`,
`X R THETA_DEG` or `X Y Z` (NASA's HECC; X of the first two is along the axis); TurboGrid `.curve` and `.crv` with
columns x y z and sections separated by lines that begin with #, several blades by lines that begin with ##; tables of
pyturbo-aero and blade3d files of T-Blade3 with all sections (``section_table.py``); clouds of points X Y Z that lie on
levels, in any order, also with their number in front (``point_cloud.py``). The files do not state a unit, so the caller
states it.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import shapely
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.files import read_regular
from chipload.geometry.bspline import BSplinePatch, patch_through
from chipload.geometry.point_cloud import levels_of_cloud
from chipload.geometry.section_table import meridian_of_table, sections_of_table
from chipload.lazy import scipy
from chipload.units import MM_PER

Floats = NDArray[np.float64]

_Half = tuple["scipy.interpolate.BSpline", float, float]

_LARGEST_FILE = 20_000_000
#: greatest absolute value of a coordinate [mm]
FARTHEST = 1e6
_LEAST_POINTS = 12
_EDGE = 0.03  # share of its length: a profile whose first point is this near to an end begins at that edge
_ACROSS = 1e-3  # difference of z of its edges over the length of a section that lies across the axis
_OUTER = 0.02  # greatest relative difference of the outer diameter from the stated one
#: order of the columns x y z that brings the axis of rotation to the last place
AXES = {"x": (1, 2, 0), "y": (2, 0, 1), "z": (0, 1, 2)}


@dataclass(frozen=True, eq=False)
class Blade:
    """The two sides of a blade; their normals point out of the metal."""

    plus: BSplinePatch
    minus: BSplinePatch

    def turned(self, angle: float) -> Blade:
        """The blade rotated about z by an angle [rad]."""
        return Blade(self.plus.turned(angle), self.minus.turned(angle))


def read_sections(
    paths: Sequence[str | Path],
    unit: str,
    over: bool = False,
    columns: str | None = None,
    axis: str = "z",
    body: int = 0,
) -> tuple[Floats, ...]:
    """Sections of one blade from files in order from hub to shroud.

    A file of TurboGrid or pyturbo-aero or T-Blade3 may contain all sections, and so may a cloud of points.

    Parameters
    ----------
    unit : unit of length of the files, a key of ``units.MM_PER``
    over : rotate the part by 180 deg about x, so that a flow along the axis in the file runs along -z
    columns : names of the columns of files whose first line does not state them; other files must agree
    axis : axis of rotation in files with the columns x y z, a key of :data:`AXES`
    body : which blade of a file that contains several, 0 the first; a file with one blade has no others

    Returns
    -------
    sections : (n, 3) float [mm] each, z along the axis

    Raises
    ------
    InputError
        A file cannot be read, a line does not have three numbers, or the columns or the unit are unknown.
    """
    out: list[Floats] = []
    for path in paths:
        out += _sections_of(Path(path), _scale(unit), columns, AXES[axis], body)
    return tuple(p * np.array([1.0, -1.0, -1.0]) if over else p for p in out)


def read_meridian(path: str | Path, unit: str, over: bool = False, shroud: bool = False, axis: str = "z") -> Floats:
    """Meridional curve of a hub or shroud, (n, 2) float [mm] r and z, from the end with the greatest z - r (inlet).

    The file has two columns `x r`, or three columns x y z (TurboGrid). From a table of all sections (pyturbo-aero), the
    first section gives the hub; with ``shroud`` the last one gives the shroud. ``unit``, ``over`` and ``axis`` are as
    in :func:`read_sections`.

    Raises
    ------
    InputError
        The file cannot be read, its columns are inconsistent, or the unit is unknown.
    """
    scale = _scale(unit)
    found = meridian_of_table(_text(Path(path)), Path(path), shroud)
    if found is not None:
        r, z = _finite(found * scale, Path(path)).T
        return _from_inlet(np.stack([r, -z if over else z], axis=-1))
    rows = [row for block in _blocks(Path(path)) for row in block[1]]
    if len({len(row) for row in rows}) > 1:
        raise InputError(f"{path}: blocks of 2 and of 3 columns: must have the same number in every block")
    p = _finite(np.array(rows) * scale, Path(path))
    if p.shape[1] == 3:
        p = p[:, AXES[axis]]
        p = np.stack([p[:, 2], np.hypot(p[:, 0], p[:, 1])], axis=-1)
    return _from_inlet(np.stack([p[:, 1], -p[:, 0] if over else p[:, 0]], axis=-1))


def _from_inlet(meridian: Floats) -> Floats:
    """A meridian (n, 2) r and z from its end with the greatest z - r, each of its points once."""
    differs = np.linalg.norm(np.diff(meridian, axis=0), axis=1) > 0.0
    meridian = meridian[np.concatenate([[True], differs])]
    first = meridian[:, 1] - meridian[:, 0]
    return meridian[::-1] if first[-1] > first[0] else meridian


def check_sections(sections: tuple[Floats, ...], outer_diameter: float | None = None) -> tuple[Floats, ...]:
    """The sections, if a blade can be lofted through them.

    Parameters
    ----------
    outer_diameter : outer diameter of the blade on the drawing [mm], to detect a wrong unit; None: not checked

    Raises
    ------
    InputError
        There are fewer than two sections, one has too few points or crosses itself, they are out of order, or the
        diameter differs from the stated one.
    """
    if len(sections) < 2:
        raise InputError(f"sections: {len(sections)}: must be at least 2, from hub to shroud")
    for k, p in enumerate(sections, 1):
        if len(p) < _LEAST_POINTS:
            raise InputError(f"section {k}: {len(p)} points: must be at least {_LEAST_POINTS}")
        if not np.isfinite(p).all():
            raise InputError(f"section {k}: a number is not finite")
        if _crosses_itself(p):
            raise InputError(f"section {k}: crosses itself: its points must go once round the profile")
    centre = np.array([_centre(p) for p in sections])
    step = np.diff(centre, axis=0)
    back = (step[1:] * step[:-1]).sum(axis=1) <= 0.0
    if back.any():
        k = int(back.argmax()) + 2
        raise InputError(
            f"section {k}: is not between sections {k - 1} and {k + 1}: sort the sections from hub to shroud"
        )
    if outer_diameter is not None:
        found = 2.0 * max(float(np.hypot(p[:, 0], p[:, 1]).max()) for p in sections)
        checked_diameter(found, outer_diameter, "sections")
    return sections


def checked_diameter(found: float, stated: float, what: str) -> None:
    """Refuse an outer diameter [mm] that differs from the stated one; the message names the units probably confused."""
    if abs(found / stated - 1.0) > _OUTER:
        factor = stated / found
        pairs = [
            f"{a} read as {b}" for a in MM_PER for b in MM_PER if abs(MM_PER[a] / MM_PER[b] / factor - 1.0) < _OUTER
        ]
        hint = f": smaller by {factor:.4g}, as {' or '.join(pairs)}" if pairs else ": check the unit"
        raise InputError(f"{what}: outer diameter {found:.6g} mm: must be {stated:g} as stated{hint}")


def loft(sections: tuple[Floats, ...], count: int = 61) -> Blade:
    """Both sides of a blade through its sections.

    Each section is interpolated over its chord length and split at its two most distant points; the leading edge is the
    one of greater z, and of a section across the axis the second in the file. A section that begins at an edge is split
    at its first point. Each half is sampled at ``count`` places, closer together at the edges, and the patch
    interpolates these points.

    Raises
    ------
    InputError
        A point of a section is repeated.
    """
    u = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, count))
    u[0], u[-1] = 0.0, 1.0
    halves = [_halves(p) for p in sections]
    both = [[_read(half[k], u) for k in range(2)] for half in halves]
    for before, pair in itertools.pairwise(both):
        # a section may begin at either edge: it runs, and its sides face, as those of the one before
        chord, own = (x[0] + x[1] - x[0][::-1] - x[1][::-1] for x in (before, pair))
        if float((chord * own).sum()) < 0.0:
            pair[:] = [side[::-1] for side in pair]
        if float(((before[0] - before[1]) * (pair[0] - pair[1])).sum()) < 0.0:
            pair.reverse()
    sides = [np.array([pair[k] for pair in both]) for k in range(2)]
    theta = [np.unwrap(np.arctan2(s[..., 1], s[..., 0]), axis=1) for s in sides]
    ahead = np.angle(np.exp(1j * (theta[0] - theta[1]))).mean() > 0.0
    plus, minus = sides if ahead else sides[::-1]
    middle = 0.5 * (plus + minus)
    step = np.linalg.norm(np.diff(middle, axis=0), axis=2).mean(axis=1)
    v = np.concatenate([[0.0], np.cumsum(step)]) / step.sum()
    v[-1] = 1.0
    return Blade(_side(plus, u, v, 1.0), _side(minus, u, v, -1.0))


def _side(grid: Floats, u: Floats, v: Floats, sign: float) -> BSplinePatch:
    return face_patch(patch_through(np.swapaxes(grid, 0, 1), u, v), sign)


def face_patch(patch: BSplinePatch, sign: float) -> BSplinePatch:
    """The patch with its normal towards increasing theta (sign 1) or decreasing theta (-1)."""
    at = patch.at(0.5, 0.5)[0]
    towards = sign * np.array([-at[1], at[0], 0.0])
    return patch if patch.normal(0.5, 0.5)[0] @ towards > 0.0 else replace(patch, side=-patch.side)


def _halves(p: Floats) -> tuple[_Half, _Half]:
    """The two halves from the leading to the trailing edge: curve, first and last parameter."""
    ring = p[:-1] if np.allclose(p[0], p[-1], rtol=0.0, atol=1e-9 * np.abs(p).max()) else p
    apart = ((ring[:, None] - ring[None]) ** 2).sum(axis=2)
    i, j = sorted(int(x) for x in np.unravel_index(apart.argmax(), apart.shape))
    length = np.sqrt(apart.max())
    # a profile that begins at an edge is split there, at the same place in every section
    begins = min(apart[0, i], apart[0, j]) < (_EDGE * length) ** 2
    if not begins:
        ring, i, j = np.roll(ring, -i, axis=0), 0, j - i
    elif apart[0, j] < apart[0, i]:
        j = i
    ring = np.concatenate([ring, ring[:1]])
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(ring, axis=0), axis=1))])
    if not (np.diff(s) > 0.0).all():
        row = int((np.diff(s) <= 0.0).argmax()) + 1
        raise InputError(f"sections: point {row} of a section is repeated: remove one")
    curve = scipy.interpolate.make_interp_spline(s, ring, k=3)
    last = len(s) - 2
    found = scipy.optimize.minimize_scalar(
        lambda x: -float(((curve(x) - ring[0]) ** 2).sum()), method="bounded",
        bounds=(s[max(j - 1, 1)], s[min(j + 1, last)]),
        options={"xatol": 1e-9 * s[-1]},
    )  # fmt: skip
    split, end = float(found.x), float(s[-1])
    # of a section across the axis the edge that comes first in the file is the trailing one
    if curve(split)[2] >= ring[0, 2] - _ACROSS * length:
        return (curve, split, 0.0), (curve, split, end)
    return (curve, 0.0, split), (curve, end, split)


def _read(half: _Half, u: Floats) -> Floats:
    """Points (n, 3) [mm] at the shares u (n,) of the length of a half."""
    curve, first, last = half
    out: Floats = curve(first + u * (last - first))
    return out


def _crosses_itself(p: Floats) -> bool:
    """Whether a profile crosses itself in each of three projections; a twisted profile may seem to in one of them."""
    ring = p[:-1] if np.array_equal(p[0], p[-1]) else p
    _, _, axes = np.linalg.svd(ring - ring.mean(axis=0), full_matrices=False)
    r, theta = np.hypot(ring[:, 0], ring[:, 1]), np.unwrap(np.arctan2(ring[:, 1], ring[:, 0]))
    views = [ring @ axes[:2].T, *(np.stack([r + k * ring[:, 2], r * theta], axis=-1) for k in (1.0, -1.0))]
    return not any(shapely.LinearRing(view).is_simple for view in views)


def _centre(p: Floats) -> Floats:
    """Centroid (3,) [mm] of the closed polyline of a section, independent of the spacing of its points."""
    ring = np.concatenate([p, p[:1]])
    length = np.linalg.norm(np.diff(ring, axis=0), axis=1)
    out: Floats = (length[:, None] * 0.5 * (ring[1:] + ring[:-1])).sum(axis=0) / length.sum()
    return out


def _scale(unit: str) -> float:
    if unit not in MM_PER:
        raise InputError(f"unit = {unit!r}: must be one of {', '.join(MM_PER)}")
    return MM_PER[unit]


def _sections_of(path: Path, scale: float, columns: str | None, order: tuple[int, int, int], body: int) -> list[Floats]:
    table = sections_of_table(_text(path), path)
    if table is not None:
        if columns is not None:
            raise InputError(f"{path}: columns {columns}: must not be stated: the table names its own")
        return [_finite(p * scale, path) for p in table]
    out: list[Floats] = []
    stated = "X Y Z" if path.suffix.lower() in (".curve", ".crv") else columns
    for names, rows in _blocks_of_blade(path, body):
        p = np.array(rows)
        if p.shape[1] != 3:
            raise InputError(f"{path}: {p.shape[1]} columns: must be 3")
        found = " ".join(names) or stated
        if found is None:
            raise InputError(f"{path}: no line names the columns: state them, for example X R*THETA R")
        if columns is not None and found != columns:
            raise InputError(f"{path}: columns {found}: must be {columns} as stated")
        if found == "X Y Z":
            p = _finite(p[:, order] * scale, path)
            out += levels_of_cloud(p) or (p,)
            continue
        if found == "X R*THETA R":
            if (p[:, 2] <= 0.0).any():
                raise InputError(f"{path}: row {int((p[:, 2] <= 0.0).argmax()) + 1}: R must be above 0")
            x, r, theta = p[:, 0], p[:, 2], p[:, 1] / p[:, 2]
        elif found == "X R THETA_DEG":
            x, r, theta = p[:, 0], p[:, 1], np.radians(p[:, 2])
        else:
            raise InputError(f"{path}: columns {found}: must be X R*THETA R, X R THETA_DEG or X Y Z")
        out.append(_finite(scale * np.stack([r * np.cos(theta), r * np.sin(theta), x], axis=-1), path))
    return out


def _finite(p: Floats, path: Path) -> Floats:
    greatest = float(np.abs(p).max())
    if not greatest <= FARTHEST:
        raise InputError(f"{path}: a coordinate is {greatest:.4g} mm: must be at most {FARTHEST:g}: check the unit")
    return p


def _text(path: Path) -> str:
    return read_regular(path, str(path), _LARGEST_FILE, "not a table of points").decode("utf-8-sig", "replace")


def _blocks_of_blade(path: Path, body: int) -> list[tuple[list[str], list[list[float]]]]:
    """Blocks of one blade of a file: of all of it, or those after the line ## number ``body`` + 1."""
    lines = _text(path).splitlines()
    begins = [k for k, line in enumerate(lines) if line.lstrip().startswith("##")]
    if not begins:
        return _blocks(path)
    if body >= len(begins):
        raise InputError(f"{path}: {len(begins)} blades (lines that begin with ##): must have at least {body + 1}")
    return _blocks(path, begins[body], begins[body + 1] if body + 1 < len(begins) else None)


def _blocks(path: Path, first: int = 0, last: int | None = None) -> list[tuple[list[str], list[list[float]]]]:
    """(names of the columns, rows) of each block of a file, or of a part of its lines."""
    blocks: list[tuple[list[str], list[list[float]]]] = [([], [])]
    for k, line in enumerate(_text(path).splitlines()[first:last], first + 1):
        words = line.replace(",", " ").split()
        if not words:
            continue
        if line.lstrip().startswith("#"):
            blocks.append((blocks[-1][0], []))
            continue
        try:
            row = [float(w) for w in words]
        except ValueError:
            if any(block[1] for block in blocks):
                raise InputError(f"{path} line {k}: not numbers: {line.strip()[:40]!r}") from None
            blocks[-1] = ([w.upper() for w in words], [])
            continue
        if not all(map(math.isfinite, row)):
            raise InputError(f"{path} line {k}: a number is not finite: {line.strip()[:40]!r}")
        if len(row) not in (2, 3, 4) or (blocks[-1][1] and len(row) != len(blocks[-1][1][0])):
            raise _wrong_length(path, k, len(row))
        if len(row) == 4 and row[0] != round(row[0]):
            raise _wrong_length(path, k, 4)
        blocks[-1][1].append(row)
    # of four numbers the first is that of the point
    blocks = [(b[0][-3:], [row[-3:] for row in b[1]]) for b in blocks if b[1]]
    if not blocks:
        raise InputError(f"{path}: no numbers: must be a table of points")
    return blocks


def _wrong_length(path: Path, line: int, count: int) -> InputError:
    remedy = "" if count < 4 else ": write each section to a file of its own, a line X Y Z for each point"
    return InputError(f"{path} line {line}: {count} numbers: must be 2 or 3, the same in every line{remedy}")
