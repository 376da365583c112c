"""Changes that would settle a limit: the margin that they predict is that of the program simulated with the change."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import chipload
from chipload import Limits, Stock
from chipload.cutter.cutter import Cutter
from chipload.result import LimitCheck, Track, TrackKind, Verdict, in_memory
from chipload.result.budget import ErrorBudget, ErrorPart
from chipload.result.changes import ChangeKind, feed_change, propose_changes, statement_change
from chipload.result.feed_law import FeedLaw
from chipload.result.limits import hold_at_confidence

MILL = Cutter(10.0, 2, math.radians(30.0), 20.0, 30.0, 580e3)
TEXT = """G17 G21 G90 G94 G40 G49 G80 G54
T1 M6
S4000 M3
G0 X-10 Y-8 Z5
G0 Z-2
G1 X30 F400
G0 Z5
G0 X-10 Y4
G0 Z-3
G1 X30 F{feed}
G0 Z5
M2
"""
STOCK = Stock.block((0.0, -16.0, -6.0), (20.0, 12.0, 0.0))


def simulated(folder: Path, feed: float, limit: float) -> chipload.History:
    (folder / "two.ngc").write_text(TEXT.format(feed=feed))
    return chipload.simulate(
        program=folder / "two.ngc", stock=STOCK, cutters=MILL, material="group-2-steel", machine="vmc",
        limits=Limits(force_n=limit), step_mm=2.0,
    )  # fmt: skip


def force_of(result: chipload.History) -> LimitCheck:
    return next(check for check in result.limits if check.name == "force_n")


def test_the_program_simulated_with_a_lower_feed_has_the_margin_that_was_predicted(tmp_path: Path) -> None:
    limit = 1300.0
    before = simulated(tmp_path, 900.0, limit)
    assert force_of(before).state is not Verdict.HOLDS
    (change,) = (c for c in before.changes if c.kind is ChangeKind.FEED)
    # the slower line is not touched
    assert change.lines == (10,)
    after = force_of(simulated(tmp_path, 900.0 * change.factor, limit))
    assert after.margin == pytest.approx(change.margin, abs=change.error + 0.005)
    assert after.margin >= 0.0
    # the least feed that settles it is not far below
    assert change.error < 0.1


def row(force: list[float], chip: list[float], law: FeedLaw, limit: float = 100.0) -> tuple[Track, LimitCheck]:
    columns = {
        "line": np.arange(1, len(force) + 1), "force_n": np.array(force), "chip_max_mm": np.array(chip),
    }  # fmt: skip
    check = LimitCheck(
        "force_n", limit, max(force), Verdict.EXCEEDS, "t", int(np.argmax(force)), resolution_error=0.0, feed_law=law
    )
    return Track("t", TrackKind.PROGRAM, True, 1.0, (check,), blocks=in_memory(columns)), check


def test_without_edge_forces_the_feed_falls_as_the_force_must() -> None:
    # 125 N to 98 N: 78.4 %, of which a person writes 78 %; line 1 stays at 97 N
    track, _ = row([97.0, 125.0, 110.0], [0.1, 0.1, 0.1], FeedLaw(0.0, 0.0))
    (change,) = propose_changes(track)
    assert (change.factor, change.lines) == (0.78, (2, 3))
    assert change.margin == pytest.approx(1.0 - 0.78 * 1.25)
    assert change.error == 0.0
    assert change.text == "feed of lines 2 to 3 at 78 %"


def test_edge_forces_alone_are_not_settled_by_a_feed() -> None:
    # half of the force of chips of 0.1 mm, and more of thinner ones
    track, check = row([250.0], [0.1], FeedLaw(0.1, 0.1))
    assert feed_change(track, [check]) is None
    # 140 N: at 28 % of the feed 64 to 76 % are left, 90 to 106 N: it may hold, and the interval says so
    track, check = row([140.0], [0.1], FeedLaw(0.1, 0.1))
    change = feed_change(track, [check])
    assert change is not None
    assert change.factor == pytest.approx(0.28, abs=0.011)
    assert change.error > change.margin > 0.0
    # 120 N: edge forces are 60 to 80 N of it; 80 + 40 k = 98 at k = 0.45
    track, check = row([120.0], [0.1], FeedLaw(0.1, 0.1))
    change = feed_change(track, [check])
    assert change is not None
    assert change.factor == 0.44 if 80.0 + 40.0 * 0.45 > 98.0 else change.factor == pytest.approx(0.45)
    low, high = (1.0 - (share + (120.0 - share) * change.factor) / 100.0 for share in (80.0, 60.0))
    assert change.margin == pytest.approx(0.5 * (low + high))
    assert change.error == pytest.approx(0.5 * (high - low))


def test_a_statement_proves_what_only_its_part_leaves_open() -> None:
    fit = ErrorPart("coefficients", deviation=0.1, remedy="fit them")
    own = LimitCheck("force_n", 110.0, 100.0, Verdict.HOLDS, resolution_error=0.0)
    check = hold_at_confidence(own, ErrorBudget(0.95, (fit, ErrorPart("turns", bound=0.02))))
    assert check.state is Verdict.UNPROVEN
    change = statement_change(check, "t")
    assert change is not None
    # 102 of 110 N
    assert change.margin == pytest.approx(1.0 - 102.0 / 110.0)
    assert change.line_text == "fit them: force with margin 7.27 %"
    assert statement_change(replace(check, limit=101.0), "t") is None
    # with a limit of 200 N the budget leaves room: what is unproven is so for another reason, as in a coarse run
    assert statement_change(replace(check, limit=200.0), "t") is None
    assert statement_change(replace(check, state=Verdict.EXCEEDS, reason=""), "t") is None


def test_a_history_of_a_result_that_holds_is_not_read() -> None:
    def blocks():
        raise AssertionError("read")

    check = LimitCheck("force_n", 100.0, 50.0, Verdict.HOLDS, resolution_error=0.0, feed_law=FeedLaw(0.0, 0.0))
    assert propose_changes(Track("t", TrackKind.PROGRAM, True, 1.0, (check,), blocks=blocks)) == ()
