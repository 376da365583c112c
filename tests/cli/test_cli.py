"""The command line: what it says, where, and with which exit code."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from chipload import examples, jobs
from chipload.jobs import Capability, FinishedJob, LoadedJob
from chipload.jobs.contour.outcome import ContourResult
from chipload.progress import Progress
from chipload.result import Verdict
from chipload.simulation.checkpoint import Checkpoint
from command import call

Maker = Callable[..., ContourResult]
CHIPLOAD = [sys.executable, "-c", "from chipload.cli import main; main()"]


def finished(capability: Capability, made: ContourResult) -> FinishedJob:
    """What a run gives of an outcome that is made."""
    result, figures = capability.module("result"), capability.module("figures")
    return FinishedJob(result.result_of(made), figures.presentation_of(made), made)


@pytest.fixture
def planned(monkeypatch: pytest.MonkeyPatch, outcome: Maker) -> Callable[[ContourResult | BaseException], None]:
    """Let `run` find an outcome, or an accident, in place of the planner."""

    def put(made: ContourResult | BaseException) -> None:
        def stand_in(loaded: LoadedJob, progress: Progress, kept: Checkpoint, **_: object) -> FinishedJob:
            progress(0.5, "half")
            if isinstance(made, BaseException):
                raise made
            return finished(loaded.capability, made)

        monkeypatch.setattr(jobs, "run_job", stand_in)

    put(outcome())
    return put


def test_a_job_that_holds_ends_with_0(job_dir: Path, tmp_path: Path, planned: object) -> None:
    code, out, err = call("run", job_dir / "job.toml", "--out", tmp_path / "r")
    assert (code, err) == (0, "")
    assert out.splitlines()[0].startswith(
        "Holds: engagement 12.7 of 13 deg in the finish pass, margin 2.48 %, at (5, 8.01, -5)."
    )
    assert out.splitlines()[1].startswith("Not checked: ")
    assert out.splitlines()[2] == f"report: {tmp_path / 'r' / 'report.html'}"


@pytest.mark.parametrize(
    ("use", "found", "verdict"),
    [
        ("plain", Verdict.HOLDS, "exceeds"),
        ("backward", Verdict.UNPROVEN, "unproven"),
        ("backward", Verdict.EXCEEDS, "exceeds"),
    ],
)
def test_a_job_that_does_not_hold_ends_with_3_and_its_result(
    job_dir: Path,
    tmp_path: Path,
    planned: Callable[[ContourResult], None],
    outcome: Maker,
    use: str,
    found: Verdict,
    verdict: str,
) -> None:
    planned(outcome(use, found))
    code, out, err = call("run", job_dir / "job.toml", "--out", tmp_path / "r")
    assert (code, err) == (3, "")
    assert out.startswith(f"{verdict.capitalize()}: ")
    assert json.loads((tmp_path / "r" / "summary.json").read_bytes())["verdict"] == verdict


def test_wrong_input_ends_with_2_and_one_line(job_dir: Path, tmp_path: Path) -> None:
    job = job_dir / "job.toml"
    code, out, err = call("run", job, "--out", tmp_path / "r", "--set", "operation.0.feed_mm_min=-4")
    assert (code, out) == (2, "")
    assert err == "chipload: job.toml: operation.0.feed_mm_min = -4: must be above 0 (feed of the cutter's centre)\n"
    assert [p.name for p in tmp_path.iterdir()] == ["job"]


def test_a_folder_that_is_refused_is_said_before_the_work(job_dir: Path, planned: Callable[..., None]) -> None:
    planned(AssertionError("the planner was called"))
    code, _, err = call("run", job_dir / "job.toml", "--out", job_dir)
    assert code == 2
    assert "holds files that are not a result of chipload" in err


def test_a_fault_of_ours_ends_with_1_and_says_how_to_report(
    job_dir: Path, tmp_path: Path, planned: Callable[..., None]
) -> None:
    planned(ZeroDivisionError("division by zero"))
    words = ("run", job_dir / "job.toml", "--out", tmp_path / "r")
    code, _, err = call(*words)
    assert code == 1
    assert err == (
        "chipload: an error in chipload: ZeroDivisionError: division by zero. Please report it with the job file and "
        "the output of the same command with --debug\n"
    )
    assert "Traceback" in call(*words, "--debug")[2]
    assert not (tmp_path / "r").exists()


def test_a_stop_ends_with_130(job_dir: Path, tmp_path: Path, planned: Callable[..., None]) -> None:
    planned(KeyboardInterrupt())
    code, out, err = call("run", job_dir / "job.toml", "--out", tmp_path / "r")
    assert (code, out, err) == (130, "", "chipload: stopped: nothing was written\n")


@pytest.mark.parametrize("words", [("run",), ("run", "job.toml"), ("nonsense",), ("check", "--sett", "a=1"), ()])
def test_wrong_usage_ends_with_2(words: tuple[str, ...]) -> None:
    assert call(*words)[0] == 2


def test_check_reads_and_plans_nothing(job_dir: Path) -> None:
    code, out, err = call("check", job_dir / "job.toml")
    assert (code, err) == (0, "")
    assert out.splitlines()[:2] == [
        "job.toml: valid: 0 closed and 1 open contours, machine vmc, material al7075-carbide",
        "operation 0: contour, cutter 1 of 10 mm, 6 passes",
    ]
    pocket = ("operation.0.kind=pocket", 'operation.0.strategies=["pocket"]', "operation.0.use=pocket")
    code, out, err = call("check", job_dir / "job.toml", *(word for text in pocket for word in ("--set", text)))
    assert (code, out) == (2, "")
    assert "a closed contour is needed" in err
    assert sorted(p.name for p in job_dir.iterdir()) == ["README.md", "al7075-carbide.toml", "corner.dxf", "job.toml"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("part.file=none.dxf", "none.dxf: no such file"),
        ("part.file=README.md", "part.file = README.md: must end in .dxf, .step or .stp"),
        ("machine.name=vmx", "machine vmx: not known: the nearest is vmc"),
        ("material.name=al7075", "material al7075: not known: the nearest are al7075-"),
        ("material.file=no.toml", "no.toml: cannot be read: No such file or directory"),
        ("operation.0.speed_rpm=20000", "operation.0.speed_rpm = 20000: machine vmc turns from 60 to 15000 rpm: state"),
    ],
)
def test_check_reads_every_file(job_dir: Path, text: str, said: str) -> None:
    code, out, err = call("check", job_dir / "job.toml", "--set", text)
    assert (code, out) == (2, "")
    assert said in err
    assert err.count("\n") == 1


def test_examples_are_listed_with_a_line_each() -> None:
    code, out, _ = call("example")
    assert code == 0
    assert [line.split()[0] for line in out.splitlines()] == [
        "blade",
        "bracket",
        "chatter",
        "chips",
        "cone",
        "contour",
        "feeds",
        "frame",
        "hecc",
        "impeller",
        "notebooks",
        "part",
        "plate",
        "pocket",
        "trunnion",
        "tube",
    ]


@pytest.mark.parametrize("name", list(examples.example_titles()))
def test_an_example_that_was_copied_out_is_right(name: str, tmp_path: Path) -> None:
    code, out, _ = call("example", name, tmp_path / "mine")
    assert code == 0
    assert f"chipload run {tmp_path / 'mine' / 'job.toml'}" in out
    assert call("check", tmp_path / "mine" / "job.toml")[0] == 0


def test_an_example_overwrites_nothing(tmp_path: Path) -> None:
    (tmp_path / "a").write_text("")
    code, _, err = call("example", "contour", tmp_path)
    assert (code, err) == (2, f"chipload: {tmp_path}: is not empty: name a folder that is new or empty\n")


def test_the_demo_overwrites_nothing_and_runs_the_examples_of_make(tmp_path: Path) -> None:
    from chipload.cli.results import DEMO

    (tmp_path / "pocket").mkdir()
    (tmp_path / "pocket" / "mine.txt").write_text("mine")
    code, _, err = call("demo", tmp_path)
    assert code == 2
    assert "pocket" in err
    assert [path.name for path in tmp_path.iterdir()] == ["pocket"]
    makefile = (Path(__file__).parents[2] / "Makefile").read_text(encoding="utf-8")
    assert sorted(re.findall(r"\bjob (\w+)", makefile.split("\ndemo:")[1])) == sorted(DEMO)


def test_an_unknown_example_names_the_nearest(tmp_path: Path) -> None:
    code, _, err = call("example", "contur", tmp_path / "a")
    assert code == 2
    known = (
        "blade, bracket, chatter, chips, cone, contour, feeds, frame, hecc, impeller, notebooks, part, plate, "
        "pocket, trunnion, tube"
    )
    assert err == f"chipload: example contur: not known; did you mean contour? (known: {known})\n"


def test_version() -> None:
    assert call("--version")[:2] == (0, "chipload 0.2.0\n")


def test_help_comes_without_the_heavy_imports() -> None:
    heavy = "numpy", "numba", "scipy", "plotly", "trimesh", "pyarrow", "pydantic", "ezdxf", "OCP", "rich"
    code = "import sys; from chipload import cli; print([m for m in sys.argv[1:] if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code, *heavy], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def test_a_check_of_a_program_imports_no_library_that_it_does_not_use() -> None:
    heavy = "numba", "scipy.spatial", "scipy.sparse", "plotly", "trimesh", "pyarrow", "ezdxf", "OCP"
    job = Path(__file__).parents[2] / "examples/feeds/job.toml"
    code = (
        "import sys; from pathlib import Path; from chipload.jobs.inspection import inspect_file; "
        f"print(inspect_file(Path({str(job)!r}))[1], [m for m in sys.argv[1:] if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code, *heavy], capture_output=True, text=True, check=True)
    assert done.stdout == "True []\n"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_stopped_run_leaves_no_half_file(job_dir: Path, tmp_path: Path, number: signal.Signals) -> None:
    """The run is stopped when its temporary folder has appeared."""
    slow = (
        "import time\n"
        "from chipload.cli import main\n"
        "from chipload.report import folder\n"
        "write = folder._write\n"
        "folder._write = lambda path, data: (write(path, data), time.sleep(60))\n"
        "from chipload import jobs\n"
        "from importlib.util import module_from_spec, spec_from_file_location\n"
        f"import sys; sys.path.insert(0, {str(Path(__file__).parents[1])!r})\n"
        f"spec = spec_from_file_location('made', {str(Path(__file__).parents[1] / 'conftest.py')!r})\n"
        "made = module_from_spec(spec)\n"
        "spec.loader.exec_module(made)\n"
        "from chipload.jobs.contour.figures import presentation_of\n"
        "from chipload.jobs.contour.result import result_of\n"
        "one = made.made_outcome()\n"
        "done = jobs.FinishedJob(result_of(one), presentation_of(one), one)\n"
        "jobs.run_job = lambda loaded, progress, kept, **_: done\n"
        "main()\n"
    )
    words = [sys.executable, "-c", slow, "run", str(job_dir / "job.toml"), "--out", str(tmp_path / "r")]
    pipe = subprocess.PIPE
    # a shell that runs in the background lets its children ignore Ctrl-C
    heard = lambda: signal.signal(signal.SIGINT, signal.SIG_DFL)  # noqa: E731
    with subprocess.Popen(words, stdout=pipe, stderr=pipe, text=True, preexec_fn=heard) as process:
        for _ in range(600):
            if any(p.name.startswith(".chipload-") and list(p.iterdir()) for p in tmp_path.iterdir()):
                break
            time.sleep(0.1)
        os.kill(process.pid, number)
        out, err = process.communicate(timeout=60)
    assert (process.returncode, out, err) == (130, "", "chipload: stopped: nothing was written\n")
    assert [p.name for p in tmp_path.iterdir()] == ["job"]


def test_the_installed_command_ends_with_the_same_codes(job_dir: Path) -> None:
    job = str(job_dir / "job.toml")
    done = subprocess.run([*CHIPLOAD, "check", job], capture_output=True, text=True, check=False)
    assert done.returncode == 0
    done = subprocess.run([*CHIPLOAD, "check", job, "--set", "x=1"], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.count("\n") == 1
