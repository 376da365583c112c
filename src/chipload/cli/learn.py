"""The command ``chipload learn``: force coefficients of a material from logs of the spindle."""

from __future__ import annotations

from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from chipload.cli.app import Debug, Sets, app
from chipload.errors import InputError, Severity
from chipload.number_text import number_text
from chipload.terminal import EXCEEDED, bar, run_guarded, show

if TYPE_CHECKING:
    from chipload.control.learning import LearnedMaterial, Signal
    from chipload.control.log_alignment import PredictedTorque
    from chipload.cutting.material import Material


@app.command()
def learn(
    logs: Annotated[
        list[Path],
        typer.Argument(metavar="LOG...", help="logs (CSV) of the program, in the order in which it ran with one tool"),
    ],
    job: Annotated[Path, typer.Option("--job", metavar="JOB", help="the job (TOML) of the program that ran")],
    out: Annotated[
        Path, typer.Option("--out", metavar="FILE", help="the material (TOML), for [material] file of a job")
    ],
    name: Annotated[str, typer.Option("--name", help="name of the material; default: the job's, with -learned")] = "",
    spindle: Annotated[
        Path | None, typer.Option("--spindle", metavar="FILE", help="the spindle (TOML) that chipload spindle wrote")
    ] = None,
    efficiency: Annotated[
        float | None, typer.Option("--efficiency", help="power of the cut over the logged power, from 0 to 1")
    ] = None,
    efficiency_error: Annotated[
        float | None, typer.Option("--efficiency-error", help="its relative standard deviation; default 0.05")
    ] = None,
    columns: Annotated[
        Path | None,
        typer.Option("--columns", metavar="FILE", help="names and units of the columns (TOML), if the log states none"),
    ] = None,
    sets: Sets = None,
    debug: Debug = False,
) -> None:
    """Learn the force coefficients of a material from logs of the spindle while the program of a job ran.

    The job is simulated, each log aligned with it, and Ktc and Kte are updated: the spread of the job's material is
    what was known before. Logs have the columns time_s, and power_w, torque_nm or current_a (with --spindle); with
    line or override they are aligned more surely. Exit code 3: the logs show something that the job does not have.
    """

    def work() -> int:
        from chipload.control.learning import SignalKind, learn_from_logs, signal_of_logs
        from chipload.control.logs import read_log
        from chipload.cutting.material import material_text
        from chipload.files import write_whole

        read, hashes = {}, []
        for path in logs:
            log, findings = read_log(path, columns)
            for f in findings:
                show(f"{path.name}: {f}")
            read[path.name] = log
            hashes.append(f"{path.name} (sha256 {sha256(path.read_bytes()).hexdigest()[:16]})")
        if len(read) < len(logs):
            raise InputError("LOG: two logs have one name: name each once, and rename one of two")
        predicted, prior = _prediction(job, sets or ())
        if spindle is None:
            signal, lag = signal_of_logs(read.values(), efficiency, efficiency_error), 0.0
        elif efficiency is None and efficiency_error is None:
            signal, lag = _signal_of_spindle(spindle, predicted)
        else:
            raise InputError("--spindle, --efficiency: state only one of them")
        if signal.kind is SignalKind.POWER:
            spread = number_text(100.0 * signal.gain_error, 2)
            show(f"efficiency of the spindle: {number_text(1.0 / signal.gain)} +- {spread} %")
        found, aligned = learn_from_logs(read, predicted, signal, prior, lag, name, ", ".join(hashes))
        for one in aligned:
            stated_line = read[one.name].line is not None
            clock = (
                "" if stated_line else f", starts at {number_text(one.lag)} s, {number_text(one.rate)} times as long"
            )
            show(f"{one.name}: correlation {one.correlation:.3f}{clock}")
        write_whole(out, material_text(found.material).encode("utf-8"))
        for line in lines_of(found):
            show(line)
        show(f'written: {out}; name it in the job: [material] file = "{out.name}"')
        return EXCEEDED if any(f.severity is not Severity.NOTE for f in found.findings) else 0

    run_guarded(work, debug)


def _prediction(job: Path, sets: Any) -> tuple[PredictedTorque, Material]:
    """Return the torque of the program of a job, simulated now, and the material of the job."""
    from chipload import jobs
    from chipload.api.mechanics.learning import torque_of_result
    from chipload.jobs.simulation.job import ProgramJob
    from chipload.jobs.simulation.run import material_of

    loaded = jobs.load_job(job, sets)
    if not isinstance(loaded.job, ProgramJob):
        raise InputError(f"{job}: a job of {loaded.capability.name}: state one that simulates the program that ran")
    material = material_of(loaded.job)
    with bar() as progress:
        result = jobs.run_job(loaded, progress, accept=True).result
    return torque_of_result(result, str(job)), material


def _signal_of_spindle(file: Path, predicted: PredictedTorque) -> tuple[Signal, float]:
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
    for key, error in found.fit_error.items():
        out.append(f"{key}: its cut takes {share_text(error)} than the new coefficients predict")
    out.append(f"{found.used} blocks used, {found.left_out} left out")
    return [*out, *map(str, found.findings)]
