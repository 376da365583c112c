"""A spindle identified from logs that were made from known numbers: current and power, range, bandwidth, refusals."""

from __future__ import annotations

import math
import tomllib

import pytest

from chipload.control.identification import alias_frequency, bandwidth
from chipload.control.spindle_file import read_spindle
from chipload.errors import InputError
from command import call
from spindle_logs import DT, EFFICIENCY, IDLE, INERTIA, KT, LAG, NOISE, STEP, spindle_log


@pytest.fixture(scope="module")
def identified(tmp_path_factory):
    folder = tmp_path_factory.mktemp("spindle")
    logs = [spindle_log(folder / f"{k}.csv", k, torques) for k, torques in enumerate(((0.2, 0.5, 1.0), (0.3, 0.8)))]
    code, out, err = call("spindle", *logs, "--out", folder / "spindle.toml", "--flutes", "3")
    assert (code, err) == (0, "")
    return folder / "spindle.toml", out, tomllib.loads((folder / "spindle.toml").read_text())


def test_the_parameters_are_found(identified):
    """Within their intervals, and those are narrow."""
    _, _, found = identified
    share = found["torque_constant_error_share"]
    assert share < 0.01
    assert found["torque_constant_nm_a"] == pytest.approx(KT, rel=max(1.5 * share, 0.004))
    assert found["inertia_kg_m2"] == pytest.approx(INERTIA, rel=0.05)
    assert found["idle_a"] == [pytest.approx(IDLE[0], abs=0.02), pytest.approx(IDLE[1], abs=4e-5)]
    low, high = found["interval"]["sensor_lag_s"]
    assert low <= found["sensor_lag_s"] <= high
    assert found["sensor_lag_s"] == pytest.approx(LAG, abs=0.004)
    assert found["current_step_a"] == pytest.approx(STEP, rel=1e-3)
    assert found["noise_a"] == pytest.approx(NOISE, rel=0.25)


def test_where_it_holds(identified):
    """Torque from what the noise leaves to the greatest that was cut; half the power at the bandwidth."""
    _, out, found = identified
    least, greatest = found["range"]["torque_nm"]
    assert greatest == pytest.approx(1.0)
    assert 0.002 < least < 0.05
    assert found["range"]["speed_rpm"] == [pytest.approx(190.0, rel=0.05), pytest.approx(5997.0, rel=1e-3)]
    w = math.tau * found["range"]["bandwidth_hz"]
    lags = found["sensor_lag_s"], found["smoothing_s"]
    assert math.prod(1.0 + (w * x) ** 2 for x in lags) == pytest.approx(2.0, rel=1e-2)
    assert "valid for torques from" in out
    assert "tooth passing frequency" in out


def test_each_log_is_predicted_from_the_others(identified):
    """Within 2 % of its greatest torque, and cuts are told from air."""
    _, out, found = identified
    assert [each["log"] for each in found["predictions"].values()] == ["0.csv", "1.csv"]
    for each in found["predictions"].values():
        assert each["rms_nm"] < 0.02 * each["greatest_nm"]
        assert abs(each["mean_nm"]) < 0.01 * each["greatest_nm"]
        assert each["apart_share"] > 0.99
    assert out.count("prediction of") == 2


def test_power_in_the_place_of_the_current(tmp_path):
    """The efficiency takes the place of the torque constant; a job gets it at its own speed, in N m."""
    logs = [spindle_log(tmp_path / f"{k}.csv", k, (0.3, 0.9), kind="power") for k in range(2)]
    code, _, err = call("spindle", *logs, "--out", tmp_path / "p.toml", "--power")
    assert (code, err) == (0, "")
    found = tomllib.loads((tmp_path / "p.toml").read_text())
    assert found["efficiency"] == pytest.approx(EFFICIENCY, rel=0.01)
    assert found["idle_w"][0] == pytest.approx(KT * IDLE[0] / EFFICIENCY, rel=0.2)
    data = read_spindle(tmp_path / "p.toml", 600.0)
    assert data.source == "power"
    assert data.values["torque_constant_nm_a"] == found["efficiency"]
    assert data.values["noise_a"] == pytest.approx(found["noise_w"] / 600.0)


def test_drift_is_seen(tmp_path):
    """An idle current that doubles its constant part in each log, by 0.12 A; the second has its speeds exchanged."""
    drifts = []
    for drift in (0.0, 1.0):
        logs = [
            spindle_log(tmp_path / f"{k}.csv", k, (0.3, 0.8), drift=drift, speeds=speeds)
            for k, speeds in enumerate(((590.0, 628.0), (628.0, 590.0)))
        ]
        assert call("spindle", *logs, "--out", tmp_path / "s.toml")[0] == 0
        found = tomllib.loads((tmp_path / "s.toml").read_text())
        drifts.append((found["interval"]["drift_per_min"][0], found["idle_error_share"]))
    minutes = 2.0 * 7.0 / 60.0
    assert drifts[0][0] == pytest.approx(0.0, abs=0.03)
    assert drifts[1][0] * minutes == pytest.approx(IDLE[0], rel=0.25)
    assert drifts[1][1] > 2.0 * drifts[0][1]


