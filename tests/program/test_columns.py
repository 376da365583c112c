"""Columns of a program that nobody can change are kept as they are; those that somebody can are copied."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from chipload.machine.machine import machine_named
from chipload.program import path_mode, to_work
from chipload.program.build import plunge, rapid
from chipload.program.gcode.reader import read_gcode
from chipload.program.path_mode import frozen_column
from chipload.program.program import Program
from chipload.program.time import row_times
from chipload.simulation.checkpoint import digest


def test_a_column_that_can_be_changed_is_copied() -> None:
    own = np.arange(4.0)
    view = own[1:]
    view.setflags(write=False)  # but not what it is a view of
    for value in (own, view, np.asfortranarray(np.ones((2, 3)))[:, 0]):
        found = frozen_column(value, float)
        assert not np.shares_memory(found, value)
        with pytest.raises(ValueError, match="read-only"):
            found[0] = 7.0
    assert frozen_column([1, 2], float).tolist() == [1.0, 2.0]
    assert frozen_column(np.array([1, 2]), float).dtype == np.float64


def test_a_column_that_cannot_be_changed_is_kept() -> None:
    own = np.arange(4.0)
    own.setflags(write=False)
    assert frozen_column(own, float) is own
    assert np.shares_memory(frozen_column(own[1:], float), own)
    assert frozen_column(own[::2], float).flags.c_contiguous
    program = Program.join([rapid([0, 0, 0], 0, 1, "link"), plunge([9, 0, 0], 3.0, 800.0, 1, "cut")])
    again = replace(program, spindle=np.array([1.0, 1.0]))
    assert again.p_work is program.p_work
    assert again.path_mode is program.path_mode


@pytest.mark.parametrize("long", [2, 10**9])
def test_equal_rows_take_the_memory_of_one(long: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(path_mode, "LONG", long)
    up = frozen_column(np.tile([0.0, 0.0, 1.0], (5, 1)), float)
    assert up.tolist() == [[0.0, 0.0, 1.0]] * 5
    assert (up.strides[0] == 0) == (long == 2)
    assert not up.flags.writeable
    assert not up.base.flags.writeable if up.base is not None else True
    assert frozen_column(up, float) is up
    # equal bits, not equal numbers: 0 and -0 are two rows
    signs = frozen_column(np.array([0.0, -0.0, 0.0]), float)
    assert np.signbit(signs).tolist() == [False, True, False]
    for values in ([1, 1, 2, 1, 1], [1, 2, 1, 1, 1], [1, 1, 1, 1, 2]):
        assert frozen_column(np.array(values), int).tolist() == values


def test_a_program_is_the_same_with_columns_of_one_row(monkeypatch: pytest.MonkeyPatch) -> None:
    text = "G21 G90 G17 G94\nT1 M6\nS800 M3\nG0 X0 Y0 Z5\nG1 Z-1 F200\nG2 X8 Y0 I4 J0\nG1 X9 Y3\nG0 Z5\nM30\n"
    machine = machine_named("vmc")
    found = []
    for long in (2, 10**9):
        monkeypatch.setattr(path_mode, "LONG", long)
        monkeypatch.setattr(to_work, "ROWS", long)
        commands, _ = read_gcode(text, name="short")
        program, _ = to_work.to_work(commands, machine)
        found.append((commands, program, row_times(program, machine)))
    assert found[0][1].axis.strides[0] == 0 < found[1][1].axis.strides[0]
    for some, whole in zip(found[0], found[1], strict=True):
        assert digest(some) == digest(whole)
