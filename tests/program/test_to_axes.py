"""Programs to the axes of machines and back; feeds as times; what is refused."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from chipload.errors import InputError
from chipload.machine.kinematics import forward
from chipload.machine.machine import machine_named, machine_names
from chipload.program.build import rapid, rows
from chipload.program.commands import Commands, Frame
from chipload.program.motions import lengths, spans
from chipload.program.program import ARC_CCW, ARC_CW, LINE, RAPID, Program
from chipload.program.to_axes import to_axes
from chipload.program.to_work import to_work

FIVE = [name for name in machine_names() if len(machine_named(name).chain.free()) == 2]


def program(points, axes, motion=None, tool=None, feed=10.0, normal=(0.0, 0.0, 1.0)):
    n = len(points)
    motion = np.array([RAPID] + [LINE] * (n - 1)) if motion is None else np.array(motion)
    axes = np.asarray(axes, dtype=float)
    return Program(
        motion=motion,
        p_work=points,
        axis=axes / np.linalg.norm(axes, axis=1)[:, None],
        centre=np.zeros((n, 3)),
        normal=np.tile(normal, (n, 1)),
        turns=np.zeros(n),
        feed=np.where(motion == RAPID, 0.0, feed),
        spindle=np.full(n, 300.0),
        tool=np.ones(n) if tool is None else tool,
        line=np.arange(1, n + 1),
        label=np.zeros(n),
        labels=("cut",),
    )


def wandering(seed, n=25):
    """Tips and axes at random; with an odd seed a second tool from row 12 on."""
    rng = np.random.default_rng(seed)
    points = np.cumsum(rng.normal(scale=4.0, size=(n, 3)), axis=0)
    tilt = np.radians(rng.uniform(5, 40, n))
    turn = np.cumsum(rng.normal(scale=0.4, size=n))
    axes = np.column_stack([np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), np.cos(tilt)])
    motion, tool = np.full(n, LINE), np.ones(n, dtype=int)
    motion[0] = RAPID
    if seed % 2:
        motion[12], tool[12:] = RAPID, 2
    return program(points, axes, motion, tool)


@pytest.mark.parametrize("tcp", [False, True])
@pytest.mark.parametrize("name", FIVE)
@pytest.mark.parametrize("seed", [0, 1])
def test_there_and_back(name, tcp, seed):
    """The ends of all rows to 1e-9, every piece near its line, the same time for each row."""
    machine, meant = machine_named(name), wandering(seed)
    tools = {1: 50.0, 2: 80.0}
    commands, _ = to_axes(meant, machine, tool_lengths=tools, tcp=tcp)
    back, _ = to_work(commands, machine)
    last = np.flatnonzero(np.append(np.diff(back.line) != 0, True))
    assert back.line[last].tolist() == meant.line.tolist()
    np.testing.assert_allclose(back.p_work[last], meant.p_work, atol=1e-9)
    np.testing.assert_allclose(back.axis[last], meant.axis, atol=1e-9)
    assert (back.tool[last] == meant.tool).all()
    if tcp:
        assert len(back) == len(meant)
    for k in range(1, len(meant)):
        piece = back.p_work[back.line == k + 1]
        a, b = meant.p_work[k - 1], meant.p_work[k]
        if meant.tool[k] != meant.tool[k - 1]:
            assert len(piece) == 1
            continue
        away = np.linalg.norm(np.cross(piece - a, (b - a) / np.linalg.norm(b - a)), axis=1)
        assert away.max() <= 2.1e-3
    cuts = back.motion == LINE
    time = np.where(cuts, spans(back) / np.where(cuts, back.feed, 1.0), 0.0)
    for k in np.flatnonzero(meant.motion == LINE):
        assert time[back.line == k + 1].sum() == pytest.approx(lengths(meant)[k] / 10.0, rel=2e-3)


@pytest.mark.parametrize("name", FIVE)
def test_the_axes_themselves(name):
    """What forward says of the commanded axes is the program's tip, without to_work."""
    machine, meant = machine_named(name), wandering(0)
    commands, _ = to_axes(meant, machine, tool_lengths={1: 30.0})
    last = np.flatnonzero(np.append(np.diff(commands.line) != 0, True))
    tip, axis = forward(machine, commands.machine()[last], 30.0)
    np.testing.assert_allclose(tip, meant.p_work, atol=1e-9)
    np.testing.assert_allclose(axis, meant.axis, atol=1e-9)


@pytest.mark.parametrize("name", FIVE)
def test_arcs_of_a_tilted_plane(name):
    """Three plus two: an arc about the tool's axis stays an arc where X Y Z see it in a plane of theirs."""
    machine = machine_named(name)
    turn = Rotation.from_euler("zx", [20, 30], degrees=True)
    tilt = turn.apply([0.0, 0.0, 1.0])
    points = turn.apply([[5, 0, 0], [5, 0, 0], [0, 5, 0], [-5, 0, 2]])
    meant = program(points, [tilt] * 4, [RAPID, LINE, ARC_CCW, ARC_CW], normal=tilt)
    commands, _ = to_axes(meant, machine)
    back, _ = to_work(commands, machine)
    np.testing.assert_allclose(lengths(back).sum(), lengths(meant).sum(), rtol=1e-4)
    if all(not axis.head for axis in machine.chain.rotary):
        assert back.motion.tolist() == meant.motion.tolist()
        np.testing.assert_allclose(np.abs((back.normal[2:] * tilt).sum(axis=1)), 1.0, atol=1e-12)
    np.testing.assert_allclose(back.p_work[-1], meant.p_work[-1], atol=1e-9)


