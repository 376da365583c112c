"""Scene of a search: contact points that are milled, and check points that must not be touched.

Notation: S contact point [mm], N its unit normal into the channel, K curvature tensor of its surface (3, 3) [1/mm],
above 0 where the surface bends towards N; c check point.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.lazy import LateModule
from chipload.planning.impeller.tree import Tree, tree_of

if TYPE_CHECKING:
    from chipload.planning.impeller.covering.covering import Covering

_scene = LateModule("chipload.planning.impeller._scene")

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_UNIT = 1e-6  # a normal may differ from a unit vector by so much


@dataclass(frozen=True, eq=False)
class CheckPoints:
    """Check points in the order of their tree, to be shared by scenes: ``points`` and ``of`` are those of a scene.

    Parameters
    ----------
    points, of : check points (m, 3) [mm] and their surfaces (m,), read-only
    tree : over them
    ordered, own : both in the order of the tree
    """

    points: Floats
    of: Ints
    tree: Tree
    ordered: Floats
    own: Ints


@dataclass(frozen=True, eq=False)
class Scene:
    """Contact points and check points of one setup.

    Parameters
    ----------
    contact : S (c, 3) float [mm]
    normal : N (c, 3) float, unit
    curvature : K (c, 3, 3) float [1/mm]
    surface : (c,) int, which surface each contact point lies on
    check : (m, 3) float [mm]
    check_surface : (m,) int
    near : check points of the contact's own surface nearer than this [mm] are left out: there the curvature stands for
        them. A deviation of the surface from its second order, over that distance, is not seen.
    covering : of the walls between the check points; None: ranges hold at the check points alone
    shared : the same check points in another scene, which are not processed again; None: they are new

    Raises
    ------
    InputError
        An array has the wrong shape or a number that is not finite, a normal is not a unit vector.
    """

    contact: Floats
    normal: Floats
    curvature: Floats
    surface: Ints
    check: Floats
    check_surface: Ints
    near: float
    known: Tree | None = field(default=None, repr=False)
    covering: Covering | None = field(default=None, repr=False)
    shared: CheckPoints | None = field(default=None, repr=False)
    rows: Floats = field(init=False, repr=False)

    def __post_init__(self) -> None:
        c, m = len(self.contact), len(self.check)
        shapes = {"contact": (c, 3), "normal": (c, 3), "curvature": (c, 3, 3), "check": (m, 3)}
        lengths = {"surface": c, "check_surface": m}
        same = self.shared
        if same is not None and same.points is self.check and same.of is self.check_surface:
            del shapes["check"], lengths["check_surface"]
        else:
            same = None
        for name, shape in shapes.items():
            value = np.array(getattr(self, name), dtype=np.float64)
            if value.shape != shape:
                raise InputError(f"scene.{name}: shape {value.shape}: must be {shape}")
            if not np.isfinite(value).all():
                raise InputError(f"scene.{name}: a number is not finite")
            value.flags.writeable = False
            object.__setattr__(self, name, value)
        for name, length in lengths.items():
            number = np.array(getattr(self, name), dtype=np.int64)
            if number.shape != (length,):
                raise InputError(f"scene.{name}: shape {number.shape}: must be ({length},)")
            number.flags.writeable = False
            object.__setattr__(self, name, number)
        if c == 0:
            raise InputError("scene.contact: no contact point: must have at least one")
        wrong = np.abs((self.normal**2).sum(axis=1) - 1.0) > _UNIT
        if wrong.any():
            raise InputError(f"scene.normal of contact point {int(wrong.argmax())}: must be a unit vector")
        if not 0.0 <= self.near < np.inf:
            raise InputError(f"scene.near_mm = {self.near:g}: must be at least 0")
        if same is None:
            tree = tree_of(self.check) if self.known is None else self.known
            ordered = np.ascontiguousarray(self.check[tree.order])
            own = self.check_surface[tree.order]
            object.__setattr__(self, "shared", CheckPoints(self.check, self.check_surface, tree, ordered, own))
        object.__setattr__(self, "rows", self._rows())

    @property
    def walls(self) -> CheckPoints:
        """The check points with their tree."""
        if self.shared is None:
            raise InputError("scene: its check points are not known: create it again")
        return self.shared

    @property
    def tree(self) -> Tree:
        """Tree of the check points."""
        return self.walls.tree

    @property
    def ordered(self) -> Floats:
        """Check points in the order of the tree (m, 3) [mm]."""
        return self.walls.ordered

    @property
    def own(self) -> Ints:
        """Surface of each check point (m,), in the order of the tree."""
        return self.walls.own

    def at_contacts(self, contact: Floats, normal: Floats, curvature: Floats, surface: int) -> Scene:
        """Scene with the same check points and other contact points, all on one surface."""
        number = np.full(len(contact), surface, dtype=np.int64)
        return Scene(
            contact, normal, curvature, number, self.check, self.check_surface, self.near, self.tree, self.covering,
            self.shared,
        )  # fmt: skip

    def _rows(self) -> Floats:
        """(c, 16): S, N, tangents E1, E2, K in them, the surface."""
        out = np.empty((len(self.contact), 16))
        _scene.contact_rows(self.contact, self.normal, self.curvature, self.surface, out)
        return out

    @property
    def curvature_max(self) -> Floats:
        """Largest principal curvature (c,) [1/mm] of the surface at each contact point."""
        a, b, d = self.rows[:, 12], self.rows[:, 13], self.rows[:, 14]
        out: Floats = 0.5 * (a + d) + np.hypot(0.5 * (a - d), b)
        return out
