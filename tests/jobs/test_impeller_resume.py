"""An impeller run that is stopped goes on from its finished parts and ends with the same programs."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from chipload import examples
from chipload.errors import Cancelled
from chipload.jobs import load_job, run_job
from chipload.jobs.impeller import paths, point_milling
from chipload.jobs.impeller.checkpoint import KeptParts, part_bytes, read_part
from chipload.jobs.impeller.five_axis_outcome import CheckedPoints
from chipload.planning.impeller.lines import Tracks, UnreachedSpan
from chipload.planning.impeller.links import Moves
from chipload.planning.impeller.track import ToolTrack
from chipload.progress import Progress
from chipload.simulation.checkpoint import Checkpoint

SURFACE = """[[surface]]
body = "blade"
side = "plus"
along = [0.30, 0.36]
up = [0.50, 0.60]
points = [2, 2]

"""


def job(folder: Path) -> Path:
    """A piece of one side with programs for one cutter."""
    text = (Path(examples.__file__).parent / "impeller" / "job.toml").read_text()
    text = text[: text.index("[[surface]]")] + SURFACE + text[text.index("[[operation]]") :]
    text = text[: text.index("[operation.rough]")] + text[text.index("[operation.paths]") :]
    text = re.sub(r"^hand_picked.*\n", "", text, flags=re.MULTILINE)
    changes = {"most_cutters": "1", "check_mm": "4.0", "tolerance_mm": "0.3", "chord_mm": "0.02", "scallop_mm": "0.2"}
    text = text.replace("check_mm = 3.0\n", "check_mm = 3.0\ntolerance_mm = 0.3\ntable_deg = [55.0, 70.0]\n")
    for key, value in changes.items():
        text, n = re.subn(rf"^{key} = .*$", f"{key} = {value}", text, flags=re.MULTILINE)
        assert n
    folder.mkdir()
    (folder / "job.toml").write_text(text)
    return folder / "job.toml"


def track(rng: np.random.Generator) -> ToolTrack:
    unit = rng.normal(size=(5, 3))
    return ToolTrack(rng.random((5, 2)), rng.normal(size=(5, 3)), unit, rng.random(5), unit[::-1], unit, 3)


def test_a_part_comes_back_bit_for_bit() -> None:
    rng = np.random.default_rng(1)
    one = track(rng)
    missed = UnreachedSpan(2, (0.1, 1.0 / 3.0), (np.nextafter(0.3, 1.0), -0.0), float("inf"), "touches")
    part = (Tracks((one, one.back()), (missed,), 2), {("a", 1): [None, True, 0.1 + 0.2]}, np.array([[True, False]]))
    tracks, plain, flags = read_part(part_bytes(part))
    assert tracks.missed == (missed,)
    assert [type(x) for x in tracks.tracks] == [ToolTrack, ToolTrack]
    for a, b in zip(tracks.tracks, part[0].tracks, strict=True):
        for name in ("at", "contact", "normal", "pallet", "tip", "axis"):
            assert getattr(a, name).tobytes() == np.ascontiguousarray(getattr(b, name)).tobytes()
    assert plain == part[1]
    assert flags.dtype == np.bool_
    assert flags.tolist() == [[True, False]]
    moves = Moves.of(1, np.eye(3), np.eye(3), 2.5, "finish")
    again = read_part(part_bytes(moves))
    assert (again.motion, again.label, again.feed.tolist()) == (moves.motion, moves.label, moves.feed.tolist())


def test_what_is_not_known_is_not_kept() -> None:
    with pytest.raises(TypeError, match="a part of a run holds a set, which is not kept"):
        part_bytes((1, {2}))


def test_parts_are_made_once_and_read_again(tmp_path: Path) -> None:
    made = []

    def make(k: int) -> int:
        made.append(k)
        return k * k

    with Checkpoint(tmp_path / "kept", 0.0) as checkpoint:
        keep = KeptParts(checkpoint, "key")
        assert [keep(("square", k), lambda k=k: make(k)) for k in (2, 3, 2)] == [4, 9, 4]
    assert made == [2, 3]
    with Checkpoint(tmp_path / "kept", 0.0) as checkpoint:
        keep = KeptParts(checkpoint, "key")
        assert checkpoint.safe == 2
        assert [keep(("square", k), lambda k=k: make(k)) for k in (3, 4)] == [9, 16]
    assert made == [2, 3, 4]
    with Checkpoint(tmp_path / "kept", 0.0) as checkpoint:
        # another job, or other sources: nothing of it counts
        assert KeptParts(checkpoint, "another key")(("square", 2), lambda: make(2)) == 4
    assert made == [2, 3, 4, 2]


def test_point_milling_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = job(tmp_path / "job")
    path.write_text(
        path.read_text() + '\n[operation.point_milling]\nmachine = { name = "cradle-ac" }\nfeed_mm_min = 300.0\n'
    )
    loaded = load_job(path)
    with Checkpoint(tmp_path / "kept", 0.0) as checkpoint:
        (first,) = run_job(loaded, checkpoint=checkpoint).outcome.points

    def again(*_: object) -> None:
        raise AssertionError("planned or checked again")

    monkeypatch.setattr(point_milling, "_plan_shortest", again)
    monkeypatch.setattr(paths, "left_on", again)
    monkeypatch.setattr(paths, "deepest_gouge", again)
    with Checkpoint(tmp_path / "kept", 0.0) as checkpoint:
        (last,) = run_job(loaded, checkpoint=checkpoint).outcome.points
    assert isinstance(last, CheckedPoints)
    for name in ("motion", "p_work", "axis", "feed"):
        assert getattr(first.program, name).tobytes() == getattr(last.program, name).tobytes()
    assert (first.gouge, first.length, first.scallop) == (last.gouge, last.length, last.scallop)
    assert first.left.rest.tobytes() == last.left.rest.tobytes()


def test_a_run_that_was_stopped_goes_on(tmp_path: Path) -> None:
    loaded = load_job(job(tmp_path / "job"))
    whole = run_job(loaded)
    said: list[str] = []
    reached: list[str] = []

    def until(text: str) -> Progress:
        def progress(done: float, what: str) -> None:
            reached.append(what)
            if what.startswith(text):
                raise Cancelled("stopped")

        return progress

    for text in ("patches", "paths of 1 patches"):
        with (
            pytest.raises(Cancelled),
            Checkpoint(tmp_path / "kept", 0.0, notice=said.append) as checkpoint,
        ):
            run_job(loaded, until(text), checkpoint)
    assert "largest cutters, corner radius 2 mm" in reached
    reached.clear()
    with Checkpoint(tmp_path / "kept", 0.0, notice=said.append) as checkpoint:
        done = run_job(loaded, lambda _, what: reached.append(what), checkpoint)
    went_on = [text for text in said if not text.startswith("estimate: ")]
    # each of the three runs says what it needs before it begins
    assert len(said) == len(went_on) + 3
    assert [text.split(" of ")[0].rstrip("0123456789") for text in went_on] == ["continues after step "] * 2
    # what was searched is not searched again
    assert not any(what.startswith("largest cutters") for what in reached)
    first, last = whole.outcome, done.outcome
    assert first.programs is not None
    assert len(first.programs) == len(last.programs) > 0
    for a, b in zip(first.programs, last.programs, strict=True):
        for name in ("motion", "p_work", "axis", "feed"):
            assert getattr(a.setting.program, name).tobytes() == getattr(b.setting.program, name).tobytes()
        assert replace(a.gouge) == b.gouge
        assert a.scallops == b.scallops
    assert [c.left.rest.tobytes() for c in first.covered] == [c.left.rest.tobytes() for c in last.covered]
