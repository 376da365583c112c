"""Tilted working planes of three controllers: the tip and the axis of the tool in the workpiece.

Oracles: rotations by SciPy; the same plane in the words of three controllers, whose angles SciPy computes from one
rotation; the machine's axes, which the kinematics of its own tests take back to the workpiece.
"""

from __future__ import annotations

import math
import warnings

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from chipload.errors import InputError, Severity
from chipload.machine.kinematics import forward
from chipload.machine.machine import machine_named
from chipload.program.commands import ARC
from chipload.program.gcode.reader import read_gcode
from chipload.program.gcode.tools import Tool, ToolTable
from chipload.program.heidenhain.reader import read_heidenhain
from chipload.program.swivel import Swivel
from chipload.program.tilt import Tilt, of_vectors, spatial, tilt_of, turn_matrix
from chipload.program.to_work import axes_of, home, to_work

#: machines with two rotary axes: both in the table, both in the head, one in each
MACHINES = ("xyzac-trunnion", "xyzbc-trunnion", "cradle-ac", "xyzbcw-bridge", "xyzbc-head-table", "dmu50")
ORIGIN = np.array([12.0, -7.0, 3.5])
#: positions in the plane: approach, plunge, slot, end of a half circle, up
PATH = np.array([[5.0, 3.0, 40.0], [5.0, 3.0, -2.0], [25.0, 3.0, -2.0], [25.0, 13.0, -2.0], [25.0, 13.0, 30.0]])


def rotation(lean: float, round_z: float, spin: float) -> Rotation:
    """A plane that leans by an angle towards a direction and is turned about its normal [deg]."""
    return Rotation.from_euler("ZYZ", [round_z, lean, spin], degrees=True)


def numbers(names: str, values) -> str:
    return " ".join(f"{x}{v:.10f}" for x, v in zip(names, values, strict=True))


def fanuc(R: Rotation, head: str = "G68.2", align: str = "G53.1") -> str:
    angles = R.as_euler("ZXZ", degrees=True)
    a, b, c, d, e = (numbers("XYZ", p) for p in PATH)
    return (
        f"%\nO1\nG21 G90 G17 G54\nT1 M6\nS5000 M3\nG0 X0.0 Y0.0 Z300.0\n"
        f"{head} {numbers('XYZ', ORIGIN)} {numbers('IJK', angles)}\n{align}\n"
        f"G0 {a}\nG1 {b} F600.\n{c}\nG3 {d} I0.0 J5.0\nG0 {e}\nG69\nM30\n%\n"
    )


def sinumerik(R: Rotation, mode: int = 57, order: str = "XYZ") -> str:
    angles = R.as_euler(order, degrees=True)
    values = ",".join(f"{v:.10f}" for v in (*ORIGIN, *angles, 0, 0, 0))
    a, b, c, d, e = (numbers("XYZ", p) for p in PATH)
    return (
        f'G71 G90 G17 G54\nT1 M6\nS5000 M3\nG0 X0 Y0 Z300\nCYCLE800(0,"TC1",0,{mode},{values},-1,0)\n'
        f"G0 {a}\nG1 {b} F600\n{c}\nG3 {d} I0 J5\nG0 {e}\nCYCLE800()\nM30\n"
    )


def heidenhain(R: Rotation, how: str = "TURN FMAX") -> str:
    a, b, c = R.as_euler("xyz", degrees=True)
    p = [" ".join(f"{x}{v:+.10f}" for x, v in zip("XYZ", row, strict=True)) for row in PATH]
    shift = "\n".join(f"CYCL DEF 7.{k + 1} {x}{v:+.10f}" for k, (x, v) in enumerate(zip("XYZ", ORIGIN, strict=True)))
    return (
        f"BEGIN PGM T MM\nTOOL CALL 1 Z S5000\nL X+0 Y+0 Z+300 R0 FMAX M3\nCYCL DEF 7.0 DATUM SHIFT\n{shift}\n"
        f"PLANE SPATIAL SPA{a:+.10f} SPB{b:+.10f} SPC{c:+.10f} {how}\n"
        f"L {p[0]} FMAX\nL {p[1]} F600\nL {p[2]}\nCC X+25 Y+8\nC {p[3][: p[3].index(' Z')]} DR+\nL {p[4]} FMAX\n"
        "PLANE RESET STAY\nEND PGM T MM\n"
    )


def read(text: str, dialect: str, machine, **more):
    swivel = Swivel(machine)
    if dialect == "heidenhain":
        return read_heidenhain(text, swivel=swivel, **more)
    return read_gcode(text, dialect=dialect, swivel=swivel, lenient=True, **more)


