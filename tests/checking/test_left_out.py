"""What exceeds behind a block that is not read is unproven; what exceeds before it, or by a word alone, is not."""

import pytest

from chipload.checking.left_out import rest_on_left_out
from chipload.errors import Finding, Severity
from chipload.result import LimitCheck, Track, TrackKind, Verdict

BLOCK = Finding("nc-not-read", 8, "G150: the block is left out", Severity.UNPROVEN)
UNIT = Finding("nc-unit", 0, "read as mm", Severity.UNPROVEN)


def judged(found, line, code="rapid-cuts"):
    """State of a limit and severity of a finding, both of a line."""
    limit = LimitCheck("force_n", 500.0, 812.0, Verdict.EXCEEDS, line=line)
    track = Track(
        "program", TrackKind.PROGRAM, True, 1.0, (limit,), (Finding(code, line, "a rapid", Severity.EXCEEDS),)
    )
    out = rest_on_left_out(track, found)
    return out.limits[0].state.value, out.findings[0].severity.name.lower()


@pytest.mark.parametrize(
    ("found", "line", "code", "expected"),
    [
        ((), 11, "rapid-cuts", "exceeds"),
        ((BLOCK,), 7, "rapid-cuts", "exceeds"),
        ((BLOCK,), 8, "rapid-cuts", "unproven"),
        ((BLOCK,), 11, "rapid-cuts", "unproven"),
        ((BLOCK,), 0, "rapid-cuts", "unproven"),
        ((UNIT, BLOCK), 3, "rapid-cuts", "unproven"),
        ((Finding("nc-not-read", 8, "a note"),), 11, "rapid-cuts", "exceeds"),
        ((Finding("nc-no-end", 8, "truncated", Severity.UNPROVEN),), 11, "rapid-cuts", "exceeds"),
    ],
)
def test_behind_a_block_nothing_exceeds_for_sure(found, line, code, expected):
    assert judged(found, line, code) == (expected, expected)


def test_a_speed_beyond_the_machine_is_one_whatever_is_left_out():
    assert judged((BLOCK,), 11, "machine-spindle") == ("unproven", "exceeds")
    assert judged((UNIT,), 11, "machine-feed") == ("unproven", "unproven")


def test_the_reason_names_the_line():
    limit = LimitCheck("force_n", 500.0, 812.0, Verdict.EXCEEDS, line=9)
    out = rest_on_left_out(Track("program", TrackKind.PROGRAM, True, 1.0, (limit,)), (BLOCK,))
    assert out.limits[0].reason == "it exceeds the limit, but rests on what is left out from line 8 on"
