"""Table angles and pallet angles of a machine, against its forward kinematics and the numbers of the source."""

import dataclasses
import math

import numpy as np
import pytest

from chipload.errors import InputError
from chipload.machine.axis import LETTERS
from chipload.machine.kinematics import forward
from chipload.machine.machine import machine_named
from chipload.planning.impeller.closed_form import axis_at
from chipload.planning.impeller.tables import index_table


def test_the_angles_of_the_source():
    table = index_table(machine_named("horizontal-b"))
    assert np.degrees(table.angle) == pytest.approx(np.arange(20.0, 91.0, 5.0), abs=1e-9)
    assert (table.index, table.pallet) == ("A", "B")
    # of the machine's file: alpha = 90 deg - A
    assert np.degrees(table.position + table.angle) == pytest.approx(90.0, abs=1e-9)
    assert table.spans.tolist() == [[0.0, 2.0 * math.pi]]


def changed(**keys):
    machine = machine_named("horizontal-b")
    axes = tuple(dataclasses.replace(a, **keys.get(a.letter, {})) for a in machine.chain.axes)
    return dataclasses.replace(machine, chain=dataclasses.replace(machine.chain, axes=axes))


@pytest.mark.parametrize("turn", [1.0, -1.0])
def test_it_is_where_the_axes_lead(turn):
    machine = changed(B={"direction": (0.0, turn, 0.0), "low": -0.5, "high": 2.0})
    table = index_table(machine)
    rng = np.random.default_rng(5)
    q = rng.uniform(-0.5, 2.0, 40)
    for alpha, a in zip(table.angle, table.position, strict=True):
        axes = np.zeros((len(q), len(LETTERS)))
        axes[:, LETTERS.index("A")], axes[:, LETTERS.index("B")] = a, q
        B = table.offset + table.sense * q
        assert np.abs(forward(machine, axes)[1] - axis_at(alpha, B)).max() < 1e-12
        assert ((table.spans[0, 0] <= B) & (table.spans[0, 1] >= B)).all()
    assert np.ptp(table.spans) == pytest.approx(2.5)


def test_some_of_them():
    table = index_table(machine_named("horizontal-b")).at(np.radians([45.0, 20.0, 45.0]))
    assert np.degrees(table.angle) == pytest.approx([20.0, 45.0])
    assert np.degrees(table.position) == pytest.approx([70.0, 45.0])


def test_what_has_no_index_table_is_refused():
    with pytest.raises(InputError, match="axis A: no steps between two limits"):
        index_table(changed(A={"step": None}))
    with pytest.raises(InputError, match="B does not turn about the work's Z"):
        index_table(changed(B={"direction": (0.0, 1.0, 0.1)}))
