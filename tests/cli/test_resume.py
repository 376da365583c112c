"""Simulations that are killed or stopped and run again, by the command line."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import trimesh

from cli.test_simulate import JOB
from command import TIME_LEFT, call

COMMAND = [sys.executable, "-c", "from chipload.cli import main; main()"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A job of some thousand short steps, and its result from a run that nobody disturbed."""
    place = tmp_path_factory.mktemp("job")
    words = ["G21 G90 G17 G94", "T1 M6", "S3000 M3", "G0 X-10 Y-15 Z5", "G0 Z-1", "F600"]
    for k in range(16):
        words += [f"G1 X{60 if k % 2 == 0 else -10}", f"G1 Y{-15 + 2 * (k + 1)}"]
    (place / "slot.ngc").write_text("\n".join([*words, "G0 Z5", "M2", ""]))
    (place / "job.toml").write_text(JOB.replace("step_mm = 2.0", "step_mm = 0.2"))
    assert ran(place, "whole")[0] == 0
    return place


def ran(place: Path, out: str, *more: str, file: str = "job.toml") -> tuple[int, str]:
    """Exit code and stderr of a run in this process: what is compared is how it goes on, not how a process starts."""
    code, _, err = call("run", place / file, "--out", place / out, *more)
    return code, err


def start(place: Path, out: str, *more: str, file: str = "job.toml") -> subprocess.Popen[str]:
    words = [*COMMAND, "run", str(place / file), "--out", str(place / out), *more]

    # what starts the tests in the background may have it ignore these, which is handed down
    def heard() -> None:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        signal.signal(signal.SIGHUP, signal.SIG_DFL)

    return subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, preexec_fn=heard)


def ended(process: subprocess.Popen[str]) -> subprocess.CompletedProcess[str]:
    out, err = process.communicate(timeout=500)
    return subprocess.CompletedProcess(process.args, process.returncode, out, TIME_LEFT.sub("", err))


def goes_on(said: str, passes: tuple[str, ...] = ("heights",)) -> tuple[int, int]:
    """What was said is that these passes and then the removal go on: steps that were done, and all."""
    *before, last = said.splitlines()
    assert [re.split(r" continues after step \d+, kept in ", text)[0] for text in before] == [
        f"chipload: the pass '{name}'" for name in passes
    ]
    found = re.fullmatch(r"chipload: continues after step (\d+) of (\d+), kept in \S+\.unfinished", last)
    assert found is not None
    return int(found[1]), int(found[2])


def stop(
    place: Path, out: str, how: signal.Signals, *more: str, file: str = "job.toml"
) -> subprocess.CompletedProcess[str]:
    """Start a run and end it when it has kept something."""
    process = start(place, out, "--keep-s", "0", *more, file=file)
    while process.poll() is None and not (place / f"{out}.unfinished" / "last.json").exists():
        time.sleep(0.01)
    process.send_signal(how)
    return ended(process)


def same(place: Path, out: str, known: str = "whole") -> None:
    """The result has the bytes of the one that nobody disturbed, and nothing is left beside it."""
    names = sorted(p.name for p in (place / known).iterdir())
    assert names == sorted(p.name for p in (place / out).iterdir())
    assert "history.parquet" in names
    for name in names:
        assert (place / out / name).read_bytes() == (place / known / name).read_bytes(), name
    assert not (place / f"{out}.unfinished").exists()


def test_a_run_that_was_killed_goes_on_to_the_same_bytes(folder: Path) -> None:
    killed = stop(folder, "killed", signal.SIGKILL)
    assert killed.returncode == -signal.SIGKILL
    assert not (folder / "killed").exists()
    assert (folder / "killed.unfinished" / "last.json").exists()
    code, said = ran(folder, "killed")
    assert code == 0
    done, steps = goes_on(said)
    assert 0 < done < steps
    same(folder, "killed")


DYNAMICS = """[dynamics]
frequency_percent = 2.0
damping_percent = 20.0
stiffness_percent = 10.0
[[dynamics.mode]]
of = "cutter"
direction = "x"
frequency_hz = 900.0
damping_ratio = 0.03
stiffness_n_um = 8.0
[[dynamics.mode]]
of = "cutter"
direction = "y"
frequency_hz = 950.0
damping_ratio = 0.03
stiffness_n_um = 9.0
"""


