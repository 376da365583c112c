"""Progress in a log: a line a minute with the time that is left."""

from __future__ import annotations

import pytest

from chipload.terminal import log_lines, with_note


def test_a_line_a_minute_with_the_time_left(capsys: pytest.CaptureFixture[str]) -> None:
    """After 60 s a tenth is done: 540 s are left; after 100 s half: 100 s."""
    now = 0.0
    report = log_lines(lambda: now)
    for now, done in ((0.0, 0.0), (30.0, 0.05), (60.0, 0.1), (100.0, 0.5), (120.0, 0.75), (300.0, 1.0)):  # noqa: B007
        report(done, "chips")
    assert capsys.readouterr().err.splitlines() == [
        "chipload: 10 %, about 9 min left: chips",
        "chipload: 75 %, about 40 s left: chips",
    ]


def test_a_note_where_a_run_is_long(capsys: pytest.CaptureFixture[str]) -> None:
    """Once, a minute after the beginning; never in a run that ends before."""
    now = 0.0
    reports: list[float] = []
    noted = with_note(lambda done, what: reports.append(done), "does not resume", lambda: now)
    for now, done in ((30.0, 0.4), (59.0, 1.0)):  # noqa: B007
        noted(done, "chips")
    assert capsys.readouterr().err == ""
    for now, done in ((60.0, 0.5), (90.0, 0.6)):  # noqa: B007
        noted(done, "chips")
    assert capsys.readouterr().err == "chipload: does not resume\n"
    assert reports == [0.4, 1.0, 0.5, 0.6]
    silent = with_note(lambda done, what: None, "", lambda: now)
    now = 500.0
    silent(0.5, "chips")
    assert capsys.readouterr().err == ""
