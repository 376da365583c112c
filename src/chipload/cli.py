"""The command line: parse, call one function, show.

Exit codes of every command: 0 done and every limit holds; 2 the input is wrong (one line, nothing written); 3 done, but
a limit or a status does not hold; 4 the result cannot be written, what is kept of the work stays; 1 a fault of ours;
130 stopped by Ctrl-C. Imports are late so that `--help` is quick.
"""

from __future__ import annotations

import math
import signal
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer

from chipload.errors import Cancelled, InputError, Severity, worst_severity
from chipload.terminal import EXCEEDED, bar, guarded, say, show
from chipload.units import mm_s_from_mm_min

if TYPE_CHECKING:
    from chipload.machine.machine import Machine
    from chipload.program.setup import Setup

#: [mm] where none is stated
TOLERANCE_MM = 0.001
#: [s] between two states of a simulation
KEEP_S = 10.0
#: machines that a program is read for where none is stated: the first that has its axes
GENERIC = ("vmc", "xyzbc-trunnion", "xyzac-trunnion", "xyzbc-head-table")
#: findings of a machine that break nothing
HARMLESS = ("machine-singular", "machine-rewind", "machine-offset")

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    help="Plans and proves CNC milling of the parts that are hard to mill.",
    epilog="Exit codes: 0 every limit holds; 2 wrong input, nothing written; 3 a limit does not hold; 4 the result "
    "cannot be written, kept work stays; 1 our fault.",
)

JobFile = Annotated[Path, typer.Argument(metavar="JOB", help="the job file (TOML)")]
Sets = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY.PATH=VALUE",
        help="override a key, as cutter.0.diameter_mm=12; repeatable; files are relative to the job's folder",
    ),
]
MachineName = Annotated[
    str | None, typer.Option("--machine", metavar="MACHINE", help="a shipped machine, or a file (.toml, LinuxCNC .ini)")
]
Tools = Annotated[Path | None, typer.Option("--tools", metavar="FILE", help="LinuxCNC tool table (.tbl)")]
DialectName = Annotated[
    str | None,
    typer.Option("--dialect", help="linuxcnc, fanuc, sinumerik, heidenhain or apt; else by the file's ending"),
]
FeedIfUnsaid = Annotated[float | None, typer.Option("--feed-mm-min", help="feed of cuts before the program states one")]
ParameterValues = Annotated[
    list[str] | None,
    typer.Option(
        "--parameter", metavar="NAME=VALUE", help="a value that the controller holds, as Q10=5 or '#100=2'; repeatable"
    ),
]
WorkOffsets = Annotated[
    list[str] | None,
    typer.Option(
        "--work-offset", metavar="CODE=X,Y,Z", help="origin of a work offset in the machine, as G55=80,0,0; repeatable"
    ),
]
ToleranceMm = Annotated[
    float,
    typer.Option("--tolerance-mm", help="how far the tip may leave its path where a move with rotary axes is cut up"),
]
Debug = Annotated[bool, typer.Option("--debug", help="show the traceback of a fault")]


@app.command()
def run(
    job: JobFile,
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="the result folder; appears whole or not at all")],
    sets: Sets = None,
    fresh: Annotated[
        bool, typer.Option("--fresh", help="throw away what an earlier run of a program kept when it was stopped")
    ] = False,
    keep_s: Annotated[
        float,
        typer.Option(
            "--keep-s",
            help="seconds of simulation between two states from which a stopped run can go on; 0: as often as possible",
        ),
    ] = KEEP_S,
    debug: Debug = False,
) -> None:
    """Plan a job and prove its programs, or read the program that it names; write the result folder.

    A simulation that was stopped goes on where it was when the same command is given again.
    """

    def work() -> int:
        from chipload.jobs import load_job, run_job

        loaded = load_job(job, sets or ())
        from chipload.report.folder import check_target, checkpoint_folder, write_finished
        from chipload.simulation.checkpoint import Checkpoint

        check_target(out)
        if not 0.0 <= keep_s < math.inf:
            raise InputError(f"--keep-s = {keep_s:g}: must be at least 0 s")
        if not loaded.capability.resumes:
            say(f"a {loaded.capability.name} job does not resume: if it is stopped, it begins again")
        with Checkpoint(checkpoint_folder(out), keep_s, fresh=fresh, notice=say) as kept:
            try:
                with bar() as progress:
                    done = run_job(loaded, lambda part, what: progress(0.8 * part, what), kept)
                    target = write_finished(
                        done.result, done.presentation, out, lambda part, what: progress(0.8 + 0.2 * part, what)
                    )
            except (KeyboardInterrupt, Cancelled):
                if not kept.safe:
                    raise
                raise Cancelled(
                    f"{kept.safe} steps are kept in {kept.folder.name}: the same command goes on from there, with "
                    "--fresh it begins again"
                ) from None
            kept.discard()
        show(done.result.message)
        show(f"report: {target / 'report.html'}")
        return done.result.verdict.exit_code

    guarded(work, debug)


