"""Fixtures of common workholding by their numbers: the jaws of a vise, strap clamps and blocks, without a drawing.

Notation: the stock is a box from ``low`` to ``high`` [mm] in workpiece coordinates; a vise closes along one axis and
its jaws are wide along the other. The tops of the jaws are ``grip`` above the bottom of the stock.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from chipload.checking.workpiece import Fixture
from chipload.errors import InputError

if TYPE_CHECKING:
    import trimesh

Corner = tuple[float, float, float]
#: height of the bed of a vise between and below its jaws, which is shown and checked [mm]
BED_MM = 20.0
#: an opening that differs from the stock by more does not hold it [mm]
SLACK_MM = 0.1
#: sides of the prism of a bolt
SIDES = 24


@dataclass(frozen=True)
class Vise:
    """A vise that holds the stock between two jaws.

    Parameters
    ----------
    jaw : width, height and thickness of a jaw [mm]
    grip : height of the stock between the jaws [mm]
    closes : axis along which it closes
    fixed : side of the stock on which the fixed jaw stands, as ``y+``
    opening : distance between the jaws [mm]; None: the stock
    step : height and depth of the step of both jaws that the stock rests on [mm]; None: none
    parallels : thickness of the two parallels that the stock rests on [mm]; None: none
    at : middle of the jaws along their width [mm]; None: that of the stock
    """

    jaw: tuple[float, float, float]
    grip: float
    closes: Literal["x", "y"] = "y"
    fixed: Literal["x-", "x+", "y-", "y+"] | None = None
    opening: float | None = None
    step: tuple[float, float] | None = None
    parallels: float | None = None
    at: float | None = None

    def boxes(self, low: Corner, high: Corner, key: str = "fixture") -> dict[str, tuple[Corner, Corner]]:
        """Return the corners of its bodies by name around a stock.

        Raises
        ------
        InputError
            The numbers contradict one another or the stock; ``key`` names the table.

        >>> vise = Vise((100.0, 40.0, 20.0), 8.0)
        >>> boxes = vise.boxes((0.0, 0.0, -20.0), (80.0, 50.0, 0.0))
        >>> boxes["fixed jaw"], boxes["moving jaw"]
        (((-10.0, 50.0, -52.0), (90.0, 70.0, -12.0)), ((-10.0, -20.0, -52.0), (90.0, 0.0, -12.0)))
        """
        a, b = (0, 1) if self.closes == "x" else (1, 0)
        size = high[a] - low[a]
        self._check(low, high, size, key)
        opening = size if self.opening is None else self.opening
        width, height, thick = self.jaw
        upper = (self.fixed or f"{self.closes}+").endswith("+")
        inner = (high[a] - opening, high[a]) if upper else (low[a], low[a] + opening)
        middle = 0.5 * (low[b] + high[b]) if self.at is None else self.at
        top = low[2] + self.grip
        bottom = top - height

        def box(from_a: float, to_a: float, from_z: float, to_z: float) -> tuple[Corner, Corner]:
            corners = []
            for along, across, z in ((from_a, middle - 0.5 * width, from_z), (to_a, middle + 0.5 * width, to_z)):
                corners.append((along, across, z) if a == 0 else (across, along, z))
            return corners[0], corners[1]

        lower_jaw, upper_jaw = (
            box(inner[0] - thick, inner[0], bottom, top),
            box(inner[1], inner[1] + thick, bottom, top),
        )
        out = {
            "fixed jaw": upper_jaw if upper else lower_jaw,
            "moving jaw": lower_jaw if upper else upper_jaw,
            "bed": box(inner[0] - thick, inner[1] + thick, bottom - BED_MM, bottom),
        }
        if self.step is not None:
            tall, deep = self.step
            out["lower step"] = box(inner[0], inner[0] + deep, low[2] - tall, low[2])
            out["upper step"] = box(inner[1] - deep, inner[1], low[2] - tall, low[2])
        if self.parallels is not None:
            out["lower parallel"] = box(inner[0], inner[0] + self.parallels, bottom, low[2])
            out["upper parallel"] = box(inner[1] - self.parallels, inner[1], bottom, low[2])
        return out

    def _check(self, low: Corner, high: Corner, size: float, key: str) -> None:
        """Refuse numbers that contradict one another or the stock."""
        height, tall = self.jaw[1], high[2] - low[2]
        if min(self.jaw) <= 0.0 or not 0.0 < self.grip < height:
            raise InputError(
                f"{key}.grip_mm = {self.grip:g}: must be above 0 and below the height of the jaw, {height:g}"
            )
        if self.grip > tall:
            raise InputError(f"{key}.grip_mm = {self.grip:g}: must be at most the height of the stock, {tall:g}")
        if self.fixed is not None and self.fixed[0] != self.closes:
            raise InputError(f'{key}.fixed = "{self.fixed}": must be a side along {self.closes}, which the vise closes')
        if self.opening is not None and abs(self.opening - size) > SLACK_MM:
            raise InputError(
                f"{key}.opening_mm = {self.opening:g}: the stock has {size:g} mm between the jaws: must agree within "
                f"{SLACK_MM:g} mm, or the jaws do not hold it"
            )
        if self.step is not None and self.parallels is not None:
            raise InputError(f"{key}: step_mm and parallels_mm: the stock rests on one of them: leave one out")
        if self.step is not None and not (0.0 < self.step[0] <= height - self.grip and 0.0 < self.step[1] < 0.5 * size):
            raise InputError(
                f"{key}.step_mm = {list(self.step)}: height must be at most that of the jaw below the stock, "
                f"{height - self.grip:g}, depth below half of the opening, {0.5 * size:g}"
            )
        if self.parallels is not None and not 0.0 < self.parallels < 0.5 * size:
            raise InputError(
                f"{key}.parallels_mm = {self.parallels:g}: must be above 0 and below half of the opening, "
                f"{0.5 * size:g}"
            )


@dataclass(frozen=True)
class StrapClamp:
    """A strap on the stock, with its bolt.

    Parameters
    ----------
    point : middle of the end of the strap that presses, on the face of the stock [mm]
    strap : length, width and thickness [mm]
    angle : direction of the strap from that end, from X to Y [rad]
    bolt : diameter, and height above the strap [mm]; None: no bolt stands out
    """

    point: Corner
    strap: tuple[float, float, float]
    angle: float = 0.0
    bolt: tuple[float, float] | None = None

    def meshes(self, key: str = "fixture") -> dict[str, trimesh.Trimesh]:
        """Return its bodies by name.

        >>> clamp = StrapClamp((0.0, 0.0, 5.0), (60.0, 20.0, 12.0), 0.5 * np.pi, (10.0, 15.0))
        >>> [[round(float(x), 6) + 0.0 for x in corner] for corner in clamp.meshes()["strap"].bounds]
        [[-10.0, 0.0, 5.0], [10.0, 60.0, 17.0]]
        """
        import trimesh

        length, width, thick = self.strap
        if min(self.strap) <= 0.0:
            raise InputError(f"{key}.strap_mm = {list(self.strap)}: length, width and thickness must be above 0")
        turn = trimesh.transformations.rotation_matrix(self.angle, [0.0, 0.0, 1.0])
        turn[:3, 3] = self.point
        strap = trimesh.creation.box(bounds=[[0.0, -0.5 * width, 0.0], [length, 0.5 * width, thick]])
        out = {"strap": strap.apply_transform(turn)}
        if self.bolt is not None:
            d, above = self.bolt
            if not (0.0 < d <= length and above > 0.0):
                raise InputError(
                    f"{key}.bolt_mm = {list(self.bolt)}: diameter and height above the strap must be above 0"
                )
            bolt = trimesh.creation.cylinder(0.5 * d, above, sections=SIDES)
            bolt.apply_translation([0.5 * length, 0.0, thick + 0.5 * above])
            out["bolt"] = bolt.apply_transform(turn)
        return out


def block(low: Sequence[float], high: Sequence[float], key: str = "fixture") -> trimesh.Trimesh:
    """Return a box as a mesh.

    Raises
    ------
    InputError
        It has no volume.
    """
    import trimesh

    if not all(a < b for a, b in zip(low, high, strict=True)):
        raise InputError(f"{key}: low_mm = {list(low)}: must be below high_mm = {list(high)} along each axis")
    return trimesh.creation.box(bounds=np.array([low, high], dtype=np.float64))


def fixtures(bodies: Mapping[str, trimesh.Trimesh], spacing_mm: float, name: str) -> tuple[Fixture, ...]:
    """Return the bodies of a piece of workholding as fixtures, each by the name of the piece and its own."""
    return tuple(Fixture(mesh, spacing_mm, None, f"{name} ({body})" if body else name) for body, mesh in bodies.items())
