from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from chipload.errors import InputError
from chipload.machine.axis import LETTERS, Axis
from chipload.machine.chain import Chain
from chipload.machine.kinematics import forward, inverse, with_tip
from chipload.machine.machine import machine_named, machine_names

CHAINS = machine_names()


def random_axes(machine, n, seed):
    """Positions within the limits, endless axes within two turns."""
    rng = np.random.default_rng(seed)
    q = np.zeros((n, 9))
    for axis in machine.chain.axes:
        q[:, axis.column] = rng.uniform(max(axis.low, -13.0), min(axis.high, 13.0), n)
        if not axis.rotary:
            q[:, axis.column] = rng.uniform(axis.low, axis.high, n)
    return q


def rot(letter, degrees):
    return Rotation.from_euler(letter.lower(), degrees, degrees=True).as_matrix()


def linuxcnc_trt(name, joints, offset, tool):
    """World coordinates of the modules as their documentation has them: Q = Rz(-C) (Rt(-tilt) (P - D) + D), where the
    tool's length is added to D_z, and LinuxCNC takes it from the coordinate that it shows."""
    x, y, z, tilt, c = joints
    D = np.add(offset, (0.0, 0.0, tool))
    P = np.array([x, y, z]) - D
    st, ct, sc, cc = np.sin(tilt), np.cos(tilt), np.sin(c), np.cos(c)
    if name == "xyzac-trunnion":
        Q = np.array(
            [
                cc * P[0] + sc * ct * P[1] + sc * st * P[2] + cc * D[0] + sc * D[1],
                -sc * P[0] + cc * ct * P[1] + cc * st * P[2] - sc * D[0] + cc * D[1],
                -st * P[1] + ct * P[2] + D[2],
            ]
        )
        K = np.array([sc * st, cc * st, ct])
    else:
        Q = np.array(
            [
                cc * ct * P[0] + sc * P[1] - cc * st * P[2] + cc * D[0] + sc * D[1],
                -sc * ct * P[0] + cc * P[1] + sc * st * P[2] - sc * D[0] + cc * D[1],
                st * P[0] + ct * P[2] + D[2],
            ]
        )
        K = np.array([-cc * st, sc * st, ct])
    return Q - [0.0, 0.0, tool], K


@pytest.mark.parametrize(
    ("name", "tilt", "offset"), [("xyzac-trunnion", 3, (0, 20, 10)), ("xyzbc-trunnion", 4, (-20, 0, -15))]
)
def test_trunnions_as_linuxcnc_documents_them(name, tilt, offset):
    machine = machine_named(name)
    q = random_axes(machine, 50, 1)
    tip, axis = forward(machine, q, 63.0)
    for k in range(50):
        Q, K = linuxcnc_trt(name, q[k, [0, 1, 2, tilt, 5]], offset, 63.0)
        np.testing.assert_allclose(tip[k], Q, atol=1e-10)
        np.testing.assert_allclose(axis[k], K, atol=1e-14)


def moved(machine, **pivots):
    """The machine with other pivots."""
    axes = tuple(replace(a, pivot=pivots.get(a.letter, a.pivot)) for a in machine.chain.axes)
    return replace(machine, chain=replace(machine.chain, axes=axes))


def tdr(rot, x, z):
    """LinuxCNC's xyzab_tdr_kins: A on the table of B."""
    far = (rot[0] + x, rot[1], rot[2] + z)
    ways = [Axis("A", False, (1, 0, 0), far), Axis("B", False, (0, 1, 0), rot)]
    ways += [Axis(c, True, d) for c, d in (("X", (1, 0, 0)), ("Y", (0, 1, 0)), ("Z", (0, 0, 1)))]
    return replace(machine_named("vmc"), chain=Chain(tuple(ways)))


