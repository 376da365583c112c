"""A watched folder: each program that is new or has changed is simulated, and its verdict and report lie beside it."""

from __future__ import annotations

import hashlib
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from chipload.errors import InputError
from chipload.files import cannot_write, hash_of, is_file, write_whole
from chipload.processes import own_group, stop_group
from chipload.program.read import ENDINGS
from chipload.result.load import SUMMARY, load_result

#: what is added to the name of a program for its result folder and for its verdict
RESULT, VERDICT = "-chipload", ".verdict.txt"
#: last line of a verdict: of which bytes it is
OF_INPUT = "input: sha256 "
#: codes of a run that has a result; code of a program that did not end in time; those of the command line are 0 to 4
FINISHED, LATE = (0, 3), 5
#: [s] a stopped process may take so long to end by itself
PATIENCE_S = 10.0


@dataclass(frozen=True)
class FolderSettings:
    """How the programs of a folder are simulated.

    Parameters
    ----------
    job : a job file in which each program takes the place of ``program.file``; None: a draft with guesses
    machine, tools : of the drafts, as ``chipload simulate`` takes them
    sets : values in place of those of the job, ``KEY.PATH=VALUE``
    limit_s : [s] above 0, after which a program is given up
    """

    job: Path | None = None
    machine: str | None = None
    tools: Path | None = None
    sets: tuple[str, ...] = ()
    limit_s: float = 600.0

    def __post_init__(self) -> None:
        if not self.limit_s > 0.0:
            raise InputError(f"--limit-s = {self.limit_s:g}: must be above 0")
        for option, value in (("machine", self.machine), ("tools", self.tools)):
            if self.job is not None and value is not None:
                raise InputError(f"--{option}: state it in the job {self.job.name}, or with --set")

    def words(self, program: Path) -> list[str]:
        """The command that simulates a program and writes its result."""
        target = ["--out", str(result_folder(program))]
        sets = [word for one in self.sets for word in ("--set", one)]
        if self.job is not None:
            return ["run", str(self.job), "--set", f"program.file={program.resolve()}", "--accept", *sets, *target]
        options = (("--machine", self.machine), ("--tools", self.tools))
        given = [word for name, value in options if value is not None for word in (name, str(value))]
        return ["simulate", str(program), *given, *sets, *target]

    def hash(self, program: Path) -> str:
        """SHA-256 over the bytes of the program, of the job or tool table, and over the settings."""
        digest = hashlib.sha256()
        for path in (self.job, self.tools, program):
            digest.update(b"-" if path is None else hash_of(path).encode())
        digest.update("\0".join((str(self.machine), *self.sets)).encode())
        return digest.hexdigest()


@dataclass(frozen=True)
class ProgramChecked:
    """A program that was simulated.

    Parameters
    ----------
    program : its file
    code : exit code of the run, :data:`LATE` for one that was given up
    line : first line of its verdict
    time_s : [s] duration of the run
    """

    program: Path
    code: int
    line: str
    time_s: float


def result_folder(program: Path) -> Path:
    """Return the folder of the report of a program, beside it.

    >>> str(result_folder(Path("a/part.nc")))
    'a/part.nc-chipload'
    """
    return program.with_name(program.name + RESULT)


def verdict_file(program: Path) -> Path:
    """Return the text file that holds the verdict of a program, beside it.

    >>> str(verdict_file(Path("a/part.nc")))
    'a/part.nc.verdict.txt'
    """
    return program.with_name(program.name + VERDICT)


def list_programs(folder: Path) -> list[Path]:
    """Return the programs of a folder and of those in it, sorted, without hidden files, links and our own files.

    Raises
    ------
    InputError
        There is no such folder.
    """
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder: name the folder that programs are posted to")

    def foreign(path: Path) -> bool:
        parts = path.relative_to(folder).parts
        ours = path.name.endswith(VERDICT) or any(part.endswith(RESULT) for part in parts[:-1])
        return ours or any(part.startswith(".") for part in parts)

    return sorted(
        path
        for path in folder.rglob("*")
        if path.suffix.lower() in ENDINGS and not foreign(path) and not path.is_symlink() and path.is_file()
    )


def recorded_hash(program: Path) -> str | None:
    """Return the hash of the input that the verdict beside a program is of; None without one."""
    try:
        lines = verdict_file(program).read_text("utf-8", "replace").splitlines()
    except OSError:
        return None
    return lines[-1].removeprefix(OF_INPUT) if lines and lines[-1].startswith(OF_INPUT) else None


