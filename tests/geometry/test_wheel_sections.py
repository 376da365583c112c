"""Blades cut out of closed meshes of whole wheels, against the formula that the meshes were made from."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from shapely import Point, union_all

from chipload.geometry.sections import check_sections, loft
from chipload.geometry.wheel_sections import wheel_blades
from wheel_mesh import Wheel, axial, radial, wheel_mesh, with_splitter

Floats = NDArray[np.float64]


def greatest_off(wheel: Wheel, body: tuple[Floats, ...]) -> float:
    """Greatest distance round the axis [mm] of the sides of a lofted blade from the formula, without its edges."""
    blade = loft(check_sections(body))
    u, v = (x.ravel() for x in np.meshgrid(np.linspace(0.04, 0.96, 24), np.linspace(0.0, 1.0, 9), indexing="ij"))
    return max(float(wheel.off(side.at(u, v), sign).max()) for sign, side in ((1, blade.plus), (-1, blade.minus)))


@pytest.mark.parametrize(
    ("wheels", "within"), [((radial(5),), 0.03), ((axial(5),), 0.08), (with_splitter(radial(4)), 0.03)]
)
def test_blades_of_a_mesh_are_those_of_the_formula(wheels: tuple[Wheel, ...], within: float) -> None:
    """Number, splitter, hub, shroud and sides, from the outlet to the inlet."""
    found = wheel_blades(wheel_mesh(wheels, along=49, up=9, round_axis=120))
    assert found is not None
    assert (found.count, len(found.bodies)) == (wheels[0].blades, len(wheels))
    for wheel, body in zip(wheels, found.bodies, strict=True):
        assert greatest_off(wheel, body) < within
    assert found.off < within
    assert found.others == pytest.approx(found.off, rel=0.01)
    s = np.linspace(0.0, 1.0, 4001)
    hub, shroud = found.meridian.hub, found.meridian.shroud
    for curve, stated, least in ((hub, wheels[0].hub, 0.01), (shroud, wheels[0].shroud, 0.1)):
        assert cKDTree(stated(s)).query(curve.points)[0].max() < least
        assert np.abs(curve.points[[-1, 0]] - stated(np.array([0.0, 1.0]))).max() < 0.1


def test_what_is_stated_holds_in_fillets() -> None:
    """A foot that spreads by 2 mm on both sides, above 2 % of the height, against the formula in points."""
    wheel = replace(radial(3), foot=2.0)
    found = wheel_blades(wheel_mesh((wheel,), along=41, up=33, round_axis=90))
    assert found is not None
    assert 0.02 < found.off < 0.12
    blade = loft(check_sections(found.bodies[0]))
    u, v = (x.ravel() for x in np.meshgrid(np.linspace(0.1, 0.9, 12), np.linspace(0.02, 1.0, 21), indexing="ij"))
    s, h = (x.ravel() for x in np.meshgrid(np.linspace(0.0, 1.0, 501), np.linspace(0.0, 1.0, 301), indexing="ij"))
    for sign, side in ((1, blade.plus), (-1, blade.minus)):
        assert cKDTree(wheel.side(s, h, sign)).query(side.at(u, v))[0].max() < found.off + 0.05


def test_a_blade_that_differs_is_reported() -> None:
    """One blade of five is turned by 0.2 mm at the outlet: it is that far from the others."""
    wheel = radial(5)
    parts = list(wheel_mesh((wheel,), along=41, up=9, round_axis=90).split(only_watertight=False))
    parts[-1].apply_transform(trimesh.transformations.rotation_matrix(0.2 / 40.0, [0, 0, 1]))
    found = wheel_blades(trimesh.util.concatenate(parts))
    assert found is not None
    assert 0.1 < found.others < 0.22


def plate() -> trimesh.Trimesh:
    """A square plate: its corners stand evenly round its largest circle, but are no blades."""
    return trimesh.creation.box((60.0, 60.0, 8.0))


def gear() -> trimesh.Trimesh:
    """A spur gear: its teeth are not turned about the axis."""
    parts = [trimesh.creation.cylinder(20.0, 12.0, sections=90)]
    for k in range(12):
        tooth = trimesh.creation.box((8.0, 3.0, 12.0)).subdivide().subdivide()
        tooth.apply_translation([22.0, 0.0, 0.0])
        tooth.apply_transform(trimesh.transformations.rotation_matrix(2.0 * np.pi * k / 12, [0, 0, 1]))
        parts.append(tooth)
    return trimesh.util.concatenate(parts)


def flange() -> trimesh.Trimesh:
    """A disc with six holes: what stands between them is no blade."""
    holes = [Point(20.0 * np.cos(k * np.pi / 3), 20.0 * np.sin(k * np.pi / 3)).buffer(4.0) for k in range(6)]
    disc = Point(0.0, 0.0).buffer(30.0, 64).difference(union_all(holes))
    return trimesh.creation.extrude_polygon(disc, 6.0)


@pytest.mark.parametrize("body", [plate(), gear(), trimesh.creation.icosphere(2, 30.0), flange()], ids="pgbf")
def test_other_bodies_are_no_wheels(body: trimesh.Trimesh) -> None:
    assert wheel_blades(body) is None