AC, BC, BRIDGE = (machine_named(name) for name in ("xyzac-trunnion", "xyzbc-trunnion", "xyzbcw-bridge"))
ORIGIN = (0.0, 0.0, 0.0)
#: what the compiled modules of LinuxCNC 2.9 give for X 10 Y 20 Z 30, the letters at the angles given [deg]
OBSERVED = [
    (moved(AC, A=ORIGIN), {"A": 25, "C": 40}, 0, (27.461326220807017, 17.169895912444222, 18.73686837628551)),
    (AC, {"A": 25, "C": 40}, 0, (25.94927227040425, 15.36790018485546, 28.126155740732997)),
    (
        moved(AC, A=(7, 28, 19), C=(7, 8, 9)),
        {"A": 25, "C": 40},
        50,
        (6.898880685837845, 3.2123192134853493, 37.034942399496245 - 50),
    ),
    (moved(BC, B=ORIGIN), {"B": 25, "C": 40}, 0, (10.086141504867685, 17.644868169909238, 31.415416228506494)),
    (moved(BC, B=(20, 0, 10)), {"B": 25, "C": 40}, 0, (14.759033196620214, 13.723846474828315, 23.899973123326003)),
    (
        moved(BC, B=(27, 8, 19), C=(7, 8, 9)),
        {"B": 25, "C": 40},
        50,
        (30.857745898080523, 3.645861688186711, 26.46948585597876 - 50),
    ),
    (BRIDGE, {"B": 25, "C": 40}, 0, (90.93609274176616, 87.91344556854611, 53.423053240837504)),
    (BRIDGE, {"B": 25, "C": 40, "W": 7}, 0, (93.20230333853561, 89.8150220444654, 47.07889873158098)),
    (tdr(ORIGIN, 0, 0), {"A": 25, "B": 40}, 0, (26.944072721785957, 11.130362434462905, 23.454892394564652)),
    (
        tdr((7, 8, 9), -20, -10),
        {"A": 25, "B": 40},
        50,
        (-9.342707351552704, 24.853058931900232, 41.25291748661451 - 50),
    ),
    (tdr(ORIGIN, -20, -10), {"A": 25, "B": 40}, 0, (26.944072721785957, 6.90417981705591, 22.51797026493115)),
]


@pytest.mark.parametrize(("machine", "places", "tool", "world"), OBSERVED)
def test_positions_that_linuxcnc_gives(machine, places, tool, world):
    q = np.zeros((1, 9))
    q[0, :3] = 10.0, 20.0, 30.0
    for letter, value in places.items():
        q[0, LETTERS.index(letter)] = value if letter == "W" else np.radians(value)
    np.testing.assert_allclose(forward(machine, q, tool)[0][0], world, atol=1e-12)


def homogeneous(machine, q, tool, zero):
    """Tip and axis by 4 x 4 matrices, one axis after the other."""
    chain = machine.chain
    T = np.eye(4)
    for axis in chain.axes:
        E, d = np.eye(4), np.array(axis.direction)
        if axis.rotary:
            E[:3, :3] = Rotation.from_rotvec(q[axis.column] * d).as_matrix()
            c = np.array(axis.pivot)
            E[:3, 3] = c - E[:3, :3] @ c
        else:
            E[:3, 3] = q[axis.column] * d
        T = T @ E
    z = np.array(chain.work_z)
    W = np.eye(4)
    W[:3, :3] = np.column_stack([chain.work_x, np.cross(z, chain.work_x), z])
    W[:3, 3] = zero
    T = np.linalg.inv(W) @ T
    s = np.array(chain.spindle)
    return T @ np.append(np.array(chain.nose) - tool * s, 1.0), T @ np.append(s, 0.0)


@pytest.mark.parametrize("name", CHAINS)
def test_forward_against_homogeneous_matrices(name):
    machine = machine_named(name)
    q, tool, zero = random_axes(machine, 40, 2), np.linspace(0.0, 150.0, 40), (7.0, -8.0, 9.0)
    tip, axis = forward(machine, q, tool, zero)
    for k in range(40):
        x, a = homogeneous(machine, q[k], tool[k], zero)
        np.testing.assert_allclose(tip[k], x[:3], atol=1e-9)
        np.testing.assert_allclose(axis[k], a[:3], atol=1e-13)


@pytest.mark.parametrize("name", CHAINS)
def test_there_and_back(name):
    """Both solutions reach the same tip and axis, and one of them is where the axes were."""
    machine = machine_named(name)
    q, tool = random_axes(machine, 500, 3), np.linspace(0.0, 150.0, 500)
    tip, axis = forward(machine, q, tool)
    found = inverse(machine, tip, axis, tool, held=q)
    assert found.miss.max() < 1e-12
    near = np.full(500, np.inf)
    for k in range(found.axes.shape[1]):
        back_tip, back_axis = forward(machine, found.axes[:, k], tool)
        np.testing.assert_allclose(back_tip, tip, atol=1e-9)
        np.testing.assert_allclose(back_axis, axis, atol=1e-12)
        change = found.axes[:, k] - q
        change[:, 3:6] -= 2.0 * np.pi * np.round(change[:, 3:6] / (2.0 * np.pi))
        columns = [a.column for a in machine.chain.axes]
        near = np.minimum(near, np.abs(change[:, columns]).max(axis=1))
    assert near[found.pole > 0.01].max() < 1e-9
    np.testing.assert_allclose(with_tip(machine, q, tip, tool)[:, :3], q[:, :3], atol=1e-9)


