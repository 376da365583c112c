"""What rests on a guess of a draft neither holds nor exceeds."""

from __future__ import annotations

import pytest

from chipload.errors import Finding, Severity
from chipload.jobs.guesses import with_guesses
from chipload.result import LimitCheck, Provenance, Result, Track, TrackKind, Verdict

GUESSES = (
    "stock.low_mm = [0, 0, -3]: around the motions (line 4)",
    'material.name = "steel": no file states it (line 9)',
)
EXCEEDS = LimitCheck("force_n", 500.0, 812.0, Verdict.EXCEEDS, line=12)
HOLDS = LimitCheck("force_n", 900.0, 812.0, Verdict.HOLDS, resolution_error=0.0)
RAPID = Finding("rapid-cuts", 18, "a rapid goes through material", Severity.EXCEEDS)
FEED = Finding("no-feed", 3, "a block cuts without a feed", Severity.EXCEEDS)


def made(*limits, findings=(), own=()):
    track = Track("program", TrackKind.PROGRAM, True, 9.0, limits, findings)
    return Result("program", "a program", (track,), (), own, (), Provenance({}, (), "none", {}, {}))


def test_a_rapid_through_a_guessed_stock_is_unproven_and_comes_first():
    result = with_guesses(made(HOLDS, findings=(RAPID,)), GUESSES)
    assert (result.verdict, result.verdict.exit_code) == (Verdict.UNPROVEN, 3)
    assert result.message.startswith("Unproven: line 18 would be a rapid through the guessed stock; and 1 more. ")
    assert "xceeds" not in result.message


@pytest.mark.parametrize(("check", "would"), [(EXCEEDS, "it would exceed the limit"), (HOLDS, "it holds")])
def test_a_load_with_a_guessed_material_neither_holds_nor_exceeds(check, would):
    result = with_guesses(made(check), GUESSES)
    assert [(c.state, c.reason) for c in result.limits] == [
        (Verdict.UNPROVEN, f"{would} with the guessed material and stock")
    ]
    assert result.limits[0].worst == check.worst


def test_limits_that_hold_but_for_guesses_are_one_reason():
    result = with_guesses(made(HOLDS), GUESSES)
    assert result.message == (
        "Unproven: 2 values of the job are guesses. Critical limit: force 812 of 900 N, margin 9.78 %, unproven: it "
        "holds with the guessed material and stock."
    )


def test_what_does_not_rest_on_the_guess_stays():
    spindle = LimitCheck("spindle_power_w", 500.0, 812.0, Verdict.EXCEEDS)
    some = ('machine.name = "vmc": a guess (line 2)',)
    result = with_guesses(made(spindle, EXCEEDS, findings=(RAPID,)), some)
    assert [c.state for c in result.limits] == [Verdict.UNPROVEN, Verdict.EXCEEDS]
    assert result.tracks[0].findings == (RAPID,)
    # of which value it is not known that it does not depend on the guess
    other = with_guesses(made(own=(FEED,)), some).findings[-1]
    assert (other.severity, other.text) == (Severity.UNPROVEN, f"{FEED.text}, with the guessed machine")


@pytest.mark.parametrize(("check", "would"), [(EXCEEDS, "it would exceed the limit"), (HOLDS, "it holds")])
def test_a_plan_rests_on_all_guesses(check, would):
    """Also on those of its operation and of its machine, which a program that exists does not depend on."""
    some = ("operation.0.depth_mm = 4: no drawing states it (line 2)", 'machine.name = "vmc": a guess (line 5)')
    for plan, state in ((True, Verdict.UNPROVEN), (False, check.state)):
        result = with_guesses(made(check), some, plan=plan)
        assert result.verdict is Verdict.UNPROVEN or check is EXCEEDS
        assert [c.state for c in result.limits] == [state]
    result = with_guesses(made(check, findings=(RAPID,)), some, plan=True)
    assert result.verdict is Verdict.UNPROVEN
    assert result.limits[0].reason == f"{would} with the guessed operation and machine"
    assert "xceeds" not in result.message
