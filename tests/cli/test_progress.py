"""Progress in a log: a line a minute with the time that is left."""

from __future__ import annotations

import pytest

from chipload.terminal import log_lines


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
