"""Cycles with Q parameters against motions written by hand from their description in the controller's manual."""

import math

import numpy as np
import pytest

from chipload.errors import InputError, Severity
from chipload.program.commands import ARC, DWELL, LINE, RAPID, arc_sweeps
from chipload.program.heidenhain.reader import read_heidenhain

START = ("TOOL DEF 1 L+0 R+4", "TOOL CALL 1 Z S600", "L X+0 Y+0 Z+50 FMAX M3")


def read(*blocks, **options):
    return read_heidenhain("\n".join(["BEGIN PGM T MM", *blocks, "END PGM T MM"]), **options)


def drilled(cycle, *more):
    """(motion, z, feed) of the rows after the start."""
    c, findings = read(*START, cycle, "CYCL CALL", *more)
    assert not any(f.severity > Severity.NOTE for f in findings)
    return [(int(m), float(z), float(f)) for m, z, f in zip(c.motion, c.position[:, 2], c.feed, strict=True)][1:]


def test_universal_drilling():
    """203: plunges 5, 4, 3 (not below 3), two chips broken by 0.5, then out, a dwell, back to 2 above."""
    got = drilled(
        "CYCL DEF 203 UNIVERSAL DRILLING ~\nQ200=2 ~\nQ201=-17 ~\nQ206=60 ~\nQ202=5 ~\nQ210=0.3 ~\nQ203=+0 ~\nQ204=20 ~"
        "\nQ212=1 ~\nQ213=2 ~\nQ205=3 ~\nQ211=0.25 ~\nQ208=240 ~\nQ256=0.5"
    )
    assert got == [
        (RAPID, 2.0, 0.0), (LINE, -5.0, 1.0),
        (LINE, -4.5, 4.0), (LINE, -9.0, 1.0),
        (LINE, -8.5, 4.0), (LINE, -12.0, 1.0),
        (LINE, 2.0, 4.0), (DWELL, 2.0, 0.3), (RAPID, -10.0, 0.0), (LINE, -15.0, 1.0),
        (LINE, -14.5, 4.0), (LINE, -17.0, 1.0),
        (DWELL, -17.0, 0.25), (LINE, 2.0, 4.0), (RAPID, 20.0, 0.0),
    ]  # fmt: skip


def test_universal_drilling_without_a_feed_out_goes_out_at_that_of_plunging_and_at_max_at_rapid():
    cycle = "CYCL DEF 203 Q200=2 Q201=-3 Q206=60 Q202=5 Q203=+0 Q208={}"
    assert drilled(cycle.format(0))[2] == (LINE, 2.0, 1.0)
    assert drilled(cycle.format("MAX"))[2] == (RAPID, 2.0, 0.0)
    assert drilled(cycle.format(99999))[2] == (RAPID, 2.0, 0.0)


def test_universal_pecking():
    """205: from 4 deep, plunges of 6, chips broken every 4 by 0.2; stops 1 above the second, 3 above the last."""
    got = drilled(
        "CYCL DEF 205 UNIVERSAL PECKING ~\nQ200=2 ~\nQ201=-22 ~\nQ206=60 ~\nQ202=6 ~\nQ203=+0 ~\nQ204=20 ~\nQ212=0 ~"
        "\nQ205=0 ~\nQ258=1 ~\nQ259=3 ~\nQ257=4 ~\nQ256=0.2 ~\nQ211=0 ~\nQ379=4 ~\nQ253=600"
    )
    assert got == [
        (RAPID, 2.0, 0.0), (LINE, -2.0, 10.0),
        (LINE, -8.0, 1.0), (RAPID, -7.8, 0.0), (LINE, -10.0, 1.0),
        (RAPID, 2.0, 0.0), (RAPID, -9.0, 0.0),
        (LINE, -14.0, 1.0), (RAPID, -13.8, 0.0), (LINE, -16.0, 1.0),
        (RAPID, 2.0, 0.0), (RAPID, -13.0, 0.0),
        (LINE, -20.0, 1.0), (RAPID, -19.8, 0.0), (LINE, -22.0, 1.0),
        (RAPID, 2.0, 0.0), (RAPID, 20.0, 0.0),
    ]  # fmt: skip


