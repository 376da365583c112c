"""Workpieces that bend and must be refused, each with its exact message."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from chipload.errors import InputError
from chipload.planning.thinwall.table import read_cuts
from chipload.planning.thinwall.threshold import Experiments, calibrated, modelled
from chipload.planning.thinwall.wall import Wall
from chipload.structure.grid import Grid, from_points, plate
from chipload.structure.solid import Solid, factorise

GRID = plate(30.0, 20.0, 2.0, (3, 2, 1))


def clamped(grid: Grid = GRID, modulus: float = 1.14e5, **change) -> Solid:
    return Solid(grid, modulus, 0.34, 4.43e-9, **({"fixed": grid.side("j-")} | change))


def said(call) -> str:
    with pytest.raises(InputError) as err:
        call()
    return str(err.value)


def test_a_wall_that_nothing_holds_says_how_it_can_move() -> None:
    assert said(lambda: factorise(clamped(fixed=np.zeros(0, np.int64)))) == (
        "workpiece: not held against motion along x, along y, along z, about x, about y, about z: 6 rigid motions are "
        "free; fix more nodes"
    )


def test_a_wall_on_one_line_of_nodes_is_a_hinge() -> None:
    line = GRID.lattice[:, 0, 0]
    assert said(lambda: factorise(clamped(fixed=line[line >= 0]))) == (
        "workpiece: not held against motion about x: 1 rigid motion is free; fix more nodes"
    )


def test_a_wall_held_in_some_directions_only() -> None:
    held = np.zeros((len(GRID.nodes), 3), dtype=np.bool_)
    held[GRID.side("j-")] = [True, False, True]
    assert said(lambda: factorise(clamped(fixed=held))) == (
        "workpiece: not held against motion along y, about x, about z: 3 rigid motions are free; fix more nodes"
    )


def test_a_piece_that_is_cut_off_is_named() -> None:
    kept = np.tile([0.0, 1.0], (6, 1))
    kept[GRID.element(np.arange(3), np.full(3, 0), 0)] = 0.0
    grid = GRID
    assert said(lambda: factorise(clamped(grid, kept=kept))) == (
        "workpiece: not held against motion along x, along y, along z, about x, about y, about z: 6 rigid motions are "
        "free; fix more nodes"
    )


def corners() -> np.ndarray:
    """Corner points of three elements in a row."""
    x, y, z = np.meshgrid([0.0, 10.0, 20.0, 30.0], [0.0, 10.0], [0.0, 2.0], indexing="ij")
    return np.stack([x, y, z], axis=-1)


def test_sections_in_the_wrong_order_make_inverted_elements() -> None:
    turned = from_points(corners()[:, :, ::-1])
    assert said(lambda: factorise(clamped(turned))) == (
        "element 0: det(dx/dxi) = -25 mm^3: must be above 0 everywhere; the element is inverted, folded or flat: turn "
        "the order of the points or move its nodes"
    )


@pytest.mark.parametrize("gone", [False, True])
def test_an_element_without_volume_is_named_by_its_own_number(gone: bool) -> None:
    """Also where elements before it are gone: the number is that of the mesh."""
    flat = corners()
    flat[3] = flat[2]
    kept = np.tile([0.0, 1.0], (3, 1))
    if gone:
        kept[0] = 0.0
    message = said(lambda: factorise(clamped(from_points(flat), kept=kept)))
    assert message.startswith("element 2: det(dx/dxi) = ")
    assert message.endswith(
        "must be above 0 everywhere; the element is inverted, folded or flat: turn the order of the points or move its "
        "nodes"
    )


@pytest.mark.parametrize(
    ("modulus", "hint"),
    [(1.14e11, "is it in Pa?"), (1.14e8, "was MPa given for GPa?"), (69.0, "is it in GPa?")],
)
def test_a_modulus_in_another_unit(modulus: float, hint: str) -> None:
    assert said(lambda: clamped(modulus=modulus)) == (
        f"workpiece.modulus = {modulus:g} MPa: must be from 100 to 2e+06 MPa; {hint}"
    )


def test_a_wall_thinner_than_what_is_cut_off_it() -> None:
    assert said(lambda: Wall(clamped(), (1.0, 1.5))) == (
        "wall: allowance_mm 1 and 1.5 leave no wall: it is 2 mm thick with its stock"
    )


def test_a_table_of_experiments_with_one_place(tmp_path: Path) -> None:
    one = "experiments: 1 places: must be at least 3, not on a line, for a map of the wall; measure at the corners of "
    assert said(lambda: Experiments(np.array([[0.5, 0.5]]), np.array([20.0]))) == (
        one + "the free edge, its middle and near the clamp"
    )
    path = tmp_path / "cuts.csv"
    path.write_text("u,v,repeat,expected_normal_force_n,normal_force_n,deflection_um,too_much\n0,1,1,20,21,40,\n")
    assert said(lambda: read_cuts(path, 0.05)) == (
        "experiments cuts.csv: 1 places filled in: must be at least 3, not on a line: fill in deflection_um, or "
        "too_much with yes or no, of more cuts"
    )


def test_experiments_on_a_line() -> None:
    line = Experiments(np.array([[0.0, 1.0], [0.5, 1.0], [1.0, 1.0]]), np.array([20.0, 30.0, 20.0]))
    assert said(lambda: calibrated(line, [[0.5, 0.5]], 1.0)) == (
        "experiments: all places lie on a line: add one beside it"
    )


def test_a_compliance_of_nothing() -> None:
    assert said(lambda: modelled([0.0], 0.05)) == ("threshold: the normal compliance of a place is not above 0 mm/N")
