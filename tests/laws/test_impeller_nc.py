"""Every motion of a written impeller program: by the machine's chain against the CL path, and as LinuxCNC reads it.

Our own reading here is a few regular expressions: neither the writer nor the reader of programs is used.
"""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from tests.rs274 import MISSING, canonical, rs274_installed

from chipload.cutter.catalogue import Catalogue, CatalogueCutter
from chipload.cutter.cutter import Cutter
from chipload.jobs.impeller.channels import channel_repeat
from chipload.machine.kinematics import forward
from chipload.machine.machine import machine_named
from chipload.planning.impeller.lines import LineMotion
from chipload.planning.impeller.links import Link, link_tracks
from chipload.planning.impeller.parametric import ImpellerShape, impeller_of
from chipload.planning.impeller.paths import PatchFinish, finish_tracks
from chipload.planning.impeller.programs import pallet_rate, program_of
from chipload.planning.impeller.rough_settings import rough_channels
from chipload.planning.impeller.roughing import RoughingSettings
from chipload.planning.impeller.tables import index_table
from chipload.program.gcode.writer import write_gcode
from chipload.program.program import RAPID
from chipload.program.read import read_program
from chipload.program.read_back import text_findings
from chipload.program.release import NOT_SIMULATED

MACHINE = machine_named("horizontal-b")
CUTTER = CatalogueCutter(12.0, 2.0, cutting_length=45.0, reach=60.0, holder_diameter=30.0)
RATE = pallet_rate(MACHINE)


@pytest.fixture(scope="module")
def impeller():
    return impeller_of(ImpellerShape())


def finished(impeller):
    scene = impeller.scene(0, "plus", ([0.5], [0.5]), (90, 40), near=1.5, around=0, hub_points=(40, 12))
    table = math.radians(55.0)
    tracks = finish_tracks(
        impeller.blade.plus, "u", ((0.3, 0.45), (0.5, 0.6)), scene, 0, CUTTER, table,
        PatchFinish(0.1, LineMotion(0.005, 100.0 / 60.0, RATE, 0.5), 1.0), workers=2,
    )  # fmt: skip
    link = Link(lift=2.0, margin=0.5, touch=0.01, near=4.0, feed=20.0, above=5.0)
    moves = link_tracks(tracks.tracks, scene, CUTTER, table, 100.0 / 60.0, link, 0.5, rate=RATE).moves
    return program_of(moves, 90.0, 1)


def rough(impeller):
    how = RoughingSettings(60.0, 25.0, 0.5, 0.5, LineMotion(0.1, 5.0, RATE, 0.5), spacing=4.0, around=0, over=1.0)
    table = index_table(MACHINE).at([math.radians(55.0)])
    (plan,) = rough_channels(
        impeller, Catalogue("own", (CUTTER,)), CUTTER, how, Link(2.0, 0.3, 0.1, 0.0, 20.0, 5.0), 90.0, table, 0.9
    )
    return plan.program


@pytest.fixture(scope="module", params=[finished, rough], ids=["finishing", "roughing"])
def written(request, impeller):
    program = request.param(impeller)
    return program, write_gcode(program, MACHINE, title="impeller", release=NOT_SIMULATED)


def rows_of(text):
    """Rows that move: whether rapid, X Y Z [mm] A B [deg], minutes of a row in inverse time (nan: none), feed."""
    state = dict.fromkeys("XYZAB", 0.0)
    rapid, inverse, feed, out = False, False, math.nan, []
    for line in text.splitlines():
        if line.startswith("("):
            continue
        words = re.findall(r"([A-Z])(-?[\d.]+)", line)
        codes = {float(v) for k, v in words if k == "G"}
        rapid = (rapid or 0.0 in codes) and not codes & {1.0, 2.0, 3.0}
        inverse = (inverse or 93.0 in codes) and 94.0 not in codes
        feed = next((float(v) for k, v in words if k == "F"), math.nan if inverse else feed)
        moved = [(k, float(v)) for k, v in words if k in "XYZAB"]
        state.update(moved)
        if moved:
            out.append((rapid, *(state[k] for k in "XYZAB"), 1.0 / feed if inverse and not rapid else math.nan, feed))
    return np.array(out)