@app.command()
def check(
    file: Annotated[
        Path,
        typer.Argument(metavar="FILE", help="a job, or any file that a job names"),
    ],
    machine: MachineName = None,
    tools: Tools = None,
    dialect: DialectName = None,
    feed_mm_min: FeedIfUnsaid = None,
    tolerance_mm: ToleranceMm = TOLERANCE_MM,
    parameters: ParameterValues = None,
    work_offsets: WorkOffsets = None,
    sets: Sets = None,
    debug: Debug = False,
) -> None:
    """Read any file as a run would and list all that is wrong; nothing is run or written.

    A job with all that it names; a program as its controller does, on machine vmc (or one with the rotary axes that it
    needs) where none is stated; a fit; the faces of a STEP file; a drawing, mesh, machine, material or tool table.
    """

    def work() -> int:
        from chipload.jobs.inspection import BY_ENDING, inspect_file

        job = file.suffix.lower() == ".toml"
        if sets and not job:
            raise InputError("--set: belongs to a job: leave it out for another file")
        if not job and file.suffix.lower() not in BY_ENDING:
            setup = _setup(parameters or (), work_offsets or ())
            return _check_program(file, machine, tools, dialect, feed_mm_min, tolerance_mm, setup)
        for option, value in (
            ("machine", machine),
            ("tools", tools),
            ("dialect", dialect),
            ("feed-mm-min", feed_mm_min),
            ("parameter", parameters or None),
            ("work-offset", work_offsets or None),
        ):
            if value is not None:
                raise InputError(f"--{option}: belongs to a program: in a job state it in the file")
        found = inspect_file(file, sets or ())
        lines, holds = found if found is not None else ([], True)
        for text in lines:
            show(text)
        return 0 if holds else EXCEEDED

    guarded(work, debug)


@app.command()
def convert(
    source: Annotated[Path, typer.Argument(metavar="PROGRAM", help="NC text or CL data")],
    target: Annotated[
        Path, typer.Argument(metavar="FILE", help="what is written; its ending says what: .ngc, .nc, .apt")
    ],
    machine: MachineName = None,
    from_machine: Annotated[
        str | None, typer.Option("--from", metavar="MACHINE", help="the machine of the source, if another")
    ] = None,
    tools: Tools = None,
    dialect: DialectName = None,
    feed_mm_min: FeedIfUnsaid = None,
    tolerance_mm: ToleranceMm = TOLERANCE_MM,
    tcp: Annotated[bool, typer.Option("--tcp", help="tell the controller the tip while rotary axes move")] = False,
    debug: Debug = False,
) -> None:
    """Write a program for a machine, or as CL data; it is not verified, and its first line says so."""

    def work() -> int:
        from chipload.files import write_whole
        from chipload.program.convert import convert_program
        from chipload.program.read import read_program, read_tools

        there = _machine(machine)
        here = _machine(from_machine) if from_machine is not None else there
        table = read_tools(tools) if tools is not None else None
        lengths = table.lengths() if table is not None else {}
        with bar() as progress:
            reading = read_program(
                source, here, dialect=dialect, tools=table, feed=_mm_s(feed_mm_min), tolerance=tolerance_mm,
                progress=progress,
            )  # fmt: skip
            text, findings = convert_program(
                reading.program, reading.findings, there, target.suffix, title=source.name,
                tool_lengths=lengths, tcp=tcp, tolerance=tolerance_mm,
            )  # fmt: skip
            write_whole(target, text.encode("ascii"))
        for f in (*reading.findings, *findings):
            show(str(f))
        show(f"written: {target}: {len(text.splitlines())} lines for machine {there.name}, not verified")
        exceeded = any(f.code.startswith("machine-") and f.code not in HARMLESS for f in findings)
        return EXCEEDED if exceeded or worst_severity(reading.findings) >= Severity.UNPROVEN else 0

    guarded(work, debug)


