"""LinuxCNC's interpreter reads what we write, and understands it as we meant it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from chipload.geometry.contour import Contour
from chipload.machine.machine import machine_named
from chipload.program.build import dwell, follow, helix, plunge, rapid, rows
from chipload.program.gcode.writer import write_gcode
from chipload.program.program import ARC_CCW, ARC_CW, LINE, RAPID, Program
from chipload.program.release import NOT_SIMULATED, Release
from rs274 import MISSING, Refused, assert_same_motions, canonical, rs274_installed, run_rs274

pytestmark = pytest.mark.skipif(not rs274_installed(), reason=MISSING)
LINUXCNC, FANUC = machine_named("vmc"), machine_named("vmc-fanuc")


def written(program, machine=LINUXCNC):
    return write_gcode(program, machine, title="test", release=NOT_SIMULATED)


def random_program(rng, n, *, step=1.0):
    """Lines, arcs of any sweep, full turns and helices one after the other; radii and steps over six decades."""
    motion, points, centres, feeds = [RAPID], [rng.uniform(-50, 50, 3)], [np.zeros(2)], [0.0]
    for _ in range(n):
        p = points[-1]
        kind = rng.integers(0, 5)
        size = step * 10.0 ** rng.uniform(-4, 2)
        if kind >= 2:
            size = max(size, 2e-3)
        end, centre = p + size * rng.normal(size=3), np.zeros(2)
        if kind >= 2:
            a, r = rng.uniform(0, math.tau), size
            centre = p[:2] - r * np.array([math.cos(a), math.sin(a)])
            sweep = math.tau if kind == 4 else rng.uniform(1e-4, 1.0) ** 2 * math.tau
            turn = sweep if kind == 3 else -sweep
            xy = p[:2] if kind == 4 else centre + r * np.array([math.cos(a + turn), math.sin(a + turn)])
            end = np.array([*xy, p[2] + rng.choice([0.0, 1.0]) * 0.1 * size])
            motion.append(ARC_CCW if kind == 3 else ARC_CW)
        else:
            motion.append(LINE if kind == 0 else RAPID)
        points.append(end)
        centres.append(centre)
        feeds.append(0.0 if motion[-1] == RAPID else 10.0 ** rng.uniform(-1, 2))
    return rows(motion, np.array(points), np.array(centres), feeds, 800.0, 7, "cut")


def kept(program, decimals=6):
    """Rows that do not round to nothing."""
    q = np.round(program.p_work, decimals)
    moves = np.any(q[1:] != q[:-1], axis=1)
    same = np.hypot(*np.diff(program.p_work[:, :2], axis=0).T) <= 1e-7
    full = (program.motion[1:] >= ARC_CW) & same
    return np.concatenate([[True], moves | full])


@pytest.mark.parametrize("seed", range(4))
def test_random_program_is_understood(seed):
    program = random_program(np.random.default_rng(seed), 1500)
    left = assert_same_motions(run_rs274(written(program)), program)
    assert left == np.count_nonzero(~kept(program)) <= 2


def test_tiny_motions_never_become_turns():
    """Steps of ten nanometres to ten micrometres: dropped or straight, and no arc that was not there."""
    program = random_program(np.random.default_rng(11), 1500, step=1e-4)
    keep = kept(program)
    seen = run_rs274(written(program))[1:]
    assert 50 < np.count_nonzero(~keep) < 1000
    assert len(seen) == np.count_nonzero(keep)
    for k, got in zip(np.flatnonzero(keep), seen, strict=True):
        assert np.abs(np.array(got.end) - program.p_work[k]).max() <= 1e-4
        if got.kind == "arc":
            assert got.turns == (1 if program.motion[k] == ARC_CCW else -1)
            assert np.abs(np.array(got.centre) - program.centre[k, :2]).max() <= 1e-4
        else:
            assert (got.kind == "traverse") == (program.motion[k] == RAPID)


@pytest.mark.parametrize("radius", [2e-7, 1e-5, 1e-3, 1.29e-3])
@pytest.mark.parametrize("turn", [math.tau, 3.0, -5.0])
def test_arcs_too_small_for_linuxcnc_are_chords(radius, turn):
    p0 = np.array([20.0, -3.0, 0.0])
    c = p0[:2] - (radius, 0.0)
    end = p0 if turn == math.tau else np.array([*(c + radius * np.array([math.cos(turn), math.sin(turn)])), 0.0])
    motion = [RAPID, ARC_CCW if turn > 0 else ARC_CW, RAPID]
    program = rows(motion, [p0, end, [90, 0, 0]], c, [0, 5.0, 0], 100.0, 1, "cut")
    seen = [m for m in run_rs274(written(program)) if m.kind != "traverse"]
    assert all(m.kind == "feed" for m in seen)
    assert len(seen) == {2e-7: 0, 1e-3: math.ceil(abs(turn) / (math.pi / 4)), 1e-5: len(seen)}.get(radius, len(seen))
    off = [abs(math.hypot(*(m.end[:2] - c)) - radius) for m in seen]
    assert max(off, default=0.0) < 1e-4


def test_fanuc_text_with_four_decimals():
    program = random_program(np.random.default_rng(5), 800)
    lines = written(program, FANUC).splitlines()
    assert lines[0] == lines[-1] == "%"
    assert lines[1] == "O0001 (NOT VERIFIED: NO SIMULATION HAS CHECKED THIS PROGRAM)"
    text = "\n".join(lines[2:-1]) + "\n"
    spun = Program(
        **{
            **{name: getattr(program, name) for name in program.__dataclass_fields__},
            "spindle": np.full(len(program), round(800.0 * 60 / math.tau) * math.tau / 60),
        }
    )
    assert_same_motions(run_rs274(text), spun, mm=2e-4, unit=1e-4)


coordinate = st.one_of(
    st.floats(-100, 100, allow_nan=False),
    st.integers(-100, 100).map(float),
    st.floats(-1e-5, 1e-5, allow_nan=False),
)


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow], derandomize=True)
@given(
    st.lists(
        st.tuples(st.integers(0, 3), coordinate, coordinate, coordinate, st.floats(-7, 7)), min_size=1, max_size=30
    )
)
def test_any_program_is_understood(moves):
    p = [np.zeros(3)]
    motion, centres = [RAPID], [np.zeros(2)]
    for kind, x, y, z, turn in moves:
        before = p[-1]
        v = before[:2] - (x, y)
        if kind >= 2 and np.hypot(*v) > 2e-3 and 1e-9 < abs(turn) < math.tau:
            c, s = math.cos(turn), math.sin(turn)
            motion.append(ARC_CCW if turn > 0 else ARC_CW)
            centres.append(np.array([x, y]))
            p.append(np.array([x + c * v[0] - s * v[1], y + s * v[0] + c * v[1], z if kind == 3 else before[2]]))
        else:
            motion.append(RAPID if kind == 0 else LINE)
            centres.append(np.zeros(2))
            p.append(np.array([x, y, z]))
    feed = [0.0 if m == RAPID else 10.0 for m in motion]
    program = rows(motion, np.array(p), np.array(centres), feed, 500.0, 1, "cut")
    assert_same_motions(run_rs274(written(program)), program)


def test_contour_helix_dwell_and_change_of_tool():
    pocket = Contour.from_bulges([[0, 0], [30, 0], [30, 20], [0, 20]], [0.2, -0.3, 0.0, 0.4], closed=True)
    circle = Contour.circle((50.0, 10.0), 8.0, -1)
    parts = [
        rapid([[*pocket.start, 10.0], [*pocket.start, 1.0]], 900.0, 3, "link"),
        plunge([*pocket.start, -2.0], 2.0, 900.0, 3, "entry"),
        follow(pocket, -2.0, ([0.0, 13.0, 60.0], [10.0, 5.0, 7.5]), 900.0, 3, "finish"),
        dwell([*pocket.end, -2.0], 0.25, 900.0, 3, "finish"),
        rapid([*pocket.end, 10.0], 900.0, 3, "link"),
        rapid([58.0, 10.0, 10.0], -400.0, 12, "link"),
        helix((58.0, 10.0), (50.0, 10.0), (10.0, -1.0), 3.0, 4.0, -400.0, 12, "entry"),
        follow(circle, (-1.0, -2.0), 9.0, -400.0, 12, "ramp"),
        rapid([58.0, 10.0, 10.0], 0.0, 12, "link"),
    ]
    program = Program.join(parts)
    assert assert_same_motions(run_rs274(written(program)), program) == 0


def test_the_reader_does_refuse():
    """The oracle can say no: an arc whose end is off its circle by 0.1 mm."""
    good = written(rows([RAPID, ARC_CCW], [[0, 0, 0], [0, 10, 0]], [[0, 0], [0, 5]], [0, 5.0], 100.0, 1, "cut"))
    assert len(run_rs274(good)) == 3
    with pytest.raises(Refused, match="Radius to end of arc differs"):
        run_rs274(good.replace("Y10", "Y10.1"))


@pytest.mark.parametrize(
    "text", ["MSG, move", "debug, #5", "a (b) c", "print,x", "%", "naïve\nM30", "LOGOPEN,x", "py,1"]
)
def test_comments_do_nothing(text):
    program = rows([RAPID, LINE], [[0, 0, 0], [5, 0, 0]], (0, 0), [0, 5.0], 100.0, 1, text)
    out = write_gcode(program, LINUXCNC, title=text, release=Release(""), comments=(text, "x" * 500))
    assert assert_same_motions(run_rs274(out), program) == 0
    plain = written(rows([RAPID, LINE], [[0, 0, 0], [5, 0, 0]], (0, 0), [0, 5.0], 100.0, 1, "cut"))
    acts = [name for name, _ in canonical(out) if name != "COMMENT"]
    assert acts == [name for name, _ in canonical(plain) if name != "COMMENT"]
    assert out.splitlines()[0] == "(chipload: verified by independent simulation)"
