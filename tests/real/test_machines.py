"""Configurations of LinuxCNC and the positions of its five-axis programs."""

from __future__ import annotations

import os
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from chipload.machine.follow import follow
from chipload.machine.ini import read_ini
from chipload.machine.kinematics import forward, inverse, with_tip
from chipload.machine.machine import machine_named

DATA = Path(os.environ.get("CHIPLOAD_DATA", Path(__file__).parents[2].parent / "shared" / "data"))
FIVE = DATA / "machines_tools" / "linuxcnc" / "axis" / "vismach" / "5axis"
BOATS = DATA / "nc" / "linuxcnc_5axis"
pytestmark = pytest.mark.skipif(not BOATS.is_dir(), reason=f"no {BOATS}")

LETTERS = "XYZABC"
PAIRS = [("boat-xyzac.ngc", "xyzac-trunnion"), ("boat-xyzbc.ngc", "xyzbc-trunnion")]


def positions(name):
    """(n, 9) of every line that has a word X Y Z A B C: the tip in the work frame [mm], the rotary axes [rad]."""
    now, rows = np.zeros(9), []
    for line in (BOATS / name).read_text().splitlines():
        words = re.findall(r"([XYZABC])(-?[0-9.]+)", re.sub(r"\([^)]*\)", "", line))
        for letter, value in words:
            now[LETTERS.index(letter)] = float(value) * (1.0 if letter in "XYZ" else np.pi / 180.0)
        if words:
            rows.append(now.copy())
    return np.array(rows)


@pytest.mark.parametrize(
    ("program", "name"), [("boat-xyzac.ngc", "xyzac-trunnion"), ("boat-xyzbc.ngc", "xyzbc-trunnion")]
)
def test_boats_from_the_machine_to_the_workpiece_and_back(program, name):
    """Under M428 the text gives the tip in the workpiece; the axes there lead back to it and to themselves."""
    machine, tool, zero = machine_named(name), 40.0, (3.0, -4.0, -13.25)
    text = positions(program)
    assert len(text) > 1500
    axes = with_tip(machine, text, text[:, :3], tool, zero)
    tip, axis = forward(machine, axes, tool, zero)
    np.testing.assert_allclose(tip, text[:, :3], atol=1e-9)
    found = inverse(machine, tip, axis, tool, zero, held=axes)
    change = found.axes - axes[:, None]
    change[..., 3:6] -= 2.0 * np.pi * np.round(change[..., 3:6] / (2.0 * np.pi))
    assert np.abs(change).max(axis=2).min(axis=1).max() < 1e-9
    for k in (0, 1):
        back, same = forward(machine, found.axes[:, k], tool, zero)
        np.testing.assert_allclose(back, tip, atol=1e-9)
        np.testing.assert_allclose(same, axis, atol=1e-9)


@pytest.mark.parametrize(
    ("program", "name"), [("boat-xyzac.ngc", "xyzac-trunnion"), ("boat-xyzbc.ngc", "xyzbc-trunnion")]
)
def test_boats_are_followed_with_no_more_rotary_motion_than_written(program, name):
    machine = machine_named(name)
    wide = tuple(axis if axis.rotary else replace(axis, low=-1e4, high=1e4) for axis in machine.chain.axes)
    machine = replace(machine, chain=replace(machine.chain, axes=wide))
    text = positions(program)
    for a in machine.chain.rotary:
        assert ((text[:, a.column] >= a.low) & (text[:, a.column] <= a.high)).all()
    tip, axis = forward(machine, with_tip(machine, text, text[:, :3]))
    axes, findings = follow(machine, tip, axis, text[0])
    back, same = forward(machine, axes)
    np.testing.assert_allclose(back, tip, atol=1e-9)
    np.testing.assert_allclose(same, axis, atol=2e-9)
    columns = [a.column for a in machine.chain.rotary]
    written, found = (np.abs(np.diff(q[:, columns], axis=0)).max(axis=1).sum() for q in (text, axes))
    assert found <= written + 1e-6
    assert "machine-limit" not in [f.code for f in findings]


@pytest.mark.parametrize(
    ("path", "shipped"),
    [
        ("table-rotary-tilting/xyzac-trt.ini", "xyzac-trunnion"),
        ("table-rotary-tilting/xyzbc-trt.ini", "xyzbc-trunnion"),
        ("bridgemill/5axis.ini", "xyzbcw-bridge"),
    ],
)
def test_configurations_are_the_shipped_machines(path, shipped):
    """The axes that were copied by hand into the shipped files, to the last number."""
    machine, findings = read_ini(FIVE / path)
    ours = machine_named(shipped)
    assert machine.chain.letters == ours.chain.letters
    for read, copied in zip(machine.chain.axes, ours.chain.axes, strict=True):
        assert read.letter == copied.letter
        for key in ("direction", "pivot", "low", "high", "rate", "acceleration"):
            assert getattr(read, key) == pytest.approx(getattr(copied, key), rel=1e-12), key
    assert machine.rapid == pytest.approx(ours.rapid)
    assert {"ini-spindle", "ini-hal"} <= {f.code for f in findings}


def test_dual_rotary_table():
    machine, _ = read_ini(FIVE / "table-dual-rotary" / "xyzab-tdr.ini")
    assert [(a.letter, a.pivot, a.direction) for a in machine.chain.rotary] == [
        ("A", (-20.0, 0.0, -10.0), (1.0, 0.0, 0.0)),
        ("B", (0.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
    ]
