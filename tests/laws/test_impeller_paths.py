"""Finishing paths of an impeller, planned, written, read and simulated: the planner against the check of channels."""

import math
import re

import numpy as np
import pytest
from tests.rs274 import MISSING, canonical, rs274_installed

from chipload.cutter.catalogue import CatalogueCutter
from chipload.machine.kinematics import forward
from chipload.machine.machine import machine_named
from chipload.planning.impeller.coverage import between_lines
from chipload.planning.impeller.lines import LineMotion, stations
from chipload.planning.impeller.links import Link, link_tracks, safe_height
from chipload.planning.impeller.parametric import ImpellerShape, impeller_of
from chipload.planning.impeller.passes import surface_joint
from chipload.planning.impeller.paths import PatchFinish, finish_tracks
from chipload.planning.impeller.programs import pallet_rate, pallet_speed, program_of, table_stands, too_fast
from chipload.planning.impeller.refinement import Refinement
from chipload.program.gcode.writer import write_gcode
from chipload.program.program import RAPID
from chipload.program.release import NOT_SIMULATED
from chipload.program.to_axes import to_axes
from chipload.simulation.channel.channel import left_on, wall

MACHINE = machine_named("horizontal-b")
CUTTER = CatalogueCutter(12.0, 2.0, cutting_length=45.0, reach=60.0, holder_diameter=30.0)
TABLE, SCALLOP, CHORD = math.radians(55.0), 0.1, 0.005
BOX = ((0.3, 0.45), (0.5, 0.71))


@pytest.fixture(scope="module")
def impeller():
    return impeller_of(ImpellerShape())


@pytest.fixture(scope="module")
def scene(impeller):
    return impeller.scene(0, "plus", ([0.5], [0.5]), (90, 40), near=1.5, around=0, hub_points=(40, 12))


@pytest.fixture(scope="module", params=["u", "v"])
def machined(request, impeller, scene):
    motion = LineMotion(CHORD, 100.0 / 60.0, pallet_rate(MACHINE), 0.5)
    tracks = finish_tracks(
        impeller.blade.plus, request.param, BOX, scene, 0, CUTTER, TABLE, PatchFinish(SCALLOP, motion), workers=2
    )
    link = Link(lift=2.0, margin=0.5, touch=0.01, near=6.0, feed=20.0, above=5.0)
    mender = Refinement(impeller.blade.plus, scene, 0, CUTTER, TABLE, CHORD, 0.5)
    way = link_tracks(
        tracks.tracks, scene, CUTTER, TABLE, 100.0 / 60.0, link, 0.5, rate=pallet_rate(MACHINE),
        joint=surface_joint([mender] * len(tracks.tracks)),
    )  # fmt: skip
    return request.param, tracks, way, program_of(way.moves, 90.0, 1)


def test_the_last_pass_lies_at_its_full_step_beyond_the_border(machined):
    along, tracks, _, _ = machined
    across = 1 if along == "u" else 0
    low, high = BOX[across]
    # each line at its farthest: the last one passes the border, the one before does not
    farthest = [max(t.at[:, across].max() for t in tracks.tracks if t.line == k) for k in range(tracks.lines)]
    assert farthest[-1] > high
    assert min(t.at[:, across].min() for t in tracks.tracks) > low
    assert max(farthest[:-2]) < high


def test_lines_from_the_high_border_leave_as_little_as_those_from_the_low_one(impeller, scene):
    tracks = lines_of_patch(impeller, scene, "u", BOX, "high")
    low, high = BOX[1]
    v = [[t.at[:, 1].min(), t.at[:, 1].max()] for t in tracks.tracks]
    # the first line lies inside the high border, the last one beyond the low one, each below the one before
    assert v[0][1] < high
    assert v[-1][0] < low
    assert (np.diff(np.array(v), axis=0) < 0.0).all()
    leave_no_more_than_asked(impeller, scene, tracks, "u", BOX)


def test_lines_begin_in_the_middle_of_a_part_that_narrows(impeller, scene):
    # 1.4 times as wide at the foot as at the tip
    box = ((0.58, 0.75), (0.36, 0.95))
    tracks, low, best = (lines_of_patch(impeller, scene, "v", box, begin) for begin in ("middle", "low", "any"))
    assert best.length == min(tracks.length, low.length)
    # numbered from the low border to the high one
    at = [float(np.interp(0.4, t.at[:, 1], t.at[:, 0])) for t in tracks.tracks if t.at[0, 1] < 0.4 < t.at[-1, 1]]
    number = [t.line for t in tracks.tracks]
    assert number == sorted(number)
    assert number[-1] == tracks.lines - 1
    assert (np.diff(at) > 0.0).all()
    # one line runs straight along v, and no line as much askew as where all begin at a border

    def askew(some):
        return [float(np.ptp(t.at[:, 0])) for t in some.tracks]

    assert min(askew(tracks)) < 1e-12
    assert max(askew(tracks)) < 0.8 * max(askew(low))
    leave_no_more_than_asked(impeller, scene, tracks, "v", box)


