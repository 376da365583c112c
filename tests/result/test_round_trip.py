"""A result that is written and read again is the same, and what cannot be written is refused."""

from __future__ import annotations

import io
import json
import math
from dataclasses import replace

import numpy as np
import pyarrow.parquet as pq
import pytest

from chipload.errors import Finding, InputError, Severity
from chipload.report.folder import write_result
from chipload.report.presentation import Presentation
from chipload.result import (
    COLUMNS,
    Provenance,
    Result,
    SurfaceMap,
    Track,
    TrackKind,
    check_limit,
    in_memory,
    load_result,
    read_summary,
)
from chipload.result.history import write_history

N = 150_000


def rows(seed, n):
    random = np.random.default_rng(seed)
    return {
        "t_s": np.cumsum(random.uniform(0.01, 0.02, n)),
        "line": np.arange(n) // 3,
        "pass": np.array(["rough", "finish"], dtype=object)[np.arange(n) * 2 // n],
        "rapid": random.uniform(size=n) < 0.1,
        **{f"{x}_mm": random.normal(size=n) for x in "xyz"},
        "force_n": random.uniform(0.0, 400.0, n),
        "form_error_um": np.where(random.uniform(size=n) < 0.5, np.nan, random.normal(size=n)),
    }


def track(name, in_use, columns, blocks=None):
    some = {k: v for k, v in columns.items() if k != "form_error_um"}
    limits = (
        check_limit("force_n", 399.0, some, track=name, error=0.02),
        check_limit("power_w", 900.0, some, track=name, reason="no speed is stated"),
    )
    found = (
        Finding("a-code", 12, "a text with \u00b5 and <b>", Severity.UNPROVEN, (1.0, 2.0, 3.0), 4),
        Finding("b", 0, "note"),
    )
    return Track(
        name, TrackKind.VARIANT, in_use, float(columns["t_s"][-1]), limits, found, (f"0-{name}.ngc",), 1,
        {"latency_s": 0.1, "schedule": "variable"}, blocks or in_memory(columns),
    )  # fmt: skip


@pytest.fixture(scope="module")
def made():
    one, two = rows(1, N), rows(2, 70)
    two["torque_nm"] = np.linspace(0.0, 3.0, 70)

    def in_blocks():
        for at in range(0, N, 40_000):
            yield {k: v[at : at + 40_000] for k, v in one.items()}

    points = np.arange(12.0).reshape(4, 3)
    faces = np.array([[0, 1, 2], [1, 2, 3]], dtype=np.int64)
    maps = (
        SurfaceMap("error", "form_error_um", points, np.array([1.0, np.nan, -3.0, 2.0]), faces, "used"),
        SurfaceMap("nothing known", "gouge_mm", points, np.full(4, np.nan), np.zeros((0, 3), dtype=np.int64)),
    )
    return Result(
        "thinwall", "a job", (track("used", True, one, in_blocks), track("other", False, two)),
        ({"kind": "thinwall", "numbers": [np.float64(1.5), np.int64(2)], "more": {"ok": np.bool_(True)}},),
        (Finding("job", 3, "of the job", Severity.NOTE),), ("torque_nm",),
        Provenance({"job": "job.toml abc"}, ("a=1",), "vmc", {"al": "a book"}, {"numpy": "2"}), maps, "A note.",
    )  # fmt: skip


@pytest.fixture(scope="module")
def folder(made, tmp_path_factory):
    show = Presentation(lambda figures: ["<p>own section</p>"], lambda: b"glb", lambda result: {"0-used.ngc": b"%\n"})
    return write_result(made, show, tmp_path_factory.mktemp("round") / "result")


def test_all_but_the_arrays_is_equal(made, folder):
    back = load_result(folder)
    for name in ("capability", "title", "verdict", "message", "limits", "findings", "unchecked", "provenance", "note"):
        assert getattr(back, name) == getattr(made, name), name
    assert list(back.operations) == [{"kind": "thinwall", "numbers": [1.5, 2], "more": {"ok": True}}]
    for new, old in zip(back.tracks, made.tracks, strict=True):
        for name in ("name", "kind", "in_use", "time_s", "limits", "findings", "programs", "operation", "verdict"):
            assert getattr(new, name) == getattr(old, name), name
        assert dict(new.parameters) == dict(old.parameters)


def test_the_columns_are_equal_to_the_bit(made, folder):
    back = load_result(folder)
    for new, old in zip(back.tracks, made.tracks, strict=True):
        assert set(new.columns) == set(old.columns)
        for name, values in old.columns.items():
            np.testing.assert_array_equal(new.columns[name], values, err_msg=name)


def test_the_maps_are_equal(made, folder):
    back = load_result(folder)
    for new, old in zip(back.maps, made.maps, strict=True):
        assert (new.name, new.column, new.track) == (old.name, old.column, old.track)
        for name in ("points", "values", "faces"):
            np.testing.assert_array_equal(getattr(new, name), getattr(old, name))
    one, none = read_summary(folder).maps
    assert (one.least, one.greatest, one.greatest_place) == (-3.0, 2.0, (9.0, 10.0, 11.0))
    assert (none.least, none.greatest, none.greatest_place) == (None, None, None)


def test_the_history_states_unit_label_and_meaning(folder):
    schema = pq.read_schema(folder / "history.parquet")
    assert schema.names[:2] == ["operation", "track"]
    for field in schema:
        column = COLUMNS[field.name]
        assert {k.decode(): v.decode() for k, v in field.metadata.items()} == {
            "unit": column.unit, "label": column.label, "meaning": column.meaning,
        }  # fmt: skip
    table = pq.read_table(folder / "history.parquet")
    assert table.num_rows == N + 70
    assert table["torque_nm"].null_count == N


def test_the_same_result_gives_the_same_bytes(made, folder, tmp_path):
    show = Presentation(lambda figures: ["<p>own section</p>"], lambda: b"glb", lambda result: {"0-used.ngc": b"%\n"})
    again = write_result(made, show, tmp_path / "result")
    for name in ("summary.json", "history.parquet", "report.html"):
        assert (again / name).read_bytes() == (folder / name).read_bytes(), name


@pytest.mark.parametrize(
    "operations",
    [
        ({"a": math.nan},),
        ({"a": [1.0, math.inf]},),
        ({"a": {"b": np.float64(-math.inf)}},),
        ({"a": np.array([np.nan])},),
    ],
)
def test_numbers_of_operations_that_are_not_finite_are_refused(made, tmp_path, operations):
    show = Presentation(lambda figures: [], lambda: b"glb")
    with pytest.raises(ValueError, match=r"[Oo]ut of range float|finite"):
        write_result(replace(made, operations=operations), show, tmp_path / "result")
    assert list(tmp_path.iterdir()) == []


def test_parameters_that_are_not_finite_are_refused(made, tmp_path):
    wrong = replace(made.tracks[1], parameters={"latency_s": math.nan})
    with pytest.raises(ValueError, match="finite"):
        write_result(replace(made, tracks=(wrong,)), Presentation(lambda figures: [], lambda: b""), tmp_path / "result")


def written(columns_of_blocks):
    blocks = [{k: np.array(v) for k, v in block.items()} for block in columns_of_blocks]
    one = Track("a", TrackKind.PROGRAM, True, 1.0, blocks=lambda: iter(blocks))
    return write_history(Result("program", "t", (one,), (), (), (), Provenance({}, (), "", {}, {})), io.BytesIO())


@pytest.mark.parametrize(
    ("blocks", "message"),
    [
        ([{"t_s": [0.0, 2.0, 1.0]}], "track a: its time falls"),
        ([{"t_s": [0.0, 2.0]}, {"t_s": [1.9, 3.0]}], "track a: its time falls"),
        ([{"t_s": [0.0, math.nan]}], "track a: a time is not finite"),
        ([{"t_s": [0.0, math.inf]}], "track a: a time is not finite"),
        ([{"t_s": [0.0], "loudness": [1.0]}], "column loudness: not in the table of columns"),
        ([{"t_s": [0.0]}, {"t_s": [1.0], "force_n": [1.0]}], r"track a: columns \['force_n'\] are not in its first"),
    ],
)
def test_a_history_that_is_none_is_refused(blocks, message):
    with pytest.raises(ValueError, match=message):
        written(blocks)


def test_a_history_in_blocks_counts_its_rows():
    assert written([{"t_s": [0.0, 1.0]}, {"t_s": [1.0, 1.0, 2.0]}]) == {"a": 5}


def test_another_version_of_the_schema_is_refused(folder, tmp_path):
    values = json.loads((folder / "summary.json").read_text())
    for change in ({"schema_version": 2}, {"verdict": "fine"}, {"more": 1}):
        (tmp_path / "summary.json").write_text(json.dumps(values | change))
        with pytest.raises(
            InputError, match=r"is not a result of schema version 1 \(1 difference\): run the job again"
        ):
            read_summary(tmp_path)


def test_a_history_that_is_shorter_than_its_summary_is_refused(made, folder, tmp_path):
    for name in ("summary.json", "maps.npz"):
        (tmp_path / name).write_bytes((folder / name).read_bytes())
    pq.write_table(pq.read_table(folder / "history.parquet").slice(0, N), tmp_path / "history.parquet")
    with pytest.raises(InputError, match=r"history\.parquet: is not the history of this result, or has changed: run"):
        load_result(tmp_path)
    # a summary that states no hash
    summary = json.loads((tmp_path / "summary.json").read_bytes()) | {"history_sha256": ""}
    (tmp_path / "summary.json").write_text(json.dumps(summary))
    back = load_result(tmp_path)
    assert len(back.tracks[0].columns["t_s"]) == N
    with pytest.raises(InputError, match=f"history.parquet: has {N} rows, the summary states {N + 70}: run the job"):
        _ = back.tracks[1].columns
