"""The notebooks that are shipped run, and their last cells agree with closed forms and symmetry."""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Iterator
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest

import chipload
from chipload.jobs import load_job, run_job

nbformat = pytest.importorskip("nbformat")
nbclient = pytest.importorskip("nbclient")
jupyter_client = pytest.importorskip("jupyter_client")
pytest.importorskip("ipykernel")

FOLDER = Path(str(files("chipload") / "examples" / "notebooks"))
NAMES = sorted(p.stem for p in FOLDER.glob("*.ipynb"))


@pytest.fixture(scope="module")
def ran() -> Iterator[Callable[[str], tuple[Any, list[Any]]]]:
    """The value of the last cell of a notebook, and all outputs; one kernel for all, which imports libraries once."""
    kernel = jupyter_client.KernelManager(kernel_name="python3")
    kernel.start_kernel(cwd=str(FOLDER))
    yield lambda name: _executed(name, kernel)
    kernel.shutdown_kernel(now=True)


def _executed(name: str, kernel: Any) -> tuple[Any, list[Any]]:
    """A notebook without any name of one before it."""
    book = nbformat.read(FOLDER / f"{name}.ipynb", as_version=4)
    book.cells.insert(0, nbformat.v4.new_code_cell("%reset -f"))
    client = nbclient.NotebookClient(book, km=kernel, timeout=300)
    client.execute()
    client.kc.stop_channels()
    out = [o for cell in book.cells for o in cell.get("outputs", ())]
    return ast.literal_eval(out[-1].data["text/plain"]), out


@pytest.mark.parametrize("name", NAMES)
def test_no_outputs_are_kept(name: str) -> None:
    book = nbformat.read(FOLDER / f"{name}.ipynb", as_version=4)
    nbformat.validate(book)
    code = [c for c in book.cells if c.cell_type == "code"]
    assert code
    assert all(c.outputs == [] and c.execution_count is None for c in code)
    assert f"`{name}.ipynb`" in (FOLDER / "README.md").read_text()


def test_program(ran) -> None:
    said, out = ran("program")
    # a slot 10 wide round a corner, inner and outer radius 1 and 11, and 1.5 mm off the outer wall; 4 deep
    slot = 400.0 + 0.25 * math.pi * (11.0**2 - 1.0) + 240.0
    wall = 1.5 * 40.0 + 0.25 * math.pi * (12.5**2 - 11.0**2) + 1.5 * 24.0
    assert said["removed_mm3"] == pytest.approx(4.0 * (slot + wall), rel=2e-4)
    assert said["verdict"] == ("unproven", "holds")
    alone, whole = said["deflection_um"]
    assert 0.0 < alone < whole < 60.0
    job = run_job(load_job(FOLDER / "job.toml"))
    assert chipload.History.of(job.outcome).numbers["deflection_um"]["max"] == pytest.approx(whole, rel=1e-9)
    assert "<table>" in out[0].data["text/html"]
    assert len(out[1].data["application/vnd.plotly.v1+json"]["data"]) >= 3


def test_chip(ran) -> None:
    said, out = ran("chip")
    assert said["pieces"] == 2
    # the turn about the point is the same seen from its end: the pieces are alike
    assert said["areas_mm2"][0] == pytest.approx(said["areas_mm2"][1], rel=1e-4)
    assert said["volume_mm3"] > 0.0
    assert sum("application/vnd.plotly.v1+json" in o.get("data", {}) for o in out) == 3


def test_wall(ran) -> None:
    said, _ = ran("wall")
    # by plate theory the edge's middle bears 0.504 of what its corner bears where b = 2 a, 0.73 where b = a
    assert 0.504 < 1.0 / said["corner_over_middle"] < 0.73
    # a beam of half the height gives way by an eighth; the edge of a plate by more, its corner bends by itself
    assert 1.0 < said["corner_over_half_height"] < 8.0
    before, after = said["corner_um_n"]
    assert said["weaker_by"] == pytest.approx(after / before)
    # more than a beam whose upper half is 2/3 as thick, 7/8 + 27/8 / 8; less than if all of it were
    assert 7.0 / 8.0 + 27.0 / 64.0 < said["weaker_by"] < 27.0 / 8.0


def test_contour(ran) -> None:
    found, out = ran("contour")
    # radial depth 0.1 on a straight wall; in the corner the centre runs on a radius of 3 and the stock begins at 7.9
    assert found["straight_deg"] == pytest.approx(math.degrees(math.acos(1.0 - 0.1 / 5.0)), abs=0.01)
    corner = math.degrees(math.acos((7.9**2 - 3.0**2 - 5.0**2) / (2.0 * 3.0 * 5.0)))
    assert found["corner_deg"] == pytest.approx(corner, abs=0.02)
    assert found["straight_deg"] < found["backward_deg"] < 13.0 < found["corner_deg"]
    assert found["verdict"] == "holds"
    assert set(found["time_s"]) == {"backward", "plain", "feed"}
    assert "<table>" in out[0].data["text/html"]


def test_torque(ran) -> None:
    found, _ = ran("torque")
    own, over = found["in_use"], found["over_percent"]
    assert over[own] <= 0.0
    # whatever takes less time exceeds the allowable torque
    assert all(over[name] > 0.0 for name, t in found["time_s"].items() if t < found["time_s"][own])
    assert len(over) == 6
    assert sum(value <= 0.0 for value in over.values()) == 3


def test_impeller(ran) -> None:
    found, out = ran("impeller")
    largest, times = found["largest_mm"], found["time_min"]
    assert len(largest) == 24
    # one cutter for all fits at each point; two mill in less time, and neither beats the proved bound
    assert 0.0 < found["one_cutter_mm"] <= largest[0] < largest[-1]
    assert found["least_time_min"] <= times["2 cutters"] <= times["1 cutter"]
    assert found["verdict"] == "holds"
    assert any("application/vnd.plotly.v1+json" in o.get("data", {}) for o in out)