def test_a_run_with_modes_that_was_killed_goes_on_to_the_same_bytes(folder: Path) -> None:
    """The margins of cuts that were met before are those of the first that was met: they belong to the state."""
    job = (folder / "job.toml").read_text().replace("step_mm = 0.2", "step_mm = 5.0")
    (folder / "modes.toml").write_text(job + DYNAMICS)
    assert ran(folder, "modes", file="modes.toml")[0] in (0, 3)
    numbers = json.loads((folder / "modes" / "summary.json").read_text())["operations"][0]["stability"]
    assert numbers["different_cuts"] > 1
    killed = stop(folder, "killed-modes", signal.SIGKILL, file="modes.toml")
    assert killed.returncode == -signal.SIGKILL
    assert list((folder / "killed-modes.unfinished").glob("watch-*.npz"))
    code, said = ran(folder, "killed-modes", file="modes.toml")
    assert code in (0, 3)
    goes_on(said)
    same(folder, "killed-modes", "modes")
    # the modes belong to the input
    stop(folder, "other-modes", signal.SIGKILL, file="modes.toml")
    change = ("--set", "dynamics.mode.0.stiffness_n_um=7.0")
    other = ran(folder, "other-modes", *change, file="modes.toml")
    assert other[1].endswith("\nchipload: starts from the beginning: the checkpoint belongs to another input\n")


def test_a_run_that_was_killed_reads_what_it_had_found_of_the_part(folder: Path) -> None:
    """The distances to the part are found before the removal: the run that goes on begins with neither."""
    trimesh.creation.box(bounds=[[0.0, -15.0, -5.0], [50.0, 15.0, -1.5]]).export(folder / "part.stl")
    part = '[part]\nfile = "part.stl"\nunits = "mm"\nspacing_mm = 2.0\n'
    job = (
        (folder / "job.toml")
        .read_text()
        .replace("step_mm = 0.2", "step_mm = 1.0")
        .replace("[material]", part + "[material]")
    )
    (folder / "part.toml").write_text(job)
    known, said = ran(folder, "part", file="part.toml")
    assert known in (0, 3), said
    assert stop(folder, "killed-part", signal.SIGKILL, file="part.toml").returncode == -signal.SIGKILL
    assert (folder / "killed-part.unfinished" / "pass-part.npz").exists()
    again, said = ran(folder, "killed-part", file="part.toml")
    assert again == known
    goes_on(said, ("heights", "part"))
    same(folder, "killed-part", "part")


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGHUP])
def test_ctrl_c_says_what_is_kept_and_how_to_go_on(folder: Path, how: signal.Signals) -> None:
    out = f"stopped-{how.name}"
    stopped = stop(folder, out, how)
    assert stopped.returncode == 130
    assert re.fullmatch(
        rf"chipload: stopped: \d+ steps are kept in {out}.unfinished: the same command continues from there; with "
        r"--fresh it starts from the beginning\n",
        stopped.stderr,
    )
    assert ran(folder, out, "--fresh") == (0, "chipload: starts from the beginning, as requested\n")
    same(folder, out)


def test_another_input_does_not_go_on(folder: Path) -> None:
    stop(folder, "other", signal.SIGKILL)
    again = ran(folder, "other", "--set", "material.name=al6082-t6")
    # the stock of each moment does not depend on the material
    kept, said = again[1].splitlines()
    assert kept.startswith("chipload: the pass 'heights' continues after step ")
    assert said == "chipload: starts from the beginning: the checkpoint belongs to another input"
    other = (folder / "other" / "history.parquet").read_bytes()
    assert other != (folder / "whole" / "history.parquet").read_bytes()


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="cores cannot be chosen here")
def test_one_core_and_two_give_the_same_bytes(folder: Path) -> None:
    mine = sorted(os.sched_getaffinity(0))
    if len(mine) < 2:
        pytest.skip("there is one core")
    os.sched_setaffinity(0, mine[:1])
    try:
        process = start(folder, "one")
    finally:
        os.sched_setaffinity(0, mine)
    assert ended(process).returncode == 0
    same(folder, "one")


def test_a_number_of_seconds_that_is_none(folder: Path) -> None:
    assert ran(folder, "none", "--keep-s", "-1") == (2, "chipload: --keep-s = -1: must be at least 0 s\n")
