"""The add-on of FreeCAD in `freecadcmd`: a job of FreeCAD's own CAM is checked, shown, and gets other feeds."""

from __future__ import annotations

import json
import math
import os
import shlex
import shutil
import subprocess
import sys
import tomllib
from importlib import import_module
from pathlib import Path
from types import ModuleType, SimpleNamespace
from xml.etree import ElementTree

import numpy as np
import pytest

from chipload.jobs.feeds.tables import FeedsTable
from chipload.machine.machine import machine_named
from chipload.program.program import DWELL, RAPID, Program
from chipload.program.read import read_program

ADDON = Path(__file__).parents[2] / "integrations" / "freecad"
FREECAD = shutil.which("freecadcmd") or shutil.which("FreeCADCmd")
#: [mm] of one level of the outline: the sides, quarter circles of 3 mm at the corners
LEVEL = 2 * (40 + 30) + 2 * math.pi * 3


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    if FREECAD is None:
        pytest.skip("no freecadcmd: the add-on is not run in FreeCAD")
    pytest.importorskip("OCP", reason="no CAD kernel: the stock of a FreeCAD document is not read")
    out = tmp_path_factory.mktemp("freecad")
    command = f"{shlex.quote(sys.executable)} -m chipload"
    own = os.environ | {"ADDON": str(ADDON), "FOLDER": str(out), "CHIPLOAD": command, "HOME": str(out)}
    script = Path(__file__).with_name("freecad_job.py")
    subprocess.run([FREECAD, str(script)], env=own, stdin=subprocess.DEVNULL, capture_output=True, check=False)
    fault = out / "fault.txt"
    assert not fault.exists(), fault.read_text()
    return out


@pytest.fixture(scope="module")
def found(folder: Path) -> dict[str, object]:
    return json.loads((folder / "out.json").read_text())


def test_what_the_document_states_is_no_guess(folder: Path, found: dict[str, object]) -> None:
    """Stock (1 mm around the part), diameter and cutting edge are the document's; the tool has no flutes in it."""
    assert (found["jobs"], found["settings"]) == (["Job"], [])
    assert sorted(found["guesses"]) == ["flutes", "helix_deg", "name", "name", "overhang_mm"]
    text = (folder / "part-chipload" / "job.toml").read_text()
    assert "low_mm = [-1.0, -1.0, -1.0]" in text
    assert "high_mm = [41.0, 31.0, 11.0]" in text


def test_the_program_is_that_of_freecads_own_post(folder: Path) -> None:
    """Motion by motion: the same end, the same feed; FreeCAD rounds to 0.001 mm."""
    machine = machine_named("vmc")
    ours, theirs = (
        read_program(path, machine, dialect="linuxcnc", feed=10.0).program
        for path in (folder / "part-chipload" / "program.ngc", folder / "posted.ngc")
    )
    ends, feeds = zip(*(_cuts(program) for program in (ours, theirs)), strict=True)
    assert np.abs(ends[0] - ends[1]).max() < 1.1e-3
    assert np.abs(feeds[0] - feeds[1]).max() < 1.1e-3


def _cuts(program: Program) -> tuple[np.ndarray, np.ndarray]:
    """Ends [mm] and feeds [mm/s] of the motions with a feed that move; a post may leave out the others."""
    length = np.r_[0.0, np.linalg.norm(np.diff(program.p_work, axis=0), axis=1)]
    cuts = (program.motion != RAPID) & (program.motion != DWELL) & (length > 1e-9)
    return program.p_work[cuts], program.feed[cuts]


def test_the_verdict_and_its_findings_are_in_the_document(found: dict[str, object]) -> None:
    """With every guess stated the rigid model is the only thing in doubt; its place stands on the path."""
    assert found["verdict"] == "unproven"
    kinds = [kind for kind, _ in found["shown"]]
    assert kinds.count("App::FeaturePython") == 1
    assert kinds.count("App::Annotation") >= 1
    labels = [label for kind, label in found["shown"] if kind == "Part::Feature"]
    edges = [[float(label.split()[1]), float(label.split()[3])] for label in labels]
    assert 1 <= len(edges) <= 5
    assert edges[-1][1] == pytest.approx(found["force"], rel=1e-3)
    # two levels, the plunges between 14 and -1 mm, and nothing that is a rapid
    assert found["length"] == pytest.approx(2 * LEVEL + 15.0, rel=0.01)


def test_feeds_are_written_back(found: dict[str, object]) -> None:
    """The force stays below 300 N at twice the feed, the greatest that is asked for: each feed is doubled."""
    assert found["exceeding"].startswith("the feeds are not written: with them the program exceeds a limit")
    assert found["kept"]
    before, after = ([f or 0.0 for f in found[key]] for key in ("before", "after"))
    assert found["changed"] == np.count_nonzero(before) > 10
    assert after == pytest.approx([2.0 * f for f in before], rel=1e-5)
    assert found["better"] == "unproven"


