"""Reference loads for load monitors: sections, bounds and the motor's power by hand; the table read back."""

from __future__ import annotations

import csv
import io
import math
import re
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from chipload.cli import app
from chipload.errors import InputError
from chipload.report.load_monitor import afc_table, load_csv, sections_of
from chipload.result import LimitCheck, Provenance, Result, Track, Verdict
from slot_job import slot_job

#: 3000 and 6000 rpm
SLOW, FAST = 3000.0 * math.tau / 60.0, 6000.0 * math.tau / 60.0
SPINDLE = """input = "power"
efficiency = 0.8
torque_constant_error_share = 0.25
idle_w = [0.5, 0.001]
idle_error_share = 0.1
sensor_lag_s = 0.05
smoothing_s = 0.02
noise_w = 5.0
power_step_w = 1.0
inertia_kg_m2 = 0.005
[range]
torque_nm = [0.1, 5.0]
speed_rpm = [3000, 6000]
bandwidth_hz = 2.0
"""


def result_of(deviation: bool = True, rated: float | None = 2000.0, tools: tuple[int, ...] = (1, 1, 1, 1, 1, 2, 2, 2)):
    """Eight steps of a second: a cut, air at feed, a heavier cut, a rapid, a cut, another tool, air."""
    power = np.array([100.0, 0.0, 300.0, 0.0, 50.0, 80.0, 90.0, 0.0])
    speed = np.where(np.array(tools) == 1, SLOW, FAST)
    columns = {
        "line": np.array([3, 4, 5, 6, 7, 10, 11, 12]), "tool": np.array(tools), "t_s": np.arange(1.0, 9.0),
        "rapid": np.array([0, 0, 0, 1, 0, 0, 0, 0], dtype=bool), "power_w": power, "torque_mean_nm": power / speed,
    }  # fmt: skip
    if deviation:
        columns["power_sd_w"] = 0.05 * power
    limits = ()
    if rated is not None:
        limits = (LimitCheck("spindle_power_w", rated, 300.0, Verdict.HOLDS, "program", resolution_error=0.02),)
    track = Track("program", "simulate", True, 8.0, limits, (), (), 0, {}, lambda: iter([columns]))
    return Result("program", "job", (track,), ({},), (), (), Provenance({}, (), "vmc", {}, {}))


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "spindle.toml"
    path.write_text(SPINDLE)
    return path


def test_sections_by_hand() -> None:
    """A rapid and a tool change divide, air at feed does not; the bounds are 2 % and two deviations of 5 %."""
    one, two, three = sections_of(result_of())
    assert [(s.number, s.tool, s.lines, s.times) for s in (one, two, three)] == [
        (1, 1, (3, 5), (0.0, 3.0)), (2, 1, (7, 7), (4.0, 5.0)), (3, 2, (10, 11), (5.0, 7.0))
    ]  # fmt: skip
    assert one.mean == pytest.approx(200.0)
    assert (one.cutting.most, one.cutting.low, one.cutting.high) == pytest.approx((300.0, 264.0, 336.0))
    assert (one.speed, three.speed) == pytest.approx((SLOW, FAST))
    assert {s.rated for s in (one, two, three)} == {2000.0}


def test_the_motor_by_hand(file: Path) -> None:
    """P / e + i0 w + i1 w^2, with the efficiency 25 % and the idle power 10 % off, each to its side."""
    one = sections_of(result_of(), file)[0]
    free = 0.5 * SLOW + 0.001 * SLOW**2
    assert one.motor is not None
    assert one.motor.most == pytest.approx(300.0 / 0.8 + free)
    assert one.motor.low == pytest.approx(264.0 / (0.8 * 1.25) + 0.9 * free)
    assert one.motor.high == pytest.approx(336.0 / (0.8 * 0.75) + 1.1 * free)


