"""Deflections that force and compliance of the neighbours do not explain."""

from __future__ import annotations

import numpy as np
import pytest

from chipload.errors import Severity
from chipload.simulation.deflection_jumps import jump_findings, jumps


def wall(count=41, length=40.0):
    """Places along the free edge of a wall [mm] and its compliance [um/N]: from the middle to the corner it grows
    fourfold, as that of a clamped plate.
    """
    x = np.linspace(0.0, length, count)
    return np.column_stack([x, np.zeros(count), np.zeros(count)]), 0.1 * (1.0 + 3.0 * (x / length) ** 4)


def test_a_wall_that_grows_softer_is_explained():
    place, c = wall()
    force = np.where(np.arange(len(c)) % 2 == 0, 300.0, 80.0)
    assert len(jumps(place, force, force * c, c, 4.0)[0]) == 0


@pytest.mark.parametrize(("factor", "found"), [(7.8, [20]), (2.9, []), (1.0 / 7.8, [20]), (0.4, [])])
def test_one_step_that_bends_otherwise_is_found(factor, found):
    """At the force with which it is the worst by its neighbours' compliance."""
    place, c = wall()
    force = np.full(len(c), 50.0)
    force[20] = 400.0
    own = c.copy()
    own[20] *= factor
    step, ratio = jumps(place, force, force * own, own, 4.0)
    assert step.tolist() == found
    if found:
        near = max(c[19], c[21]) if factor > 1.0 else min(c[19], c[21])
        assert ratio[0] == pytest.approx(factor * c[20] / near)


def test_what_does_not_decide_is_not_found():
    """Eight times as much per newton, under a force so small that other steps bend the wall further."""
    place, c = wall()
    force, own = np.full(len(c), 200.0), c.copy()
    force[10], own[10] = 5.0, 8.0 * c[10]
    assert len(jumps(place, force, force * own, own, 4.0)[0]) == 0


def test_steps_far_away_explain_nothing_and_are_no_reason():
    """A rib that is eight times as soft, 50 mm away; and a step without any neighbour."""
    place, c = wall()
    place[25:, 0] += 50.0
    own = np.where(np.arange(len(c)) < 25, c, 8.0 * c)
    assert len(jumps(place, np.full(len(c), 100.0), 100.0 * own, own, 4.0)[0]) == 0
    one = np.array([[0.0, 0.0, 0.0]])
    assert len(jumps(one, np.ones(1), np.ones(1), np.ones(1), 4.0)[0]) == 0


def test_a_step_of_two_rows_behind_air_has_its_next_neighbour_only():
    """The first step of a wall, after a rapid, as in a finishing pass that enters square."""
    place, c = wall(10, 9.0)
    own = c.copy()
    own[0] *= 8.0
    step, _ = jumps(place, np.full(10, 100.0), 100.0 * own, own, 4.0)
    assert step.tolist() == [0]


def test_the_finding_names_line_place_and_row():
    place, c = wall(5, 4.0)
    own = c.copy()
    own[2] *= 8.0
    columns = {
        "line": np.arange(100, 110),
        "force_n": np.r_[np.zeros(5), np.full(5, 200.0)],
        "deflection_workpiece_um": np.r_[np.zeros(5), 200.0 * own],
    }
    (found,) = jump_findings(columns, np.arange(5, 10), place, own, 4.0, "force_n")
    assert (found.code, found.severity, found.line, found.row) == ("deflection-jump", Severity.UNPROVEN, 107, 7)
    assert found.place == (2.0, 0.0, 0.0)
    assert found.text.startswith("the workpiece bends by ")
    assert "under 200 N" in found.text
    assert jump_findings(columns, np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros(0), 4.0, "force_n") == ()