def test_two_solutions_differ():
    found = inverse(machine_named("dmu50"), [[1.0, 2.0, 3.0]], [[0.3, 0.4, 0.5]])
    assert np.abs(found.axes[0, 0, 3:6] - found.axes[0, 1, 3:6]).max() > 0.1


def test_iso_841_by_hand():
    """B = +90 deg turns the tool right-handed about +Y: its axis from +Z to +X, so that the tip lies at -X of the
    pivot; C = +90 deg, of the table, then shows the workpiece a tool that has turned from X to Y."""
    machine = machine_named("xyzbc-head-table")  # gauge 200, pivot 200 above the origin
    q = np.zeros((3, 9))
    q[1:, 4] = np.pi / 2
    q[2, 5] = np.pi / 2
    tip, axis = forward(machine, q, 100.0)
    np.testing.assert_allclose(axis, [[0, 0, 1], [1, 0, 0], [0, 1, 0]], atol=1e-15)
    np.testing.assert_allclose(tip, [[0, 0, -100], [-300, 0, 200], [0, -300, 200]], atol=1e-12)


def test_axis_of_the_sectional_paper():
    """T(B) = (sin al cos B, sin al sin B, cos al), al = 90 deg - A."""
    machine = machine_named("horizontal-b")
    B, al = np.radians([0.0, 30.0, 200.0]), np.radians([90.0, 45.0, 20.0])
    q = np.zeros((3, 9))
    q[:, 3], q[:, 4] = np.pi / 2 - al, B
    T = np.column_stack([np.sin(al) * np.cos(B), np.sin(al) * np.sin(B), np.cos(al)])
    np.testing.assert_allclose(forward(machine, q)[1], T, atol=1e-15)
    found = inverse(machine, np.zeros((3, 3)), T, held=q)
    assert found.axes.shape == (3, 1, 9)
    np.testing.assert_allclose(np.mod(found.axes[:, 0, 4], 2 * np.pi), B, atol=1e-12)
    both = inverse(machine, np.zeros((3, 3)), T, free="AB")
    assert np.abs(both.axes[:, :, 3] - q[:, None, 3]).min(axis=1).max() < 1e-12


def test_cradle_of_the_chips_paper():
    """p_W = Rz(-C) Rx(-A) (p_M - (0, 0, 77.5)), 77.5 mm."""
    machine = machine_named("cradle-ac")
    q = random_axes(machine, 20, 4)
    tip, _ = forward(machine, q)
    for k in range(20):
        by_hand = rot("z", -np.degrees(q[k, 5])) @ rot("x", -np.degrees(q[k, 3])) @ (q[k, :3] - [0, 0, 77.5])
        np.testing.assert_allclose(tip[k], by_hand, atol=1e-10)


#: a cradle whose spindle leans towards A: the tool never comes nearer to C than 90 - 53.13 degrees
CRADLE = machine_named("cradle-ac")
LEANING = replace(CRADLE, chain=replace(CRADLE.chain, spindle=(0.6, 0.0, 0.8)))


@pytest.mark.parametrize(
    ("name", "free"),
    [("dmu50", None), ("leaning", None), ("horizontal-b", None), ("vmc", None), ("horizontal-b", "AB")],
)
def test_miss_is_the_angle_to_the_nearest_axis_that_is_reached(name, free):
    machine = LEANING if name == "leaning" else machine_named(name)
    rng = np.random.default_rng(5)
    a = rng.normal(size=(200, 3))
    a /= np.linalg.norm(a, axis=1)[:, None]
    found = inverse(machine, np.zeros((200, 3)), a, free=free)
    turns = np.linspace(-np.pi, np.pi, 721)
    letters = [axis.column for axis in found.free]
    grid = np.zeros((len(turns) ** len(letters), 9))
    if letters:
        grid[:, letters] = np.stack(np.meshgrid(*[turns] * len(letters)), axis=-1).reshape(-1, len(letters))
    reached = forward(machine, grid)[1]
    best = np.array([np.arccos(np.clip(reached @ v, -1.0, 1.0).max()) for v in a])
    np.testing.assert_allclose(found.miss, best, atol=0.01)
    nearest = forward(machine, found.axes[:, 0])[1]
    np.testing.assert_allclose(np.arccos(np.clip((nearest * a).sum(axis=1), -1, 1)), found.miss, atol=1e-7)
    if len(found.free) == 2 and free is None:
        assert (found.miss > 0.1).any()
        assert (found.miss == 0.0).any()


