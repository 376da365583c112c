"""The text of a thin wall is what is simulated: a text with one thing changed never holds and is never released."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
import pytest

from chipload.errors import Severity
from chipload.examples import copy_example
from chipload.jobs import load_job, run_job
from chipload.jobs.thinwall import program_text as written
from chipload.jobs.thinwall.figures import program_files
from chipload.jobs.thinwall.outcome import USED
from chipload.jobs.thinwall.result import result_of
from chipload.result import Verdict

SMALL = (
    "wall.length_mm=8.0",
    "wall.height_mm=7.0",
    "wall.thickness_mm=1.7",
    "wall.foot_mm=4.0",
    "wall.allowance_mm=[0.2, 0.2]",
    "wall.elements=[4, 5]",
    "operation.0.scallop_um=80.0",
    "operation.0.depth_max_mm=0.2",
    "operation.0.step_mm=3.0",
    "operation.0.layer_mm=0.25",
    "operation.0.corner_slices=40",
    "operation.0.refine=false",
    "operation.0.least_error=false",
    "operation.0.compensate_um=0.0",
    "limits.deflection_workpiece_um=60.0",
    "checks.confidence=0.5",
)


def moved(text: str) -> str:
    """A feed motion in the middle of the program ends 0.1 mm off along X."""
    lines = text.splitlines(keepends=True)
    feeds = [k for k, line in enumerate(lines) if line.startswith("G1 ") or " F" in line]
    k = next(k for k in feeds[len(feeds) // 2 :] if re.search(r"X-?[\d.]+", lines[k]))
    lines[k] = re.sub(r"X(-?[\d.]+)", lambda m: f"X{float(m[1]) + 0.1:.4f}", lines[k], count=1)
    return "".join(lines)


def without_a_pass(text: str) -> str:
    """The blocks of the second quarter of the program are left out."""
    lines = text.splitlines(keepends=True)
    return "".join(lines[: len(lines) // 4] + lines[len(lines) // 2 :])


CHANGES: dict[str, Callable[[str], str]] = {
    "half the feed": lambda text: re.sub(r"F(\d+(\.\d+)?)", lambda m: f"F{0.5 * float(m[1]):g}", text),
    "spindle reversed": lambda text: text.replace(" M3", " M4"),
    "0.1 mm off": moved,
    "a pass left out": without_a_pass,
    "no end": lambda text: re.sub(r"\nM(2|30)\n", "\n", text),
}


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wall")
    return run_job(load_job(copy_example("plate", folder / "plate") / "job.toml", SMALL))


def test_the_history_is_that_of_the_text(finished) -> None:
    """It ends where the text does, takes its time, and has no other loads than those of a text that is read exactly."""
    one = finished.outcome.variants[USED]
    reading, found = written._read(finished.outcome, one, finished.outcome.texts[USED])
    assert found == ()
    c, read = one.columns, reading.program
    end = np.array([c[f"{x}_mm"][-1] for x in "xyz"])
    assert end == pytest.approx(read.p_work[-1], abs=1e-9)
    assert c["duration_s"].sum() == pytest.approx(one.seconds)
    assert finished.result.verdict is Verdict.HOLDS
    files = program_files(finished.outcome, finished.result)
    texts = [data.decode() for name, data in files.items() if USED in name]
    assert len(texts) == 2
    assert all("verified by independent simulation" in text.lower() and "NOT VERIFIED" not in text for text in texts)


def test_lines_are_those_of_the_written_text(finished) -> None:
    """A step ends on the motion of its line: where the text states the place of the cutter, it is the step's."""
    for name, one in finished.outcome.variants.items():
        text = finished.outcome.texts[name].splitlines()
        reading, _ = written._read(finished.outcome, one, finished.outcome.texts[name])
        c, read = one.columns, reading.program
        assert (np.diff(c["line"]) >= 0).all()
        assert set(c["line"]) <= set(np.asarray(read.line).tolist())
        assert all(re.search(r"[XYZBCA]-?\d", text[line - 1]) for line in set(c["line"].tolist())), name
        # the last step of each line stands where the text has come to there
        last = np.flatnonzero(np.diff(c["line"], append=-1))
        at = np.column_stack([c[f"{x}_mm"] for x in "xyz"])[last]
        end = {int(line): read.p_work[k] for k, line in enumerate(np.asarray(read.line))}
        off = np.linalg.norm(at - np.array([end[int(line)] for line in c["line"][last]]), axis=1)
        assert np.quantile(off, 0.95) < 1e-3, name
    checks = {c.name: c for c in finished.result.tracks[0].limits}
    used = finished.outcome.texts[USED].splitlines()
    assert re.search(r"[XYZ]-?\d", used[checks["deflection_workpiece_um"].line - 1])


@pytest.mark.parametrize("change", CHANGES)
def test_a_changed_text_is_never_released(finished, monkeypatch, change: str) -> None:
    walled = finished.outcome
    own = written.write_commands
    plain = walled.texts[USED]
    assert CHANGES[change](plain) != plain
    monkeypatch.setattr(written, "write_commands", lambda *a, **k: CHANGES[change](own(*a, **k)))
    # the text that is written for release is not the one that was simulated
    (text,) = (t for name, t in program_files(walled, finished.result).items() if name == f"0-{USED}.ngc")
    assert "NOT VERIFIED" in text.decode()
    # and a run that writes it exceeds
    found = written.with_texts_read_back(walled, None)
    assert Severity.EXCEEDS in {f.severity for f in found.variants[USED].beyond}
    result = result_of(found)
    assert result.verdict is Verdict.EXCEEDS
    assert all("NOT VERIFIED" in text.decode() for text in program_files(found, result).values())


def test_what_the_comparison_lets_pass_is_simulated(finished, monkeypatch) -> None:
    """A text that goes 0.015 mm lower in one row than planned, which is within what an axis that turns may be off, is
    simulated as it stands.
    """
    walled, seen = finished.outcome, []

    class Proof:
        def prove_text(self, one, read, times):
            seen.append(read)
            return one

    own = written.write_commands

    def lower(*args, **more) -> str:
        text = own(*args, **more)
        k = text.index("G1 ")
        return text[:k] + re.sub(r"Z(-?[\d.]+)", lambda m: f"Z{float(m[1]) - 0.015:.4f}", text[k:], count=1)

    monkeypatch.setattr(written, "write_commands", lower)
    written.with_texts_read_back(walled, Proof())
    (read,) = seen
    plan = walled.variants[USED].program
    off = np.array([np.linalg.norm(plan.p_work - p, axis=1).min() for p in read.p_work[read.motion == 1]])
    assert off.max() == pytest.approx(0.015, abs=2e-3)
