"""Each job says before it starts what of it begins again where it is stopped."""

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
        ("feeds", "what finds new feeds does not resume: "),
        ("chatter", "what finds new speeds does not resume: "),
        ("part", "what finds new feeds and the compliance of the workpiece does not resume: "),
        ("contour", "a contour job does not resume: "),
        ("pocket", "a contour job does not resume: "),
        ("tube", "a torque job does not resume: "),
        ("plate", "plans that were simulated are kept; the simulation of a plan does not resume: "),
        ("impeller", ""),
    ],
)
def test_what_begins_again_is_said(tmp_path: Path, name: str, note: str) -> None:
    copy_example(name, tmp_path / "job")
    said = resume_note(load_job(tmp_path / "job" / "job.toml"))
    assert said.startswith(note)
    assert bool(said) == bool(note)