@app.command()
def fit(
    file: Annotated[Path, typer.Argument(metavar="FIT", help="the fit (TOML): measured cuts, cutter, engagement")],
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="the result folder; appears whole or not at all")],
    sets: Sets = None,
    debug: Debug = False,
) -> None:
    """Identify force coefficients from measured forces; write a material, its intervals and what it predicts."""

    def work() -> int:
        from chipload.jobs import load_job, run_job

        loaded = load_job(file, sets or ())
        if loaded.capability.name != "fit":
            raise InputError(f"{file.name}: has no [[measurement]]: give it to chipload run")
        from chipload.report.folder import check_target, write_finished

        check_target(out)
        with bar() as progress:
            done = run_job(loaded, progress)
            target = write_finished(done.result, done.presentation, out)
        for f in done.result.findings:
            show(str(f))
        show(done.result.message)
        show(f"report: {target / 'report.html'}")
        return done.result.verdict.exit_code

    guarded(work, debug)


@app.command()
def tap(
    files: Annotated[
        list[Path], typer.Argument(metavar="FRF...", help="receptances (CSV, .frf, .uff), one a direction")
    ],
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="the modes (TOML), for [dynamics] file")],
    direction: Annotated[
        list[str] | None, typer.Option("--direction", help="x or y of the machine, for each file in its order")
    ] = None,
    unit: Annotated[
        str | None, typer.Option("--unit", help="m/N, mm/N, um/N, m/s/N or m/s2/N, where the file does not state it")
    ] = None,
    tool: Annotated[int | None, typer.Option("--tool", min=0, help="tool number; none: every tool")] = None,
    from_hz: Annotated[float | None, typer.Option("--from-hz", min=0.0, help="lowest frequency of the fit")] = None,
    to_hz: Annotated[float | None, typer.Option("--to-hz", min=0.0, help="highest frequency of the fit")] = None,
    debug: Debug = False,
) -> None:
    """Fit modes to hammer tests of a tool's tip; refused where they do not fit."""

    def work() -> int:
        from chipload.files import write_whole
        from chipload.jobs.program.tap import modes_text
        from chipload.jobs.program.tap import tap as tapped

        found = tapped(files, direction or (), unit, (from_hz, to_hz))
        write_whole(out, modes_text(found, tool).encode("utf-8"))
        for one in found:
            for f, z, k in zip(one.fit.frequency, one.fit.damping, one.fit.stiffness, strict=True):
                show(f"{one.name} {one.direction}: {f:.5g} Hz, damping {z:.3g}, {1e-3 * k:.4g} N/um")
            show(f"{one.name} {one.direction}: the fit leaves {100.0 * one.fit.left:.2g} % of the peak")
        show(f'written: {out}; name it in the job: [dynamics] file = "{out.name}"')
        return 0

    guarded(work, debug)


@app.command()
def cuts(
    job: JobFile,
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="the table (CSV), to be filled in")],
    sites: Annotated[int, typer.Option("--sites", help="places on the wall, at least 4")] = 6,
    repeats: Annotated[
        int, typer.Option("--repeats", help="places that are cut twice, which says how they scatter")
    ] = 2,
    steps: Annotated[int, typer.Option("--steps", help="depths below and above what the model says, each")] = 2,
    bracket: Annotated[float, typer.Option("--bracket", help="factor from force to force")] = 1.25,
    scatter_percent: Annotated[float, typer.Option("--scatter-percent", help="expected of one cut")] = 5.0,
    sets: Sets = None,
    debug: Debug = False,
) -> None:
    """Propose calibration cuts for a job with a [wall]: what it bears, measured; [threshold] file reads the table."""

    def work() -> int:
        from chipload.jobs import load_job
        from chipload.jobs.thinwall.job import ThinWallJob

        read = load_job(job, sets or ()).job
        if not isinstance(read, ThinWallJob):
            raise InputError(f"{job.name}: has no [wall]: calibration cuts are proposed for a thin wall")
        from chipload.jobs.thinwall.run import propose
        from chipload.planning.thinwall.table import write_cuts

        with bar() as progress:
            found = propose(read, sites, scatter_percent / 100.0, bracket, steps, repeats, progress)
        write_cuts(out, found)
        for f in found.findings:
            show(str(f))
        show(
            f"{len(found.site)} cuts at {len(found.sites)} places: interpolation misses {100.0 * found.bias:.2g} %, "
            f"scatter brings {100.0 * found.noise:.2g} % (root mean square over the wall)"
        )
        show(f'fill in and name it in the job: [threshold] file = "{out.name}"')
        return 0

    guarded(work, debug)


