from __future__ import annotations

import math
from dataclasses import replace
from importlib import resources

import numpy as np
import pytest

from chipload.errors import InputError
from chipload.machine.machine import machine_named, machine_names, read_machine
from chipload.machine.table import MachineTable

VMC = (resources.files("chipload") / "data" / "machines" / "vmc.toml").read_text()


def test_units_are_converted(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(VMC.replace('name = "vmc"', 'name = "mine"'))
    mine = read_machine(path)
    assert mine.name == "mine"
    assert mine.limits == ((-400.0, 400.0), (-250.0, 250.0), (-250.0, 250.0))
    assert (mine.rapid, mine.feed_max) == (400.0, 200.0)
    assert mine.acceleration == (3000.0, 3000.0, 2500.0)
    assert mine.spindle_max == pytest.approx(500.0 * math.pi)
    assert (mine.power_w, mine.torque) == (11000.0, 70000.0)
    assert replace(mine, name="vmc") == machine_named("vmc")


@pytest.mark.parametrize(
    ("name", "rpm", "hp", "rates_in_s", "travel_in"),
    [
        ("tormach-1100", 1100, 1.5, (1.833, 1.833, 1.5), (18, 9.5, 16.25)),
        ("tormach-1100m-plus", 7500, 0.4, (5, 5, 3.8333), (18, 11, 16.25)),
        ("tormach-770", 3000, 1.0, (2.25, 2.25, 1.833), (14, 7.5, 13.25)),
        ("tormach-440", 10000, 0.68, (2.25, 2.25, 1.833), (10, 6.25, 10)),
    ],
)
def test_machines_by_their_makers_configuration(name, rpm, hp, rates_in_s, travel_in):
    """Oracle: numbers of the maker's files in inches, one horsepower being 745.7 W."""
    machine = machine_named(name)
    speed = rpm * 2 * np.pi / 60
    torque = np.interp(speed, *np.array(machine.torque_curve).T) / 1e3
    assert torque * speed == pytest.approx(hp * 745.7, rel=2e-3)
    axes = machine.chain.axes
    assert [a.rate / 25.4 for a in axes] == pytest.approx(list(rates_in_s), rel=1e-4)
    assert [(a.high - a.low) / 25.4 for a in axes] == pytest.approx(list(travel_in))


def test_shipped_ones_are_read():
    assert [machine_named(n).name for n in machine_names()] == list(machine_names())
    assert (machine_named("vmc-fanuc").dialect, machine_named("vmc-fanuc").decimals) == ("fanuc", 4)


GUESS = "must be given, a machine's limits are never guessed"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("rapid_mm_min = 24000.0", "", f"rapid_mm_min is missing: {GUESS}"),
        ("max_rpm = 15000.0", "", f"spindle.max_rpm is missing: {GUESS}"),
        ("[axis.y]", "[axis.b]", "unknown key axis.b: the nearest known one is axis.z"),
        ("rapid_mm_min", "rapid_m_min", "unknown key rapid_m_min: the nearest known one is rapid_mm_min"),
        ("max_rpm", "max_rmp", "unknown key spindle.max_rmp: the nearest known one is spindle.max_rpm"),
        ("24000.0", "-1", "machine.rapid_mm_min = -1: must be above 0"),
        ("24000.0", "nan", "machine.rapid_mm_min = nan: must be above 0"),
        ("24000.0", '"fast"', "rapid_mm_min = 'fast': must be a number"),
        ("24000.0", "true", "rapid_mm_min = True: must be a number"),
        ("decimals = 6", "decimals = 6.0", "decimals = 6.0: must be a whole number"),
        ("decimals = 6", "decimals = 2", "machine.decimals = 2: must be from 3 to 6"),
        ('"linuxcnc"', '"heidenhain"', "machine.dialect = 'heidenhain': must be linuxcnc or fanuc"),
        ("max_mm = 400.0", "max_mm = -400.0", "machine.axis.x.max_mm = -400: must be above min_mm = -400"),
        ("min_rpm = 60.0", "min_rpm = 2e4", "machine.spindle.min_rpm = 20000: must be from 0 to max_rpm = 15000"),
        ("2500.0", "0", "machine.axis.z.acceleration_mm_s2 = 0: must be above 0"),
        ("torque_nm = 70.0", "torque_nm = -70.0", "machine.spindle.torque_nm = -70: must be above 0"),
        (
            "corner_tolerance_mm = 0.005",
            "corner_tolerance_mm = 5",
            "machine.corner_tolerance_mm = 5: must be from 0 to 1 mm",
        ),
        (
            "decimals = 6",
            "decimals = 6\nblock_time_ms = 0.0",
            "machine.block_time_ms = 0: must be above 0, at most 1000 ms",
        ),
        (
            "decimals = 6",
            "decimals = 6\nblock_time_ms = 2.0\ntrajectory_planner.cycle_ms = 1.0",
            "machine.block_time_ms = 2: must be left out with [trajectory_planner]: its cycle_ms limits short segments",
        ),
        (
            "decimals = 6",
            "decimals = 6\njerk_mm_s3 = 4e4",
            "machine.jerk_low_mm_s3 = 20000: must be left out where jerk_mm_s3 is stated",
        ),
    ],
)
def test_refused(tmp_path, old, new, message):
    path = tmp_path / "mine.toml"
    assert old in VMC
    path.write_text(VMC.replace(old, new, 1))
    with pytest.raises(InputError) as err:
        read_machine(path)
    assert str(err.value) == f"machine {path}: {message}"


