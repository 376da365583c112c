"""Verdict, limit checks with error bands, and their texts."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from chipload.errors import Finding, InputError, Severity
from chipload.result import LimitCheck, Verdict, check_limit, state_of

H, U, E = Verdict.HOLDS, Verdict.UNPROVEN, Verdict.EXCEEDS


def test_the_worst_of_every_three_states_is_the_greatest_in_their_order():
    rank = {H: 0, U: 1, E: 2}
    for states in itertools.product(Verdict, repeat=3):
        assert rank[Verdict.worst(states)] == max(rank[s] for s in states)
    assert Verdict.worst([]) is H


def test_exit_codes():
    assert {state.value: state.exit_code for state in Verdict} == {"holds": 0, "unproven": 3, "exceeds": 3}


def test_a_finding_counts_by_its_severity():
    found = [
        Verdict.of_finding(Finding("x", 1, "text", s)) for s in (Severity.NOTE, Severity.UNPROVEN, Severity.EXCEEDS)
    ]
    assert found == [H, U, E]


@pytest.mark.parametrize("worst", [-12.0, -1.0, 0.0, 4.0, 95.0, 99.9, 100.0, 100.1, 105.0, 140.0])
@pytest.mark.parametrize("error", [0.0, 0.02, 0.1, 1.5])
@pytest.mark.parametrize("limit", [-6.0, 0.0, 100.0])
def test_a_state_is_that_of_the_whole_band(worst, error, limit):
    """Beside samples of the band: all within the limit, all above it, or some of both."""
    band = worst + np.linspace(-1.0, 1.0, 2001) * error * abs(worst)
    expected = H if (band <= limit).all() else E if (band > limit).all() else U
    state, reason = state_of(worst, limit, error)
    assert state is expected
    assert bool(reason) == (state is U)


def test_a_reason_leaves_a_value_unproven_but_not_one_that_exceeds():
    assert state_of(1.0, 100.0, 0.0, "spindle not stated") == (U, "spindle not stated")
    assert state_of(101.0, 100.0, 0.0, "spindle not stated") == (E, "")


@pytest.mark.parametrize(
    "numbers",
    [(math.nan, 1.0, 0.0), (1.0, math.nan, 0.0), (1.0, math.inf, 0.0), (math.inf, 2.0, math.inf), (1.0, 2.0, math.nan)],
)
def test_a_state_of_no_number_is_refused(numbers):
    with pytest.raises(ValueError, match="must be finite"):
        state_of(*numbers)


def test_an_error_of_unknown_size_leaves_a_value_unproven():
    assert state_of(900.0, 100.0, math.inf)[0] is state_of(1.0, 100.0, math.inf)[0] is U


@pytest.mark.parametrize(
    "wrong",
    [
        {"limit": math.inf}, {"worst": math.nan}, {"worst": math.inf}, {"t_s": math.nan},
        {"place": (0.0, math.inf, 0.0)}, {"resolution_error": math.nan},
    ],
)  # fmt: skip
def test_a_check_refuses_what_is_not_finite(wrong):
    with pytest.raises(ValueError, match=r"limit force_n: .* must be finite"):
        LimitCheck(**({"name": "force_n", "limit": 1.0, "worst": 0.5, "state": H} | wrong))


def test_a_check_refuses_an_error_below_zero_and_a_missing_value_that_holds():
    with pytest.raises(ValueError, match=r"resolution_error = -0.1: must be at least 0"):
        LimitCheck("force_n", 1.0, 0.5, H, resolution_error=-0.1)
    with pytest.raises(ValueError, match="without a value it can only be unproven"):
        LimitCheck("force_n", 1.0, None, H)


@pytest.mark.parametrize(
    ("check", "text"),
    [
        (LimitCheck("force_n", 500.0, 412.345, H), "force 412.3 of 500 N"),
        (LimitCheck("force_n", 500.0, 812.0, E, line=12), "force 812 N exceeds 500 N in line 12"),
        (
            LimitCheck("gouge_mm", 0.02, 0.05, E, place=(1.0, -2.5, 3.0)),
            "gouge 0.05 mm exceeds 0.02 mm at (1, -2.5, 3)",
        ),
        (LimitCheck("flute_fill", 1.0, 1.5, E), "chip space 1.5 exceeds 1"),
        (
            LimitCheck("power_w", 900.0, None, U, reason="no speed is stated"),
            "power of at most 900 W is unknown: no speed is stated",
        ),
        (LimitCheck("torque_nm", 3.0, 2.9, U, reason="coarse"), "torque 2.9 of 3 N m, unproven: coarse"),
        (LimitCheck("spindle_power_w", 900.0, 100.0, H), "spindle power 100 of 900 W"),
    ],
)
def test_the_text_of_a_check(check, text):
    assert check.text == text


ROWS = {
    "force_n": np.array([100.0, 480.0, 300.0]),
    "form_error_um": np.array([5.0, -9.0, 8.0]),
    "line": np.array([3, 4, 9]),
    "t_s": np.array([0.5, 1.0, 2.0]),
    **{f"{x}_mm": np.array([1.0, 2.0, 3.0]) * k for k, x in enumerate("xyz", start=1)},
}


def test_a_check_names_the_row_of_the_greatest_value():
    check = check_limit("force_n", 470.0, ROWS, track="program", error=0.01)
    assert (check.state, check.worst, check.row, check.line, check.t_s) == (E, 480.0, 1, 4, 1.0)
    assert (check.place, check.track, check.resolution_error) == ((2.0, 4.0, 6.0), "program", 0.01)
    assert check_limit("force_n", 480.0, ROWS, error=0.01).state is U


def test_only_the_chosen_rows_count():
    check = check_limit("force_n", 470.0, ROWS, rows=np.array([True, False, True]))
    assert (check.state, check.worst, check.row) == (H, 300.0, 2)


def test_a_signed_column_is_bounded_by_its_size():
    check = check_limit("form_error_um", 8.5, ROWS)
    assert (check.state, check.worst, check.row) == (E, 9.0, 1)


def test_what_is_not_calculated_is_unproven():
    missing = check_limit("power_w", 900.0, ROWS)
    assert (missing.state, missing.worst, missing.reason) == (U, None, "power was not calculated")
    none = check_limit("force_n", 900.0, ROWS, rows=np.zeros(3, dtype=bool))
    assert (none.state, none.worst, none.reason) == (U, None, "no step was checked")


def test_a_column_that_is_not_a_number_is_refused():
    with pytest.raises(ValueError, match="must be finite"):
        check_limit("force_n", 1.0, {"force_n": np.array([0.5, np.nan])})


def test_a_limit_that_bounds_no_column_is_refused():
    with pytest.raises(InputError, match="limit loudness_db: not known: no column of a history has this name"):
        check_limit("loudness_db", 1.0, ROWS)