def test_all_motions_lead_along_the_cl_path(written):
    program, text = written
    rows = rows_of(text)
    q = np.zeros((len(rows), 9))
    q[:, :5] = rows[:, 1:6]
    q[:, 3:5] = np.radians(q[:, 3:5])
    tips, axes = forward(MACHINE, q)
    p, T = program.p_work, program.axis
    # the rows of the program stand in the text in their order; what stands between lies on the straight between them
    k = 0
    worst = turned = aside = 0.0
    for i in range(len(rows)):
        if k < len(p) and np.linalg.norm(tips[i] - p[k]) <= 1e-6 and np.abs(axes[i] - T[k]).max() <= 1e-8:
            worst = max(worst, float(np.linalg.norm(tips[i] - p[k])))
            turned = max(turned, float(np.abs(axes[i] - T[k]).max()))
            # rows that repeat a pose are not written
            k += 1
            while k < len(p) and np.linalg.norm(p[k] - p[k - 1]) <= 1e-6 and np.abs(T[k] - T[k - 1]).max() <= 1e-8:
                k += 1
            continue
        if k == 0:
            continue  # over the start: X and Y before Z
        assert k < len(p), f"row {i} of the text is behind the end of the path"
        if rows[i, 0]:
            assert program.motion[k] == RAPID
            continue
        d = p[k] - p[k - 1]
        share = float((tips[i] - p[k - 1]) @ d / (d @ d))
        off = float(np.linalg.norm(tips[i] - p[k - 1] - share * d))
        assert 0.0 <= share <= 1.0, f"row {i}"
        aside = max(aside, off)
    assert k == len(p), f"row {k} of {len(p)} is not in the text"
    assert worst <= 1e-6
    assert turned <= 1e-8
    # between two rows B is rounded as well: half its sixth decimal is 1e-6 mm at the rim
    assert aside <= 2e-6


def test_the_pallet_keeps_its_rate_in_the_text(written):
    program, text = written
    rows = rows_of(text)
    turn = np.abs(np.diff(rows[:, 5], prepend=rows[0, 5]))
    fed = rows[:, 0] == 0.0
    timed = np.isfinite(rows[:, 6])
    # by feed per minute nothing turns
    assert (turn[fed & ~timed] == 0.0).all()
    assert timed.any()
    rate = turn[timed] / rows[timed, 6]
    assert rate.max() <= math.degrees(RATE) * 60.0 * (1.0 + 1e-3)
    assert np.ptp(rows[:, 4]) == 0.0
    assert len(program)


@pytest.mark.skipif(not rs274_installed(), reason=MISSING)
def test_linuxcnc_reads_every_motion_as_written(written):
    _, text = written
    rows = rows_of(text)
    calls = [
        (name == "STRAIGHT_TRAVERSE", *(float(x) for x in words[:5]))
        for name, words in canonical(text)
        if name in ("STRAIGHT_TRAVERSE", "STRAIGHT_FEED")
    ]
    assert len(calls) == len(rows)
    # it prints four decimals
    assert np.abs(np.array(calls)[:, 1:] - rows[:, 1:6]).max() <= 0.5001e-4
    assert (np.array(calls)[:, 0] == rows[:, 0]).all()


BLADES = 11


def by_machine(rows):
    """Tips and axes of rows X Y Z [mm] A B [deg]."""
    q = np.zeros((len(rows), 9))
    q[:, :3], q[:, 3:5] = rows[:, :3], np.radians(rows[:, 3:5])
    return forward(MACHINE, q)


