from __future__ import annotations

import math
from importlib import resources

import numpy as np
import pytest

from chipload.errors import InputError
from chipload.machine.limits import limit_findings
from chipload.machine.machine import machine_named, machine_names, read_machine

FOLDER = resources.files("chipload") / "data" / "machines"
HEAD = (FOLDER / "xyzbc-head-table.toml").read_text()
INDEX = (FOLDER / "horizontal-b.toml").read_text()


def test_units_of_a_rotary_axis():
    machine = machine_named("horizontal-b")
    a, b = machine.chain.axis("A"), machine.chain.axis("B")
    assert (a.low, a.high, a.step) == pytest.approx((0.0, math.radians(70.0), math.radians(5.0)))
    assert (a.rate, a.acceleration) == pytest.approx((math.radians(30.0), math.radians(100.0)))
    assert (b.low, b.high, b.endless) == (-math.inf, math.inf, True)
    assert (a.indexed, b.indexed, a.head, machine.chain.axis("X").head) == (True, False, False, True)
    assert machine.chain.axis("X").rate == machine.rapid


def test_gauge_sets_the_nose_below_the_pivot():
    chain = machine_named("xyzbc-head-table").chain
    assert chain.nose == (0.0, 0.0, 0.0)
    assert chain.letters == "CXYZB"


@pytest.mark.parametrize("name", machine_names())
def test_every_shipped_machine_says_where_its_numbers_come_from(name):
    text = (FOLDER / f"{name}.toml").read_text()
    assert text.startswith("# ")
    if len(machine_named(name).chain.axes) > 3:
        assert "Assumed" in machine_named(name).note


@pytest.mark.parametrize(
    ("text", "old", "new", "message"),
    [
        (HEAD, 'chain = "CXYZB"', 'chain = "CXYB"', "unknown key axis.z: the nearest known one is axis.y"),
        (HEAD, 'chain = "CXYZB"', 'chain = "CXYZBB"', "machine.chain = CXYZBB: B appears twice: must appear once"),
        (
            HEAD,
            '"CXYZB"',
            '"BCXYZ"',
            "machine.chain = BCXYZ: C in the table after B in the head: must go from the workpiece to the tool",
        ),
        (HEAD, '"CXYZB"', '"CXYZQ"', "chain = 'CXYZQ': Q: must be letters of XYZABCUVW"),
        (
            HEAD,
            "rate_deg_min = 18000.0",
            "rate_deg_s = 300.0",
            "unknown key axis.c.rate_deg_s: the nearest known one is axis.c.rate_deg_min",
        ),
        (
            HEAD,
            "pivot_mm = [0.0, 0.0, 0.0]",
            "pivot_mm = [0.0, 0.0]",
            "axis.c.pivot_mm = [0.0, 0.0]: must be three numbers",
        ),
        (
            HEAD,
            "pivot_mm = [0.0, 0.0, 0.0]\n",
            "",
            "axis.c.pivot_mm is missing: must be given, a machine's limits are never guessed",
        ),
        (HEAD, "endless = true", "endless = 1", "axis.c.endless = 1: must be true or false"),
        (HEAD, "endless = true\n", "", "machine.axis.c.min_deg: give min_deg and max_deg, or endless = true, not both"),
        (
            HEAD,
            "endless = true",
            "endless = true\nmin_deg = 0",
            "machine.axis.c.min_deg: give min_deg and max_deg, or endless = true, not both",
        ),
        (HEAD, 'side = "table"', 'side = "bed"', "machine.axis.c.side = 'bed': must be table or head"),
        (
            HEAD,
            "direction = [0.0, 0.0, 1.0]",
            "direction = [0, 0, 0]",
            "machine.axis.c.direction = (0.0, 0.0, 0.0): must have a length above 0",
        ),
        (HEAD, "max_deg = 110.0", "max_deg = -120.0", "machine.axis.b.max_deg = -120: must be above min_deg = -110"),
        (HEAD, "rate_deg_min = 9000.0", "rate_deg_min = -1.0", "machine.axis.b.rate_deg_min = -1: must be above 0"),
        (HEAD, "max_deg = 110.0", "max_deg = inf", "machine.axis.b.max_deg = inf: must be a finite number"),
        (
            HEAD,
            "acceleration_deg_s2 = 500.0",
            "acceleration_deg_s2 = 0",
            "machine.axis.b.acceleration_deg_s2 = 0: must be above 0",
        ),
        (HEAD, "gauge_mm = 200.0", "gauge_mm = -1", "machine.spindle.gauge_mm = -1: must be from 0 to 1e5"),
        (
            HEAD,
            "gauge_mm = 200.0",
            "gauge_mm = 1\nnose_mm = [0, 0, 0]",
            "machine.spindle.gauge_mm: needs a rotary axis in the head, and no nose_mm",
        ),
        (
            HEAD,
            "[axis.x]",
            "[axis.x]\ndirection = [0, 1, 0]",
            "machine.chain: directions of X, Y and Z: must not lie in a plane",
        ),
        (
            INDEX,
            "indexed = true",
            "indexed = false",
            "machine.axis.a.step_deg = 5: must be left out where the axis is not indexed",
        ),
        (
            INDEX,
            "x_axis = [0.0, 0.0, 1.0]",
            "x_axis = [0.0, 1.0, 1.0]",
            "machine.work.x_axis: must be at right angles to z_axis",
        ),
        (INDEX, "[work]", "[word]", "unknown key word: the nearest known one is work"),
    ],
)
def test_refused(tmp_path, text, old, new, message):
    path = tmp_path / "mine.toml"
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(InputError) as err:
        read_machine(path)
    assert str(err.value) == f"machine {path}: {message}"


def test_three_free_rotary_axes_are_refused():
    chain = machine_named("horizontal-b").chain
    assert [axis.letter for axis in chain.free()] == ["B"]
    assert [axis.letter for axis in chain.free("AB")] == ["B", "A"]
    assert chain.free("") == ()


def test_limits_name_the_worst_row():
    q = np.zeros((4, 9))
    q[1:, 0] = 401.0, 450.0, 0.0
    q[3, 3] = math.radians(12.5)
    found = limit_findings(machine_named("horizontal-b"), q, [7, 8, 9, 10])
    assert [(f.code, f.line, f.text) for f in found] == [
        ("machine-index", 10, "A = 12.5 deg: machine horizontal-b stands at multiples of 5 deg"),
        (
            "machine-limit",
            9,
            "X = 450 mm: machine horizontal-b travels from -400 mm to 400 mm (2 motions, the first in line 8)",
        ),
    ]