def test_not_a_machine(tmp_path):
    with pytest.raises(InputError) as err:
        machine_named("vcm")
    assert (
        str(err.value)
        == f"machine vcm: not known: the nearest is vmc (known: {', '.join(machine_names())}), or give a file"
    )
    with pytest.raises(InputError) as err:
        read_machine(tmp_path)
    assert str(err.value) == f"machine {tmp_path}: cannot be read: Is a directory"
    bad = tmp_path / "bad.toml"
    bad.write_bytes(b"\x00\xff")
    with pytest.raises(InputError, match="not a TOML file"):
        read_machine(bad)


CURVE = "torque_curve = [[0.0, 80.0], [3000.0, 60.0], [15000.0, 12.0]]"


def test_a_curve_of_torque_is_straight_between_its_points(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(VMC.replace("torque_nm = 70.0", f"torque_nm = 70.0\n{CURVE}"))
    mine = read_machine(path)
    speeds = [math.tau / 60.0 * n for n in (0.0, 1500.0, 2000.0, -3000.0, 9000.0, 15000.0)]
    # the greatest torque is not exceeded either
    assert mine.torque_at(speeds) == pytest.approx([7e4, 7e4, 80e3 - 20e3 * 2.0 / 3.0, 6e4, 3.6e4, 1.2e4])
    alone = replace(mine, torque=None)
    assert alone.torque_at(speeds[:2]) == pytest.approx([8e4, 7e4])
    assert replace(alone, torque_curve=()).torque_at(speeds[0]) == math.inf


@pytest.mark.parametrize(
    ("curve", "message"),
    [
        ("[[100.0, 80.0], [15000.0, 12.0]]", "from 100 to 15000 rpm: must hold min_rpm = 60 to max_rpm = 15000"),
        ("[[0.0, 80.0], [9000.0, 12.0]]", "from 0 to 9000 rpm: must hold min_rpm = 60 to max_rpm = 15000"),
        ("[[0.0, 80.0], [9000.0, 12.0], [9000.0, 11.0]]", "9000 rpm after 9000: speeds must rise"),
        ("[[0.0, 80.0], [15000.0, 0.0]]", "a torque must be above 0"),
        ("[[0.0, 80.0, 3.0]]", "must be pairs of numbers"),
        ("[0.0, 80.0]", "must be pairs of numbers"),
        ("70.0", "must be pairs of numbers"),
    ],
)
def test_curves_that_are_refused(tmp_path, curve, message):
    path = tmp_path / "mine.toml"
    path.write_text(VMC.replace("torque_nm = 70.0", f"torque_curve = {curve}"))
    with pytest.raises(InputError) as caught:
        read_machine(path)
    assert "torque_curve" in str(caught.value)
    assert message in str(caught.value)


def test_the_table_of_a_machine(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(VMC + "[table]\nlow_mm = [-350.0, -200.0, -150.0]\nhigh_mm = [350, 200, -100]\nspacing_mm = 4\n")
    assert read_machine(path).table == MachineTable((-350.0, -200.0, -150.0), (350.0, 200.0, -100.0), 4.0)
    assert machine_named("vmc").table is None


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("low_mm = [0, 0, 0]", "table.high_mm is missing"),
        ("low_mm = [0, 0, 0]\nhigh_mm = [9, 9]", "table.high_mm = [9, 9]: must be three numbers"),
        ("low_mm = [0, 9, 0]\nhigh_mm = [9, 9, 9]", "machine.table.low_mm: Y = 9: must be below high_mm, Y = 9"),
        ("low_mm = [0, 0, 0]\nhigh_mm = [9, 9, inf]", "machine.table.high_mm: Z = inf: must be a finite number"),
        ("low_mm = [0, 0, 0]\nhigh_mm = [9, 9, 9]\nspacing_mm = 0", "machine.table.spacing_mm = 0: must be above 0"),
        ("low_mm = [0, 0, 0]\nhigh = [9, 9, 9]", "unknown key table.high: the nearest known one is table.high_mm"),
    ],
)
def test_a_table_of_a_machine_that_is_refused(tmp_path, table, message):
    path = tmp_path / "mine.toml"
    path.write_text(f"{VMC}[table]\n{table}\n")
    with pytest.raises(InputError) as refused:
        read_machine(path)
    assert message in str(refused.value)