def test_tapping_that_breaks_chips():
    """209: pitch 1.25 at ten turns a second; every 4 mm back by a turn; the spindle reversed on each way back."""
    c, _ = read(*START, "CYCL DEF 209 Q200=2 Q201=-9 Q239=1.25 Q203=0 Q204=5 Q257=4 Q256=1", "CYCL CALL")
    fed = c.motion == LINE
    np.testing.assert_allclose(c.position[fed, 2], [-4, -2.75, -8, -6.75, -9, 2])
    np.testing.assert_allclose(c.feed[fed], 12.5)
    assert np.sign(c.spindle[fed]).tolist() == [1, -1, 1, -1, 1, -1]
    assert c.position[-1, 2] == 5


def test_centring_and_boring():
    assert drilled("CYCL DEF 240 Q200=2 Q343=0 Q201=-2 Q206=60 Q211=0.5 Q203=0 Q204=9") == [
        (RAPID, 2.0, 0.0), (LINE, -2.0, 1.0), (DWELL, -2.0, 0.5), (RAPID, 9.0, 0.0)
    ]  # fmt: skip
    assert drilled("CYCL DEF 202 Q200=2 Q201=-8 Q206=60 Q211=0 Q208=120 Q203=0 Q204=9 Q214=1") == [
        (RAPID, 2.0, 0.0), (LINE, -8.0, 1.0), (LINE, 2.0, 2.0), (RAPID, 9.0, 0.0)
    ]  # fmt: skip
    _, findings = read(*START, "CYCL DEF 240 Q200=2 Q343=1 Q201=-2 Q344=-5 Q206=60 Q203=0 Q204=9", "CYCL CALL")
    assert [f.code for f in findings] == ["heidenhain-left-out"]


THREAD = "CYCL DEF 262 Q335=10 Q239={} Q201=-6 Q355={} Q253=750 Q351={} Q200=2 Q203=0 Q204=20 Q207=300"


@pytest.mark.parametrize(
    ("pitch", "climb", "degrees", "start", "end"),
    [(1.5, 1, 360, -6.0, -4.5), (1.5, -1, -360, -4.5, -6.0), (-1.5, 1, 360, -4.5, -6.0), (-1.5, -1, -360, -6.0, -4.5)],
)
def test_thread_milling_one_turn(pitch, climb, degrees, start, end):
    """262: nominal 10, tool 8: centre on 1 mm; a right-hand thread is climb milled upwards, counter-clockwise."""
    c, findings = read(*START, THREAD.format(pitch, 0, climb), "CYCL CALL")
    assert findings == ()
    rise = 0.25 * (end - start)
    assert c.motion.tolist()[1:] == [RAPID, LINE, ARC, ARC, ARC, RAPID, RAPID]
    np.testing.assert_allclose(
        c.position[1:, :3],
        [[0, 0, 2], [0, 0, start - rise], [1, 0, start], [1, 0, end], [0, 0, end + rise], [0, 0, 2], [0, 0, 20]],
        atol=1e-9,
    )
    np.testing.assert_allclose(np.degrees(arc_sweeps(c)[3:6]), np.array([0.5, 1.0, 0.5]) * degrees)
    np.testing.assert_allclose(c.centre[3:6], [[0.5, 0], [0, 0], [0.5, 0]], atol=1e-9)
    np.testing.assert_allclose(c.feed[2:6], [12.5, 5, 5, 5])


def test_thread_milling_over_the_whole_depth_and_in_steps():
    """Q355 = 1: four turns in one helix; Q355 = 2: a turn at each second pitch."""
    c, _ = read(*START, THREAD.format(1.5, 1, 1), "CYCL CALL")
    helix = np.flatnonzero(c.motion == ARC)[1]
    assert np.degrees(arc_sweeps(c)[helix]) == pytest.approx(4 * 360)
    assert c.position[helix, 2] == pytest.approx(0.0)
    for climb, starts in ((1, [-6.0, -3.0]), (-1, [-1.5, -4.5])):
        c, _ = read(*START, THREAD.format(1.5, 2, climb), "CYCL CALL")
        arcs = np.flatnonzero(c.motion == ARC)
        np.testing.assert_allclose(c.position[arcs[0::3], 2], starts)
        np.testing.assert_allclose(c.position[arcs[1::3], 2] - starts, 1.5 * climb)


