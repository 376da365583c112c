"""Modes from receptances: made with known modes, with noise, from columns and from the universal file."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from chipload.cli import app
from chipload.errors import InputError
from chipload.jobs.simulation.modes_file import read_modes
from chipload.structure.modal_fit import fit_modes
from chipload.structure.receptance import Receptance
from chipload.structure.receptance_files import read_receptance

F = np.arange(2.0, 2501.0, 2.0)
#: frequency [Hz], damping, stiffness [N/mm]
MODES = np.array([[420.0, 0.03, 6000.0], [980.0, 0.015, 20000.0], [1650.0, 0.02, 30000.0]])


def receptance(modes=MODES, f=F, noise=0.0, rest=0.0, seed=0):
    h = sum(1.0 / k / (1.0 - (f / f0) ** 2 + 2j * z * f / f0) for f0, z, k in modes) + rest
    rng = np.random.default_rng(seed)
    size = noise * np.abs(h).max()
    return h + size * (rng.standard_normal(len(f)) + 1j * rng.standard_normal(len(f)))


def test_modes_without_noise_come_back():
    found = fit_modes(Receptance(F, receptance(rest=3e-6)), (50.0, 2400.0))
    assert np.column_stack([found.frequency, found.damping, found.stiffness]) == pytest.approx(MODES, rel=1e-6)
    assert found.compliance == pytest.approx(3e-6, rel=1e-4)
    assert found.left < 1e-6


def test_modes_with_noise_come_back_within_it():
    for seed in range(3):
        found = fit_modes(Receptance(F, receptance(noise=0.01, seed=seed)), (50.0, 2400.0))
        assert len(found.frequency) == 3
        assert found.frequency == pytest.approx(MODES[:, 0], rel=2e-3)
        assert found.damping == pytest.approx(MODES[:, 1], rel=0.1)
        assert found.stiffness == pytest.approx(MODES[:, 2], rel=0.1)


def test_a_mode_below_the_band_is_left_to_its_neighbours_and_one_at_its_end_is_refused():
    found = fit_modes(Receptance(F, receptance(MODES[1:2])), (500.0, 1500.0))
    assert found.frequency == pytest.approx([980.0], rel=1e-6)
    with pytest.raises(InputError, match=r"leave|must lie within|damping ratio"):
        fit_modes(Receptance(F, receptance(MODES[1:2])), (1000.0, 1500.0))


@pytest.mark.parametrize(
    ("h", "text"),
    [
        (receptance() * 1000.0, "check the unit"),
        (receptance() / 1000.0, "check the unit"),
        (-receptance(), "compliance below 0"),
        (receptance(noise=0.3), "of the peak: must be at most 5 %"),
        (np.ones(len(F)) * 1e-4 + 0j, "no mode was found|damping ratio|must lie within|stiffness"),
    ],
)
def test_what_is_no_receptance_of_a_tip_is_refused(h, text):
    with pytest.raises(InputError, match=text):
        fit_modes(Receptance(F, h), (50.0, 2400.0))


def test_a_sensor_that_is_off_and_frequencies_in_khz_are_refused():
    with pytest.raises(InputError, match="every value is 0: check the channel of the sensor"):
        fit_modes(Receptance(F, np.zeros(len(F), dtype=complex)), (50.0, 2400.0))
    with pytest.raises(
        InputError, match=r"the mode at 0\.42 Hz: must be at least 5 Hz: check the unit of the frequency"
    ):
        fit_modes(Receptance(1e-3 * F, receptance()), (0.05, 2.4))


def test_a_mode_that_was_not_measured_coherently_is_refused():
    coherence = np.ones(len(F))
    assert fit_modes(Receptance(F, receptance()), (50.0, 2400.0), coherence).coherence.tolist() == [1.0] * 3
    coherence[np.abs(F - 980.0) < 60.0] = 0.5
    with pytest.raises(InputError, match=r"coherence 0\.5 about the mode at 980 Hz"):
        fit_modes(Receptance(F, receptance()), (50.0, 2400.0), coherence)


def test_too_few_frequencies_are_refused():
    with pytest.raises(InputError, match="11 frequencies from 400 to 420 Hz"):
        fit_modes(Receptance(F, receptance()), (400.0, 420.0))


def universal(f, h, kind=4, direction=2, ordinate=12, data=5):
    """Dataset 58 as its description says, complex single, even spacing; kind 6: coherence, real."""
    rows = ["    -1", "    58", "tip", "NONE", "NONE", "NONE", "NONE"]
    rows.append(f"{kind:5d}{0:10d}{0:5d}{0:10d} {'TIP':10s}{1:10d}{direction:4d} {'TIP':10s}{1:10d}{direction:4d}")
    rows.append(f"{data:10d}{len(f):10d}{1:10d}{f[0]:13.5e}{f[1] - f[0]:13.5e}{0.0:13.5e}")
    rows += [f"{18:10d}{0:5d}{0:5d}{0:5d} {'NONE':20s} {'Hz':20s}"]
    rows += [f"{ordinate:10d}{0:5d}{0:5d}{0:5d} {'NONE':20s} {'NONE':20s}"]
    rows += [f"{13:10d}{0:5d}{0:5d}{0:5d} {'NONE':20s} {'N':20s}", f"{0:10d}{0:5d}{0:5d}{0:5d} NONE NONE"]
    values = np.column_stack([h.real, h.imag]).ravel() if data == 5 else np.asarray(h).real
    rows += ["".join(f"{x:13.5e}" for x in values[k : k + 6]) for k in range(0, len(values), 6)]
    return "\n".join([*rows, "    -1"]) + "\n"


def test_an_accelerance_in_a_universal_file(tmp_path: Path):
    h = receptance()
    accelerance = h / 1000.0 * (2j * np.pi * F) ** 2
    coherence = 0.97 * np.ones(len(F))
    text = universal(F, accelerance) + universal(F, coherence, kind=6, data=2)
    (tmp_path / "a.uff").write_text(text)
    measured = read_receptance(tmp_path / "a.uff")
    assert measured.direction == "y"
    assert measured.receptance.response == pytest.approx(h, rel=1e-4, abs=1e-9)
    assert measured.coherence == pytest.approx(coherence)
    done = CliRunner().invoke(
        app, ["tap", str(tmp_path / "a.uff"), "--out", str(tmp_path / "m.toml"), "--from-hz", "50"]
    )
    assert done.exit_code == 0, done.output
    modes = tomllib.loads((tmp_path / "m.toml").read_text())["mode"]
    assert [m["direction"] for m in modes] == ["y"] * 3
    assert [m["frequency_hz"] for m in modes] == pytest.approx(MODES[:, 0], rel=1e-4)
    assert modes[0]["coherence"] == pytest.approx(0.97)
    assert [m.damping_ratio for m in read_modes(tmp_path / "m.toml")] == [m["damping_ratio"] for m in modes]


def columns(h, head="frequency [Hz], real [um/N], imag [um/N]\n"):
    return head + "".join(f"{f:g}, {x.real:.9e}, {x.imag:.9e}\n" for f, x in zip(F, h, strict=True))


def test_columns_with_a_head_in_any_unit(tmp_path: Path):
    for unit, factor in (("um/N", 1e3), ("m/N", 1e-3), ("mm/N", 1.0)):
        (tmp_path / "x.csv").write_text(columns(receptance() * factor).replace("um/N", unit))
        measured = read_receptance(tmp_path / "x.csv")
        assert measured.receptance.response == pytest.approx(receptance(), rel=1e-6)


@pytest.mark.parametrize(
    ("text", "words", "message"),
    [
        (columns(receptance(), "f re im\n"), ["--direction", "x"], "x.csv: states no unit: give --unit"),
        (columns(receptance() * 1e3), [], "x.csv: direction not stated: give --direction x or y"),
        (columns(receptance() * 1e3), ["--direction", "x", "--unit", "inch/lb"], "--unit inch/lb: must be one of"),
        (columns(receptance() * 1e3), ["--direction", "x", "--unit", "mm/N"], "check the unit"),
        ("1, 2, 3\n", ["--direction", "x"], "1 rows of frequency"),
        (columns(receptance() * 1e3), ["--direction", "x", "--direction", "y"], "--direction: 2 for 1 files"),
    ],
)
def test_what_the_command_refuses(tmp_path: Path, text, words, message):
    (tmp_path / "x.csv").write_text(text)
    done = CliRunner().invoke(app, ["tap", str(tmp_path / "x.csv"), "--out", str(tmp_path / "m.toml"), *words])
    assert done.exit_code == 2
    assert message in done.output
    assert not (tmp_path / "m.toml").exists()


def test_mutated_files_are_read_or_refused(tmp_path: Path):
    """Nothing but a refusal comes of bytes that are wrong."""
    rng = np.random.default_rng(2)
    h = receptance()
    whole = {
        "a.uff": universal(F, h / 1000.0, ordinate=8),
        "a.csv": "".join(f"{f:g} {x.real:.6e} {x.imag:.6e} 0.9 m/N\n" for f, x in zip(F, h / 1000.0, strict=True)),
    }
    refused = 0
    for name, text in whole.items():
        for _ in range(60):
            data = bytearray(text[:9000].encode())
            for at in rng.integers(0, min(len(data), 1200), 4):
                data[at] = rng.choice(list(b"0123456789-+.eE ,nai\n"))
            (tmp_path / name).write_bytes(bytes(data))
            try:
                measured = read_receptance(tmp_path / name, "m/N")
            except InputError:
                refused += 1
            else:
                assert np.isfinite(measured.receptance.response).all()
    assert refused > 20
    (tmp_path / "huge.uff").write_text(whole["a.uff"].replace(f"{len(F):10d}", "9999999999"))
    with pytest.raises(InputError, match="dataset 58 cannot be read"):
        read_receptance(tmp_path / "huge.uff")
    (tmp_path / "c.csv").write_text(whole["a.csv"].replace(" 0.9 ", " nan "))
    with pytest.raises(InputError, match="a coherence is not from 0 to 1"):
        read_receptance(tmp_path / "c.csv")