@app.command()
def example(
    name: Annotated[str | None, typer.Argument(help="the example; none: list them")] = None,
    folder: Annotated[Path | None, typer.Argument(metavar="DIR", help="where it is copied to")] = None,
    debug: Debug = False,
) -> None:
    """List the examples, or copy one out."""

    def work() -> int:
        from chipload.examples import copy_example, example_titles

        if name is None:
            for key, title in example_titles().items():
                show(f"{key:12} {title}")
            return 0
        if folder is None:
            raise InputError(f"example {name}: missing folder: chipload example {name} DIR")
        show(f"copied: chipload run {copy_example(name, folder) / 'job.toml'} --out result")
        return 0

    guarded(work, debug)


@app.command()
def view(
    path: Annotated[Path, typer.Argument(metavar="PATH", help="a result folder, a job, or a folder that holds them")],
    port: Annotated[int | None, typer.Option("--port", min=1, max=65535, help="else 8170, or a free one")] = None,
    open_browser: Annotated[bool, typer.Option("--open/--no-open", help="open the page in the browser")] = True,
    debug: Debug = False,
) -> None:
    """Show results and jobs of a folder in the browser, run jobs there; only for this computer; Ctrl-C ends it."""

    def work() -> int:
        from chipload.web.serve import serve

        serve(path, port, open_browser, show)
        return 0

    guarded(work, debug)


@app.command()
def hal(
    file: Annotated[Path, typer.Argument(metavar="HAL", help="the controller (TOML): path, override, spindle")],
    out: Annotated[Path | None, typer.Option("--out", metavar="FILE", help="what happened, step by step (CSV)")] = None,
    name: Annotated[str, typer.Option("--name", help="of the component; its pins and signals begin so")] = "chipload",
    python: Annotated[
        str, typer.Option("--python", help="the interpreter that LinuxCNC's modules belong to")
    ] = "/usr/bin/python3",
    debug: Debug = False,
) -> None:
    """Hold the torque on a LinuxCNC that runs: a component in HAL that sends the override; Ctrl-C ends it."""

    def work() -> int:
        from chipload.control.hal import control, load_hal, table_of
        from chipload.control.linuxcnc.hal_client import HalPins
        from chipload.files import write_whole

        job = load_hal(file)
        asked: list[int] = []
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda n, _: asked.append(n))
        with HalPins(name, python) as pins:
            record = control(
                job,
                pins,
                stop=lambda: bool(asked),
                notice=lambda reason, s: typer.echo(
                    f"stopped the machine: {reason} at {s:.4g} mm: it stays stopped until this command ends", err=True
                ),
            )
        if out is not None:
            write_whole(out, table_of(record).encode("ascii"))
        show(
            f"{len(record.rows)} steps, ended: {record.ended}; greatest torque {1e-3 * record.torque_max:.4g} N m, "
            f"limit held {1e-3 * job.override.torque_ref:.4g} N m"
        )
        return 0 if record.ended == "path" else EXCEEDED

    guarded(work, debug)


@app.callback(invoke_without_command=True)
def top(version: Annotated[bool, typer.Option("--version", help="show the version and leave")] = False) -> None:
    """Plan and prove CNC milling of the parts that are hard to mill."""
    if version:
        from importlib.metadata import version as installed

        show(f"chipload {installed('chipload')}")
        raise typer.Exit


