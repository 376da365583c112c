"""Frames and rows of Commands by hand."""

import math

import numpy as np
import pytest

from chipload.errors import InputError
from chipload.machine.machine import machine_named
from chipload.program.commands import (
    ARC,
    LINE,
    RAPID,
    YZ,
    Commands,
    Frame,
    chord_arcs,
    commands_from_rows,
    extents,
    starts,
)
from chipload.program.gcode.reader import read_gcode
from chipload.program.gcode.writer import write_commands
from chipload.program.release import NOT_SIMULATED
from chipload.program.to_work import to_work

SHIFTED = Frame(
    2, [100.0, 20, 5, 0.1, 0, 0, 1, 0, 0], math.pi / 2, [1.0, 2, 3, 0, 0, 0.5, 0, 0, 0], [0, 0, 50.0, *[0] * 6]
)


def nine(*xyz):
    return [*xyz, *[0.0] * (9 - len(xyz))]


OWN = (Frame(),)


def commands(rows, frames=OWN):
    """Rows (motion, position, frame) with what else they need."""
    full = [(m, p, 0, (0.0, 0.0), 0, 0.0 if m == RAPID else 5.0, 100.0, 1, False, f, k + 1, 0) for k, (m, p, f) in
            enumerate(rows)]  # fmt: skip
    return commands_from_rows(full, frames, ("x",))


def test_a_frame_by_hand():
    """(10, 0, 0) shifted to (11, 2, 3), turned to (-2, 11, 3), then by the offset and the tool's length."""
    got = SHIFTED.to_machine(np.array([nine(10.0)]))
    np.testing.assert_allclose(got, [[98, 31, 58, 0.1, 0, 0.5, 1, 0, 0]], atol=1e-12)


def test_a_frame_there_and_back():
    p = np.random.default_rng(0).normal(scale=50, size=(40, 9))
    np.testing.assert_allclose(SHIFTED.from_machine(SHIFTED.to_machine(p)), p, atol=1e-12)
    assert (SHIFTED.to_machine(p) != p).any(axis=0).sum() >= 6


def test_a_row_starts_where_the_machine_stands():
    c = commands([(RAPID, nine(98.0, 31, 58, 0.1, 0, 0.5, 1), 0), (LINE, nine(20.0), 1)], (Frame(), SHIFTED))
    np.testing.assert_allclose(starts(c)[1], nine(10.0), atol=1e-12)
    assert extents(c)[1] == pytest.approx(10.0)


def test_what_a_feed_is_counted_along():
    c = commands(
        [(RAPID, nine(), 0), (LINE, [3, 4, 0, 9, 9, 9, 9, 9, 9], 0), (LINE, [3, 4, 0, 9, 9, 12, 9, 9, 11], 0),
         (LINE, [3, 4, 0, 9, 12, 16, 9, 9, 11], 0)]
    )  # fmt: skip
    np.testing.assert_allclose(extents(c), [0, 5, 2, 5])


def test_chords_of_an_arc_in_another_plane():
    """A quarter in YZ about (0, 0) with a rise of 2 along X and A turning by 1: points on the helix."""
    rows = [
        (RAPID, nine(0.0, 10, 0), 0, (0, 0), 0, 0, 1, 1, False, 0, 1, 0),
        (ARC, nine(2.0, 0, 10, 1.0), YZ, (0, 0), 1, 5, 1, 1, False, 0, 2, 0),
    ]
    c = chord_arcs(commands_from_rows(rows, (Frame(),), ("x",)), np.array([False, True]), 0.01)
    u = np.arange(1, len(c)) / (len(c) - 1)
    a = 0.5 * math.pi * u
    np.testing.assert_allclose(
        c.position[1:, :4], np.column_stack([2 * u, 10 * np.cos(a), 10 * np.sin(a), u]), atol=1e-9
    )
    assert 10 * (1 - math.cos(0.25 * math.pi / (len(c) - 1))) <= 0.01
    assert set(c.motion[1:]) == {LINE}


