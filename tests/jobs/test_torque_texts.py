"""The text of a torque job is what is simulated: a text with one thing changed never holds and is never released."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
import pytest

import chipload
from chipload.errors import Severity
from chipload.jobs import load_job
from chipload.jobs.torque import written_program as written
from chipload.jobs.torque.files import program_files
from chipload.machine.machine import machine_named
from chipload.result import Verdict
from torque_job import TUBE_JOB

Change = Callable[[str], str]
MACHINE = machine_named("vmc")


def moved(text: str) -> str:
    """The end of the way out 0.1 mm off."""
    k = text.rindex("G1 ")
    return text[:k] + re.sub(r"Y(-?[\d.]+)", lambda m: f"Y{float(m[1]) + 0.1:.4f}", text[k:], count=1)


def without_a_turn(text: str) -> str:
    """The line of the last full turn is left out."""
    lines = text.splitlines()
    arcs = [k for k, line in enumerate(lines) if line.startswith(("G2", "G3")) or " J" in line]
    return "\n".join(lines[: arcs[-1]] + lines[arcs[-1] + 1 :]) + "\n"


CHANGES: dict[str, Change] = {
    "feed doubled": lambda text: text.replace("F1800", "F3600"),
    "spindle reversed": lambda text: text.replace(" M3", " M4"),
    "0.1 mm off": moved,
    "line deleted": without_a_turn,
    "spindle not started": lambda text: re.sub(r"\n[^\n]*M3[^\n]*", "", text),
    "wrong tool": lambda text: text.replace("T1 M6", "T2 M6"),
    "no end": lambda text: text.replace("\nM2\n", "\n"),
    "goes on": lambda text: text.replace("\nM5\n", "\nG0 X200\nM5\n"),
}


def writes(monkeypatch: pytest.MonkeyPatch, change: Change) -> None:
    """The writer makes a text with a change."""
    own = written.write_commands
    monkeypatch.setattr(written, "write_commands", lambda *a, **k: change(own(*a, **k)))


@pytest.fixture(scope="module")
def job(tmp_path_factory):
    path = tmp_path_factory.mktemp("tube") / "job.toml"
    path.write_text(TUBE_JOB)
    return load_job(path)


@pytest.mark.parametrize("change", CHANGES)
def test_a_changed_text_is_never_released(job, monkeypatch, change: str) -> None:
    plain = written.written_program(job.job, MACHINE)
    assert plain.findings == ()
    assert CHANGES[change](plain.text) != plain.text
    writes(monkeypatch, CHANGES[change])
    found = written.written_program(job.job, MACHINE)
    assert Severity.EXCEEDS in {f.severity for f in found.findings}


def test_what_is_simulated_is_what_the_text_says(job, monkeypatch) -> None:
    """A helix 0.25 mm deeper in the text is deeper in what is simulated, and its feed is that of the text."""
    plain = written.written_program(job.job, MACHINE)
    writes(monkeypatch, lambda text: text.replace("Z-2", "Z-2.25").replace("F1800", "F900"))
    found = written.written_program(job.job, MACHINE)
    assert found.program.p_work[:, 2].min() == pytest.approx(plain.program.p_work[:, 2].min() - 0.25)
    assert set(found.program.feed[found.program.feed > 0.0].round(9)) == {15.0}
    assert found.times.sum() > 1.9 * plain.times.sum()
    assert len(plain.program) == len(plain.planned)
    np.testing.assert_allclose(plain.program.p_work, plain.planned.p_work, atol=1e-4)


@pytest.fixture(scope="module")
def done(job):
    return chipload.run_job(job.job.path)


def test_the_released_text_is_the_simulated_one(done, monkeypatch) -> None:
    outcome = done.outcome
    assert not outcome.job.written.findings
    result = done.result
    assert result.verdict is Verdict.HOLDS
    name = written.override_file(MACHINE)
    assert program_files(outcome, result)[name].startswith(b"(chipload: verified by")
    for change in CHANGES.values():
        with monkeypatch.context() as patch:
            writes(patch, change)
            assert program_files(outcome, result)[name].startswith(b"(NOT VERIFIED: its text is not the one")


def test_each_step_names_the_line_of_the_text_that_moves_it(done) -> None:
    """A turn downwards, one level: the line of a step follows from its height and its side."""
    text = done.outcome.job.written.text.splitlines()
    arcs = [k for k, line in enumerate(text, 1) if " I" in line]
    first, last = (next(k for k, line in enumerate(text, 1) if line == word) for word in ("G1 Y0 F1800", "G1 Y-9"))
    assert len(arcs) == 4
    for track in done.result.tracks:
        c = next(iter(track.blocks()))
        moves = np.flatnonzero(c["override_state"] != "rapid")[1:]
        if track.name.startswith("model_not_derated,"):  # its feeds are in a text of its own
            assert not c["line"].any()
            continue
        x, y, z, line = (np.asarray(c[name])[moves] for name in ("x_mm", "y_mm", "z_mm", "line"))
        lead, level = x > 17.749, z < -1.9999
        wanted = np.select(
            [lead & (y > 0.0), lead & (y < -0.1) & level, z > -1.5 + 1e-9, ~level, y < 0.0],
            [first, last, arcs[0], arcs[1], arcs[2]], arcs[3],
        )  # fmt: skip
        # where one motion ends and the next begins either may be named
        assert (line == wanted).mean() > 0.98, track.name
        assert set(line) == {first, *arcs, last}
    assert done.result.critical.line in arcs
    assert f"in line {done.result.critical.line} at (" in done.result.message


def test_a_changed_text_does_not_hold(job, monkeypatch) -> None:
    writes(monkeypatch, CHANGES["feed doubled"])
    found = chipload.run_job(job.job.path)
    assert found.result.verdict is Verdict.EXCEEDS
    assert "text-differs" in {f.code for f in found.result.findings}
    (text,) = (v for k, v in program_files(found.outcome, found.result).items() if k == written.override_file(MACHINE))
    assert b"F3600" in text
    assert text.startswith(b"(NOT VERIFIED")
