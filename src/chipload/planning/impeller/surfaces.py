"""Surfaces of an impeller that are milled, each as a grid of contact points with its check points.

Notation: a surface is named by a body and a side: `blade` or `splitter`, `plus` or `minus` as in ``sections.py`` of the
geometry, `plus fillet` or `minus fillet` between it and the hub, or `floor`, the hub between the plus side of the body
and the next body round. u along the surface from the leading edge, v up from the hub or, on a floor, across from the
body's plus side, both 0..1.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.planning.impeller.covering.covering import Covering
from chipload.planning.impeller.impeller import Impeller
from chipload.planning.impeller.scene import Floats, Scene

BODIES, SIDES = ("blade", "splitter"), ("plus", "minus", "floor", "plus fillet", "minus fillet")
_FINE = 201  # points of a curve whose length is measured


@dataclass(frozen=True)
class ContactSampling:
    """Spacing of contact points and check points.

    Parameters
    ----------
    along, up : from where to where along and up the surface, 0..1
    points : how many contact points along and up
    spacing : greatest distance of check points along their surfaces [mm]
    near : as :class:`Scene` [mm]
    around : as :meth:`Impeller.scene`
    ahead : length of the hub ahead of the blade's leading edge [mm]
    """

    along: tuple[float, float]
    up: tuple[float, float]
    points: tuple[int, int]
    spacing: float
    near: float
    around: int = 1
    ahead: float = 0.0

    def __post_init__(self) -> None:
        for key, (low, high) in (("along", self.along), ("up", self.up)):
            if not 0.0 <= low < high <= 1.0:
                raise InputError(f"{key} = [{low:g}, {high:g}]: must ascend within 0 to 1")
        if min(self.points) < 2:
            raise InputError(f"points = {list(self.points)}: must be at least 2 each")
        if not 0.0 < self.spacing < math.inf:
            raise InputError(f"check_mm = {self.spacing:g}: must be above 0")


@dataclass(frozen=True, eq=False)
class ContactSurface:
    """A surface with its contact points.

    Parameters
    ----------
    body, side : its name
    scene : contact points (a b), v the faster, and check points
    u, v : (a,), (b,) of the contact points
    area : what each contact point stands for (c,) [mm^2]
    along, up : (c,) [mm] lengths on the surface, for a map: along each row v, up each column u
    """

    body: str
    side: str
    scene: Scene
    u: Floats
    v: Floats
    area: Floats
    along: Floats
    up: Floats

    @property
    def name(self) -> str:
        """`blade plus`."""
        return f"{self.body} {self.side}"

    @property
    def shape(self) -> tuple[int, int]:
        """Number of contact points (a, b) along u and v."""
        return len(self.u), len(self.v)


def surface_of(
    impeller: Impeller, body: str, side: str, how: ContactSampling, covering: Covering | None = None
) -> ContactSurface:
    """A surface of an impeller. With a ``covering`` of the walls its ranges also hold between the check points.

    Raises
    ------
    InputError
        There is no such surface, or its contact points do not lie in it.
    """
    if body not in BODIES or side not in SIDES:
        raise InputError(f"surface {body} {side}: must be {' or '.join(BODIES)} and {', '.join(SIDES)}")
    index = BODIES.index(body)
    if index >= len(impeller.bodies):
        raise InputError(f"surface {body} {side}: the impeller has no splitter: leave it out")
    if side.endswith(" fillet") and not impeller.fillets:
        raise InputError(f"surface {body} {side}: the impeller has no fillets: state fillet_mm, or leave it out")
    u, v = np.linspace(*how.along, how.points[0]), np.linspace(*how.up, how.points[1])
    check, hub = counts(impeller, how)
    where = hub_range(impeller, how.ahead)
    walls = "plus" if side == "floor" else side
    scene = impeller.scene(index, walls, (u, v), check, how.near, how.around, hub, where)
    if side == "floor":
        scene = _floor(impeller, index, u, v, scene, where)
    scene = replace(scene, covering=covering, known=scene.tree)
    grid = scene.contact.reshape(len(u), len(v), 3)
    along = np.linalg.norm(np.diff(grid, axis=0, prepend=grid[:1]), axis=2).cumsum(axis=0)
    up = np.linalg.norm(np.diff(grid, axis=1, prepend=grid[:, :1]), axis=2).cumsum(axis=1)
    return ContactSurface(body, side, scene, u, v, _areas(grid), along.ravel(), up.ravel())


def hub_range(impeller: Impeller, ahead: float) -> tuple[float, float]:
    """Range of the hub that counts: from ``ahead`` [mm] of the blade's leading edge to its trailing edge."""
    s = np.linspace(0.0, 1.0, 20 * _FINE)
    length = np.concatenate([[0.0], np.linalg.norm(np.diff(impeller.hub.curve(s), axis=0), axis=1).cumsum()])
    foot = np.concatenate([impeller.foot(0, w).at([0.0, 1.0], 0.0) for w in (1, -1)])
    at = impeller.hub.nearest(np.hypot(foot[:, 0], foot[:, 1]), foot[:, 2], len(s))
    first = np.interp(at.min(), s, length) - ahead
    return float(np.interp(max(first, 0.0), length, s)), float(at.max())


def counts(impeller: Impeller, how: ContactSampling) -> tuple[tuple[int, int], tuple[int, int]]:
    """Number of check points along and up a side, and along and across a channel's floor."""
    t = np.linspace(0.0, 1.0, _FINE)
    sides = [p for body in impeller.bodies for p in (body.plus, body.minus)]
    along = max(_length(p.at(t, v)) for p in sides for v in (0.0, 0.5, 1.0))
    up = max(_length(p.at(u, t)) for p in sides for u in (0.0, 0.5, 1.0))
    low, high = hub_range(impeller, how.ahead)
    curve = impeller.hub.curve(np.linspace(low, high, _FINE))
    across = 2.0 * math.pi * float(curve[:, 0].max()) / (impeller.blades * len(impeller.bodies))

    def count(length: float) -> int:
        return max(math.ceil(length / how.spacing), 1) + 1

    return (count(along), count(up)), (count(_length(curve)), count(across))


def _floor(impeller: Impeller, index: int, u: Floats, v: Floats, walls: Scene, where: tuple[float, float]) -> Scene:
    """The scene of a floor: contact on the hub, check points of the channel's walls as before."""
    s = where[0] + u * (where[1] - where[0])
    theta = impeller.across(index, s, v)
    S, W = np.repeat(s, len(v)), theta.ravel()
    hub = impeller.hub
    # of the walls' scene the hub is surface 2, the wall itself 0: they change names
    names = walls.check_surface.copy()
    names[walls.check_surface == 2], names[walls.check_surface == 0] = 0, 2
    return Scene(
        hub.at(S, W), hub.normal(S, W), hub.curvature(S, W), np.zeros(len(S), dtype=np.int64),
        walls.check, names, walls.near,
    )  # fmt: skip


def _areas(grid: Floats) -> Floats:
    """(a b,) [mm^2]: a quarter of each of the four cells round a point, cells as two triangles."""
    p, q, r, s = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    cell = 0.5 * sum(np.linalg.norm(np.cross(b - a, c - a), axis=2) for a, b, c in ((p, q, r), (p, r, s)))
    out = np.zeros(grid.shape[:2])
    for rows in (slice(None, -1), slice(1, None)):
        for columns in (slice(None, -1), slice(1, None)):
            out[rows, columns] += 0.25 * cell
    return out.ravel()


def _length(points: NDArray[np.float64]) -> float:
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