def simulate_posted(program: Path, settings: FolderSettings) -> ProgramChecked:
    """Simulate a program in a process of its own and write its verdict; the verdict is written last, and whole.

    What ends that process, an error in it or the end of its memory, is the verdict of the program, not the end of the
    watch. A result of other bytes does not stay beside a program that has none.

    Raises
    ------
    InputError
        The program or the job cannot be read.
    OutputError
        The verdict cannot be written, or an earlier result cannot be removed.
    """
    of_input, begin = settings.hash(program), time.monotonic()
    command = [sys.executable, "-m", "chipload", *settings.words(program)]
    process = subprocess.Popen(
        command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, **own_group()
    )
    try:
        try:
            said, _ = process.communicate(timeout=settings.limit_s)
            code = process.returncode
            lines = said.decode("utf-8", "replace").splitlines()
        except subprocess.TimeoutExpired:
            code, lines = LATE, [f"unproven: not finished in {settings.limit_s:g} s: raise --limit-s"]
    finally:
        _end(process)
    if code < 0 or not lines:
        lines.append(f"chipload: the run ended without a verdict (code {code})")
    result = result_folder(program)
    if code in FINISHED:
        first = load_result(result).first_lines[0]
    else:
        first = next((line for line in reversed(lines) if line.strip()), "")
        if (result / SUMMARY).is_file():
            try:
                shutil.rmtree(result)
            except OSError as err:
                raise cannot_write(result, err) from None
    write_whole(verdict_file(program), "\n".join([*lines, OF_INPUT + of_input, ""]).encode())
    return ProgramChecked(program, code, first, time.monotonic() - begin)


def watch_folder(
    folder: Path,
    settings: FolderSettings,
    *,
    once: bool = False,
    settle_s: float = 2.0,
    wait: Callable[[float], None] = time.sleep,
) -> Iterator[ProgramChecked]:
    """Yield each program of a folder when it was simulated: those there are, then those that are added or changed.

    A program is taken once its size and time have not changed for ``settle_s``, so that one that is being posted is
    not read by halves. A program whose verdict is of the same bytes and settings is not simulated again, so that a
    watch that was stopped goes on where it was. Files that a job names beside its program (a mesh, a tool table) are
    not watched.

    Parameters
    ----------
    once : end when every program that is there has a verdict; a program that still changes is waited for
    settle_s : [s] at least 0
    wait : how to wait so many seconds

    Raises
    ------
    InputError
        The folder or the job is missing.
    OutputError
        A verdict cannot be written.
    """
    if not settle_s >= 0.0:
        raise InputError(f"--settle-s = {settle_s:g}: must be at least 0")
    seen: dict[Path, _Stamp] = {}
    while True:
        waiting = False
        for program in list_programs(folder):
            stamp = _Stamp.of(program)
            before = seen.get(program)
            if stamp is None or (before is not None and before.done and before == stamp):
                continue
            if before != stamp:
                seen[program] = before = stamp
            if time.monotonic() - before.since < settle_s:
                waiting = True
                continue
            try:
                known = recorded_hash(program) == settings.hash(program)
                checked = None if known else simulate_posted(program, settings)
            except InputError as err:
                if not program.exists():
                    continue  # it was taken away
                if any(path is not None and not is_file(path) for path in (settings.job, settings.tools)):
                    raise
                checked = ProgramChecked(program, 2, str(err), 0.0)
            seen[program] = _Stamp(stamp.size, stamp.time_ns, before.since, done=True)
            if checked is not None:
                yield checked
        if once and not waiting:
            return
        wait(max(settle_s / 4.0, 0.05))


def worst_code(codes: Sequence[int]) -> int:
    """Return the exit code of a folder: that of an error, of a disk, of wrong input, of a limit, or 0.

    >>> worst_code([0, 3, 2]), worst_code([0, LATE]), worst_code([])
    (2, 3, 0)
    """
    known = [3 if code == LATE else 1 if code < 0 else code for code in codes]
    return next((code for code in (1, 4, 2, 3) if code in known), 0)


@dataclass(frozen=True)
class _Stamp:
    """Size and time of a file, since when they are so, and whether its program has a verdict."""

    size: int
    time_ns: int
    since: float = field(compare=False)
    done: bool = field(default=False, compare=False)

    @classmethod
    def of(cls, path: Path) -> _Stamp | None:
        try:
            found = path.stat()
        except OSError:
            return None
        return cls(found.st_size, found.st_mtime_ns, time.monotonic())


def _end(process: subprocess.Popen[bytes]) -> None:
    """Stop a process that still runs, and wait for it."""
    if process.poll() is None:
        stop_group(process.pid)
        try:
            process.communicate(timeout=PATIENCE_S)
        except subprocess.TimeoutExpired:
            stop_group(process.pid, kill=True)
            process.communicate()