def test_an_arc_whose_radii_differ_is_a_spiral():
    """The half circle about (0, 0) from 5 to -5.002, as LinuxCNC takes it: the radius grows evenly with the angle."""
    text = "G21 G90 G94 G17\nG0 X5 Y0 Z0\nG3 X-5.002 Y0 I-5 J0 F600\nM2\n"
    program = to_work(read_gcode(text)[0], machine_named("vmc"))[0]
    chords = program.p_work[program.line == 3][:, :2]
    a = np.linspace(0.0, math.pi, len(chords) + 1)[1:]
    r = 5.0 + 0.002 * a / math.pi
    np.testing.assert_allclose(chords, np.column_stack([r * np.cos(a), r * np.sin(a)]), atol=1e-9)
    assert 5.0 * (1.0 - math.cos(0.5 * math.pi / len(chords))) <= 1e-3
    even = to_work(read_gcode(text.replace("5.002", "5.0005"))[0], machine_named("vmc"))[0]
    assert (even.line == 3).sum() == 1


def test_a_shift_is_written_into_the_coordinates():
    """What G92 did is in the numbers, so that the axes go to the same places without it."""
    frame = Frame(2, nine(), 0.0, nine(1.0, 2, 3))
    c = commands([(RAPID, nine(10.0, 0, 5), 0), (LINE, nine(20.0, 0, 0), 0)], (frame,))
    text = write_commands(c, machine_named("vmc"), title="t", release=NOT_SIMULATED)
    assert "\nG55\n" in text
    read, _ = read_gcode(text)
    np.testing.assert_allclose(read.machine()[-1], c.machine()[-1], atol=1e-9)
    assert read.frames[read.frame[-1]].number == 2


@pytest.mark.parametrize("tcp", [True, False])
def test_the_feed_of_a_turn_alone(tcp):
    """0.5 rad/s about A: 1718.9 deg/min with tip control, else the time of 0.2 rad: 150 times a minute."""
    rows = [
        (RAPID, nine(1.0, 2, 3), 0, (0, 0), 0, 0, 10.0, 1, tcp, 0, 1, 0),
        (LINE, nine(1.0, 2, 3, 0.2), 0, (0, 0), 0, 0.5, 10.0, 1, tcp, 0, 2, 0),
    ]
    c = commands_from_rows(rows, (Frame(),), ("x",))
    text = write_commands(c, machine_named("xyzac-trunnion"), title="t", release=NOT_SIMULATED)
    assert ("F1718.873" if tcp else "G93 A11.459156 F150") in text
    read, _ = read_gcode(text)
    assert read.feed[-1] == pytest.approx(0.5, rel=1e-6)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"frame": [5]}, "commands.frame = 5..5: must be from 0 to 0"),
        ({"motion": [9]}, "commands.motion = 9..9: must be from 0 to 4"),
        ({"position": [[1.0, 2.0]]}, "commands.position: shape (1, 2): must be (1, 9)"),
        ({"feed": [math.nan]}, "commands.feed: a value is not a finite number"),
    ],
)
def test_refused(change, text):
    columns = {"motion": [0], "position": [nine()], "plane": [0], "centre": [[0, 0]], "turns": [0], "feed": [0]}
    columns |= {"spindle": [0], "tool": [0], "tcp": [False], "frame": [0], "line": [0], "label": [0]}
    with pytest.raises(InputError) as err:
        Commands(**{**columns, **change}, frames=(Frame(),), labels=("x",))
    assert str(err.value) == text


def test_a_turn_beside_a_way_of_nearly_nothing_takes_its_time():
    """0.2 rad in 0.4 s beside 0.02 µm: LinuxCNC takes at least 0.1 mm/min along X and would turn 33 times too fast."""
    rows = [
        (RAPID, nine(1.0, 2, 3), 0, (0, 0), 0, 0, 10.0, 1, False, 0, 1, 0),
        (LINE, nine(1.00002, 2, 3, 0.2), 0, (0, 0), 0, 2e-5 / 0.4, 10.0, 1, False, 0, 2, 0),
        (LINE, nine(2.0, 2, 3, 0.4), 0, (0, 0), 0, 1.0 / 0.4, 10.0, 1, False, 0, 3, 0),
    ]
    c = commands_from_rows(rows, (Frame(),), ("x",))
    text = write_commands(c, machine_named("xyzac-trunnion"), title="t", release=NOT_SIMULATED)
    assert "G93 A11.459156 F150\n" in text
    read, _ = read_gcode(text)
    assert read.feed[-2:].tolist() == pytest.approx([0.5, 2.5], rel=1e-4)
