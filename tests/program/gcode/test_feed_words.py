"""Feeds changed in the text: F words and nothing else; read back, the feeds are the wanted ones."""

from __future__ import annotations

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chipload.errors import InputError
from chipload.program.gcode.feed_words import with_feeds
from chipload.program.gcode.reader import read_gcode


def without_f(text: str) -> str:
    return re.sub(r"\s*F=?[0-9.]+", "", text)


@pytest.mark.parametrize(
    ("text", "lines", "said"),
    [
        ("G1 X1 F100", {1: 0.5}, "G1 X1 F50"),
        ("g1x1f100.", {1: 0.5}, "g1x1f50."),
        ("N10 G1 X1 F 100 (F900) ; F800", {1: 1.5}, "N10 G1 X1 F 150 (F900) ; F800"),
        ("F100\nG1 X1\nX2\nX3", {2: 1.0, 3: 2.0, 4: 2.0}, "F100\nG1 X1\nX2 F200\nX3"),
        ("G1 X1 F100\nG0 Z5\nG1 X2\nX3", {1: 2.0, 3: 1.0, 4: 1.0}, "G1 X1 F200\nG0 Z5\nG1 X2 F100\nX3"),
        ("G1 X1 F100\r\nX2\r", {1: 1.0, 2: 0.25}, "G1 X1 F100\r\nX2 F25\r"),
        ('G1 X1 F=100 MSG("F3")', {1: 0.5}, 'G1 X1 F=50 MSG("F3")'),
        ("G93 G1 X1 F4.5\nX2 F3", {1: 0.1, 2: 1.0}, "G93 G1 X1 F0.45\nX2 F3"),
        ("G1 X1 F1000", {1: 1 / 3}, "G1 X1 F333.3"),
        ("G1 X1 F0.03 ", {1: 2 / 3}, "G1 X1 F0.02 "),
        # a Haas counts F30 in ten thousandths of an inch: a feed with a point keeps one, also where F is new
        ("G1 X1 F15.0\nX2\nX3", {1: 2.0, 2: 2.0, 3: 4.0}, "G1 X1 F30.\nX2\nX3 F60."),
        ("G1 X1 F123456", {1: 1.5}, "G1 X1 F185100"),
        ("#<f> = 3\nG1 X1 F100", {2: 0.5}, "#<f> = 3\nG1 X1 F50"),
    ],
)
def test_by_hand(text, lines, said):
    assert with_feeds(text, lines) == said


@pytest.mark.parametrize(
    ("text", "lines", "said"),
    [
        ("G1 X1 F#1", {1: 0.5}, "line 1: F#1: a feed that is calculated cannot be changed: write the number"),
        ("G1 X1 F[2*#1]", {1: 0.5}, "line 1: F[2*#1]: a feed that is calculated"),
        ("G1 X1", {1: 0.5}, "line 1: moves at a feed that no line above it states"),
        ("F1\nG1 X1", {2: 0.0}, "line 2: a feed 0 times the old one: must be above 0"),
        ("F100\nG20 G1 X1", {2: 0.5}, "line 2: moves at a feed that was stated in another unit: state it again here"),
        ("G20 G1 X1 F100\nX2", {1: 1.0, 2: 0.5}, "line 2: moves at a feed that was stated in another unit"),
        ("o100 while [#1 LT 3]", {}, "line 1: o100 while: feeds are changed only in a program without jumps"),
        ("G0 X1\nN5 M98 P7", {}, "line 2: M98: feeds are changed only"),
        ("GOTOF END", {}, "line 1: GOTOF: feeds are changed only"),
    ],
)
def test_what_is_refused(text, lines, said):
    with pytest.raises(InputError, match=re.escape(said)):
        with_feeds(text, lines)


@settings(max_examples=60, deadline=None)
@given(st.data())
def test_read_back(data):
    """Random feeds, words given or modal, both units: positions stay, feeds are the wanted ones, rounded down."""
    n = data.draw(st.integers(2, 12))
    unit = data.draw(st.sampled_from(["G20", "G21"]))
    rows = [f"{unit} G90 G94", f"G1 X0 F{data.draw(st.integers(20, 3000))}"]
    for k in range(1, n):
        word = data.draw(st.sampled_from(["", f" F{data.draw(st.floats(1.0, 5e3)):.2f}", " (F7)"]))
        rows.append(f"{data.draw(st.sampled_from(['G1', 'G0']))} X{k} Y{data.draw(st.integers(0, 9))}{word}")
    text = "\n".join([*rows, "M2", ""])
    before, _ = read_gcode(text)
    moves = before.motion != 0
    factor = {int(k): data.draw(st.floats(0.05, 4.0)) for k in np.unique(before.line[moves])}
    new = with_feeds(text, factor)
    after, _ = read_gcode(new)
    np.testing.assert_array_equal(after.position, before.position)
    np.testing.assert_array_equal(after.motion, before.motion)
    wanted = before.feed[moves] * np.array([factor[int(k)] for k in before.line[moves]])
    assert (after.feed[moves] <= wanted * (1.0 + 1e-9)).all()
    np.testing.assert_allclose(after.feed[moves], wanted, rtol=1.1e-3)
    assert without_f(new).split() == without_f(text).split()
