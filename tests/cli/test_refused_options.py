"""Options that do not go together, and files that a command cannot take: one line, and nothing is written."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path

import pytest

from chipload import jobs
from chipload.cli import program_filter
from chipload.cli.program_filter import INI
from chipload.errors import Cancelled, InputError, Severity
from chipload.simulation.checkpoint import Checkpoint
from chipload.sweep import run as sweep_run
from command import call
from slot_job import slot_job, slot_program
from torque_job import TUBE_JOB

READ_ONLY = '[program]\nfile = "slot.ngc"\n[machine]\nname = "vmc"\n'


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A program, a job that only reads it, a torque job, and a file where a folder could be."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv(INI, raising=False)
    Path("slot.ngc").write_text(slot_program())
    Path("read.toml").write_text(READ_ONLY)
    Path("tube.toml").write_text(TUBE_JOB)
    Path("file").write_text("not a folder")
    return tmp_path


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("init slot.ngc", "slot.ngc: the folder is missing: use chipload init FILE DIR"),
        ("init slot.ngc new --material", "slot.ngc: a template takes no file: use chipload init --material DIR"),
        ("init none.ngc new", "none.ngc: no such file: name a program, a drawing, a model or sections of a blade"),
        ("init slot.ngc file", "file: is not a folder: name another one"),
        ("fit read.toml --out r", "read.toml: has no [[measurement]]: use chipload run for this job"),
        ("cuts read.toml --out r", "read.toml: has no [wall]: calibration cuts need a thin-wall job"),
        ("check slot.ngc --set a=1", "--set: applies to a job: leave it out for other files"),
        ("check read.toml --machine vmc", "--machine: applies to a program: in a job, state it in the job file"),
        ("convert slot.ngc new.ngc", "--machine: missing: name a file (.toml, .ini) or one of "),
        ("mtconnect x.xml --out m.toml --component C", "--component: applies to a log: leave it out, or use --out "),
        (
            "mtconnect x.xml --out m.txt",
            "--out m.txt: must end with .toml (the machine) or .csv (a log of its spindle)",
        ),
        ("hal h.toml --current-pin a --power-pin b", "--current-pin, --power-pin: state only the one that the spindle"),
        ("filter slot.ngc", "--machine: missing: name the .ini of the machine, or run LinuxCNC, which sets INI_FILE"),
        (
            "run read.toml --out r --workers 2",
            "--workers = 2: nothing is simulated in a job without [[operation]]: leave it out",
        ),
        ("run tube.toml --out r --workers 2", "--workers, --dask: a torque job has no parts that other processes can "),
        ("run read.toml --out r --keep-s -1", "--keep-s = -1: must be at least 0 s"),
        ("run read.toml --out r --keep-s nan", "--keep-s = nan: must be at least 0 s"),
        ("simulate read.toml --machine vmc", "--machine: read.toml is a job: state it there, or with --set"),
    ],
)
def test_what_does_not_go_together(folder: Path, words: str, message: str) -> None:
    before = sorted(folder.iterdir())
    code, out, err = call(*words.split())
    assert (code, out) == (2, "")
    assert err.startswith(f"chipload: {message}")
    assert err.count("\n") == 1
    assert sorted(folder.iterdir()) == before


def test_a_template_is_not_written_over_another_file(folder: Path) -> None:
    assert call("init", "--material", "new")[0] == 0
    own = folder / "new" / "material.toml"
    own.write_text("mine")
    assert call("init", "--material", "new")[::2] == (
        2,
        "chipload: new/material.toml: already exists and is not overwritten: name another folder\n",
    )
    assert own.read_text() == "mine"


@pytest.mark.parametrize(
    ("files", "named"),
    [
        (["/"], "it names none"),
        (["", ".."], ".."),
        ([], "it names none"),
        ("a.nc", "it names none"),
        (["a.nc"], "a.nc"),
    ],
)
def test_a_camotics_project_without_its_program(folder: Path, files: object, named: str) -> None:
    """`/` ended with a fault: it has no name whose ending could be another."""
    Path("own.camotics").write_text(json.dumps({"files": files, "tools": {}}))
    code, _, err = call("init", "own.camotics", "new")
    assert code == 2
    assert f"none of its files is an NC text that exists ({named}): put it next to the project" in err


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("Other.xml", "x", "not a FreeCAD document: it holds no Document.xml"),
        ("Document.xml", '<!DOCTYPE a [<!ENTITY b "c">]><a>&b;</a>', "Document.xml: entities are not read"),
        ("Document.xml", "<a", "Document.xml: not XML: "),
        ("Document.xml", "<a/>", "neither a CAM job nor a part: "),
    ],
)
def test_a_document_that_is_none_of_freecad(folder: Path, name: str, text: str, message: str) -> None:
    with zipfile.ZipFile("own.FCStd", "w") as archive:
        archive.writestr(name, text)
    code, _, err = call("init", "own.FCStd", "new")
    assert code == 2
    assert err.startswith(f"chipload: own.FCStd: {message}")


# -- the filter of LinuxCNC -------------------------------------------------------------------------------------
@pytest.mark.parametrize("there", [False, True])
def test_a_job_of_another_program_beside_it(folder: Path, there: bool) -> None:
    """A job that names a missing file ended with a fault."""
    Path("slot.toml").write_text(READ_ONLY.replace("slot.ngc", "other.ngc"))
    if there:
        Path("other.ngc").write_text("M2\n")
    code, out, err = call("filter", "slot.ngc", "--machine", "vmc")
    assert (code, out) == (2, "")
    assert err.splitlines()[-1] == (
        "chipload: slot.toml: is not a job of slot.ngc: name the program in [program] file, or rename the job"
    )


def test_a_program_that_changes_while_it_is_checked(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def read(file: Path, *_: object) -> Severity:
        file.write_text("G1 X999 F999\nM2\n")
        return Severity.NOTE

    monkeypatch.setattr(program_filter, "_read", read)
    assert call("filter", "slot.ngc", "--machine", "vmc") == (
        2, "", "chipload: slot.ngc: changed during the check: load it again\n"
    )  # fmt: skip


# -- stopped ----------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("kept", [False, True])
def test_a_stopped_run_tells_what_is_kept(folder: Path, monkeypatch: pytest.MonkeyPatch, kept: bool) -> None:
    def stopped(_loaded: object, _progress: object, checkpoint: Checkpoint, **_: object) -> None:
        if kept:
            checkpoint.keep_pass("gouges", b"", 12)
        raise Cancelled("")

    monkeypatch.setattr(jobs, "run_job", stopped)
    code, out, err = call("run", slot_job(folder / "slot"), "--out", "r")
    assert (code, out) == (130, "")
    told = "12 steps of a pass are kept in r.unfinished: the same command continues from there; with --fresh it starts"
    assert err.startswith(f"chipload: stopped: {told if kept else 'nothing was written'}")
    assert (folder / "r.unfinished").exists() is kept
    assert not (folder / "r").exists()


def test_a_stopped_sweep(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def stopped(*_: object, **__: object) -> None:
        raise Cancelled("")

    monkeypatch.setattr(sweep_run, "run_sweep", stopped)
    assert call("sweep", "read.toml", "--out", "r", "--over", "a.b=1,2") == (
        130, "", "chipload: stopped: finished cases are kept: the same command continues\n"
    )  # fmt: skip


def test_a_fault_is_told_as_one(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Exit code 1 is that of an error in chipload alone; the traceback comes with --debug."""

    def faulty(*_: object, **__: object) -> None:
        raise ZeroDivisionError("by zero")

    monkeypatch.setattr(jobs, "load_job", faulty)
    code, _, err = call("run", "read.toml", "--out", "r")
    assert code == 1
    assert err.startswith("chipload: an error in chipload: ZeroDivisionError: by zero. Please report it")
    assert "Traceback" not in err
    monkeypatch.setattr(jobs, "load_job", lambda *_: (_ for _ in ()).throw(InputError("a wrong value")))
    assert call("run", "read.toml", "--out", "r") == (2, "", "chipload: a wrong value\n")
