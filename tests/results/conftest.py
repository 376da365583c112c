"""Every example is run once in a test run, at its own settings; the workers of a run share the results.

The first test that asks for an example runs it, behind a lock on a file; results stand in the base folder of the run.
"""

from __future__ import annotations

import fcntl
import json
import os
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from page_values import SOURCES
from typer.testing import CliRunner

import chipload.examples
import chipload.report.folder as folder_module
import chipload.report.removal as removal_module
from chipload.cli import app
from chipload.jobs import LoadedJob, load_job
from chipload.result import Result, Summary, load_result, read_summary

EXAMPLES = Path(chipload.examples.__file__).parent
#: of an example that takes many minutes: coarser steps, less of a surface; `make real` runs it whole
SHORTER: Mapping[str, tuple[str, ...]] = {
    "hecc": (
        "operation.0.most_cutters=1",
        "operation.0.tolerance_mm=1.0",
        *(f"surface.{k}.points=[6, 3]" for k in range(6)),
    ),
}
#: the stock that is shown has cells so many times as wide; of the second the shown volumes are tested
WIDER, WIDER_OF = 3.0, {"impeller": 1.6}


@dataclass(frozen=True, eq=False)
class Example:
    """An example that was run.

    Parameters
    ----------
    name : of :data:`page_values.SOURCES`
    folder : its result folder
    exit_code, output : of ``chipload run``
    differences : between the result that was made and the one that is read back; empty: none
    """

    name: str
    folder: Path
    exit_code: int
    output: str
    differences: tuple[str, ...]

    @property
    def loaded(self) -> LoadedJob:
        """Its job."""
        return load_job(_job_file(self.name), _sets(self.name, self.folder.parent))

    @property
    def limits(self) -> dict[str, Any]:
        """The limits that its job states."""
        return dict(tomllib.loads(_job_file(self.name).read_text()).get("limits", {}))

    @property
    def result(self) -> Result:
        """Its result, read back."""
        return load_result(self.folder)

    @property
    def summary(self) -> Summary:
        """Its summary."""
        return read_summary(self.folder)


@pytest.fixture(scope="session")
def example(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Example]:
    """The result of an example by name."""
    base = tmp_path_factory.getbasetemp()
    top = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "examples"
    top.mkdir(exist_ok=True)

    @cache
    def of(name: str) -> Example:
        for other, _ in SOURCES[name].files.values():
            of(other)
        with (top / f"{name}.lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            ended = top / f"{name}.json"
            if not ended.exists():
                ended.write_text(json.dumps(_run(name, top / name)))
            values = json.loads(ended.read_text())
        return Example(name, top / name, values["exit_code"], values["output"], tuple(values["differences"]))

    return of


def _job_file(name: str) -> Path:
    """The job file of an example."""
    source = SOURCES[name]
    return EXAMPLES / source.example / source.job


def _sets(name: str, results: Path) -> tuple[str, ...]:
    """What is changed in the job of an example."""
    return (*SHORTER.get(name, ()), *SOURCES[name].sets(results))


def _run(name: str, out: Path) -> dict[str, Any]:
    """Run an example as the command does, and compare what is read back with what was written."""
    made: list[Result] = []
    write = folder_module.write_result

    def kept(result: Result, *others: Any) -> Path:
        made.append(result)
        return write(result, *others)

    shown = removal_module.removal_mesh

    def wide(blank: Any, path: Any, cutters: Any, before: Any, wider: float) -> Any:
        return shown(blank, path, cutters, before, wider * WIDER_OF.get(name, WIDER))

    # nothing is kept on the way: what was made is compared when that has gone
    words = ["run", str(_job_file(name)), "--out", str(out), "--keep-s", "86400"]
    words += [word for value in _sets(name, out.parent) for word in ("--set", value)]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(folder_module, "write_result", kept)
        patch.setattr(removal_module, "removal_mesh", wide)
        done = CliRunner().invoke(app, words)
    differences = _differences(made[0], load_result(out)) if made else ["no result was written"]
    return {"exit_code": done.exit_code, "output": done.output, "differences": differences}


def _differences(made: Result, back: Result) -> list[str]:
    """What two results differ in, as names."""
    plain = ("capability", "title", "verdict", "message", "limits", "findings", "unchecked", "provenance", "note")
    out = [name for name in plain if getattr(made, name) != getattr(back, name)]
    own = ("name", "kind", "in_use", "time_s", "limits", "findings", "programs", "operation", "verdict")
    if [t.name for t in made.tracks] != [t.name for t in back.tracks]:
        return [*out, "tracks"]
    for a, b in zip(made.tracks, back.tracks, strict=True):
        out += [f"{a.name}: {name}" for name in own if getattr(a, name) != getattr(b, name)]
        out += [f"{a.name}: parameters"] if dict(a.parameters) != dict(b.parameters) else []
        before, after = a.columns, b.columns
        out += [f"{a.name}: columns {sorted(set(before) ^ set(after))}"] if set(before) != set(after) else []
        out += [f"{a.name}: {n}" for n in set(before) & set(after) if not _same(before[n], after[n])]
    if len(made.maps) != len(back.maps):
        return [*out, "maps"]
    for one, other in zip(made.maps, back.maps, strict=True):
        same = (one.name, one.column, one.track) == (other.name, other.column, other.track)
        same = same and all(_same(getattr(one, n), getattr(other, n)) for n in ("points", "values", "faces"))
        out += [] if same else [f"map {one.name}"]
    return out


def _same(a: Any, b: Any) -> bool:
    """Equal to the bit, words as words."""
    a, b = np.asarray(a), np.asarray(b)
    if a.dtype.kind in "OU":
        return a.astype(str).tolist() == b.astype(str).tolist()
    return bool(np.array_equal(a, b, equal_nan=a.dtype.kind == "f"))