def lines_of_patch(impeller, scene, along, box, begin):
    """Lines of the cutter over a part of the plus side."""
    motion = LineMotion(CHORD, 100.0 / 60.0, pallet_rate(MACHINE), 0.5)
    finish = PatchFinish(SCALLOP, motion)
    return finish_tracks(impeller.blade.plus, along, box, scene, 0, CUTTER, TABLE, finish, workers=2, begin=begin)


def leave_no_more_than_asked(impeller, scene, tracks, along, box):
    """The check finds no gouge, and nothing above the scallop between the lines."""
    link = Link(lift=2.0, margin=0.5, touch=0.01, near=6.0, feed=20.0, above=5.0)
    way = link_tracks(tracks.tracks, scene, CUTTER, TABLE, 100.0 / 60.0, link, 0.5, rate=pallet_rate(MACHINE))
    assert not tracks.missed
    assert not way.refused
    share = [np.linspace(0.05, 0.95, 9), np.linspace(0.0, 1.0, 401)]
    u, v = (a + x * (b - a) for x, (a, b) in zip(share if along == "u" else share[::-1], box, strict=True))
    own = wall("blade", impeller.blade.plus, u, v)
    (left,) = left_on([own], program_of(way.moves, 90.0, 1), CUTTER, 1.0, 1.0, workers=2)
    assert left.deepest[0] <= 2.0 * CHORD
    assert left.rest.max() <= SCALLOP


def test_stations_are_as_close_as_asked(impeller):
    surface, chord = impeller.blade.plus, 0.5  # far coarser than 1.5 mm would be
    for along in ("u", "v"):
        P, Q = (0.05, 0.95), (0.3, 0.9)
        p = np.linspace(*P, stations(surface, along, P, Q, chord, 1.5))
        for q in np.linspace(*Q, 7):
            line = surface.at(p, q) if along == "u" else surface.at(q, p)
            assert np.linalg.norm(np.diff(line, axis=0), axis=1).mean() <= 1.5


def test_no_gouge_and_scallop_as_asked(impeller, machined):
    along, tracks, way, program = machined
    assert not tracks.missed
    assert not way.refused
    fine, few = np.linspace(0.0, 1.0, 401), np.linspace(0.05, 0.95, 9)
    (u0, u1), (v0, v1) = BOX
    share = (few, fine) if along == "u" else (fine, few)
    own = wall("blade", impeller.blade.plus, u0 + share[0] * (u1 - u0), v0 + share[1] * (v1 - v0))
    grid = np.linspace(0.0, 1.0, 41), np.linspace(0.0, 1.0, 21)
    others = [
        wall("own side", impeller.blade.plus, *grid), wall("facing blade", impeller.body(1).minus, *grid),
        wall("back of the blade", impeller.blade.minus, *grid),
    ]  # fmt: skip
    s, theta = (x.ravel() for x in np.meshgrid(np.linspace(0, 1, 41), np.linspace(0, 1, 15), indexing="ij"))
    low = impeller.across(0, np.linspace(0, 1, 41), np.linspace(0, 1, 15)).ravel()
    hub = type(own)("hub", impeller.hub.at(s, low), impeller.hub.normal(s, low), s, theta, np.ones(len(s)), (41, 15))
    found = left_on([own, *others, hub], program, CUTTER, 1.0, 1.0, workers=2)
    # two surfaces are approximated by straight rows: a chord each
    assert max(x.deepest[0] for x in found) <= 2.0 * CHORD, [x.message() for x in found]
    at = np.column_stack([own.u, own.v])
    within = between_lines(tracks.tracks, along, at)
    # the outermost lines lie inside the border; beyond them as much is left as between two
    assert within.mean() > 0.75
    assert found[0].rest.max() <= SCALLOP
    scallops = found[0].scallops("v" if along == "u" else "u", within)
    assert len(scallops) >= 9 * (tracks.lines - 2)
    assert 0.8 * SCALLOP <= scallops.mean() <= SCALLOP


def test_steps_are_those_of_the_cutter(machined):
    # no step is needlessly fine: along u the corner alone, 2 sqrt(2 r h), is the least that a step may be
    along, tracks, _, _ = machined
    if along == "u":
        least = 2.0 * math.sqrt(2.0 * 2.0 * SCALLOP * 0.8)
        p = [t.contact[np.abs(t.at[:, 0] - 0.37).argmin()] for t in tracks.tracks]
        steps = np.linalg.norm(np.diff(p, axis=0), axis=1)
        assert (steps[:-1] > least).all()


