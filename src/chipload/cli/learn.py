"""The command ``chipload learn``: force coefficients of a material from logs of the spindle."""

from __future__ import annotations

import json
from collections.abc import Sequence
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from chipload.cli.app import Debug, Sets, app
from chipload.errors import InputError, Severity
from chipload.number_text import number_text
from chipload.terminal import EXCEEDED, bar, run_guarded, show

if TYPE_CHECKING:
    from chipload.control.learning import LearnedMaterial, Signal
    from chipload.control.log_alignment import PredictedTorque
    from chipload.cutting.material import Material
    from chipload.jobs import FinishedJob

SpindleFile = Annotated[
    Path | None, typer.Option("--spindle", metavar="FILE", help="the spindle (TOML) that chipload spindle wrote")
]
Efficiency = Annotated[
    float | None, typer.Option("--efficiency", help="power of the cut over the logged power, from 0 to 1")
]
EfficiencyError = Annotated[
    float | None, typer.Option("--efficiency-error", help="its relative standard deviation; default 0.05")
]
LogColumns = Annotated[
    Path | None,
    typer.Option("--columns", metavar="FILE", help="names and units of the columns (TOML), if the log states none"),
]


@app.command()
def learn(
    logs: Annotated[
        list[Path],
        typer.Argument(
            metavar="LOG...", help="logs (CSV, Parquet) of the program, in the order in which it ran with one tool"
        ),
    ],
    job: Annotated[Path, typer.Option("--job", metavar="JOB", help="the job (TOML) of the program that ran")],
    out: Annotated[
        Path, typer.Option("--out", metavar="FILE", help="the material (TOML), for [material] file of a job")
    ],
    name: Annotated[str, typer.Option("--name", help="name of the material; default: the job's, with -learned")] = "",
    spindle: SpindleFile = None,
    efficiency: Efficiency = None,
    efficiency_error: EfficiencyError = None,
    following: Annotated[
        Path | None,
        typer.Option(
            "--next", metavar="JOB", help="the job that runs next: what the knowledge is worth to it; default: --job"
        ),
    ] = None,
    worth: Annotated[
        bool,
        typer.Option(
            "--worth/--no-worth", help="run the next job with the material before and after, and compare the two"
        ),
    ] = True,
    worn: Annotated[
        bool,
        typer.Option(
            "--worn/--sharp", help="Kte of the edge as it is after the logs, for a tool that stays; default: sharp"
        ),
    ] = False,
    columns: LogColumns = None,
    overrides: Sets = None,
    debug: Debug = False,
) -> None:
    """Learn the force coefficients of a material from logs of the spindle while the program of a job ran.

    The job is simulated, each log aligned with it, and Ktc and Kte are updated: the spread of the job's material is
    what was known before. Then the job is run with the material before and after: the limits, and the time saved by new
    feeds, that the knowledge gives. Logs have the columns time_s, and power_w, torque_nm or current_a (with --spindle);
    with line or override they are aligned more surely. Exit code 3: the logs show something that the job does not have.
    """

    def work() -> int:
        from chipload.api.mechanics.learning import torque_of_result
        from chipload.control.learning import SignalKind, learn_from_logs, refuse_known_logs, signal_of_logs
        from chipload.control.logs import read_log
        from chipload.cutting.material import material_text, with_worth
        from chipload.files import write_whole
        from chipload.jobs.knowledge_worth import worth_of_knowledge

        if following is not None and not worth:
            raise InputError("--next, --no-worth: the next job is run only for the worth: state one of them")
        read, hashes = {}, {}
        for path in logs:
            log, findings = read_log(path, columns)
            for f in findings:
                show(f"{path.name}: {f}")
            read[path.name] = log
            hashes[path.name] = sha256(path.read_bytes()).hexdigest()
        if len(read) < len(logs):
            raise InputError("LOG: two logs have one name: name each once, and rename one of two")
        sets = tuple(overrides or ())
        material, prior = program_job(job, sets)
        # what can be refused without a simulation
        refuse_known_logs(prior, hashes)
        if spindle is not None and (efficiency is not None or efficiency_error is not None):
            raise InputError("--spindle, --efficiency: state only one of them")
        if spindle is None:
            signal, lag = signal_of_logs(read.values(), efficiency, efficiency_error), 0.0
        done = run_job_now(job, sets)
        predicted = torque_of_result(done.result, str(job))
        if spindle is not None:
            signal, lag = signal_of_spindle(spindle, predicted)
        if signal.kind is SignalKind.POWER:
            spread = number_text(100.0 * signal.gain_error, 2)
            show(f"efficiency of the spindle: {number_text(1.0 / signal.gain)} +- {spread} %")
        found, aligned = learn_from_logs(read, predicted, signal, prior, lag, name, hashes, worn=worn)
        for one in aligned:
            stated_line = read[one.name].line is not None
            clock = (
                "" if stated_line else f", starts at {number_text(one.lag)} s, {number_text(one.rate)} times as long"
            )
            sensor = f", the sensor lags by {number_text(one.sensor_lag, 2)} s" if one.sensor_lag >= 0.01 else ""
            show(f"{one.name}: correlation {one.correlation:.3f}{clock}{sensor}")
        write_whole(out, material_text(found.material).encode("utf-8"))
        for line in lines_of(found):
            show(line)
        if worth:
            own = following or job
            before = done if following is None else run_job_now(own, _sets_with_material(sets, material))
            after = run_job_now(own, _sets_with_material(sets, out.absolute()))
            gain = worth_of_knowledge(own, before.result, after.result)
            write_whole(out, material_text(with_worth(found.material, gain)).encode("utf-8"))
            show(f"worth: {gain.text}")
            for line in _next_lines(after, signal):
                show(line)
        show(f'written: {out}; name it in the job: [material] file = "{out.name}"')
        return EXCEEDED if any(f.severity is not Severity.NOTE for f in found.findings) else 0

    run_guarded(work, debug)