TEXTS = {"fanuc": fanuc, "sinumerik": sinumerik, "heidenhain": heidenhain}


@pytest.mark.parametrize("dialect", TEXTS)
@pytest.mark.parametrize("name", MACHINES)
@pytest.mark.parametrize("angles", [(40.0, 25.0, -35.0), (20.0, -110.0, 15.0), (48.0, 180.0, 90.0)])
def test_path_in_a_tilted_plane(name, dialect, angles):
    machine, R = machine_named(name), rotation(*angles)
    commands, findings = read(TEXTS[dialect](R), dialect, machine)
    program, more = to_work(commands, machine)
    assert not [f for f in (*findings, *more) if f.severity >= Severity.UNPROVEN]
    cut = program.feed > 0.0
    tips = R.apply(PATH) + ORIGIN
    # the rows from the approach on
    first = int(np.flatnonzero(cut)[0]) - 1
    np.testing.assert_allclose(program.p_work[first : first + 5], tips, atol=1e-6)
    np.testing.assert_allclose(program.axis[first : first + 5], np.tile(R.apply([0.0, 0.0, 1.0]), (5, 1)), atol=1e-7)
    arc = first + 3
    np.testing.assert_allclose(program.centre[arc], R.apply([25.0, 8.0, -2.0]) + ORIGIN, atol=1e-6)
    np.testing.assert_allclose(program.normal[arc], R.apply([0.0, 0.0, 1.0]), atol=1e-7)


@pytest.mark.parametrize("dialect", TEXTS)
@pytest.mark.parametrize("name", MACHINES)
def test_axes_of_the_machine_bring_the_tip_there(name, dialect):
    """What the controller tells the axes leads back to the tip, and while the rotary axes turn X Y Z stand."""
    machine, R = machine_named(name), rotation(35.0, 70.0, 10.0)
    commands, _ = read(TEXTS[dialect](R), dialect, machine)
    axes = axes_of(commands, machine)
    tip, axis = forward(machine, axes)
    cuts = np.flatnonzero(commands.feed > 0.0)
    np.testing.assert_allclose(tip[cuts], R.apply(PATH[1:4]) + ORIGIN, atol=1e-6)
    np.testing.assert_allclose(axis[cuts], np.tile(R.apply([0.0, 0.0, 1.0]), (3, 1)), atol=1e-7)
    turning = np.flatnonzero(np.abs(np.diff(axes[:, 3:6], axis=0)).max(axis=1) > 1e-9)
    assert len(turning) == 1
    np.testing.assert_allclose(axes[turning[0] + 1, :3], axes[turning[0], :3], atol=1e-7)


def test_haas_names_the_same_plane():
    machine, R = machine_named("cradle-ac"), rotation(30.0, 10.0, 0.0)
    one, _ = read(fanuc(R), "fanuc", machine)
    two, _ = read(fanuc(R, "G268", "G253").replace("G69", "G269"), "fanuc", machine)
    np.testing.assert_array_equal(one.machine(), two.machine())


@pytest.mark.parametrize(("mode", "order"), [(27, "ZYX"), (54, "YXZ"), (39, "ZXY")])
def test_order_of_the_turns(mode, order):
    machine, R = machine_named("cradle-ac"), rotation(30.0, 50.0, 20.0)
    one, _ = read(sinumerik(R), "sinumerik", machine)
    two, _ = read(sinumerik(R, mode, order), "sinumerik", machine)
    np.testing.assert_allclose(one.machine(), two.machine(), atol=1e-6)


@pytest.mark.parametrize("how", ["STAY\nL A+Q120 B+Q121 C+Q122 R0 FMAX", "MOVE DIST50 F2000"])
def test_ways_to_turn_the_axes(how):
    machine, R = machine_named("cradle-ac"), rotation(30.0, 50.0, 20.0)
    one = to_work(read(heidenhain(R), "heidenhain", machine)[0], machine)[0]
    how = how.replace("B+Q121 ", "")
    two = to_work(read(heidenhain(R, how), "heidenhain", machine)[0], machine)[0]
    np.testing.assert_allclose(one.p_work[-5:], two.p_work[-5:], atol=1e-6)
    np.testing.assert_allclose(one.axis[-5:], two.axis[-5:], atol=1e-7)


