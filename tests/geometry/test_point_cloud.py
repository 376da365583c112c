"""Sections out of clouds of points: which points are neighbours is known before they are shuffled."""

import os
from pathlib import Path

import numpy as np
import pytest

from chipload.errors import InputError
from chipload.geometry.point_cloud import MOST, levels_of_cloud
from chipload.geometry.sections import check_sections, loft, read_sections

DATA = Path(os.environ.get("CHIPLOAD_DATA", Path(__file__).parents[2].parent / "shared" / "data"))
CLOUDS = DATA / "blades" / "parablade"
SHUFFLE = np.random.default_rng(3)


def profile(count: int = 150) -> np.ndarray:
    """A cambered profile (count, 2) of 60 mm, 3 mm thick, with round edges, in order round it."""
    t = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    # nearer together at the edges
    s = t - 0.45 * np.sin(2.0 * t)
    x, half = 30.0 * np.cos(s), 0.4 + 1.1 * np.sin(s) ** 2
    return np.stack([x, 12.0 * (1.0 - (x / 30.0) ** 2) + half * np.sin(s)], axis=-1)


def pairs(p: np.ndarray) -> set[frozenset[tuple[float, ...]]]:
    """The pairs of neighbours round a closed section."""
    rows = [tuple(np.round(row, 9)) for row in p]
    return {frozenset(pair) for pair in zip(rows, [*rows[1:], rows[0]], strict=True)}


def shuffled(sections: list[np.ndarray]) -> np.ndarray:
    return SHUFFLE.permutation(np.concatenate(sections))


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_levels_of_one_coordinate(axis):
    heights = [-5.0, 0.0, 12.0, 30.0]
    sections = [np.insert(profile() * (1.0 + 0.002 * h), axis, h, axis=1) for h in heights]
    found = levels_of_cloud(shuffled(sections))
    assert [float(p[0, axis]) for p in found] == heights
    for p, right in zip(found, sections, strict=True):
        assert pairs(p) == pairs(right)


def test_levels_of_one_radius():
    sections = []
    for r in (80.0, 90.0, 105.0):
        across, along = profile().T
        sections.append(np.stack([r * np.cos(across / r), r * np.sin(across / r), along], axis=-1))
    found = levels_of_cloud(shuffled(sections))
    for p, right in zip(found, sections, strict=True):
        assert pairs(p) == pairs(right)


def test_measured_levels_scatter():
    sections = [np.insert(profile(), 2, h, axis=1) for h in (0.0, 10.0)]
    points = shuffled(sections) + SHUFFLE.normal(0.0, 1.0, (300, 3)) * (0.003, 0.003, 0.1)
    assert [len(p) for p in levels_of_cloud(points)] == [150, 150]


def test_a_point_that_is_repeated_is_one():
    sections = [np.insert(np.concatenate([profile(), profile()[:1]]), 2, h, axis=1) for h in (0.0, 10.0)]
    assert [len(p) for p in levels_of_cloud(np.concatenate(sections))] == [150, 150]


def test_no_levels():
    scattered = SHUFFLE.uniform(0.0, 50.0, (500, 3))
    assert levels_of_cloud(scattered) is None
    assert levels_of_cloud(np.insert(profile(), 2, 4.0, axis=1)) is None
    # two parallel sides of one section are no levels
    x = np.linspace(0.0, 30.0, 40)
    plate = np.concatenate([np.stack([x, 0.0 * x + y, 0.0 * x], axis=-1) for y in (0.0, 2.0)])
    assert levels_of_cloud(plate) is None


def test_too_many_points():
    one = SHUFFLE.uniform(0.0, 50.0, (2 * (MOST + 1), 3))
    one[:, 2] = np.repeat([0.0, 9.0], MOST + 1)
    with pytest.raises(InputError, match=f"{MOST + 1} on one level: must be at most {MOST}"):
        levels_of_cloud(one)


def test_a_file_with_numbers_of_points(tmp_path):
    points = shuffled([np.insert(profile(), 2, h, axis=1) for h in (0.0, 10.0, 20.0)])
    path = tmp_path / "scan.txt"
    path.write_text("".join(f"{k}\t{x:.9f}\t{y:.9f}\t{z:.9f}\n" for k, (x, y, z) in enumerate(points, 100)))
    sections = read_sections([path], "mm", columns="X Y Z")
    assert [float(p[0, 2]) for p in sections] == [0.0, 10.0, 20.0]
    blade = loft(check_sections(sections))
    for side in (blade.plus, blade.minus):
        low, middle, high = (side.at(np.linspace(0.1, 0.9, 9), v) for v in (0.0, 0.5, 1.0))
        np.testing.assert_allclose(middle[:, 2], 10.0, atol=1e-6)
        # the points of a profile are not those of the next, so that the curves differ between them
        np.testing.assert_allclose(low[:, :2], high[:, :2], atol=0.02)
        np.testing.assert_allclose(low[:, :2], middle[:, :2], atol=0.02)
    path.write_text("0.5 1 2 3\n1.5 1 2 4\n")
    with pytest.raises(InputError, match="line 1: 4 numbers: must be 2 or 3"):
        read_sections([path], "mm", columns="X Y Z")


@pytest.mark.skipif(not CLOUDS.is_dir(), reason="no blades of parablade in CHIPLOAD_DATA or ../shared/data")
@pytest.mark.parametrize(("name", "count"), [("prismatic_radial", 3), ("Aachen_3D", 4)])
def test_clouds_of_others(name, count):
    path = CLOUDS / name / "MoveSurface.txt"
    assert len(check_sections(read_sections([path], "m", columns="X Y Z"))) == count
