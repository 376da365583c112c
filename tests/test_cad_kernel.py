"""Processes of the CAD kernel that tests fork: they answer and end as those that users start."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from cad_kernel import Forked, Loaded
from chipload import examples
from chipload.errors import InputError
from chipload.geometry import isolated
from chipload.geometry.isolated import Isolated

WEB = Path(examples.__file__).parent / "part" / "web.step"


@pytest.fixture(scope="module")
def loaded() -> Iterator[Loaded]:
    pytest.importorskip("OCP", reason="no CAD kernel")
    process = Loaded()
    yield process
    process.close()


def said(file: Path, function: str) -> object:
    """The answer of the kernel, or why it refuses."""
    with Isolated(file, "part.file", "step.read_part") as part:
        try:
            return part.call(function)
        except InputError as err:
            return str(err)


def test_it_answers_as_a_started_one(loaded, tmp_path, monkeypatch):
    damaged = tmp_path / "damaged.step"
    damaged.write_bytes(WEB.read_bytes()[:2000])
    asked = [(WEB, "step.levels"), (WEB, "step.nothing"), (damaged, "step.levels")]
    started = [said(*what) for what in asked]
    monkeypatch.setattr(isolated, "_start", lambda: Forked(loaded))
    assert [said(*what) for what in asked] == started
    assert len(started[0]) > 1
    assert started[1].startswith("part.file = web.step: damaged: the CAD kernel fails on it: AttributeError")


def test_its_end_is_seen(loaded):
    one, other = Forked(loaded), Forked(loaded)
    os.kill(one.pid, signal.SIGKILL)
    assert one.wait(5.0) == -signal.SIGKILL
    other.stdin.close()
    assert other.wait(5.0) == 0
    for process in (one, other):
        process.stdin.close()
        process.stdout.close()
