"""Files of forces: values written by hand, and what must be refused with its line."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chipload.cutting import measured
from chipload.cutting.measured import read_forces
from chipload.cutting.turns import MeasuredCut, turns_of
from chipload.errors import InputError

HEAD = "DynoWare,Version 2.5.1.2\nPath:,C:\\m\\\nSampling rate [Hz]:,1000\nCycle No:,1\nTime,Fx,Fy,Fz\ns,N,N,N\n"


def written(tmp_path, text, encoding="utf-8"):
    path = tmp_path / "f.csv"
    path.write_bytes(text.encode(encoding))
    return path


def test_dynoware(tmp_path):
    got, findings = read_forces(written(tmp_path, HEAD + "2,1.5,-2,3\n2.001,4,5,6e1\n2.002,7,8,9\n"))
    assert got.names == ("Fx", "Fy", "Fz")
    assert got.force.tolist() == [[1.5, -2.0, 3.0], [4.0, 5.0, 60.0], [7.0, 8.0, 9.0]]
    assert (got.rate, got.start) == (1000.0, 2.0)
    assert got.header["Path"] == "C:\\m\\"
    assert got.header["Sampling rate [Hz]"] == "1000"
    assert [f.code for f in findings] == ["force-drift"] * 3
    assert got.column("fy").tolist() == [-2.0, 5.0, 8.0]


def test_named_columns_with_units_in_their_names(tmp_path):
    got, _ = read_forces(written(tmp_path, "time_ms;fx_kn;speed_v\n0;1;7\n0.5;-2;7\n1.0;3;7\n"))
    assert got.names == ("fx_kn",)
    assert got.force[:, 0].tolist() == [1000.0, -2000.0, 3000.0]
    assert math.isclose(got.rate, 2000.0)


def test_latin_1_header_and_no_time(tmp_path):
    text = "Prüfer,Müller\nTemperatur [°C],20\nSampling rate [kHz],2\nFx,Fz\nN,N\n1,2\n3,4\n5,6\n"
    for encoding in ("latin-1", "utf-8"):
        got, _ = read_forces(written(tmp_path, text, encoding))
        assert got.header["Prüfer"] == "Müller"
        assert got.rate == 2000.0
        assert got.force.shape == (3, 2)


def test_window(tmp_path):
    rows = "".join(f"{i / 1000:.3f},{i},0,0\n" for i in range(20))
    got, findings = read_forces(written(tmp_path, HEAD + rows), (0.005, 0.010))
    assert got.force[:, 0].tolist() == [5.0, 6.0, 7.0, 8.0, 9.0, 10.0]
    assert got.start == 0.005
    assert not [f for f in findings if f.code == "force-window"]
    _, findings = read_forces(written(tmp_path, HEAD + rows), (0.005, 0.5))
    assert "force-window" in [f.code for f in findings]


def test_clipped_and_drifting(tmp_path):
    t = np.arange(400) / 1000.0
    wave = 100.0 * np.sin(math.tau * 50.0 * t)
    clipped = np.clip(wave, -math.inf, 80.0)
    rows = "".join(f"{a:.4f},{b},{c},{d}\n" for a, b, c, d in zip(t, clipped, wave, wave + 50.0 * t, strict=True))
    _, findings = read_forces(written(tmp_path, HEAD + rows))
    assert [(f.code, f.text[:2]) for f in findings] == [("force-clipped", "Fx"), ("force-drift", "Fz")]
    # 50 N/s for 0.4 s
    assert "drifts by 19" in findings[1].text or "drifts by 20" in findings[1].text


@pytest.mark.parametrize(
    ("names", "scale"),
    [
        ("time_ms,fx_kn", 1000.0),
        ("time [ms],Fx [kN]", 1000.0),
        ("Time (ms),Fx (N)", 1.0),
        ("Time [ms],Fx[lbf]", 4.4482216),
    ],
)
def test_units_in_names(tmp_path, names, scale):
    data, _ = read_forces(written(tmp_path, names + "\n0,1\n0.5,2\n1.0,3\n"))
    assert data.names == (names.split(",")[1],)
    assert data.rate == pytest.approx(2000.0)
    np.testing.assert_allclose(data.force[:, 0], scale * np.array([1.0, 2.0, 3.0]), rtol=1e-7)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (HEAD + "0,1,2,3\n0.001,1,2,3\n0.003,1,2,3\n0.004,1,2,3\n", "samples are missing (1 gaps): between 0.001"),
        (HEAD + "0,1,2,3\n0.001,1,x,3\n", "line 8: '0.001,1,x,3': must be numbers"),
        (HEAD + "0,1,2,3\n0.001,1,2\n", "line 8: 3 values: must be 4"),
        (HEAD + "0,1,2,3\n0.001,1,nan,3\n", "line 8: a value is not finite"),
        (HEAD.replace("1000", "5000") + "0,1,2,3\n0.001,1,2,3\n0.002,1,2,3\n", "the header states 5000 Hz"),
        ("Fx,Fy\n1,2\n2,3\n3,4\n", "line 1: Fx: has no unit: name it fx_n"),
        ("fx_n,fy_n\n1,2\n2,3\n3,4\n", "line 1: no time column and no sampling rate"),
        ("1,2\n2,3\n", "line 1: numbers without names"),
        ("time_s,speed_v\n0,1\n1,2\n2,3\n", "no column of forces among time_s, speed_v"),
        ("time_h,fx_n\n0,1\n1,2\n2,3\n", "time_h: its unit must be one of s, ms, us: name it time_s"),
        (HEAD, "holds no numbers"),
        (HEAD + "0,1,2,3\n", "1 samples in the window"),
        ("a\x00b", "line 1: is not text"),
        ("x" * 20_000, "line 1: longer than 10000 characters"),
        ("word\n" * 300, "no numbers in 200 lines"),
    ],
)
def test_refused(tmp_path, text, says):
    with pytest.raises(InputError, match=r"^forces f\.csv: ") as err:
        read_forces(written(tmp_path, text))
    assert says in str(err.value)


def test_no_file(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        read_forces(tmp_path / "none.csv")


def test_more_than_is_kept(tmp_path, monkeypatch):
    monkeypatch.setattr(measured, "SAMPLES", 5)
    rows = "".join(f"{i / 1000:.3f},{i},0,0\n" for i in range(20))
    with pytest.raises(InputError, match=r"line 12: more than 5 samples: state a window_s"):
        read_forces(written(tmp_path, HEAD + rows))
    assert len(read_forces(written(tmp_path, HEAD + rows), (0.001, 0.004))[0].force) == 4


def test_turns_of_a_known_signal():
    """Speed, amplitudes, extremes and scatter of a sum of cosines at a speed that is not the nominal one."""
    speed = 100.37 * math.tau
    t = np.arange(4000) / 10_000.0
    noise = np.random.default_rng(5).normal(0.0, 2.0, (len(t), 3))
    wave = 30.0 + 40.0 * np.cos(speed * t + 0.3) + 10.0 * np.cos(2.0 * speed * t - 1.0)
    force = np.column_stack([wave, -wave, 0.5 * wave]) + noise
    force[:, 2] = np.nan
    got = turns_of(MeasuredCut("c", 10_000.0, force, 10.0, 100.0 * math.tau, (0.0, math.pi), 1.0), 4)
    assert abs(got.speed / math.tau - 100.37) < 0.005
    c = got.amplitude[:, 0]
    assert np.allclose([c[0], 2.0 * c[1], 2.0 * c[2]], [30.0, 40.0 * np.exp(0.3j), 10.0 * np.exp(-1.0j)], atol=0.4)
    assert np.isnan(got.amplitude[:, 2]).all()
    assert np.allclose(got.scatter[:2], 2.0, rtol=0.06)
    assert got.mean.shape == (40, 3)
    fine = 30.0 + 40.0 * np.cos(np.linspace(0, 7, 9999) + 0.3) + 10.0 * np.cos(2.0 * np.linspace(0, 7, 9999) - 1.0)
    assert abs(got.high[:, 0].mean() - fine.max()) < 5.0
    assert abs(got.plane.mean() - math.sqrt(2.0) * fine.max()) < 6.0


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"feed": 0.0}, "feed_mm_min = 0: must be above 0"),
        ({"force": np.zeros((50, 3))}, "needs a whole turn"),
        ({"force": np.zeros((500, 2))}, "must be (n, 3)"),
        ({"force": np.full((500, 3), np.nan)}, "no channel is measured"),
        ({"force": np.where(np.arange(1500).reshape(500, 3) == 7, np.nan, 0.0)}, "samples are missing within"),
        ({"rate": 300.0}, "4 samples in it"),
    ],
)
def test_bad_cuts(changes, says):
    given = {"name": "c", "rate": 1e4, "force": np.zeros((500, 3)), "feed": 1.0, "speed": 100.0 * math.tau}
    with pytest.raises(InputError) as err:
        MeasuredCut(**{**given, "arc": (0.0, math.pi), "depth": 1.0, **changes})
    assert says in str(err.value)


def test_too_many_harmonics():
    cut = MeasuredCut("c", 1e4, np.zeros((500, 3)), 1.0, 100.0 * math.tau, (0.0, math.pi), 1.0)
    with pytest.raises(InputError, match="60 harmonics: must be from 1 to 49"):
        turns_of(cut, 60)
