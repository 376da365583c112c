"""What a notebook shows of a result: its message, its limits, its history as a table."""

from __future__ import annotations

from dataclasses import replace

import pytest

from chipload.errors import InputError
from chipload.jobs.contour.result import result_of


@pytest.fixture
def result(outcome):
    return result_of(outcome())


def test_the_html_has_the_message_and_every_limit(result):
    found = replace(result, note="a < b")._repr_html_()
    assert "a < b" not in found
    assert found.count("<tr>") == len(result.limits) > 0
    assert result.verdict.value.capitalize() in found


def test_the_table_has_the_rows_of_the_track(result):
    pytest.importorskip("pandas")
    for track in result.tracks:
        table = result.to_pandas(track.name)
        assert list(table.columns) == list(track.columns)
        assert table["force_xy_n"].max() == track.columns["force_xy_n"].max()
    assert result.to_pandas().equals(result.to_pandas(result.tracks[0].name))


def test_a_track_that_is_not_there(result):
    pytest.importorskip("pandas")
    with pytest.raises(InputError, match="track 'none': is not in the result: it has backward"):
        result.to_pandas("none")