def program_job(job: Path, sets: Sequence[str]) -> tuple[Path | str, Material]:
    """Return the file or the name of the material of a job of a program, and the material."""
    from chipload import jobs
    from chipload.jobs.simulation.job import ProgramJob
    from chipload.jobs.simulation.run import material_of

    loaded = jobs.load_job(job, sets)
    if not isinstance(loaded.job, ProgramJob):
        raise InputError(f"{job}: a job of {loaded.capability.name}: state one that simulates the program that ran")
    material = material_of(loaded.job)
    return loaded.job.material or material.name, material


def run_job_now(job: Path, sets: Sequence[str]) -> FinishedJob:
    """Run a job."""
    from chipload import jobs

    with bar() as progress:
        return jobs.run_job(jobs.load_job(job, sets), progress, accept=True)


def _next_lines(done: FinishedJob, signal: Signal) -> list[str]:
    """Return what to measure next for a job that was run, a line each; none where it is no job of a program."""
    from chipload.checking.outcome import ProgramResult
    from chipload.control.learning import SignalKind
    from chipload.jobs.next_measurement import next_measurement

    if not isinstance(done.outcome, ProgramResult):
        return []
    try:
        return next_measurement(done.outcome, done.result, signal.gain_error, signal.kind is SignalKind.POWER).texts
    except InputError as err:
        # no load has a limit: what was learned stays
        return [f"what to measure next: {err}"]


def _sets_with_material(sets: Sequence[str], material: Path | str) -> tuple[str, ...]:
    """Return the keys that are set, with another material."""
    key = "name" if isinstance(material, str) else "file"
    return (*sets, f"material.{key}={json.dumps(str(material))}")


def signal_of_spindle(file: Path, predicted: PredictedTorque) -> tuple[Signal, float]:
    """Return the signal that a spindle was identified from, and the time constant of its sensor [s]."""
    from chipload.control.learning import Signal, SignalKind
    from chipload.control.spindle_file import read_spindle

    data = read_spindle(file, float(predicted.speed.max()))
    constant = data.values.get("torque_constant_nm_a")
    if constant is None:
        raise InputError(f"{file}: no torque constant or efficiency: log a cut of known torque for chipload spindle")
    # the file states half of the interval at 95 %
    error = float(data.values.get("torque_constant_error_share", 0.0)) / 1.96
    kind = SignalKind(data.source)
    gain = 1.0 / float(constant) if kind is SignalKind.POWER else 1e-3 / float(constant)
    return Signal(kind, gain, error), float(data.values.get("sensor_lag_s", 0.0))


def lines_of(found: LearnedMaterial) -> list[str]:
    """Return what was learned, a line each."""
    from chipload.control.learning import share_text

    before, after = found.deviations
    out = []
    for k, (key, unit) in enumerate((("Ktc", "MPa"), ("Kte", "N/mm"))):
        old, new = getattr(found.prior, key), getattr(found.material, key)
        out.append(
            f"{key}: {number_text(new)} {unit} +- {number_text(200.0 * after[k], 2)} %; before {number_text(old)} +- "
            f"{number_text(200.0 * before[k], 2)} % (two standard deviations)"
        )
    out.append("Krc, Kac, Kre, Kae: as before: power and current tell the tangential force alone")
    deviation, share = found.torque_known
    if share > 0.5:
        what = "efficiency" if found.gain.signal == "power" else "torque constant"
        out.append(
            f"the torque of such cuts: +- {number_text(200.0 * deviation, 2)} %; {100.0 * share:.0f} % of that "
            f"variance is the {what} of the spindle, which more logs do not tell: cuts of known "
            "torque do (chipload spindle)"
        )
    for key, error in found.fit_error.items():
        out.append(f"{key}: its cut takes {share_text(error)} than the new coefficients predict")
    out.append(f"{found.used} blocks used, {found.left_out} left out")
    return [*out, *map(str, found.findings)]