@pytest.mark.parametrize(
    ("words", "R"),
    [
        ("EULER EULPR+30 EULNU+40 EULROT-20", Rotation.from_euler("ZXZ", [30.0, 40.0, -20.0], degrees=True)),
        ("VECTOR BX+1 BY+1 BZ+0 NX+0.3 NY-0.3 NZ+0.9", None),
    ],
)
def test_other_words_for_a_plane(words, R):
    machine = machine_named("cradle-ac")
    text = "BEGIN PGM T MM\nTOOL CALL 1 Z S1\nL X+0 Y+0 Z+90 FMAX\nPLANE {} TURN FMAX\nL X+1 Y+2 Z+3 FMAX\nEND PGM T MM"
    commands, findings = read(text.format(words), "heidenhain", machine)
    if R is None:
        z = np.array([0.3, -0.3, 0.9]) / math.sqrt(0.99)
        x = np.array([1.0, 1.0, 0.0]) / math.sqrt(2.0)
        R = Rotation.from_matrix(np.column_stack([x, np.cross(z, x), z]))
    tip = to_work(commands, machine)[0].p_work[-1]
    np.testing.assert_allclose(tip, R.apply([1.0, 2.0, 3.0]), atol=1e-7)
    assert not [f for f in findings if f.code == "heidenhain-plane"]


@pytest.mark.parametrize("name", MACHINES)
def test_planes_by_the_angles_of_the_rotary_axes(name):
    """The tool stands along Z of the plane; X of the plane is X of a machine whose table turns."""
    machine = machine_named(name)
    one, two = Swivel(machine).numbered()
    at = {one: -25.0, two: 40.0}
    words = " ".join(f"{x}{v:+.1f}" for x, v in sorted(at.items()))
    text = f"BEGIN PGM T MM\nTOOL CALL 1 Z S1\nL X+0 Y+0 Z+90 FMAX\nPLANE AXIAL {words} TURN FMAX\nL X+0 Y+0 Z+0 FMAX\n"
    text += "L X+7 FMAX\nL Z+30 FMAX\nEND PGM T MM"
    commands, findings = read(text, "heidenhain", machine)
    program = to_work(commands, machine)[0]
    assert not [f for f in findings if f.severity >= Severity.UNPROVEN]
    # from 0 along X, then along Z of the plane
    zero, x, z = program.p_work[-3:]
    np.testing.assert_allclose(zero, 0.0, atol=1e-9)
    np.testing.assert_allclose((z - x) / 30.0, program.axis[-1], atol=1e-9)
    if not any(axis.head for axis in machine.chain.rotary):
        axes = axes_of(commands, machine)[-3:]
        np.testing.assert_allclose(axes[1] - axes[0], [7.0, *[0.0] * 8], atol=1e-9)
        np.testing.assert_allclose(axes[2] - axes[1], [0.0, 0.0, 30.0, *[0.0] * 6], atol=1e-9)
    values = f"0,0,0,{at[one]},{at[two]},0,0,0,0"
    text = f'G71 G90 G54\nT1 M6\nG0 X0 Y0 Z90\nCYCLE800(0,"TC1",0,192,{values},-1,0)\nG0 X0 Y0 Z0\nX7\nZ30\nM30'
    same = to_work(read(text, "sinumerik", machine)[0], machine)[0]
    np.testing.assert_allclose(same.p_work[-3:], program.p_work[-3:], atol=1e-9)
    np.testing.assert_allclose(same.axis[-3:], program.axis[-3:], atol=1e-9)


def test_plane_within_a_plane():
    """PLANE RELATIV turns further, about the axes of the plane; cycle 7 shifts along them."""
    machine = machine_named("cradle-ac")
    text = (
        "BEGIN PGM T MM\nTOOL CALL 1 Z S1\nL X+0 Y+0 Z+90 FMAX\nPLANE SPATIAL SPA+20 SPB+0 SPC+30 TURN FMAX\n"
        "PLANE RELATIV SPB+15 TURN FMAX\nCYCL DEF 7.0 DATUM SHIFT\nCYCL DEF 7.1 X+4\nL X+1 Y+2 Z+3 FMAX\nEND PGM T MM"
    )
    R = Rotation.from_euler("ZXY", [30.0, 20.0, 15.0], degrees=True)
    tip = to_work(read(text, "heidenhain", machine)[0], machine)[0].p_work[-1]
    np.testing.assert_allclose(tip, R.apply([5.0, 2.0, 3.0]), atol=1e-7)


