"""An impeller by formula, with the dimensions of the source where they are known.

Notation: phi in 0..pi/2 from inlet to outlet. Hub r = Ro - (Ro - Ri) cos phi, z = H (1 - sin phi): a quarter of an
ellipse from radius Ri at the height H down to the outer radius Ro. Shroud likewise from Ri + b, b the height of the
blades at the inlet, to the outlet height. Blades are straight from hub to shroud at the same phi, at
theta = -wrap (phi / (pi/2))^2 + lean v; t is their thickness round the axis, so that the channel is 2 pi r / n - t wide
round the axis, narrowest at Ri.

Reference: [Wu2019]. Differs from source: its blade surface is lost; of its dimensions the `inner diameter` 45.88 is
taken for the radius Ri and the `outer` 111.5 for Ro, for only then do eleven blades of 2 mm leave its channel of
24.185.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from chipload.errors import InputError
from chipload.geometry.bspline import patch_through
from chipload.geometry.revolve import Revolved
from chipload.geometry.sections import Blade
from chipload.planning.impeller.impeller import Impeller


@dataclass(frozen=True)
class ImpellerShape:
    """Dimensions of an impeller by formula [mm, rad]; defaults are those of the source, from ``wrap`` on our own."""

    blades: int = 11
    channel: float = 24.185
    hub_radius: float = 45.88
    outer_radius: float = 111.5
    height: float = 50.0
    blade_height: float = 39.35
    wrap: float = math.radians(20.0)
    lean: float = 0.0
    outlet_height: float = 24.0

    def __post_init__(self) -> None:
        rising = 0.0 < self.hub_radius < self.hub_radius + self.blade_height < self.outer_radius
        if not rising or self.height <= self.outlet_height or self.thickness <= 0.0:
            raise InputError(
                "shape: must be hub_radius + blade_height < outer_radius, outlet_height < height, blades thick"
            )

    @property
    def thickness(self) -> float:
        """Thickness t of the blades round the axis [mm]: what the channel leaves of the pitch.

        >>> round(ImpellerShape().thickness, 3)
        2.022
        """
        return 2.0 * math.pi * self.hub_radius / self.blades - self.channel


def impeller_of(shape: ImpellerShape, along: int = 41, up: int = 9) -> Impeller:
    """The impeller of a shape; its blades pass through ``along`` x ``up`` points of the formula."""
    share = np.linspace(0.0, 1.0, along)
    phi = 0.5 * math.pi * share
    Ro = shape.outer_radius
    hub = np.stack([Ro - (Ro - shape.hub_radius) * np.cos(phi), shape.height * (1.0 - np.sin(phi))], axis=-1)
    eye = shape.hub_radius + shape.blade_height
    drop = shape.height - shape.outlet_height
    shroud = np.stack([Ro - (Ro - eye) * np.cos(phi), shape.height - drop * np.sin(phi)], axis=-1)
    v = np.linspace(0.0, 1.0, up)
    m = hub[:, None] + v[None, :, None] * (shroud - hub)[:, None]
    theta = -shape.wrap * share[:, None] ** 2 + shape.lean * v
    sides = []
    for sign in (1.0, -1.0):
        a = theta + sign * 0.5 * shape.thickness / m[..., 0]
        grid = np.stack([m[..., 0] * np.cos(a), m[..., 0] * np.sin(a), m[..., 1]], axis=-1)
        patch = patch_through(grid, share, v)
        at = patch.at(0.5, 0.5)[0]
        outward = patch.normal(0.5, 0.5)[0] @ np.array([-at[1], at[0], 0.0]) * sign > 0.0
        sides.append(patch if outward else patch_through(grid, share, v, side=-1))
    return Impeller(Blade(*sides), None, Revolved(hub, 1), Revolved(shroud, -1), shape.blades)