@pytest.mark.skipif(not rs274_installed(), reason=MISSING)
def test_linuxcnc_goes_through_every_channel(written):
    """The loop of the text, carried out by LinuxCNC: each channel is the first, turned round the part."""
    program, _ = written
    repeat = channel_repeat(program, MACHINE, index_table(MACHINE), BLADES)
    text = write_gcode(program, MACHINE, title="impeller", release=NOT_SIMULATED, repeat=repeat)
    shift, rows = np.zeros(5), []
    for name, words in canonical(text):
        if name == "SET_G92_OFFSET":
            shift = np.array([float(x) for x in words[:5]])
        elif name in ("STRAIGHT_TRAVERSE", "STRAIGHT_FEED"):
            rows.append(np.array([float(x) for x in words[:5]]) + shift)
    assert (shift == 0.0).all(), "the offset is taken back at the end"
    assert len(rows) % BLADES == 0
    each = np.array(rows).reshape(BLADES, -1, 5)
    # to the next channel at the height at which the last one ends, above the part
    assert each[1:, 0, 2] == pytest.approx(each[:-1, -1, 2], abs=1e-4)
    assert each[1:, 0, 2] == pytest.approx(each[1:, 1, 2], abs=1e-4)
    # the first row of all is over the start, from wherever the machine stands
    tips, axes = by_machine(each[0, 1:])
    for k in range(BLADES):
        p, T = by_machine(each[k, 1:])
        c, s = math.cos(math.tau * k / BLADES), math.sin(math.tau * k / BLADES)
        R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        # it prints four decimals: of degrees 2e-4 mm at the rim
        assert np.abs(p - tips @ R.T).max() <= 5e-4
        assert np.abs(T - axes @ R.T).max() <= 5e-6


@pytest.mark.parametrize("dialect", ["linuxcnc", "fanuc"])
def test_every_channel_is_read_back(written, tmp_path, dialect):
    program, _ = written
    machine = replace(MACHINE, dialect=dialect)
    repeat = channel_repeat(program, machine, index_table(machine), BLADES)
    path = tmp_path / "all.nc"
    path.write_text(write_gcode(program, machine, title="impeller", release=NOT_SIMULATED, repeat=repeat))
    once = tmp_path / "one.nc"
    once.write_text(write_gcode(program, machine, title="impeller", release=NOT_SIMULATED))
    q, one = (read_program(x, machine, dialect=dialect).axes for x in (path, once))
    assert len(q) == BLADES * len(one)
    turn = (q.reshape(BLADES, -1, 9) - one)[:, :, 4]
    assert np.degrees(turn) == pytest.approx(np.tile(360.0 / BLADES * np.arange(BLADES)[:, None], len(one)), abs=1e-6)
    # but the first row, before which Z is nowhere
    rest = np.delete((q.reshape(BLADES, -1, 9) - one)[:, 1:], 4, axis=2)
    assert np.abs(rest).max() <= 1e-9


def test_a_pallet_with_ends_is_not_turned_beyond_them(impeller):
    program = finished(impeller)
    short = replace(
        MACHINE,
        chain=replace(
            MACHINE.chain,
            axes=tuple(replace(a, low=-math.pi, high=math.pi) if a.letter == "B" else a for a in MACHINE.chain.axes),
        ),
    )
    assert channel_repeat(program, short, index_table(MACHINE), BLADES) is None
    assert channel_repeat(program, MACHINE, index_table(MACHINE), BLADES) is not None


def test_the_text_reads_back_as_the_checked_program(written):
    """Row by row: tip, axis, tool, spindle and kind of motion; a spindle turned the other way is found."""
    program, text = written
    cutters = {int(program.tool[0]): Cutter(12.0, 4, 0.5, 45.0, 60.0, 5.8e5, corner_radius=2.0)}
    assert text_findings(text, "impeller.ngc", MACHINE, cutters, program) == ()
    (wrong, *_) = text_findings(text.replace(" M3", " M4"), "impeller.ngc", MACHINE, cutters, program)
    assert wrong.code == "spindle-reversed"