def test_beside_the_pole_no_digits_are_lost():
    """A tilt of 1e-9 rad comes back as that; an arc cosine would return 0."""
    tilt = np.array([1e-9, 1e-7, 1e-5, 1e-3])
    axis = np.column_stack([np.zeros(4), np.sin(tilt), np.cos(tilt)])
    found = inverse(machine_named("xyzac-trunnion"), np.zeros((4, 3)), axis, pole_tolerance=0.0)
    np.testing.assert_allclose(np.abs(found.axes[:, :, 3]), np.column_stack([tilt, tilt]), atol=1e-15)
    np.testing.assert_allclose(found.pole, tilt, atol=1e-15)


def test_at_the_pole_the_angle_is_the_one_held():
    machine = machine_named("cradle-ac")
    held = np.zeros(9)
    held[5] = 1.25
    found = inverse(machine, [[1.0, 2.0, 3.0]], [[0.0, 0.0, 1.0]], held=held)
    assert found.pole.tolist() == [0.0]
    assert found.axes[0, :, 5].tolist() == [1.25, 1.25]
    np.testing.assert_allclose(forward(machine, found.axes[:, 0])[0], [[1.0, 2.0, 3.0]], atol=1e-12)


def test_a_quill_is_held():
    """W out by 7 mm along the tool: the joints stand 7 mm further back along it."""
    held = np.zeros(9)
    held[8] = 7.0
    a = np.array([[0.6, 0.0, 0.8]])
    plain, out = (inverse(BRIDGE, np.zeros((1, 3)), a, held=h).axes[0, 0] for h in (None, held))
    np.testing.assert_allclose(out[:3] - plain[:3], 7.0 * a[0], atol=1e-12)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda m: forward(m, np.zeros((1, 5))),
            "axes (1, 5): must be (n, 9) finite numbers, columns X Y Z A B C U V W",
        ),
        (
            lambda m: forward(m, np.zeros((2, 9)), [1, 2, 3]),
            "tool_length (3,): must be one finite number or one for each of 2 rows",
        ),
        (lambda m: forward(m, np.zeros((2, 9)), 0, [1, 2]), "work_zero [1.0, 2.0]: must be three finite numbers"),
        (
            lambda m: inverse(m, np.zeros((1, 3)), np.zeros((1, 3))),
            "inverse: row 0: axis [0.0, 0.0, 0.0]: must have a length above 0",
        ),
        (
            lambda m: inverse(m, np.zeros((1, 3)), np.ones((1, 3)), free="B"),
            "free = 'B': B is no rotary axis: must be of CAXYZ",
        ),
    ],
)
def test_refused(call, message):
    with pytest.raises(InputError) as err:
        call(machine_named("cradle-ac"))
    assert str(err.value) == message


def test_axes_that_cannot_reach_every_point_are_refused():
    """Z in the head behind B: at B = 90 deg it slides along X."""
    ways = [
        Axis("X", True, (1, 0, 0)),
        Axis("Y", True, (0, 1, 0)),
        Axis("B", True, (0, 1, 0)),
        Axis("Z", True, (0, 0, 1)),
    ]
    machine = replace(machine_named("vmc"), chain=Chain(tuple(ways)))
    with pytest.raises(InputError, match="the axes X, Y, Z lie in one plane"):
        inverse(machine, np.zeros((1, 3)), [[1.0, 0.0, 0.0]])
    spin = Axis("C", True, (0, 0, 1))
    machine = replace(machine, chain=Chain((ways[0], ways[1], Axis("Z", True, (0, 0, 1)), ways[2], spin)))
    with pytest.raises(InputError, match="C turns about the line of the spindle: hold it, or mark it indexed"):
        inverse(machine, np.zeros((1, 3)), [[0.0, 0.6, 0.8]])


@pytest.mark.parametrize(
    ("name", "column", "tip", "axis"),
    [("vmc-a", 3, (1.0, -3.0, 2.0), (0.0, -1.0, 0.0)), ("hmc-b", 4, (3.0, 2.0, -1.0), (1.0, 0.0, 0.0))],
)
def test_a_quarter_turn_of_one_rotary_axis(name, column, tip, axis):
    """By hand: the tool at (1, 2, 3) turns right-handed about +X or +Y, as the workpiece sees it (ISO 841)."""
    axes = np.zeros((1, 9))
    axes[0, :3] = 1.0, 2.0, 3.0
    axes[0, column] = np.pi / 2
    p, direction = forward(machine_named(name), axes, np.zeros(1), np.zeros(3))
    np.testing.assert_allclose(p[0], tip, atol=1e-12)
    np.testing.assert_allclose(direction[0], axis, atol=1e-12)
