"""Verdict, limit checks with error bands, and their texts."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from chipload.errors import Finding, InputError, Severity
from chipload.result import COLUMNS, Coverage, CoveredRows, LimitCheck, Verdict, check_limit, state_of

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
        LimitCheck(**({"name": "force_n", "limit": 1.0, "worst": 0.5, "state": H, "resolution_error": 0.0} | wrong))


def test_a_check_refuses_an_error_below_zero_and_a_missing_value_that_holds():
    with pytest.raises(ValueError, match=r"resolution_error = -0.1: must be at least 0"):
        LimitCheck("force_n", 1.0, 0.5, H, resolution_error=-0.1)
    with pytest.raises(ValueError, match="without a value it can only be unproven"):
        LimitCheck("force_n", 1.0, None, H)


@pytest.mark.parametrize(
    ("check", "text"),
    [
        (LimitCheck("force_n", 500.0, 412.345, H, resolution_error=0.0), "force 412 of 500 N"),
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
        (LimitCheck("spindle_power_w", 900.0, 100.0, H, resolution_error=0.0), "spindle power 100 of 900 W"),
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
    some = CoveredRows(np.array([True, False, True]), "finish pass", "where the wall is made")
    check = check_limit("force_n", 470.0, ROWS, rows=some, error=0.0)
    assert (check.state, check.worst, check.row) == (H, 300.0, 2)
    covered = Coverage("finish pass", "where the wall is made", ((0, 1), (2, 3)), 0.5, 480.0)
    assert (check.coverage, check.coverage.mask(3).tolist()) == (covered, [True, False, True])
    assert check.text == "force 300 of 470 N in the finish pass"


def test_a_signed_column_is_bounded_by_its_size():
    check = check_limit("form_error_um", 8.5, ROWS, error=0.0)
    assert (check.state, check.worst, check.row) == (E, 9.0, 1)


def test_what_is_not_calculated_is_unproven():
    missing = check_limit("power_w", 900.0, ROWS)
    assert (missing.state, missing.worst, missing.reason) == (U, None, "power was not calculated")
    none = check_limit("force_n", 900.0, ROWS, rows=CoveredRows(np.zeros(3, dtype=bool), "no pass", "none is cut"))
    assert (none.state, none.worst, none.reason) == (U, None, "no step was checked")


@pytest.mark.parametrize("name", sorted(COLUMNS))
def test_a_limit_holds_only_where_the_error_of_its_column_is_known(name):
    """Every column: a value far within its limit holds where the column is exact or its error is stated, else never."""
    column = COLUMNS[name]
    value, limit = (3.0, 1.0) if column.least else (1.0, 3.0)
    rows = {name: np.array([value])}
    assert check_limit(name, limit, rows, error=0.02).state is H
    silent = check_limit(name, limit, rows)
    assert silent.state is (H if column.error.exact else U)
    if not column.error.exact:
        assert silent.reason == f"the resolution error of {column.label} is not known"
        assert check_limit(name, limit, rows, error=math.inf).state is U
        with pytest.raises(ValueError, match="holds, but its resolution_error is not stated"):
            LimitCheck(name, limit, value, H)


def test_a_value_between_the_checked_points_counts():
    hidden = {"gouge_mm": np.array([0.01])}
    assert check_limit("gouge_mm", 0.05, hidden, error=0.0, absolute=0.03).state is H
    check = check_limit("gouge_mm", 0.05, hidden, error=0.0, absolute=0.05)
    assert (check.state, check.absolute_error) == (U, 0.05)
    assert check.reason == "between the points that are checked it may be worse by 0.05, beyond the limit"
    assert check_limit("gouge_mm", 0.005, hidden, error=0.0, absolute=0.05).state is E


def test_a_column_that_is_not_a_number_is_refused():
    with pytest.raises(ValueError, match="must be finite"):
        check_limit("force_n", 1.0, {"force_n": np.array([0.5, np.nan])})


def test_a_limit_that_bounds_no_column_is_refused():
    with pytest.raises(InputError, match="limit loudness_db: not known: no column of a history has this name"):
        check_limit("loudness_db", 1.0, ROWS)
