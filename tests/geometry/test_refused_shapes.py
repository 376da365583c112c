"""Contours, tables of points and tips of blades that are refused, and the last two forms of a table that are read."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from chipload.errors import InputError
from chipload.geometry import step_meridian
from chipload.geometry.contour import Contour
from chipload.geometry.mesh import read_mesh
from chipload.geometry.offset import offset
from chipload.geometry.revolve import Revolved
from chipload.geometry.sections import read_meridian, read_sections
from chipload.geometry.step import read_step_level
from chipload.geometry.thin_wall import blade

LINE = [0.0, 0.0, 5.0, 0.0, 0.0, 0.0, 0.0]


@pytest.mark.parametrize(
    ("segments", "message"),
    [
        ([LINE[:6]], "contour: segments have shape (1, 6): need (n, 7) with n >= 1"),
        (np.zeros((0, 7)), "contour: segments have shape (0, 7): need (n, 7) with n >= 1"),
        ([[*LINE[:3], math.nan, *LINE[4:]]], "contour: a coordinate is not a finite number"),
        ([LINE, [5.0, 0.0, 5.0, 0.0, 0.0, 0.0, 0.0]], "contour: segment 1 at (5, 0) has no length"),
        ([LINE, [6.0, 0.0, 9.0, 0.0, 0.0, 0.0, 0.0]], "contour: gap of 1 mm at (5, 0): neighbours must meet"),
    ],
)
def test_segments_that_are_no_contour(segments: object, message: str) -> None:
    with pytest.raises(InputError) as err:
        Contour(np.array(segments))
    assert str(err.value) == message


@pytest.mark.parametrize(("s0", "s1"), [(-1.0, 2.0), (2.0, 2.0), (3.0, 2.0), (0.0, 5.1), (math.nan, 2.0)])
def test_a_part_beyond_a_contour(s0: float, s1: float) -> None:
    with pytest.raises(InputError, match=r"^contour: part .* mm: need 0 <= s0 < s1 <= 5$"):
        Contour(np.array([LINE])).part(s0, s1)


@pytest.mark.parametrize("distance", [math.nan, math.inf])
def test_an_offset_by_no_number(distance: float) -> None:
    with pytest.raises(InputError, match=r"^offset: distance_mm = (nan|inf): must be a finite number$"):
        offset([Contour(np.array([LINE]))], distance)


@pytest.mark.parametrize(
    ("meridian", "side", "message"),
    [
        ([[1.0, 0.0]], 1, "meridian: shape (1, 2): must be finite, (n, 2), at least 2 points"),
        ([[1.0, 0.0], [math.inf, 1.0]], 1, "meridian: shape (2, 2): must be finite, (n, 2), at least 2 points"),
        ([[1.0, 0.0], [-2.0, 1.0]], 1, "meridian: radius -2 mm: must be at least 0"),
        ([[1.0, 0.0], [1.0, 0.0], [2.0, 1.0]], 1, "meridian: point 1 appears twice: keep one"),
        ([[1.0, 0.0], [2.0, 1.0]], 0, "meridian.side = 0: must be 1 or -1"),
    ],
)
def test_a_meridian_that_cannot_be_turned(meridian: object, side: int, message: str) -> None:
    with pytest.raises(InputError) as err:
        Revolved(np.array(meridian), side)
    assert str(err.value) == message


# -- files ------------------------------------------------------------------------------------------------------
def test_sections_by_radius_and_angle(tmp_path: Path) -> None:
    """x is along the axis: radius 10 at 90 deg is the point (0, 10)."""
    (tmp_path / "a.txt").write_text("X R THETA_DEG\n1 10 0\n2 10 90\n3 20 180\n")
    (points,) = read_sections([tmp_path / "a.txt"], "mm")
    np.testing.assert_allclose(points, [[10, 0, 1], [0, 10, 2], [-20, 0, 3]], atol=1e-12)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "no numbers: must be a table of points"),
        ("X Y Z\n", "no numbers: must be a table of points"),
        ("X Y Z\n1 2\n3 4\n", "2 columns: must be 3"),
        ("A B C\n1 2 3\n", "columns A B C: must be X R*THETA R, X R THETA_DEG or X Y Z"),
        ("X R*THETA R\n1 2 3\n1 2 0\n", "row 2: R must be above 0"),
        ("X Y Z\n1 2 3\n1 2 1e7\n", "a coordinate is 1e+07 mm: must be at most 1e+06: check the unit"),
        ("span_index x y\n", "columns x y after span_index: must be "),
        ("span_index ss_x ss_y ss_z ps_x ps_y ps_z\n0 1 2 3 4 5\n", "line 2: must be seven finite numbers: "),
        ("span_index ss_x ss_y ss_z ps_x ps_y ps_z\n0 1 2 3 4 5 q\n", "line 2: not numbers: '0 1 2 3 4 5 q'"),
        (
            "span_index ss_x ss_y ss_z ps_x ps_y ps_z\n1 1 2 3 4 5 6\n0 1 2 3 4 5 6\n",
            "span_index: must ascend from hub to shroud, each section in one piece",
        ),
    ],
)
def test_tables_that_are_no_sections(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "a.txt").write_text(text)
    with pytest.raises(InputError) as err:
        read_sections([tmp_path / "a.txt"], "mm")
    assert str(err.value).removeprefix(f"{tmp_path / 'a.txt'}").lstrip(": ").startswith(message)


def test_a_meridian_of_blocks_that_differ(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text("1 2\n3 4\n# next\n1 2 3\n4 5 6\n")
    with pytest.raises(InputError, match=r"a\.txt: blocks of 2 and of 3 columns: must have the same number in every "):
        read_meridian(tmp_path / "a.txt", "mm")


def test_a_mesh_of_another_unit(tmp_path: Path) -> None:
    corners = "".join(f"vertex {x} {y} 0\n" for x, y in ((0, 0), (2000, 0), (0, 2000)))
    (tmp_path / "a.stl").write_text(
        f"solid a\nfacet normal 0 0 1\nouter loop\n{corners}endloop\nendfacet\nendsolid a\n"
    )
    with pytest.raises(InputError, match=r"a vertex is 2e\+06 mm from the origin: must be at most 1e\+06 mm: check"):
        read_mesh(tmp_path / "a.stl", key="fixture.0.file", unit="m")


def test_a_face_at_no_height(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"^part\.z_mm = nan: must be a finite number$"):
        read_step_level(tmp_path / "none.step", z_mm=math.nan)


def test_a_blade_bent_too_far() -> None:
    with pytest.raises(InputError, match=r"^wall\.camber_deg = 95: must be between -90 and 90$"):
        blade((30.0, 20.0), 40.0, (2.0, 1.0), 0.5, math.radians(95.0), (0.0, 0.0))


# -- tips of blades ---------------------------------------------------------------------------------------------
def tip(monkeypatch: pytest.MonkeyPatch, *edges: np.ndarray) -> np.ndarray:
    """The tip between edges of a face; an end of the tip is a short third edge."""
    short = np.array([[30.0, 0.0, 0.0], [30.0, 0.1, 0.0]])
    monkeypatch.setattr(step_meridian, "_edges", lambda face, R: [short, *edges])
    return step_meridian._tip(SimpleNamespace(number=7), np.eye(3), "impeller.shroud")


def edge(radius: float, low: float, high: float, turn: float = 0.0) -> np.ndarray:
    """A line along the axis at a radius, turned about it."""
    z = np.linspace(low, high, 5)
    return np.stack([np.full(5, radius * math.cos(turn)), np.full(5, radius * math.sin(turn)), z], axis=-1)


@pytest.mark.parametrize("back", [False, True])
def test_the_tip_of_a_blade_is_half_way_between_its_edges(monkeypatch: pytest.MonkeyPatch, back: bool) -> None:
    """Radii 30 and 30.4 mm, the second edge travelled either way: 30.2 mm, from z = 0 to 20.1 mm."""
    second = edge(30.4, 0.0, 20.2, turn=0.05)
    found = tip(monkeypatch, edge(30.0, 0.0, 20.0), second[::-1] if back else second)
    np.testing.assert_allclose(found[:, 0], 30.2, atol=1e-9)
    ends = found[[0, -1], 1]
    np.testing.assert_allclose(np.sort(ends), [0.0, 20.1], atol=1e-9)
    assert (np.diff(found[:, 1]) * np.sign(ends[1] - ends[0]) > 0.0).all()


def test_a_face_that_is_no_tip(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(
        InputError, match=r"face 7 is neither of revolution .* its edges are 1\.2 mm apart in radius an"
    ):
        tip(monkeypatch, edge(30.0, 0.0, 20.0), edge(31.2, 0.0, 20.0))
    ring = 30.0 * np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    with pytest.raises(InputError, match=r"face 7 is not the tip of a blade: an edge has no length along the axis$"):
        tip(monkeypatch, edge(30.0, 0.0, 20.0), ring)