def test_whole_turns_become_rows():
    p = Program.join([rapid([5, 0, 0], 1.0, 1, "x"), rows([ARC_CCW], [[0, 5, -9]], (0, 0), 5.0, 1.0, 1, "x")])
    p = replace(p, turns=np.array([0, 2]))
    commands, _ = to_axes(p, machine_named("vmc"))
    assert commands.turns.tolist() == [0, 1, 1, 1]
    # 810 degrees in three parts of 270
    np.testing.assert_allclose(commands.position[1:, :3], [[0, -5, -3], [-5, 0, -6], [0, 5, -9]], atol=1e-12)


def test_three_axes_offsets():
    """Rows of a second work offset, of a shift and of a turned one, in the frame of the first, by hand."""
    frames = (
        Frame(1, np.array([100.0, 50, 0, 0, 0, 0, 0, 0, 0]), 0.0),
        Frame(2, np.array([110.0, 50, -5, 0, 0, 0, 0, 0, 0]), math.pi / 2),
        Frame(1, np.array([100.0, 50, 0, 0, 0, 0, 0, 0, 0]), 0.0, np.array([0, 3.0, 0, 0, 0, 0, 0, 0, 0])),
    )
    position = np.zeros((3, 9))
    position[:, 0] = 4.0
    commands = Commands(
        [0, 1, 1], position, [0] * 3, np.zeros((3, 2)), [0] * 3, [0, 5, 5], [1] * 3, [1] * 3, [False] * 3, [0, 1, 2],
        [1, 2, 3], [0] * 3, frames, ("x",),
    )  # fmt: skip
    back, _ = to_work(commands, machine_named("vmc"))
    np.testing.assert_allclose(back.p_work, [[4, 0, 0], [10, 4, -5], [4, 3, 0]], atol=1e-12)


@pytest.mark.parametrize(
    ("letter", "text"),
    [(3, "line 2: A moves: machine vmc has the axes XYZ"), (6, "line 2: U moves: machine vmc has the axes XYZ")],
)
def test_an_axis_that_is_not_there(letter, text):
    position = np.zeros((2, 9))
    position[1, letter] = 1.0
    commands = Commands(
        [0, 1], position, [0] * 2, np.zeros((2, 2)), [0] * 2, [0, 5], [1] * 2, [1] * 2, [False] * 2, [0] * 2, [1, 2],
        [0] * 2, (Frame(),), ("x",),
    )  # fmt: skip
    with pytest.raises(InputError, match=f"^{text}$"):
        to_work(commands, machine_named("vmc"))


@pytest.mark.parametrize(("far", "code"), [(500.0, "machine-offset"), (1400.0, "machine-limit")])
@pytest.mark.parametrize("other", [False, True])
def test_an_index_table_is_not_turned_over_to_stay_within_the_travels(far, code, other):
    """A part beyond the travels is a finding; its second solution, A and B the other way, is no way out of a cut."""
    machine = machine_named("horizontal-b")
    if other:
        # both solutions are within the limits of A
        chain = machine.chain
        wide = [replace(a, low=-math.pi / 2, high=math.pi / 2) if a.letter == "A" else a for a in chain.axes]
        machine = replace(machine, chain=replace(chain, axes=tuple(wide)))
    a = math.radians(55.0)
    axes = [[math.sin(a) * math.cos(b), math.sin(a) * math.sin(b), math.cos(a)] for b in np.linspace(0.0, 3.0, 40)]
    points = far * np.array([[x, y, 0.0] for x, y, _ in axes])
    points[:8] *= -0.5
    commands, findings = to_axes(program(points, axes), machine)
    tilt = np.degrees(commands.machine()[:, 3])
    assert np.ptp(tilt) < 1e-9
    assert abs(tilt[0]) == pytest.approx(35.0)
    assert {f.code for f in findings} == {code}


def test_an_index_table_stands_in_a_cut():
    machine = machine_named("horizontal-b")
    axes = [
        [math.sin(a) * math.cos(b), math.sin(a) * math.sin(b), math.cos(a)]
        for a, b in np.radians([[60, 0], [45, 10], [45, 80]])
    ]
    points = [[0, 0, 0], [10, 0, 0], [20, 5, 0]]
    with pytest.raises(InputError, match=r"^program row 1: A of machine horizontal-b would move in a cut"):
        to_axes(program(points, axes), machine)
    meant = program(points, axes, [RAPID, RAPID, LINE])
    commands, findings = to_axes(meant, machine)
    assert {f.code for f in findings} <= {"machine-offset"}
    assert np.degrees(commands.machine()[:, 3]).round(9).tolist()[-1] == 45.0
    back, _ = to_work(commands, machine)
    last = np.flatnonzero(np.append(np.diff(back.line) != 0, True))
    np.testing.assert_allclose(back.p_work[last], meant.p_work, atol=1e-9)
    np.testing.assert_allclose(back.axis[last], meant.axis, atol=1e-9)