def test_length_is_taken_along_the_tilted_tool():
    """G43 behind G53.1: the tip stands at Z of the plane, the spindle's nose the length of the tool behind it."""
    machine, R = machine_named("cradle-ac"), rotation(40.0, 25.0, 0.0)
    table = ToolTable({1: Tool(1, offset=(0.0, 0.0, 80.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))})
    text = fanuc(R).replace("G1 X", "G43 H1 X0.0 Y0.0 Z50.0\nG1 X", 1)
    commands, _ = read(text, "fanuc", machine, tools=table)
    program, _ = to_work(commands, machine)
    cut = np.flatnonzero(program.feed > 0.0)
    np.testing.assert_allclose(program.p_work[cut], R.apply(PATH[1:4]) + ORIGIN, atol=1e-6)
    rows = np.flatnonzero(commands.feed > 0.0)
    nose, axis = forward(machine, axes_of(commands, machine)[rows])
    offset = home(machine, 80.0) - home(machine, 0.0)
    assert np.linalg.norm(offset[:3]) == pytest.approx(80.0)
    np.testing.assert_allclose(nose - 80.0 * axis, R.apply(PATH[1:4]) + ORIGIN, atol=1e-6)


def test_position_behind_the_swivel():
    """X and Y alone behind G53.1: Z of the plane is where turning the axes has brought the tip."""
    machine, R = machine_named("cradle-ac"), Rotation.from_euler("X", 30.0, degrees=True)
    angles = R.as_euler("ZXZ", degrees=True)
    text = f"G21 G90 G54\nT1 M6\nG0 X0. Y0. Z100.\nG68.2 {numbers('IJK', angles)}\nG53.1\nG0 X5. Y6.\nM30"
    program, _ = to_work(read(text, "fanuc", machine)[0], machine)
    # the cradle turns about the work's zero, and the tool stays 100 mm from it
    np.testing.assert_allclose(program.p_work[-1], R.apply([5.0, 6.0, 100.0]), atol=1e-6)


def test_rotary_axes_that_a_program_names_itself():
    """A and C behind G68.2 instead of G53.1: X Y Z of the machine stand while they turn."""
    machine, R = machine_named("cradle-ac"), rotation(35.0, 70.0, 10.0)
    one, _ = read(fanuc(R), "fanuc", machine)
    a, c = np.degrees(one.position[-2, [3, 5]])
    two, _ = read(fanuc(R).replace("G53.1", f"G0 A{a:.10f} C{c:.10f}"), "fanuc", machine)
    np.testing.assert_allclose(axes_of(one, machine), axes_of(two, machine), atol=1e-6)


def test_retraction_before_the_swivel():
    """G28 Z0 to a position that is not known: the axes turn with Z at the end of its travel, not in the workpiece."""
    machine, R = machine_named("cradle-ac"), rotation(40.0, 0.0, 0.0)
    text = fanuc(R).replace("G68.2", "G0 X0. Y0. Z5.\nG91 G28 Z0.\nG90\nG68.2")
    commands, _ = read(text, "fanuc", machine)
    axes = axes_of(commands, machine)
    turning = int(np.flatnonzero(np.abs(np.diff(axes[:, 3:6], axis=0)).max(axis=1) > 1e-9)[0]) + 1
    high = next(axis.high for axis in machine.chain.axes if axis.letter == "Z")
    assert axes[turning, 2] == pytest.approx(high)
    assert axes[turning - 1, 2] == pytest.approx(high)


def test_what_is_refused_or_unproven():
    cradle, vmc = machine_named("cradle-ac"), machine_named("vmc-fanuc")
    _, findings = read(fanuc(rotation(170.0, 0.0, 0.0)), "fanuc", cradle)
    assert [f.line for f in findings if "out of the limits of the rotary axes" in f.text] == [8]
    for dialect, text in TEXTS.items():
        # three axes: nothing is cut, and nothing is proven
        commands, findings = read(text(rotation(30.0, 0.0, 0.0)), dialect, vmc)
        assert not (commands.motion == ARC).any()
        assert any(f.code == "program-no-rotary" for f in findings)
        # a turn about Z needs no rotary axis
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # SciPy: one of two Euler angles about Z is free
            upright = text(rotation(0.0, 30.0, 0.0))
        commands, findings = read(upright, dialect, vmc)
        program, _ = to_work(commands, vmc)
        assert not [f for f in findings if f.severity >= Severity.UNPROVEN]
        want = Rotation.from_euler("Z", 30.0, degrees=True).apply(PATH[1:4]) + ORIGIN
        np.testing.assert_allclose(program.p_work[program.feed > 0.0], want, atol=1e-6)
    # no G53.1: the tool does not stand along the plane
    commands, _ = read(fanuc(rotation(30.0, 0.0, 0.0)).replace("G53.1", ""), "fanuc", cradle)
    _, more = to_work(commands, cradle)
    assert [f.code for f in more] == ["program-tilted-plane"]
    assert "30 deg off its normal" in more[0].text
    # other coordinates within the plane; the same work offset is none
    for word in ("G55", "G52 X1.", "G92 X1. Y0. Z0.", "G68 X0. Y0. R30.", "G10 L2 P1 X5."):
        text = fanuc(rotation(30.0, 0.0, 0.0)).replace("G53.1", f"G53.1\n{word}")
        commands, findings = read(text, "fanuc", cradle)
        assert any(f"{word.split()[0]} within a tilted plane" in f.text for f in findings)
        assert not (commands.motion == ARC).any()
    assert (
        read(fanuc(rotation(30.0, 0.0, 0.0)).replace("G53.1", "G53.1\nG54"), "fanuc", cradle)[0].motion == ARC
    ).any()
    for wrong in ("G68.2 P4", "G68.2 P1 Q122.", "G68.2 P2 Q0.", "G68.2 R5.", "G68.2 P2 Q1."):
        text = fanuc(rotation(30.0, 0.0, 0.0)).replace("G68.2", wrong)
        commands, findings = read(text, "fanuc", cradle)
        assert any("G68.2: " in f.text and f.severity >= Severity.UNPROVEN for f in findings), wrong
        assert not (commands.motion == ARC).any()


