"""The statement in the first line of a program: verified only where the whole job holds."""

from __future__ import annotations

import ast
import itertools
from pathlib import Path

import pytest

import chipload
from chipload.errors import Finding, Severity
from chipload.program.release import NOT_SIMULATED, Release
from chipload.result import LimitCheck, Provenance, Result, Track, TrackKind, Verdict, release_of

STATES = list(Verdict)


def check(state):
    return LimitCheck("feed_mm_min", 500.0, 400.0, state, reason="" if state is not Verdict.UNPROVEN else "not known")


def track(name, state, in_use=True):
    return Track(name, TrackKind.PROGRAM, in_use, 1.0, (check(state),), programs=(f"{name}.ngc",))


@pytest.mark.parametrize(("own", "other", "found"), list(itertools.product(STATES, STATES, Severity)))
def test_a_program_is_verified_only_where_every_track_in_use_and_every_finding_holds(own, other, found):
    findings = (Finding("x", 0, "something", found),)
    result = Result("contour", "a job", (track("a", own), track("b", other)), (), findings, (), Provenance(
        {}, (), "none", {}, {}
    ))  # fmt: skip
    everything = own is other is Verdict.HOLDS and found is Severity.NOTE
    for name in ("a.ngc", "b.ngc"):
        release = release_of(result, name)
        assert release.verified == everything
        assert release.text.startswith("NOT VERIFIED: ") != everything


def test_a_program_that_is_not_in_use_is_not_verified_and_one_of_no_track_is_refused():
    tracks = (track("a", Verdict.HOLDS), track("b", Verdict.HOLDS, in_use=False))
    result = Result("contour", "a job", tracks, (), (), (), Provenance({}, (), "none", {}, {}))
    assert release_of(result, "a.ngc") == Release("")
    assert release_of(result, "b.ngc").text == "NOT VERIFIED: not released: the job uses a"
    with pytest.raises(ValueError, match=r"program c.ngc: no track"):
        release_of(result, "c.ngc")
    assert not NOT_SIMULATED.verified


def test_nothing_else_in_the_product_makes_a_statement_of_its_own():
    """A `Release` is made by `release_of` alone, and where a text is written that nothing has simulated."""
    makers = {
        path.name
        for path in Path(chipload.__file__).parent.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.Call) and getattr(node.func, "id", getattr(node.func, "attr", "")) == "Release"
    }
    assert makers == {"release.py"}
