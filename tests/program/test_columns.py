"""Columns of a program that nobody can change are kept as they are; those that somebody can are copied."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from chipload.program.build import plunge, rapid
from chipload.program.path_mode import frozen_column
from chipload.program.program import Program


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
