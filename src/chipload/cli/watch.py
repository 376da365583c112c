"""The command ``chipload watch``: a running machine against the simulation of its program."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from chipload.cli.app import Debug, Sets, app
from chipload.cli.learn import Efficiency, EfficiencyError, LogColumns, SpindleFile
from chipload.errors import Finding, InputError
from chipload.number_text import number_text
from chipload.terminal import EXCEEDED, run_guarded, show

if TYPE_CHECKING:
    from chipload.control.learning import SignalKind
    from chipload.control.linuxcnc.hal_client import HalPins
    from chipload.control.load_watch import LoadWatch
    from chipload.control.log_stream import LoadSample


@app.command()
def watch(
    source: Annotated[
        str,
        typer.Argument(
            metavar="SOURCE",
            help="an MTConnect agent, as http://127.0.0.1:5000, a log (CSV) that grows, or hal: the pins of a LinuxCNC",
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
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="log (CSV) of the samples, for chipload learn")
    ] = None,
    signal_pin: Annotated[
        str | None,
        typer.Option(
            "--signal-pin",
            metavar="PIN",
            help="of hal: power [W], torque [N m] with --torque, or current [A] as --spindle states, e.g. vfd.power",
        ),
    ] = None,
    override_pin: Annotated[
        str | None,
        typer.Option(
            "--override-pin",
            metavar="PIN",
            help="of hal: the operator's feed override, e.g. halui.feed-override.value; default: what is sent",
        ),
    ] = None,
    hold: Annotated[
        list[str] | None,
        typer.Option(
            "--hold",
            metavar="ALARM",
            help="of hal: hold the feed at this alarm: air, metal, more, tool, "
            "signal, or all; repeat it for several; default: none",
        ),
    ] = None,
    component_name: Annotated[
        str, typer.Option("--name", help="of hal: name of the component, and prefix of its pins and signals")
    ] = "chipload",
    python: Annotated[
        str, typer.Option("--python", help="of hal: the Python interpreter that has LinuxCNC's modules")
    ] = "/usr/bin/python3",
    overrides: Sets = None,
    debug: Debug = False,
) -> None:
    """Follow the power of the spindle while a program runs, and state what is not as simulated.

    A line is written where the tool cuts nothing (missing stock, a broken tool), takes more (wear, more stock), cuts in
    the air, or is a wrong one. The log needs the line of the program. A source that does not answer is asked again.
    On a LinuxCNC (hal) alarms that --hold names hold the feed, by the pin of the override of chipload hal.
    Exit code 3: an alarm, or nothing could be judged.
    """

    def work() -> int:
        from chipload.api.mechanics.learning import torque_of_result
        from chipload.cli.learn import program_job, run_job_now, signal_of_spindle
        from chipload.control.learning import Signal, SignalKind, power_signal
        from chipload.control.load_watch import LoadWatch
        from chipload.control.log_stream import log_text
        from chipload.control.machine_watch import FeedHold, machine_samples
        from chipload.control.sequential_test import WatchSettings
        from chipload.files import write_whole

        holding = FeedHold(hold or ())
        if source == "hal":
            if signal_pin is None:
                raise InputError("--signal-pin: missing: state the pin of the power or current of the spindle")
            if columns is not None or once or device is not None or component is not None:
                raise InputError("--columns, --once, --device, --component: apply to a log or an agent: leave them out")
        elif hold or signal_pin is not None or override_pin is not None:
            raise InputError(
                "--hold, --signal-pin, --override-pin: apply to hal, the pins of a LinuxCNC: leave them out"
            )
        if source != "hal" and not source.startswith(("http://", "https://")) and not Path(source).is_file():
            raise InputError(f"log {source}: no such file: start the program that writes it first")
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
        seen: list[LoadSample] = []

        def write_alarm(alarm: Finding) -> None:
            nonlocal found
            found += 1
            show(str(alarm))
            if holding.take(alarm):
                show(f"feed held by {alarm.code}: the machine stands until this command ends, and after it")

        with _pins(source, component_name, python, signal_pin, override_pin) as pins:
            show(f"watching {source}: at most {number_text(false_alarms)} false alarms an hour in the cut")
            if pins is not None:
                show(f"feed hold: {', '.join(sorted(holding.kinds)) or 'none: alarms are only written'}")
                samples = machine_samples(pins, signal.kind, holding, notice=write_alarm)
            else:
                samples = _samples(source, signal.kind, columns, device, component, once)
            try:
                for sample in samples:
                    if sample is not None:
                        if out is not None:
                            seen.append(sample)
                        for alarm in one.add(sample.time, sample.value, sample.line, sample.override):
                            write_alarm(alarm)
                    # the pins stay until the machine stands, as HAL takes the feed without them
                    holding.is_finished = one.finished
                    if (one.finished and pins is None) or (until is not None and time.monotonic() > until):
                        break
            except KeyboardInterrupt:
                show("stopped")
        # of the last samples: the pins are gone
        for alarm in one.end():
            found += 1
            show(str(alarm))
        if out is not None:
            write_whole(out, log_text(seen, signal.kind).encode("ascii"))
        return _summary(one, found)

    run_guarded(work, debug)


@contextmanager
def _pins(
    source: str, name: str, python: str, signal_pin: str | None, override_pin: str | None
) -> Iterator[HalPins | None]:
    """Yield the pins of a LinuxCNC; None for another source."""
    if source != "hal" or signal_pin is None:
        yield None
        return
    from chipload.control.linuxcnc import hal_client
    from chipload.control.machine_watch import SOURCES

    sources = {"current-in": signal_pin, **SOURCES} | ({} if override_pin is None else {"feed-in": override_pin})
    with hal_client.HalPins(name, python, sources=sources) as pins:
        yield pins


def _summary(one: LoadWatch, found: int) -> int:
    """Write what was watched, and return the exit code."""
    if one.clock.jumps:
        size, at = (number_text(x) for x in one.clock.first_jump)
        show(
            f"jumps and gaps of the clock: {one.clock.jumps}, the first of {size} s at {at} s; until the next line "
            "nothing was judged"
        )
    whole, cut, judged = (number_text(x, 3) for x in (one.seconds, one.cut_seconds, one.judged_seconds))
    show(f"{whole} s watched, {cut} s of them in the cut, {judged} s judged; {found} alarm{'' if found == 1 else 's'}")
    if one.judged_seconds == 0.0:
        show(f"nothing could be judged: {one.why_not_judged}")
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