def test_what_cannot_be_done_is_refused(found: dict[str, object]) -> None:
    assert found["outdated"] == "operation Profile: has changed since it was checked: check the job again"
    assert "'machine.name': must be a key, = and a value" in found["not_a_setting"]
    assert found["no_program"].startswith("/nowhere/chipload: cannot be started")


# -- without FreeCAD ---------------------------------------------------------------------------------------------
@pytest.fixture
def addon(monkeypatch: pytest.MonkeyPatch) -> dict[str, ModuleType]:
    """Modules of the add-on that need no FreeCAD."""
    monkeypatch.syspath_prepend(str(ADDON))
    return {name: import_module(f"chipload_freecad.{name}") for name in ("client", "feeds", "job_folder")}


def cam_job(settings: list[str], document: Path) -> SimpleNamespace:
    """What the add-on reads of a CAM job."""
    document.write_bytes(b"")
    return SimpleNamespace(
        Name="Job",
        PropertiesList=["ChiploadSettings"],
        ChiploadSettings=settings,
        Document=SimpleNamespace(saveCopy=lambda name: shutil.copyfile(document, name)),
    )


def test_new_feeds_are_asked_for_without_divided_lines(addon, tmp_path, monkeypatch):
    """A command of an operation has one feed: chipload divides lines unless it is told not to."""
    calls: list[list[str]] = []
    monkeypatch.setattr(addon["job_folder"], "call", lambda *words: calls.append([str(w) for w in words]) or "")
    monkeypatch.setattr(addon["job_folder"], "read_result", lambda *_: None)
    job = cam_job(["operation.0.feeds.fastest_percent = 150"], tmp_path / "a.FCStd")
    addon["job_folder"].check(job, tmp_path / "job", feeds=True)
    words = calls[1]
    sets = dict(words[k + 1].split("=") for k, word in enumerate(words) if word == "--set")
    keys = {key.removeprefix("operation.0.feeds."): json.loads(value) for key, value in sets.items()}
    assert FeedsTable.model_fields["divide"].default
    table = FeedsTable(**keys)
    assert (table.divide, table.fastest_percent, table.slowest_percent) == (False, 150.0, 25.0)
    job.ChiploadSettings.append("operation.0.feeds.divide = true")
    with pytest.raises(addon["client"].ChiploadError) as err:
        addon["job_folder"].check(job, tmp_path / "job", feeds=True)
    assert str(err.value) == (
        "ChiploadSettings: 'operation.0.feeds.divide = true': leave it out: a command of an operation has one feed"
    )


def test_feeds_go_to_the_commands_of_their_lines(addon, tmp_path):
    """Feeds in mm/s, modal; a program of more lines than that of the document is refused."""
    (tmp_path / "feeds").mkdir()
    (tmp_path / "program.ngc").write_text("G21\nG1 X1 F60\nG1 X2\n(b) G0 X3\nG2 X4 I.5 J0\n")
    (tmp_path / "program_lines.csv").write_text("line,operation,command\n2,A,0\n3,A,1\n4,A,2\n5,B,0\n")
    new = tmp_path / "feeds" / "program-feeds.ngc"
    new.write_text("G21\nG1 X1 F120\nG1 X2 F90\n(b) G0 X3\nG2 X4 I.5 J0\n")
    assert addon["feeds"].new_feeds(tmp_path) == {
        ("A", 0): (2.0, {"X": 1.0}), ("A", 1): (1.5, {"X": 2.0}), ("B", 0): (1.5, {"X": 4.0, "I": 0.5, "J": 0.0}),
    }  # fmt: skip
    new.write_text("G21\nG1 X.5 F120\nG1 X1 F60\nG1 X2 F90\n(b) G0 X3\nG2 X4 I.5 J0\n")
    with pytest.raises(addon["client"].ChiploadError) as err:
        addon["feeds"].new_feeds(tmp_path)
    assert str(err.value) == ("program-feeds.ngc: 6 lines, program.ngc: 5: a line was divided: look for feeds again")


def test_the_package_names_what_is_there() -> None:
    """What FreeCAD's add-on manager reads, and the class that InitGui.py registers."""
    space = "{https://wiki.freecad.org/Package_Metadata}"
    root = ElementTree.parse(ADDON / "package.xml").getroot()
    bench = root.find(f"{space}content/{space}workbench")
    assert bench.findtext(f"{space}classname") == "ChiploadWorkbench"
    assert "class ChiploadWorkbench" in (ADDON / "InitGui.py").read_text()
    assert (ADDON / bench.findtext(f"{space}subdirectory") / "Init.py").is_file()
    project = tomllib.loads((ADDON.parents[1] / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert root.findtext(f"{space}version") == project["version"]
    assert root.find(f"{space}maintainer").get("email")
    for icon in (root.findtext(f"{space}icon"), bench.findtext(f"{space}icon")):
        assert ElementTree.parse(ADDON / icon).getroot().tag == "{http://www.w3.org/2000/svg}svg"
    # the folder is copied alone: it holds its licence
    assert (ADDON / root.find(f"{space}license").get("file")).read_text() == (ADDON.parents[1] / "LICENSE").read_text()