@pytest.mark.parametrize("name", ["xyzac-trunnion", "dmu50"])
@pytest.mark.parametrize("how", ["P1", "P1 Q321", "P1 Q213", "P2", "P3"])
def test_other_words_of_a_tilted_plane(name, how):
    """Turns about fixed axes in three orders, three points, two vectors: the angles and points by SciPy."""
    machine, R = machine_named(name), rotation(35.0, 70.0, 10.0)
    x, y, z = (R.apply(np.eye(3)[k]) for k in range(3))
    at = numbers("XYZ", ORIGIN)
    if how == "P2":
        points = (ORIGIN, ORIGIN + 30.0 * x, ORIGIN + 20.0 * y - 7.0 * x)
        words = "\n".join(f"G68.2 P2 Q{k + 1} {numbers('XYZ', p)}" for k, p in enumerate(points))
    elif how == "P3":
        words = f"G68.2 P3 Q1 {at} {numbers('IJK', 2.0 * x)}\nG68.2 P3 Q2 {numbers('IJK', 0.5 * z)}"
    else:
        order = how[4:] or "123"
        axes = ["XYZ"[int(k) - 1] for k in order]
        angles = dict(zip(axes, R.as_euler("".join(axes).lower(), degrees=True), strict=True))
        words = f"G68.2 {how} {at} {numbers('IJK', [angles[axis] for axis in 'XYZ'])}"
    text = "\n".join(words if line.startswith("G68.2") else line for line in fanuc(R).split("\n"))
    commands, findings = read(text, "fanuc", machine)
    program, more = to_work(commands, machine)
    assert not [f for f in (*findings, *more) if f.severity >= Severity.UNPROVEN]
    first = int(np.flatnonzero(program.feed > 0.0)[0]) - 1
    np.testing.assert_allclose(program.p_work[first : first + 5], R.apply(PATH) + ORIGIN, atol=1e-6)
    np.testing.assert_allclose(program.axis[first + 1], z, atol=1e-7)


def test_rotations():
    rng = np.random.default_rng(5)
    for a, b, c in rng.uniform(-180.0, 180.0, (50, 3)):
        for order in ("zxz", "xyz", "zyx", "yxz"):
            want = Rotation.from_euler(order.upper(), [a, b, c], degrees=True).as_matrix()
            np.testing.assert_allclose(turn_matrix(order, (a, b, c)), want, atol=1e-12)
        np.testing.assert_allclose(
            spatial(a, b, c), Rotation.from_euler("xyz", [a, b, c], degrees=True).as_matrix(), atol=1e-12
        )
    for bad in ((1.0,) * 9, (*np.diag([1.0, 1.0, -1.0]).ravel(),), (math.nan,) * 9):
        with pytest.raises(InputError, match="tilt"):
            Tilt(tuple(float(x) for x in bad))
    with pytest.raises(InputError, match="normal has no length"):
        of_vectors(np.array([1.0, 0.0, 0.0]), np.zeros(3))
    tilt = tilt_of(turn_matrix("xyz", (10.0, 20.0, 30.0)), (1.0, 2.0, 3.0))
    p = rng.normal(size=(4, 3))
    np.testing.assert_allclose(tilt.from_offset(tilt.to_offset(p)), p, atol=1e-12)