def test_every_point_of_the_way_stays_on_the_thread():
    """Polar angle and height of the helical ways in and out go on with those of the thread."""
    c, _ = read(*START, THREAD.format(1.5, 0, 1), "CYCL CALL")
    k = int(np.flatnonzero(c.motion == ARC)[0])
    low, high = c.position[k - 1], c.position[k]
    for share in (0.2, 0.7, 0.95):
        angle = math.pi + math.pi * share
        x, y = 0.5 + 0.5 * math.cos(angle), 0.5 * math.sin(angle)
        z = low[2] + share * (high[2] - low[2])
        assert z == pytest.approx(-6.0 + 1.5 * math.atan2(y, x) / math.tau)


def test_bore_milling():
    """208: hole 20, tool 8: centre on 6 mm; 12 mm at 5 a turn, a whole turn at the depth, back on a half circle."""
    c, findings = read(
        *START,
        "CYCL DEF 208 Q200=2 Q201=-10 Q206=300 Q334=5 Q203=0 Q204=20 Q335=20 Q342=0 Q351=1",
        "L X+30 Y+5 FMAX M99",
    )
    assert findings == ()
    arcs = np.flatnonzero(c.motion == ARC)
    np.testing.assert_allclose(np.degrees(arc_sweeps(c)[arcs]), [180, 2.4 * 360, 360, 180])
    np.testing.assert_allclose(c.position[arcs, 2], [2, -10, -10, -10])
    np.testing.assert_allclose(np.hypot(*(c.position[arcs, :2] - [30, 5]).T), [6, 6, 6, 0], atol=1e-9)
    np.testing.assert_allclose(c.position[-1, :3], [30, 5, 20])


def test_cycles_that_need_a_radius_are_left_out_without_one_and_refused_where_the_tool_does_not_fit():
    _, findings = read("TOOL CALL 1 Z S600", "L X+0 Y+0 Z+9 FMAX", THREAD.format(1.5, 0, 1), "CYCL CALL")
    assert [f.code for f in findings if f.severity == Severity.UNPROVEN] == ["heidenhain-left-out"]
    with pytest.raises(InputError, match="CYCL DEF 262: Q335 = 10: the tool of radius 5 mm does not fit"):
        read("TOOL CALL 1 Z S600", "L X+0 Y+0 Z+9 FMAX", THREAD.format(1.5, 0, 1), "CYCL CALL", radii={1: 5.0})


def test_holes_on_a_circle_and_in_rows():
    hole = "CYCL DEF 200 Q200=2 Q201=-3 Q206=60 Q202=5 Q203=0 Q204=20"
    c, findings = read(
        *START,
        hole,
        "CYCL DEF 220 ~\nQ216=50 ~\nQ217=40 ~\nQ244=20 ~\nQ241=4 ~\nQ245=90 ~\nQ246=450 ~\nQ247=0 ~\nQ301=0",
    )
    assert findings == ()
    deep = c.motion == LINE
    np.testing.assert_allclose(
        c.position[deep, :3], [[50, 50, -3], [40, 40, -3], [50, 30, -3], [60, 40, -3]], atol=1e-9
    )
    assert c.position[-1, 2] == 20.0
    c, _ = read(*START, hole, "CYCL DEF 221 Q225=5 Q226=6 Q237=10 Q238=4 Q242=3 Q243=2 Q224=90 Q301=1")
    deep = c.motion == LINE
    np.testing.assert_allclose(c.position[deep, :2], [[5, 6], [5, 16], [5, 26], [1, 26], [1, 16], [1, 6]], atol=1e-9)


def test_a_call_at_a_place():
    c, _ = read(*START, "CYCL DEF 200 Q200=2 Q201=-3 Q206=60 Q202=5 Q203=0 Q204=20", "CYCL CALL POS X+7 Y+8 Z+0 FMAX")
    np.testing.assert_allclose(c.position[1:3, :3], [[7, 8, 50], [7, 8, 0]])
    assert c.position[c.motion == LINE, :3].tolist() == [[7, 8, -3]]


@pytest.mark.parametrize(
    ("name", "seconds"), [("DWELL 1.5", 1.5), ("V.ZEIT 1.5", 1.5), ("V.ZEIT.25", 0.25), ("V.ZEIT2", 2.0)]
)
def test_a_dwell_is_read_in_both_languages(name: str, seconds: float) -> None:
    commands, findings = read("L X+5 Y+0 Z+2 FMAX", f"CYCL DEF 9.0 VERWEILZEIT\nCYCL DEF 9.1 {name}", "L X+9 FMAX")
    assert commands.feed[commands.motion == DWELL].tolist() == [seconds]
    assert findings == ()
