"""Tracks, and the message of a result: the numbers of its limits, what exceeds first."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chipload.errors import Finding, Severity
from chipload.result import LimitCheck, Provenance, Result, Track, TrackKind, Verdict, in_memory

H, U, E = Verdict.HOLDS, Verdict.UNPROVEN, Verdict.EXCEEDS
NOWHERE = Provenance({}, (), "none", {}, {})
FORCE = LimitCheck("force_n", 500.0, 412.0, H, resolution_error=0.0)
TORQUE = LimitCheck("torque_nm", 3.0, 2.0, H, resolution_error=0.0)
TOO_MUCH = LimitCheck("force_n", 500.0, 812.0, E, line=12)
UNKNOWN = LimitCheck("power_w", 900.0, None, U, reason="no speed is stated")


def track(name, *limits, in_use=True, findings=()):
    return Track(name, TrackKind.STRATEGY, in_use, 9.0, limits, findings)


def result(*tracks, findings=(), note=""):
    return Result("contour", "a job", tracks, (), findings, (), NOWHERE, note=note)


def test_a_track_is_as_good_as_its_worst_limit_and_finding():
    assert track("a", FORCE).verdict is H
    assert track("a", FORCE, UNKNOWN).verdict is U
    assert track("a", UNKNOWN, TOO_MUCH).verdict is E
    assert track("a", FORCE, findings=(Finding("x", 0, "not read", Severity.UNPROVEN),)).verdict is U


@pytest.mark.parametrize(("balance", "error", "state"), [
    (0.05, 0.0, H), (-0.09, 0.0, H), (0.3, 0.25, H), (0.3, 0.1, U), (-0.3, 0.1, U), (1.22, 0.45, U), (math.nan, 0.5, U),
])  # fmt: skip
def test_work_that_is_not_that_of_the_volume_leaves_the_track_unproven(balance, error, state):
    load = LimitCheck("force_n", 500.0, 200.0, H, resolution_error=error)
    other = LimitCheck("form_error_um", 60.0, 20.0, H, resolution_error=2.0)  # does not excuse it
    one = Track("a", TrackKind.PROGRAM, True, 9.0, (load, other), energy_balance={1: 0.0, 2: balance})
    assert one.verdict is state
    assert [f.code for f in one.findings] == ["energy-balance"] * (state is U)
    again = Track("a", TrackKind.PROGRAM, True, 9.0, (load, other), one.findings, energy_balance=one.energy_balance)
    assert again.findings == one.findings


@pytest.mark.parametrize("time_s", [math.nan, math.inf, -1.0])
def test_a_time_that_is_no_time_is_refused(time_s):
    with pytest.raises(ValueError, match=r"track a: time_s = .*: must be a finite number from 0"):
        Track("a", TrackKind.PROGRAM, True, time_s)


def test_the_columns_of_a_track_are_those_of_all_its_blocks():
    blocks = [{"t_s": np.array([1.0, 2.0])}, {"t_s": np.array([3.0])}]
    many = Track("a", TrackKind.PROGRAM, True, 3.0, blocks=lambda: iter(blocks))
    assert many.columns["t_s"].tolist() == [1.0, 2.0, 3.0]
    assert Track("a", TrackKind.PROGRAM, True, 3.0, blocks=in_memory(blocks[0])).columns["t_s"].tolist() == [1.0, 2.0]
    assert Track("a", TrackKind.PROGRAM, True, 3.0).columns == {}


def test_where_everything_holds_the_critical_limit_is_named():
    assert result(track("a", FORCE, TORQUE)).message == "Holds: force 412 of 500 N, margin 17.6 %."
    two = result(track("a", FORCE), track("b", TORQUE), note="Twice as quick.")
    assert two.message == "Holds: a: force 412 of 500 N, margin 17.6 %. Twice as quick."


def test_what_exceeds_comes_before_what_is_unproven():
    some = result(track("a", FORCE, UNKNOWN, TOO_MUCH))
    assert (some.verdict, some.message) == (
        E,
        "Exceeds: force 812 N exceeds 500 N in line 12, 62.4 % beyond the limit.",
    )
    some = result(track("a", FORCE, UNKNOWN), findings=(Finding("g", 7, "G41 without D", Severity.UNPROVEN),))
    assert (some.verdict, some.message) == (
        U,
        "Unproven: line 7: G41 without D; and 1 more. Critical limit: force 412 of 500 N, margin 17.6 %.",
    )


def test_a_track_that_is_not_in_use_does_not_count():
    some = result(track("a", FORCE), track("b", TOO_MUCH, in_use=False))
    assert (some.verdict, some.limits, some.message) == (H, (FORCE,), "Holds: force 412 of 500 N, margin 17.6 %.")
    assert some.track("b").verdict is E
    with pytest.raises(KeyError):
        some.track("c")


def test_a_result_without_a_limit_is_unproven():
    assert (result(track("a")).verdict, result(track("a")).message) == (U, "Unproven: no limit was checked.")


def test_two_tracks_of_one_name_are_refused():
    with pytest.raises(ValueError, match="must differ"):
        result(track("a"), track("a"))


def test_a_track_in_use_behind_one_that_is_not_is_refused():
    with pytest.raises(ValueError, match=r"tracks: of operation 0: those in use come first: .*b"):
        result(track("a", in_use=False), track("b"))