def test_the_table_of_afc(file: Path) -> None:
    """Read as such tables are: a line BEGIN, the names at their columns, rows, [END]; percent of 2000 W, rounded up."""
    head, names, *rows = afc_table(sections_of(result_of(), file)).decode("ascii").splitlines()
    assert re.fullmatch(r"BEGIN [A-Z-]+\.TAB MM", head)
    assert rows.pop() == "[END]"
    begins = [match.start() for match in re.finditer(r"\S+", names)]
    assert names.split() == ["T", "AFC-LOAD", "AFC-OVLD1", "AFC-OVLD2"]
    cells = [[float(row[a:b]) for a, b in zip(begins, [*begins[1:], None], strict=True)] for row in rows]
    for (tool, load, wear, breakage), power, speed in zip(cells, (300.0, 90.0), (SLOW, FAST), strict=True):
        free = 0.5 * speed + 0.001 * speed**2
        wanted = 100.0 * (power / 0.8 + free) / 2000.0
        assert tool in (1.0, 2.0)
        assert 0.0 <= load - wanted <= 0.1
        most = 100.0 * (1.12 * power / 0.6 + 1.1 * free) / 2000.0
        assert 0.0 <= load + wear - most <= 0.1
        assert breakage == 0.0


def test_what_is_not_known_is_refused_or_empty(file: Path) -> None:
    with pytest.raises(InputError, match="the control measures the motor"):
        afc_table(sections_of(result_of()))
    with pytest.raises(InputError, match="the rated power is not known"):
        afc_table(sections_of(result_of(rated=None), file))
    with pytest.raises(InputError, match="spread of the coefficients is not known"):
        afc_table(sections_of(result_of(deviation=False), file))
    with pytest.raises(InputError, match=r"tool 1: takes 126 % of the rated power"):
        afc_table(sections_of(result_of(rated=500.0), file))
    file.write_text(SPINDLE.replace("[3000, 6000]", "[3000, 4000]"))
    with pytest.raises(InputError, match="identified from 3000 to 4000 rpm"):
        sections_of(result_of(), file)
    row = next(csv.DictReader(io.StringIO(load_csv(sections_of(result_of(deviation=False))).decode())))
    assert float(row["cutting_power_max_w"]) == 300.0
    assert {row[name] for name in row if "motor" in name or "low" in name or "high" in name} == {""}


def test_the_command(tmp_path: Path, file: Path) -> None:
    """Of a slot, whose greatest power is that of its summary; the power is torque times speed."""
    slot_job(tmp_path, step=3.0, end=28.0)

    def call(*words: object) -> tuple[int, str]:
        done = CliRunner().invoke(app, [str(word) for word in words])
        return done.exit_code, done.stderr

    code, said = call("run", tmp_path / "job.toml", "--out", tmp_path / "result")
    assert code in (0, 3), said
    out = tmp_path / "loads"
    assert call("export", tmp_path / "result", "--out", out, "--load-monitor", "csv", "--spindle", file) == (0, "")
    assert [path.name for path in out.iterdir()] == ["load.csv"]
    (row,) = csv.DictReader((out / "load.csv").read_text().splitlines())
    assert (row["tool"], row["line_from"], row["line_to"], row["speed_rpm"]) == ("1", "6", "6", "3000")
    low, most, high = (float(row[f"motor_power_{x}_w"]) for x in ("low", "max", "high"))
    free = 0.5 * SLOW + 0.001 * SLOW**2
    assert low < most < high
    assert 0.8 * (most - free) == pytest.approx(float(row["cutting_power_max_w"]), rel=1e-4)
    code, said = call("export", tmp_path / "result", "--out", tmp_path / "no", "--load-monitor", "other")
    assert code == 2
    assert "must be one of csv, heidenhain" in said
    for name, why in (("siemens", "machine's maker designs"), ("Fanuc", "machine's maker"), (".AFC.DEP", "itself")):
        code, said = call("export", tmp_path / "result", "--out", tmp_path / "no", "--load-monitor", name)
        assert code == 2
        assert f"--load-monitor {name}: the format of its file is not published" in said
        assert why in said
        assert "use csv" in said
    code, said = call("export", tmp_path / "result", "--out", tmp_path / "no", "--spindle", file)
    assert code == 2
    assert "applies to --load-monitor" in said
    assert not (tmp_path / "no").exists()
