"""An impeller: hub, blades and splitters, and the points of one channel.

Notation: z axis of rotation, inlet above; theta angle about it, pitch = 2 pi / blades. Sides of a blade as in
``geometry/sections.py``: `plus` faces a growing theta. The channel of `plus` of a blade is bounded by `minus` of the
next body round, a splitter where there is one. u along the blade from the leading edge, v from hub to shroud, both
0..1. Where there are fillets between sides and hub, a side begins above its fillet, and the floor ends at it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.errors import InputError
from chipload.geometry.bspline import BSplinePatch
from chipload.geometry.revolve import Revolved
from chipload.geometry.sections import Blade
from chipload.planning.impeller.scene import Scene

Floats = NDArray[np.float64]

#: number of a fillet in a scene, over that of its side
FILLET = 1000
#: check points of fillets lie so deep in the metal [mm]: a corner of the fillet's own radius fits, though not its bits
SUNK = 1e-3
#: check points round the arc of a fillet
ARC = 9


@dataclass(frozen=True, eq=False)
class Impeller:
    """An impeller: hub, shroud, blades and splitters, with their fillets.

    Parameters
    ----------
    blade, splitter : one of each, splitter None: there are none
    hub, shroud : of revolution, normals into the channel
    blades : how many of each, evenly round
    fillets : of each body of :attr:`bodies`, the fillets of its sides; none: sides meet the hub
    """

    blade: Blade
    splitter: Blade | None
    hub: Revolved
    shroud: Revolved
    blades: int
    fillets: tuple[Blade, ...] = ()

    def __post_init__(self) -> None:
        if self.blades < 2:
            raise InputError(f"impeller.blades = {self.blades}: must be at least 2")

    @property
    def pitch(self) -> float:
        """Angle between two blades [rad]."""
        return 2.0 * math.pi / self.blades

    @property
    def bodies(self) -> tuple[Blade, ...]:
        """Blade and splitter, the splitter turned into the channel on the `plus` side of the blade."""
        if self.splitter is None:
            return (self.blade,)
        ahead = (_angle(self.splitter) - _angle(self.blade)) % self.pitch
        turn = _angle(self.blade) + ahead - _angle(self.splitter)
        return self.blade, self.splitter.turned(turn)

    def body(self, index: int) -> Blade:
        """A body by its number round the impeller, 0 the blade, in both directions without end."""
        bodies = self.bodies
        return bodies[index % len(bodies)].turned(self.pitch * (index // len(bodies)))

    def fillet(self, index: int) -> Blade:
        """Fillets of the sides of a body, v from the hub; only where there are any."""
        return self.fillets[index % len(self.fillets)].turned(self.pitch * (index // len(self.fillets)))

    def foot(self, index: int, sign: int) -> BSplinePatch:
        """The edge of a side of a body, ``sign`` 1 plus, -1 minus, on the hub at v = 0."""
        return _side(self.fillet(index) if self.fillets else self.body(index), sign)

    def scene(
        self,
        body: int,
        side: str,
        contact: tuple[ArrayLike, ArrayLike],
        check: tuple[int, int],
        near: float,
        around: int = 1,
        hub_points: tuple[int, int] = (40, 25),
        hub_range: tuple[float, float] = (0.0, 1.0),
    ) -> Scene:
        """Contact points of one side, with check points of its channel and of the bodies round it.

        Parameters
        ----------
        body : 0 blade, 1 splitter
        side : `plus` or `minus`, or that with ` fillet` for the fillet below it
        contact : u (a,), v (b,) of the contact points, which are a x b, v the faster
        check : how many along u and v on each side of a body
        near : as :class:`Scene`
        around : how many bodies beyond the channel's two on either side; 0: the channel alone, as in the source
        hub_points, hub_range : how many along the hub and round each channel; from where to where along the hub

        Returns
        -------
        Scene with the surfaces 0: the side milled, 1: the side that faces it, 2: the hub, 3 on: other sides; the fillet
        of a side has :data:`FILLET` more. Check points of fillets lie :data:`SUNK` in the metal.
        """
        side, on_fillet = side.removesuffix(" fillet"), side.endswith(" fillet")
        if side not in ("plus", "minus") or not 0 <= body < len(self.bodies) or (on_fillet and not self.fillets):
            raise InputError(f"body {body}, side {side!r}: must be 0..{len(self.bodies) - 1}, plus or minus")
        u, v = (np.asarray(x, dtype=np.float64) for x in contact)
        if (np.concatenate([u, v]) < 0.0).any() or (np.concatenate([u, v]) > 1.0).any():
            raise InputError("contact: u and v must be from 0 to 1")
        U, V = (x.ravel() for x in np.meshgrid(u, v, indexing="ij"))
        a, b = (x.ravel() for x in np.meshgrid(np.linspace(0, 1, check[0]), np.linspace(0, 1, check[1]), indexing="ij"))
        step = 1 if side == "plus" else -1
        own = _side(self.body(body), step)
        first, last = -around, 1 + around
        floors = []
        for k in range(first, last):
            s = np.linspace(*hub_range, hub_points[0])
            theta = self.across(body + step * k, s, np.linspace(0.0, 1.0, hub_points[1]), step)
            floors.append(self.hub.at(np.repeat(s, hub_points[1]), theta.ravel()))
        sides = [(body, step), (body + step, -step)]
        if around:
            sides += [(body, -step), (body + step, step)]
            others = [*range(first, 0), *range(2, last + 1)]
            sides += [(body + step * k, w) for k in others for w in (1, -1)]
        parts = [_side(self.body(k), w).at(a, b) for k, w in sides]
        parts.insert(2, np.concatenate(floors))
        names = [*range(len(parts))]
        if self.fillets:
            parts += [self.fillet_points(k, w, check[0]) for k, w in sides]
            names += [FILLET + n for n in range(len(parts)) if n != 2][: len(sides)]
        milled = self.foot(body, step) if on_fillet else own
        return Scene(
            milled.at(U, V), milled.normal(U, V), milled.curvature(U, V), np.full(len(U), FILLET if on_fillet else 0),
            np.concatenate(parts), np.repeat(names, [len(p) for p in parts]), near,
        )  # fmt: skip

    def fillet_points(self, index: int, sign: int, along: int) -> Floats:
        """Check points of a fillet, ``along`` places along it and :data:`ARC` from the hub up, none on its edges."""
        patch = _side(self.fillet(index), sign)
        u, v = np.linspace(0.0, 1.0, along), (np.arange(ARC) + 0.5) / ARC
        U, V = (x.ravel() for x in np.meshgrid(u, v, indexing="ij"))
        out: Floats = patch.at(U, V) - SUNK * patch.normal(U, V)
        return out

    def across(self, index: int, s: ArrayLike, v: ArrayLike, step: int = 1) -> Floats:
        """Theta (a, b) [rad] on the hub at the shares v (b,) of a channel's width.

        Parameters
        ----------
        index : the body from which v counts, as :meth:`body`
        s : (a,) places along the hub
        step : 1: the channel on its `plus` side, -1: that on its `minus` side
        """
        low, high = self._foot(index, step, s), self._foot(index + step, -step, s)
        gap = step * np.mod(step * (high - low), 2.0 * math.pi)
        out: Floats = low[:, None] + gap[:, None] * np.asarray(v, dtype=np.float64)
        return out

    def _foot(self, index: int, side: int, s: ArrayLike) -> Floats:
        """Theta (a,) of a side's foot; a blade continues straight beyond its edges, a splitter next to its blade."""
        at = np.asarray(s, dtype=np.float64)
        first = index - index % len(self.bodies)
        places, theta = _theta_of(self.foot(index, side), self.hub)
        out: Floats = np.interp(at, places, theta)
        if index != first:
            guide = _theta_of(self.foot(first, side), self.hub)
            out += np.interp(at, *guide) - np.interp(np.clip(at, places[0], places[-1]), *guide)
        return out


def _side(blade: Blade, sign: int) -> BSplinePatch:
    return blade.plus if sign > 0 else blade.minus


def _angle(blade: Blade) -> float:
    """Mean theta [rad] of a blade at its trailing edge, half way up."""
    p = blade.plus.at(1.0, 0.5)[0]
    return math.atan2(p[1], p[0])


def _theta_of(patch: BSplinePatch, hub: Revolved) -> tuple[Floats, Floats]:
    """Places (k,) along the hub, ascending, and theta (k,) of a side's foot there."""
    foot = patch.at(np.linspace(0.0, 1.0, 201), 0.0)
    at = hub.nearest(np.hypot(foot[:, 0], foot[:, 1]), foot[:, 2])
    order = np.argsort(at, kind="stable")
    return at[order], np.unwrap(np.arctan2(foot[:, 1], foot[:, 0]))[order]
