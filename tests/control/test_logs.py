"""Logs: columns, units, rows that are left out, what is refused."""

from __future__ import annotations

import datetime as dt
import math

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from chipload.control.logs import read_log
from chipload.errors import InputError

TEXT = "t,n,I,what\n0,60,1.5,air\n10,120,2.5,cut\n20,bad,3,cut\n30,60,,cut\n\n15,60,2,cut\n40,180,4,\n"
COLUMNS = {
    "time": {"column": "t", "unit": "ms"},
    "speed": {"column": "n", "unit": "rpm"},
    "current": {"column": "I", "unit": "mA"},
    "label": {"column": "what"},
}


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(TEXT)
    return path


def test_columns_and_units(path):
    log, findings = read_log(path, COLUMNS)
    assert log.time.tolist() == [0.0, 0.01, 0.015, 0.04]
    assert log.speed.tolist() == pytest.approx([2 * math.pi, 4 * math.pi, 2 * math.pi, 6 * math.pi])
    assert log.current.tolist() == [0.0015, 0.0025, 0.002, 0.004]
    assert log.label.tolist() == ["air", "cut", "cut", ""]
    assert log.torque is None
    assert [(f.code, f.line) for f in findings] == [("log-row", 4)]


def test_semicolons_are_named(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("time_s;power_w\n0,1;100,5\n")
    with pytest.raises(InputError, match="separated by semicolons"):
        read_log(path)


def test_an_empty_file_and_a_number_that_no_instrument_writes(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("")
    with pytest.raises(InputError, match="the file is empty: log the program"):
        read_log(path)
    path.write_text("time_s,power_w\n0,100\n1,1e308\n2,nan\n3,200\n")
    log, findings = read_log(path)
    assert log.power.tolist() == [1e5, 2e5]
    assert [str(f) for f in findings] == ["line 3: 2 rows are left out: a number is missing or above 1e+30 (log-row)"]


def test_time_that_does_not_rise(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("t,I\n0,1\n2,1\n1,5\n2,6\n3,1\n")
    log, findings = read_log(path, {"time": {"column": "t", "unit": "s"}, "current": {"column": "I", "unit": "A"}})
    assert log.time.tolist() == [0.0, 2.0, 3.0]
    assert log.current.tolist() == [1.0, 1.0, 1.0]
    assert [(f.code, f.line) for f in findings] == [("log-time", 4)]


def test_a_time_of_a_row_and_a_file_of_columns(path, tmp_path):
    table = tmp_path / "columns.toml"
    table.write_text('sample_s = 0.1\n[current]\ncolumn = "I"\nunit = "A"\n')
    log, _ = read_log(path, table)
    assert log.time.tolist() == pytest.approx([0.0, 0.1, 0.2, 0.5, 0.6]) or len(log.time) == 5
    assert log.current.tolist() == [1.5, 2.5, 3.0, 2.0, 4.0]


@pytest.mark.parametrize(
    ("columns", "text"),
    [
        ({}, "log columns: current is missing: the column of the spindle current must be named, or power or torque"),
        ({"current": {"column": "I", "unit": "A"}}, "log columns: must give either time or sample_s"),
        ({**COLUMNS, "sample_s": 0.1}, "log columns: must give either time or sample_s"),
        ({"curent": {}}, "log columns: unknown quantity curent: the nearest known one is current"),
        ({"current": "I"}, "log columns: current: must be a table with column and unit"),
        (
            {"current": {"column": "I", "unit": "V"}},
            "log columns: current.unit = 'V': must be one of A, mA, count",
        ),
        ({"sample_s": -1}, "log columns: sample_s = -1: must be a number above 0"),
        (
            {"sample_s": 1, "current": {"column": "Ix", "unit": "A"}},
            "log {}: no column Ix for current: the nearest is I",
        ),
    ],
)
def test_refused(path, columns, text):
    with pytest.raises(InputError) as err:
        read_log(path, columns)
    assert str(err.value) == text.format(path)


def test_files_that_are_none(tmp_path):
    one = {"sample_s": 1, "current": {"column": "I", "unit": "A"}}
    with pytest.raises(InputError, match="cannot be read"):
        read_log(tmp_path / "none.csv", one)
    for text in ("", "I\n", "I\nx\n", "\0\0"):
        path = tmp_path / "bad.csv"
        path.write_text(text)
        with pytest.raises(InputError):
            read_log(path, one)


class TestParquet:
    """A Parquet file gives what a CSV file of the same rows gives."""

    @pytest.fixture
    def write(self, tmp_path):
        def write(name: str = "log.parquet", **columns):
            pq.write_table(pa.table(columns), tmp_path / name)
            return tmp_path / name

        return write

    def test_columns_and_units(self, path, write):
        made = write(
            t=pa.array([0, 10, 20, 30, 15, 40]), n=pa.array([60.0, 120.0, None, 60.0, 60.0, 180.0]),
            I=pa.array([1.5, 2.5, 3.0, None, 2.0, 4.0], pa.float32()),
            what=pa.array(["air", "cut", "cut", "cut", "cut", ""]).dictionary_encode(),
            other=pa.array([[1], [2], [3], [4], [5], [6]]),
        )  # fmt: skip
        log, findings = read_log(made, COLUMNS)
        same, _ = read_log(path, COLUMNS)
        for name in ("time", "speed", "current", "label"):
            assert getattr(log, name).tolist() == getattr(same, name).tolist()
        assert [(f.code, f.line) for f in findings] == [("log-row", 4)]

    def test_names_and_times_of_day(self, write):
        day = dt.datetime(2026, 1, 5, 6, 30, 0, 250_000)
        times = [day, day + dt.timedelta(seconds=1.5), None, day + dt.timedelta(minutes=2)]
        made = write("log", time_s=times, power_kw=[1.0, 2.0, 3.0, 4.0], line=[1, 1, 2, 3], note=["a", "b", "c", "d"])
        log, findings = read_log(made)
        assert log.time.tolist() == [0.0, 1.5, 120.0]
        assert log.power.tolist() == [1e6, 2e6, 4e6]
        assert log.line.tolist() == [1.0, 1.0, 3.0]
        assert [(f.code, f.line) for f in findings] == [("log-row", 4)]

    def test_refused(self, write, tmp_path):
        time = {"column": "time", "unit": "ms"}
        current = {"column": "I", "unit": "A"}
        made = write(time=[dt.datetime(2026, 1, 5)], I=[1.0], list=[[1.0]])
        for columns, text in (
            (None, "no column of time and of current"),
            ({"time": time, "current": current}, "column time holds times of day: it can only be time, in s"),
            ({"sample_s": 1.0, "current": current | {"column": "J"}}, "no column J for current"),
            ({"sample_s": 1.0, "current": current, "head": False}, "head = false: a Parquet file names its columns"),
            ({"sample_s": 1.0, "current": current | {"column": "list"}}, "not a Parquet file of numbers and texts"),
        ):
            with pytest.raises(InputError, match=text):
                read_log(made, columns)
        cut = tmp_path / "cut.parquet"
        cut.write_bytes(made.read_bytes()[:-20])
        with pytest.raises(InputError, match="not a Parquet file"):
            read_log(cut)

    def test_many_rows_in_few_bytes(self, write):
        made = write(time_s=pa.array(np.zeros(20_000_000)), power_w=pa.array(np.zeros(20_000_000)))
        assert made.stat().st_size < 1 << 20
        with pytest.raises(
            InputError, match="20000000 rows of 2 columns: more than 268435456 bytes: cut it into parts"
        ):
            read_log(made)
