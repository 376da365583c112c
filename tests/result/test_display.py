"""What a notebook shows of a result: its message, tables, plots, and its history as a table and as a dataset."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from chipload.errors import Finding, InputError
from chipload.jobs.contour.result import result_of


@pytest.fixture
def result(outcome):
    return result_of(outcome())


def test_the_html_has_the_message_every_limit_and_every_track(result):
    found = replace(result, note="a < b")._repr_html_()
    assert "a < b" not in found
    assert found.count("<table>") == 2
    assert found.count("<tr><td") == len(result.limits) + len(result.tracks) > 3
    assert result.verdict.value.capitalize() in found
    for check in result.limits:
        assert f"{check.worst:.3g}" in found


def test_the_html_shows_some_findings_and_counts_the_others(result):
    many = tuple(Finding("x", line, f"finding <{line}>") for line in range(1, 31))
    found = replace(result, findings=many)._repr_html_()
    shown = re.findall(r"<li>(.*?)</li>", found)
    assert shown[0] == "line 1: finding &lt;1&gt;"
    assert shown[-1] == f"and {30 + sum(len(t.findings) for t in result.in_use) - len(shown) + 1} more"


def test_the_table_has_the_rows_of_the_track(result):
    pytest.importorskip("pandas")
    for track in result.tracks:
        table = result.to_pandas(track.name)
        assert list(table.columns) == list(track.columns)
        assert table["force_xy_n"].max() == track.columns["force_xy_n"].max()
    assert result.to_pandas().equals(result.to_pandas(result.tracks[0].name))


def test_the_dataset_has_one_dimension_and_units(result):
    pytest.importorskip("xarray", reason="no xarray: datasets are not made")
    data = result.to_xarray()
    assert dict(data.sizes) == {"step": len(result.tracks[0].columns["t_s"])}
    assert set(data.coords) == {"t_s", "s_mm", "pass"}
    units = {name: data[name].attrs["units"] for name in ("force_xy_n", "torque_nm", "form_error_um", "t_s")}
    assert units == {"force_xy_n": "N", "torque_nm": "N m", "form_error_um": "µm", "t_s": "s"}
    finish = data.where(data["pass"] == "finish", drop=True)
    own = result.tracks[0].columns
    assert float(finish["torque_nm"].max()) == own["torque_nm"][own["pass"] == "finish"].max()


def test_the_plot_has_the_columns_of_the_limits(result):
    figure = result.plot()
    bound = list(dict.fromkeys(check.column.name for check in result.tracks[0].limits))
    history = result.tracks[0].columns
    first = [c for c in bound if c in history]
    assert [t.name for t in figure.data if not t.name.endswith(("exceeds", "elsewhere"))][: len(first)] == first
    dashed = {shape.y0 for shape in figure.layout.shapes}
    assert {check.limit for check in result.tracks[0].limits if check.column.name in bound[:2]} <= dashed
    covered, elsewhere, beyond = result.plot("engagement_deg", track="plain", x="s_mm").data
    own, check = result.track("plain").columns, result.track("plain").limits[0]
    # the limit counts in the finish pass: the greatest engagement of all is drawn apart and is no excess
    assert own["engagement_deg"].max() == np.nanmax(elsewhere.y) > np.nanmax(covered.y) == check.worst
    k = int(own["engagement_deg"].argmax())
    assert dict(zip(elsewhere.x, elsewhere.y, strict=True))[own["s_mm"][k]] == own["engagement_deg"][k]
    assert beyond.name == "engagement_deg exceeds"
    assert beyond.y.max() == check.worst


def test_values_that_are_not_known_do_not_spoil_a_plot(result):
    track = result.tracks[0]
    columns = dict(track.columns)
    columns["form_error_um"] = np.where(columns["pass"] == "finish", columns["form_error_um"], np.nan)
    unknown = replace(result, tracks=(replace(track, blocks=lambda: iter((columns,))),))
    low, high = unknown.plot("form_error_um").layout.yaxis.range
    assert low < 0.0 < high < np.inf


@pytest.mark.parametrize("method", ["to_pandas", "to_xarray", "plot"])
def test_a_track_that_is_not_there_or_has_no_history(result, method):
    pytest.importorskip("pandas")
    with pytest.raises(InputError, match="track 'none': is not in the result, which has backward"):
        getattr(result, method)(track="none")
    empty = replace(result.tracks[0], name="empty", in_use=False, blocks=lambda: iter(()))
    with pytest.raises(InputError, match="track 'empty': has no history; tracks with a history: backward"):
        getattr(replace(result, tracks=(*result.tracks, empty)), method)(track="empty")


def test_a_missing_library_is_named(result, monkeypatch):
    monkeypatch.setattr("chipload.lazy.find_spec", lambda name: None)
    for method in ("to_pandas", "to_xarray"):
        with pytest.raises(InputError, match=r"pip install 'chipload\[notebook\]'"):
            getattr(result, method)()