def main() -> NoReturn:
    """Entry of the command ``chipload``."""
    signal.signal(signal.SIGTERM, _stop)
    app()
    sys.exit(0)


def _stop(_number: int, _frame: object) -> NoReturn:
    """A polite kill stops as Ctrl-C does."""
    raise KeyboardInterrupt


def _check_program(
    path: Path,
    machine: str | None,
    tools: Path | None,
    dialect: str | None,
    feed_mm_min: float | None,
    tolerance_mm: float,
    setup: Setup,
) -> int:
    """Check a program: what leaves it unproven, the other findings by line, then what it is."""
    from chipload.program.motions import lengths
    from chipload.program.read import line_times, read_program, read_tools

    table, feed = read_tools(tools) if tools is not None else None, _mm_s(feed_mm_min)
    refused: InputError | None = None
    for name in GENERIC if machine is None else (machine,):
        on = _machine(name)
        try:
            with bar() as progress:
                reading = read_program(
                    path, on, dialect=dialect, tools=table, feed=feed, tolerance=tolerance_mm, setup=setup,
                    progress=progress,
                )  # fmt: skip
            break
        except InputError as err:
            # the first refusal is told: that of the simplest machine
            refused = refused or err
    else:
        assert refused is not None
        raise refused
    if machine is None:
        show(f"no machine is stated: read for {on.name}; state yours with --machine, as its limits and times differ")
    broken = set(map(id, reading.violations))
    gaps = [f for f in reading.findings if f.severity >= Severity.UNPROVEN]
    for f in gaps:
        show(f"{f} [unproven]")
    for f in sorted((*(f for f in reading.findings if f not in gaps), *reading.violations), key=lambda f: f.line):
        show(f"{f}{' [does not hold]' if id(f) in broken else ''}")
    low, high = reading.program.p_work.min(axis=0), reading.program.p_work.max(axis=0)
    box = ", ".join(f"{x} {a:g} to {b:g}" for x, a, b in zip("XYZ", low, high, strict=True))
    _, seconds = line_times(reading, on)
    show(
        f"{path.name}: {len(reading.commands)} motions on machine {on.name}, {lengths(reading.program).sum():.6g} mm, "
        f"{seconds.sum() / 60.0:.4g} min; {box} mm"
    )
    count = len(reading.violations)
    holds = "the limits hold" if not gaps else f"unproven: {gaps[0]}"
    show(f"{count} {'finding does' if count == 1 else 'findings do'} not hold" if count else holds)
    return EXCEEDED if reading.violations or gaps else 0


def _setup(parameters: Sequence[str], work_offsets: Sequence[str]) -> Setup:
    """What the controller holds, as options give it."""
    from chipload.program.setup import Setup

    def pairs(option: str, texts: Sequence[str]) -> Iterator[tuple[str, list[float]]]:
        for text in texts:
            name, _, values = text.rpartition("=")
            try:
                yield name.strip(), [float(value) for value in values.split(",")]
            except ValueError:
                raise InputError(f"--{option} {text}: must be a name, = and numbers") from None

    given = dict(pairs("parameter", parameters))
    for name, values in given.items():
        if len(values) != 1:
            raise InputError(f"--parameter {name}: {len(values)} numbers: must be one")
    return Setup({name: values[0] for name, values in given.items()}, dict(pairs("work-offset", work_offsets)))


def _machine(name: str | None) -> Machine:
    """A shipped machine by name, or a file: TOML of ours or LinuxCNC's .ini."""
    from chipload.machine.ini import read_ini
    from chipload.machine.machine import machine_named, machine_names, read_machine

    if name is None:
        raise InputError(f"--machine: missing: name a file (.toml, .ini) or one of {', '.join(machine_names())}")
    if name.lower().endswith(".ini"):
        machine, findings = read_ini(Path(name))
        for f in findings:
            show(f"{name}: {f}")
        return machine
    return read_machine(name) if name.lower().endswith(".toml") else machine_named(name)


def _mm_s(mm_min: float | None) -> float | None:
    if mm_min is None:
        return None
    if not 0.0 < mm_min < 1e9:
        raise InputError(f"--feed-mm-min = {mm_min:g}: must be above 0")
    return mm_s_from_mm_min(mm_min)