def test_pallet_keeps_its_rate_and_the_table_stands(machined, scene):
    _, _, way, program = machined
    assert table_stands(program)
    assert pallet_speed(program).max() <= pallet_rate(MACHINE)
    assert too_fast(program, MACHINE) == ()
    # rapids are over the part, or go to it and leave it along the axis
    top = safe_height(scene.check, TABLE)
    rapid = np.flatnonzero(program.motion == RAPID)
    over = np.einsum("ij,ij->i", program.p_work, program.axis) > top + 4.9
    for k in rapid[~over[rapid]]:
        way_down = program.p_work[k] - program.p_work[k - 1]
        assert over[k - 1]
        assert np.cross(way_down, program.axis[k]) == pytest.approx(np.zeros(3), abs=1e-9)
    # a tool that is twice as fast shows
    quick = program_of(type(way.moves)(**{**way.moves.__dict__, "feed": way.moves.feed * 1e4}), 90.0, 1)
    assert too_fast(quick, MACHINE)


def test_lines_are_milled_there_and_back_without_lifting(machined):
    _, tracks, way, program = machined
    # a step of more than 3 mm takes longer at the feed of the cut than lifting for it
    assert way.stayed >= len(tracks.tracks) - 2
    assert way.stayed + way.direct == len(tracks.tracks) - 1
    assert way.retracts == 0
    link = np.array([name == "link" for name in program.labels])[program.label]
    lead = np.array([name == "lead" for name in program.labels])[program.label]
    assert lead.sum() == 2 * (1 + way.direct)
    assert sorted({k for k in way.track.tolist() if k >= 0}) == list(range(len(tracks.tracks)))
    length = np.linalg.norm(np.diff(program.p_work, axis=0, prepend=program.p_work[:1]), axis=1)
    cut = program.feed == 100.0 / 60.0
    assert 0.0 < length[link & cut].sum() < 3.1 * way.stayed
    assert length[~link & ~lead].sum() == pytest.approx(sum(t.length for t in tracks.tracks))


def test_a_rapid_keeps_off_what_roughing_leaves(impeller, scene, machined):
    """In a channel with allowances the way down is fed where it does not clear them: no room at all, no rapid."""
    _, tracks, _, _ = machined
    for allowance, rapid in ((0.0, True), (30.0, False)):
        link = Link(lift=2.0, margin=0.5, touch=0.01, near=6.0, feed=20.0, above=5.0, allowance=allowance)
        way = link_tracks(tracks.tracks[:1], scene, CUTTER, TABLE, 100.0 / 60.0, link, 0.5)
        height = np.einsum("ij,ij->i", way.moves.tip, way.moves.axis)
        low = height < safe_height(scene.check, TABLE)
        assert (np.array(way.moves.motion)[low] == RAPID).any() == rapid
        assert (np.array(way.moves.motion)[-1] == RAPID) == rapid


def test_written_axes_lead_to_the_path(machined):
    """Positions as they stand in the text, by the chain of the machine, against the CL path."""
    _, tracks, _, program = machined
    text = write_gcode(program, MACHINE, title="finish", release=NOT_SIMULATED)
    q, rows = np.zeros(9), []
    for line in text.splitlines():
        if line.startswith("(") or not re.search(r"[XYZAB]-?[\d.]", line):
            continue
        for letter, value in re.findall(r"([XYZAB])(-?[\d.]+)", line):
            q["XYZAB".index(letter)] = float(value) * (math.pi / 180.0 if letter in "AB" else 1.0)
        rows.append(q.copy())
    tips, axes = forward(MACHINE, np.array(rows))
    # every pose of the planner is one of the text; between them there are pieces
    for track in tracks.tracks:
        for p, a in zip(track.tip, track.axis, strict=True):
            off = np.linalg.norm(tips - p, axis=1)
            k = int(off.argmin())
            assert off[k] <= 1e-6
            assert np.abs(axes[k] - a).max() < 1e-9
    commands, findings = to_axes(program, MACHINE)
    assert findings == ()
    assert np.ptp(commands.position[:, 3]) == 0.0


@pytest.mark.skipif(not rs274_installed(), reason=MISSING)
def test_linuxcnc_reads_it(machined):
    *_, program = machined
    calls = canonical(write_gcode(program, MACHINE, title="finish", release=NOT_SIMULATED))
    ends = [w for name, w in calls if name in ("STRAIGHT_FEED", "STRAIGHT_TRAVERSE")]
    commands, _ = to_axes(program, MACHINE)
    assert len(ends) >= len(commands)
    got = np.array([float(x) for x in ends[-1][:5]])
    last = commands.position[-1]
    assert np.abs(got - np.concatenate([last[:3], np.degrees(last[3:5])])).max() <= 1e-4
