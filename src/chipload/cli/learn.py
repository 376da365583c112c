"""The command ``chipload learn``: force coefficients of a material from logs of the spindle."""

from __future__ import annotations

import math
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from chipload.cli.app import Debug, Sets, app
from chipload.errors import InputError, Severity
from chipload.number_text import number_text
from chipload.terminal import EXCEEDED, guarded, show

if TYPE_CHECKING:
    from chipload.control.learning import LearnedMaterial, Signal
    from chipload.control.log_alignment import PredictedTorque
    from chipload.cutting.material import Material

#: efficiency of a spindle drive that is not stated, and its standard deviation: 0.9 with a belt, 0.7 to 0.8 with gears
#: [MachinerysHandbook, machine tool efficiency factors]
EFFICIENCY, EFFICIENCY_ERROR = 0.8, 0.08


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
        float | None, typer.Option("--efficiency-error", help="its relative standard deviation, e.g. 0.05")
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
        from chipload.control.learning import learn_from_logs
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
        stated = (spindle, efficiency, efficiency_error)
        signal, lag, told = _signal(stated, predicted, list(read.values()))
        if told:
            show(told)
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

    guarded(work, debug)


def _prediction(job: Path, sets: Any) -> tuple[PredictedTorque, Material]:
    """Return the torque of the program of a job, simulated now, and the material of the job."""
    from chipload import jobs
    from chipload.control.log_alignment import predicted_torque
    from chipload.jobs.simulation.job import ProgramJob
    from chipload.jobs.simulation.run import material_of

    loaded = jobs.load_job(job, sets)
    if not isinstance(loaded.job, ProgramJob):
        raise InputError(f"{job}: a job of {loaded.capability.name}: state one that simulates the program that ran")
    material = material_of(loaded.job)
    result = jobs.run_job(loaded, accept=True).result
    return predicted_torque(result.in_use[0].columns if result.in_use else {}, str(job)), material


def _signal(
    stated: tuple[Path | None, float | None, float | None], predicted: PredictedTorque, logs: list[Any]
) -> tuple[Signal, float, str]:
    """Return what the logs measure, the time constant of the sensor, and what was taken for it."""
    from chipload.control.learning import Signal
    from chipload.control.spindle_file import read_spindle

    spindle, efficiency, error = stated
    if spindle is not None:
        if efficiency is not None or error is not None:
            raise InputError("--spindle, --efficiency: state only one of them")
        data = read_spindle(spindle, float(predicted.speed.max()))
        constant = data.values.get("torque_constant_nm_a")
        if constant is None:
            raise InputError(
                f"{spindle}: no torque constant or efficiency: log a cut of known torque for chipload spindle"
            )
        share = float(data.values.get("torque_constant_error_share", 0.0)) / 1.96
        gain = 1.0 / float(constant) if data.source == "power" else 1e-3 / float(constant)
        return Signal(data.source, gain, share), float(data.values.get("sensor_lag_s", 0.0)), ""
    kinds = [kind for kind in ("torque", "power") if all(getattr(log, kind) is not None for log in logs)]
    if not kinds:
        raise InputError("LOG: no column of power or torque that all logs have; of current, state --spindle")
    if kinds[0] == "torque":
        return Signal("torque", 1.0, error or 0.0), 0.0, ""
    for option, value in (("--efficiency", efficiency), ("--efficiency-error", error)):
        if value is not None and not (0.0 < value <= 1.0 and math.isfinite(value)):
            raise InputError(f"{option} = {value:g}: must be above 0 and at most 1")
    told = ""
    if efficiency is None:
        told = (
            f"efficiency of the spindle: {EFFICIENCY:g} +- {EFFICIENCY_ERROR:g} taken; state --spindle or --efficiency"
        )
    own = EFFICIENCY if efficiency is None else efficiency
    spread = error if error is not None else EFFICIENCY_ERROR / EFFICIENCY if efficiency is None else 0.0
    return Signal("power", 1.0 / own, spread), 0.0, told


def lines_of(found: LearnedMaterial) -> list[str]:
    """Return what was learned, a line each."""
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
        out.append(f"{key}: the cut takes {100.0 * error:+.2g} % of what is predicted now")
    out.append(f"{found.used} blocks used, {found.left_out} left out")
    return [*out, *map(str, found.findings)]
