"""The critical limit as a bar and in words."""

import re
from dataclasses import replace

import numpy as np
import pytest

from chipload.report.answer import answer_html, bar_shares
from chipload.report.colouring import colouring_of
from chipload.report.marks import CRITICAL, marks_of
from chipload.report.view import ViewPath
from chipload.result import LimitCheck, Verdict
from chipload.result.budget import ErrorBudget, ErrorPart
from chipload.result.coverage import Coverage
from chipload.result.limits import hold_at_confidence
from square import square_result

FORCE = LimitCheck("force_n", 500.0, 400.0, Verdict.HOLDS, row=3, line=7, resolution_error=0.0)


def test_a_bar_ends_at_the_limit_or_at_what_goes_beyond_it() -> None:
    # 400 of 500 N, with 10 % more at the confidence: 440 N
    held = hold_at_confidence(FORCE, ErrorBudget(0.95, (ErrorPart("resolution", bound=0.1),)))
    shares = bar_shares(held)
    assert shares is not None
    assert (shares.value, shares.at_confidence, shares.limit) == pytest.approx((0.8, 0.88, 1.0))
    over = bar_shares(replace(FORCE, worst=1000.0, state=Verdict.EXCEEDS))
    assert over is not None
    assert (over.value, over.limit) == pytest.approx((1.0, 0.5))
    # a least allowed value: 2 of at least 1.5 uses three quarters
    margin = bar_shares(LimitCheck("stability_margin", 1.5, 2.0, Verdict.HOLDS, resolution_error=0.0))
    assert margin is not None
    assert margin.value == pytest.approx(0.75)
    assert bar_shares(LimitCheck("axial_overrun_mm", 0.0, 0.0, Verdict.HOLDS, resolution_error=0.0)) is None


def test_the_line_has_the_words_of_the_message_and_leads_to_its_row() -> None:
    text = re.sub(r"<[^>]+>", "|", answer_html(FORCE, 3))
    assert [t for t in text.split("|") if t] == ["force 400 of 500 N", "margin 20 %", "in line 7"]
    assert 'data-row="3"' in answer_html(FORCE, 3)
    assert "data-row" not in answer_html(FORCE)
    assert answer_html(None) == ""


def test_open_lines_name_what_exceeds_and_what_is_not_checked() -> None:
    result = square_result()
    assert result.critical is not None
    assert (result.critical.name, result.critical.line) == ("force_n", 9)
    assert result.headline.startswith(f"Exceeds: {result.open_lines[0][0].lower()}{result.open_lines[0][1:-1]}")
    assert result.open_lines[-1] == "Not checked: limit power_w."


def test_where_nothing_exceeds_the_critical_limit_is_marked() -> None:
    result = square_result()
    place = np.zeros((10, 3))
    track = replace(result.tracks[0], limits=(FORCE,), findings=())
    (mark,) = marks_of(result, track, lambda item: item.row, place)
    assert (mark.row, mark.kind, mark.text) == (3, CRITICAL, "force 400 of 500 N, line 7")
    # what is nearest to its limit has no place: the next that has one is marked
    nowhere = LimitCheck("scallop_mm", 0.1, 0.099, Verdict.HOLDS, resolution_error=0.0)
    (mark,) = marks_of(result, replace(track, limits=(nowhere, FORCE)), lambda item: item.row, place)
    assert mark.text == "force 400 of 500 N, line 7"
    over = replace(FORCE, worst=600.0, state=Verdict.EXCEEDS)
    assert [m.kind for m in marks_of(result, replace(track, limits=(over,)), lambda item: item.row, place)] == ["limit"]


def test_the_scale_of_colours_ends_at_the_worst_row_that_the_limit_covers() -> None:
    values = np.array([0.0, 180.0, 30.0, 45.0])
    path = ViewPath(
        np.zeros((4, 3)), np.tile([0.0, 0.0, 1.0], (4, 1)), np.arange(4.0), np.arange(4.0), np.ones(4, dtype=np.int64),
        None, np.zeros(4, dtype=np.bool_),
    )  # fmt: skip
    pocket = Coverage("pocket pass", "not in entries", ((2, 4),), 1.0, 180.0)
    check = LimitCheck("engagement_deg", 50.0, 45.0, Verdict.HOLDS, resolution_error=0.0, coverage=pocket)
    made = colouring_of("engagement_deg", values, path, check, None)
    assert (made.low, made.high) == (0.0, 45.0)
    whole = colouring_of("engagement_deg", values, path, replace(check, coverage=Coverage()), None)
    assert whole.high == 180.0