def test_an_air_run_alone(tmp_path):
    """Without a cut of known torque the torque constant is that of the data sheet, or there is none."""
    log = spindle_log(tmp_path / "air.csv", 1, (0.0, 0.0))
    code, out, _ = call("spindle", log, "--air", log, "--out", tmp_path / "s.toml", "--torque-constant-nm-a", KT)
    assert code == 0
    data = read_spindle(tmp_path / "s.toml", 600.0)
    assert data.torque[1] == math.inf
    assert data.values["inertia_kg_m2"] == pytest.approx(INERTIA, rel=0.05)
    assert "no log has a cut above that torque" in out
    assert call("spindle", log, "--air", log, "--out", tmp_path / "s.toml")[0] == 0
    assert "torque_constant_nm_a" not in tomllib.loads((tmp_path / "s.toml").read_text())
    with pytest.raises(InputError, match="log cuts of known torque, or state --torque-constant-nm-a"):
        read_spindle(tmp_path / "s.toml", 600.0)


def test_a_log_of_halsampler(tmp_path):
    """No head, separated by spaces, columns by number, a time for each row."""
    log = spindle_log(tmp_path / "a.csv", 3, (0.3, 0.9))
    rows = [line.split(",") for line in log.read_text().splitlines()[1:]]
    (tmp_path / "b.log").write_text("".join(f"{k} {r[1]} {r[2]} {r[3]}\n" for k, r in enumerate(rows)))
    (tmp_path / "columns.toml").write_text(
        f"sample_s = {DT}\nhead = false\n[speed]\ncolumn = 2\nunit = 'rpm'\n[current]\ncolumn = 3\nunit = 'A'\n"
        "[torque]\ncolumn = 4\nunit = 'N m'\n"
    )
    words = ("--out", tmp_path / "s.toml", "--columns", tmp_path / "columns.toml")
    assert call("spindle", tmp_path / "b.log", *words)[0] == 0
    assert tomllib.loads((tmp_path / "s.toml").read_text())["torque_constant_nm_a"] == pytest.approx(KT, rel=0.01)


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("--efficiency", "0.8"), "--efficiency: not used without --power: leave it out"),
        (("--torque-constant-nm-a", "0"), "--torque-constant-nm-a = 0: must be above 0"),
        (("--power",), "no column of power, which the other logs have"),
    ],
)
def test_refused(tmp_path, words, text):
    log = spindle_log(tmp_path / "a.csv", 3, (0.3,))
    code, _, err = call("spindle", log, "--out", tmp_path / "s.toml", *words)
    assert code == 2
    assert text in err
    assert not (tmp_path / "s.toml").exists()


def test_logs_without_what_is_needed(tmp_path):
    log = spindle_log(tmp_path / "a.csv", 3, (0.3,), names=["time_s", "speed_rpm", "current_a", "load"])
    code, _, err = call("spindle", log, "--out", tmp_path / "s.toml")
    assert code == 2
    assert "a.csv: no column of torque, and no label that states where it cuts" in err
    log = spindle_log(tmp_path / "b.csv", 3, (0.3,), names=["t", "speed_rpm", "current_a", "torque_nm"])
    code, _, err = call("spindle", log, "--out", tmp_path / "s.toml")
    assert code == 2
    assert "state --columns" in err


def test_a_speed_that_was_not_identified(identified):
    with pytest.raises(InputError, match=r"identified from .* rpm: the program turns at 9549\.3: log an air run"):
        read_spindle(identified[0], 1000.0)


def test_bandwidth_and_alias():
    """Two equal lags: (1 + x^2)^2 = 2; 300 Hz read 130 times a second shows as 40 Hz."""
    assert math.tau * bandwidth(0.1, 0.1) * 0.1 == pytest.approx(math.sqrt(math.sqrt(2.0) - 1.0))
    assert alias_frequency(300.0, 130.0) == pytest.approx(40.0)


def test_a_range_that_is_not_finite_is_refused(identified, tmp_path):
    text = identified[0].read_text()
    start = text.index("torque_nm = [")
    (tmp_path / "s.toml").write_text(text[:start] + "torque_nm = [0.1, inf]" + text[text.index("]", start) + 1 :])
    with pytest.raises(InputError, match=r"range.torque_nm = \[0.1, inf\]: must be two numbers"):
        read_spindle(tmp_path / "s.toml", 300.0)
