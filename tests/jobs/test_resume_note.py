"""Each job states before it starts which part of it does not resume."""

from __future__ import annotations

from pathlib import Path

import pytest

from chipload.examples import copy_example
from chipload.jobs import load_job, resume_note


@pytest.mark.parametrize(
    ("name", "note"),
    [
        ("chips", ""),
        ("trunnion", ""),
        ("feeds", "the calculation of new feeds does not resume: "),
        ("chatter", "the calculation of new speeds does not resume: "),
        ("part", "the calculation of new feeds and the compliance of the workpiece does not resume: "),
        ("contour", "a contour job does not resume: "),
        ("pocket", "a contour job does not resume: "),
        ("tube", "a torque job does not resume: "),
        ("plate", "simulated plans are kept; the simulation of a plan does not resume: "),
        ("impeller", ""),
    ],
)
def test_what_begins_again_is_said(tmp_path: Path, name: str, note: str) -> None:
    copy_example(name, tmp_path / "job")
    said = resume_note(load_job(tmp_path / "job" / "job.toml"))
    assert said.startswith(note)
    assert bool(said) == bool(note)
