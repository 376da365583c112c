"""The command ``chipload watch``: a running machine against the simulation of its program."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from chipload.cli.app import Debug, Sets, app
from chipload.cli.learn import Efficiency, EfficiencyError, LogColumns, SpindleFile
from chipload.errors import InputError
from chipload.number_text import number_text
from chipload.terminal import EXCEEDED, run_guarded, show

if TYPE_CHECKING:
    from chipload.control.learning import SignalKind
    from chipload.control.load_watch import LoadWatch
    from chipload.control.log_stream import LoadSample


@app.command()
def watch(
    source: Annotated[
        str,
        typer.Argument(
            metavar="SOURCE", help="an MTConnect agent, as http://127.0.0.1:5000, or a log (CSV) that grows"
        ),
    ],
    job: Annotated[Path, typer.Option("--job", metavar="JOB", help="the job (TOML) of the program that runs")],
    spindle: SpindleFile = None,
    efficiency: Efficiency = None,
    efficiency_error: EfficiencyError = None,
    torque: Annotated[bool, typer.Option("--torque", help="use the logged torque instead of the power")] = False,
    columns: LogColumns = None,
    device: Annotated[str | None, typer.Option("--device", help="name of the device of an agent")] = None,
    component: Annotated[str | None, typer.Option("--component", help="name of its spindle")] = None,
    false_alarms: Annotated[
        float, typer.Option("--false-alarms", help="that are allowed in an hour in the cut, at most")
    ] = 0.1,
    wear_percent: Annotated[
        float, typer.Option("--wear-percent", help="load of a worn tool over that of a sharp one, less 100 %")
    ] = 30.0,
    lag_s: Annotated[float, typer.Option("--lag-s", help="how far the line of a sample may be wrong in time")] = 0.2,
    once: Annotated[bool, typer.Option("--once", help="end at the end of the log")] = False,
    duration_s: Annotated[
        float | None, typer.Option("--duration-s", help="end after so long; default: when the program ends, or Ctrl-C")
    ] = None,
    overrides: Sets = None,
    debug: Debug = False,
) -> None:
    """Follow the power of the spindle while a program runs, and state what is not as simulated.

    A line is written where the tool cuts nothing (missing stock, a broken tool), takes more (wear, more stock), cuts in
    the air, or is a wrong one. The log needs the line of the program. A source that does not answer is asked again.
    Exit code 3: an alarm, or nothing could be judged.
    """

    def work() -> int:
        from chipload.api.mechanics.learning import torque_of_result
        from chipload.cli.learn import program_job, run_job_now, signal_of_spindle
        from chipload.control.learning import Signal, SignalKind, power_signal
        from chipload.control.load_watch import LoadWatch, WatchSettings

        settings = WatchSettings(false_alarms, 1.0 + wear_percent / 100.0, lag_s=lag_s)
        if spindle is not None and (torque or efficiency is not None or efficiency_error is not None):
            raise InputError("--spindle, --efficiency, --torque: state only one of them")
        if torque and (efficiency is not None or efficiency_error is not None):
            raise InputError("--torque, --efficiency: the torque has no efficiency: leave it out")
        sets = tuple(overrides or ())
        _, material = program_job(job, sets)
        predicted = torque_of_result(run_job_now(job, sets).result, str(job))
        if spindle is not None:
            signal, _ = signal_of_spindle(spindle, predicted)
        elif torque:
            signal = Signal(SignalKind.TORQUE, 1.0, 0.0)
        else:
            signal = power_signal(efficiency, efficiency_error)
        one = LoadWatch(predicted, signal, material, settings)
        found, until = 0, None if duration_s is None else time.monotonic() + duration_s
        show(f"watching {source}: at most {number_text(false_alarms)} false alarms an hour in the cut")
        try:
            for sample in _samples(source, signal.kind, columns, device, component, once):
                if sample is not None:
                    for alarm in one.add(sample.time, sample.value, sample.line, sample.override):
                        found += 1
                        show(str(alarm))
                if one.finished or (until is not None and time.monotonic() > until):
                    break
        except KeyboardInterrupt:
            show("stopped")
        for alarm in one.end():
            found += 1
            show(str(alarm))
        return _summary(one, found)

    run_guarded(work, debug)


def _summary(one: LoadWatch, found: int) -> int:
    """Write what was watched, and return the exit code."""
    whole, cut, judged = (number_text(x, 3) for x in (one.seconds, one.cut_seconds, one.judged_seconds))
    show(f"{whole} s watched, {cut} s of them in the cut, {judged} s judged; {found} alarms")
    if one.judged_seconds == 0.0:
        show(
            "nothing could be judged: the log needs the idle spindle before the first cut, lines of the program, and "
            "a cut well above the noise"
        )
    return EXCEEDED if found or one.judged_seconds == 0.0 else 0


def _samples(
    source: str, kind: SignalKind, columns: Path | None, device: str | None, component: str | None, once: bool
) -> Iterator[LoadSample | None]:
    """Yield the samples of a source, None where there is none now."""
    from chipload.control.log_stream import agent_samples, follow_file
    from chipload.machine.mtconnect_stream import AgentSource

    if source.startswith(("http://", "https://")):
        if columns is not None or once:
            raise InputError("--columns, --once: apply to a log: leave them out")
        yield from agent_samples(AgentSource(source, device, component), kind, notice=show)
    else:
        if device is not None or component is not None:
            raise InputError("--device, --component: apply to an agent: leave them out")
        yield from follow_file(Path(source), kind, columns, once=once)
