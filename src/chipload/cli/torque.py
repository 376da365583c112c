"""The commands of torque control: ``chipload hal`` and ``chipload spindle``."""

from __future__ import annotations

import math
import signal
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from chipload.cli.app import Debug, app
from chipload.errors import InputError
from chipload.number_text import number_text
from chipload.terminal import EXCEEDED, run_guarded, show

if TYPE_CHECKING:
    from chipload.control.hal import HalJob
    from chipload.control.identification import IdentifiedSpindle

#: share of correctly ordered pairs below which the signal does not distinguish a cut from air
TOLD_APART = 0.8


@app.command()
def hal(
    file: Annotated[Path, typer.Argument(metavar="HAL", help="the controller (TOML): path, override, spindle")],
    out: Annotated[Path | None, typer.Option("--out", metavar="FILE", help="log of every period (CSV)")] = None,
    name: Annotated[
        str, typer.Option("--name", help="name of the component, and prefix of its pins and signals")
    ] = "chipload",
    current_pin: Annotated[
        str | None,
        typer.Option(
            "--current-pin", metavar="PIN", help="pin or signal with the spindle's current [A], e.g. vfd.current"
        ),
    ] = None,
    power_pin: Annotated[
        str | None,
        typer.Option(
            "--power-pin", metavar="PIN", help="pin or signal with the spindle's power [W], instead of the current"
        ),
    ] = None,
    speed_pin: Annotated[
        str | None,
        typer.Option(
            "--speed-pin", metavar="PIN", help="pin or signal with the spindle's speed [rev/s], e.g. spindle.0.speed-in"
        ),
    ] = None,
    spindle_override_pin: Annotated[
        str | None,
        typer.Option(
            "--spindle-override-pin",
            metavar="PIN",
            help="pin or signal with the current spindle override, for the panel, e.g. halui.spindle.0.override.value",
        ),
    ] = None,
    python: Annotated[
        str, typer.Option("--python", help="the Python interpreter that has LinuxCNC's modules")
    ] = "/usr/bin/python3",
    panel: Annotated[
        Path | None,
        typer.Option("--panel", metavar="FILE", help="only write the panel (PyVCP, .xml), with its .hal file"),
    ] = None,
    debug: Debug = False,
) -> None:
    """Limit the torque on a running LinuxCNC: a HAL component that sets the feed override. Stop with Ctrl-C.

    The torque is estimated from the current and the speed of the spindle (--current-pin, --speed-pin). Without these
    options, `source` in the file states where the torque comes from.
    """

    def work() -> int:
        from chipload.control.hal import control, table_of
        from chipload.control.hal_file import load_hal
        from chipload.control.linuxcnc.hal_client import HalPins
        from chipload.files import write_whole

        if current_pin is not None and power_pin is not None:
            raise InputError("--current-pin, --power-pin: state only the one that the spindle was identified from")
        name_of = "--current-pin" if power_pin is None else "--power-pin"
        measured = current_pin if power_pin is None else power_pin
        if (measured is None) != (speed_pin is None):
            missing, there = ("--speed-pin", name_of) if speed_pin is None else (name_of, "--speed-pin")
            raise InputError(f"{missing}: missing: state it with {there}: the torque is estimated from both")
        job, sources = load_hal(file), {}
        if panel is not None:
            return _write_panel(job, panel, name, out)
        if measured is not None and speed_pin is not None:
            job = replace(job, source="current" if power_pin is None else "power")
            sources = {"current-in": measured, "speed-in": speed_pin}
        if spindle_override_pin is not None:
            sources["spindle-override-in"] = spindle_override_pin
        stop_signals: list[int] = []
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda n, _: stop_signals.append(n))
        with HalPins(name, python, sources=sources) as pins:
            record = control(
                job,
                pins,
                stop=lambda: bool(stop_signals),
                notice=lambda reason, s: typer.echo(
                    f"machine stopped: {reason} at {s:.4g} mm; it stays stopped until this command ends", err=True
                ),
            )
        if out is not None:
            write_whole(out, table_of(record).encode("ascii"))
        show(
            f"{len(record.rows)} steps, ended: {record.ended}; greatest torque "
            f"{number_text(1e-3 * record.torque_max)} N m, "
            f"set point {number_text(1e-3 * job.override.torque_ref)} N m"
        )
        return 0 if record.ended == "path" else EXCEEDED

    run_guarded(work, debug)


def _write_panel(job: HalJob, file: Path, name: str, out: Path | None) -> int:
    """Write the panel of a controller and the HAL lines that connect it."""
    from chipload.control.linuxcnc.panel import panel_hal, panel_xml
    from chipload.files import write_whole

    if out is not None:
        raise InputError("--panel, --out: --panel only writes the panel: state one of them")
    if file.suffix.lower() != ".xml":
        raise InputError(f"--panel {file}: must end with .xml; its HAL lines are written next to it, to a .hal file")
    wires = file.with_suffix(".hal")
    write_whole(file, panel_xml(job).encode("utf-8"))
    write_whole(wires, panel_hal(name).encode("utf-8"))
    show(f"written: {file}, {wires}")
    show(f"in AXIS: [DISPLAY] PYVCP = {file.name}, [HAL] POSTGUI_HALFILE = {wires.name}")
    show(f"in its own window: loadusr -Wn pyvcp pyvcp -c pyvcp {file.name}, then source {wires.name}")
    return 0


@app.command()
def spindle(
    logs: Annotated[
        list[Path], typer.Argument(metavar="LOG...", help="logs (CSV, Parquet) of cuts and of the idle spindle")
    ],
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="the spindle (TOML), for [spindle] file of a job")],
    columns: Annotated[
        Path | None,
        typer.Option(
            "--columns", metavar="FILE", help="names and units of the columns (TOML), if the log does not state them"
        ),
    ] = None,
    air: Annotated[
        list[Path] | None, typer.Option("--air", metavar="LOG", help="a log in which nothing is cut; repeatable")
    ] = None,
    power: Annotated[bool, typer.Option("--power", help="use the power column instead of the current")] = False,
    torque_constant_nm_a: Annotated[
        float | None, typer.Option("--torque-constant-nm-a", help="torque constant from the data sheet")
    ] = None,
    efficiency: Annotated[
        float | None, typer.Option("--efficiency", help="efficiency of the spindle, if known; with --power")
    ] = None,
    sensor_lag_s: Annotated[
        float | None, typer.Option("--sensor-lag-s", help="time constant of the sensor, if known")
    ] = None,
    flutes: Annotated[
        int | None, typer.Option("--flutes", help="number of flutes, for the tooth passing frequency")
    ] = None,
    debug: Debug = False,
) -> None:
    """Identify a spindle from logs: the torque as a function of current or power, its valid range and intervals.

    Logs may have the columns time_s, speed_rpm, current_a or power_w, and torque_nm (0 for the idle spindle). To test
    the result, each log is predicted from the others. Exit code 3: the signal does not distinguish a cut from the idle
    spindle.
    """

    def work() -> int:
        from chipload.control.identification import identify_spindle, run_of
        from chipload.control.logs import read_log
        from chipload.control.spindle_file import write_spindle
        from chipload.files import write_whole

        source = "power" if power else "current"
        constant = efficiency if power else torque_constant_nm_a
        for option, value, wanted in (
            ("--efficiency", efficiency, power), ("--torque-constant-nm-a", torque_constant_nm_a, not power),
            ("--sensor-lag-s", sensor_lag_s, True),
        ):  # fmt: skip
            if value is None:
                continue
            if not wanted:
                raise InputError(f"{option}: not used with{'' if power else 'out'} --power: leave it out")
            if not (0.0 <= value < math.inf) or (value == 0.0 and option != "--sensor-lag-s"):
                raise InputError(f"{option} = {value:g}: must be above 0")
        runs, hashes = {}, {}
        for path in dict.fromkeys((*logs, *(air or ()))):
            log, findings = read_log(path, columns)
            for f in findings:
                show(f"{path.name}: {f}")
            runs[path.name] = run_of(log, f"log {path}", source, path in (air or ()))
            hashes[path.name] = f"sha256 {sha256(path.read_bytes()).hexdigest()}"
        stated = None if constant is None else constant if power else 1e3 * constant
        found = identify_spindle(tuple(runs.values()), tuple(runs), source, stated, sensor_lag_s)
        write_whole(out, write_spindle(found, hashes).encode("utf-8"))
        for line in lines_of(found, flutes):
            show(line)
        show(f"written: {out}")
        return EXCEEDED if any(answer.apart < TOLD_APART for answer in found.predictions) else 0

    run_guarded(work, debug)


def lines_of(found: IdentifiedSpindle, flutes: int | None) -> list[str]:
    """The identified values, one line each."""
    from chipload.control.identification import alias_frequency
    from chipload.units import rpm_from_rad_s

    f, level, sensor = found.found, f"{100.0 * found.found.level:g} %", found.sensor
    power = found.source == "power"
    unit, scale = ("N m", 1e-3) if power else ("A", 1.0)
    name = "efficiency" if power else "torque constant"
    constant = f"{f.torque_constant:.4g}" if power else f"{number_text(1e-3 * f.torque_constant)} N m/A"
    wrong = number_text(100.0 * found.constant_error, 2)
    how = {True: "stated", False: f"+- {wrong} % at {level}", None: ""}[found.constant_known]
    low, high = (x * rpm_from_rad_s(1.0) for x in f.speeds)
    out = [
        f"{name}: {constant} ({how})"
        if found.constant_known is not None
        else f"{name}: unknown, because no log has a cut of known torque; torques below are in {unit}",
        f"idle {'power over speed' if power else 'current'}: "
        + " + ".join(
            f"{scale * float(x):.4g}{' w' if k else ''} +- {scale * float(h):.2g}"
            for k, (x, h) in enumerate(zip(f.idle, f.half_width[2:], strict=True))
        )
        + f" {unit}, w in rad/s, drift {60.0 * scale * found.idle.rate:.3g} +- "
        f"{60.0 * scale * found.idle.half_width:.2g} {unit}/min",
        f"inertia: {1e-6 * f.inertia * 1e3:.4g} kg m2 +- {1e-6 * float(f.half_width[1]) * 1e3:.2g}"
        if found.inertia_found and found.constant_known is not None
        else "inertia: unknown" + ("" if found.inertia_found else ", because the speed does not change"),
        f"lag: {1e3 * sensor.lag:.3g} ms, {1e3 * sensor.lag_interval[0]:.3g} to {1e3 * sensor.lag_interval[1]:.3g}; "
        f"noise {scale * sensor.noise:.3g} {unit}, step {scale * sensor.step:.3g} {unit}",
    ]
    if found.constant_known is not None:
        least, most = (1e-3 * x for x in found.torque)
        out.append(
            f"valid for torques from {least:.3g} to {number_text(most)} N m, {low:.5g} to "
            f"{number_text(high, 5)} rpm, below "
            f"{number_text(sensor.bandwidth, 3)} Hz"
            if most < math.inf
            else f"valid for torques above {number_text(least, 3)} N m, below {number_text(sensor.bandwidth, 3)} Hz; "
            "no log has a cut above "
            "that torque"
        )
    torque = "N m" if found.constant_known is not None else unit
    per = 1e-3 if found.constant_known is not None else scale
    for answer in found.predictions:
        text = f"prediction of {answer.name}: error {per * answer.rms:.3g} {torque} rms, {per * answer.mean:+.3g} mean"
        if answer.greatest > 0.0:
            text += (
                f", of {per * answer.greatest:.4g} at most ({number_text(100.0 * answer.rms / answer.greatest, 2)} %)"
            )
        text += f", {number_text(100.0 * answer.covered, 3)} % within the interval"
        if math.isfinite(answer.apart):
            resolved = "distinguished from air" if answer.apart >= TOLD_APART else "not distinguished from air"
            text += f"; cuts {resolved}: {number_text(100.0 * answer.apart, 3)} % of pairs in order (50 %: chance)"
        out.append(text)
    if flutes is not None:
        passing = flutes * found.cut_speed / math.tau
        seen = alias_frequency(passing, 1.0 / sensor.period)
        inside = seen < sensor.bandwidth
        out.append(
            f"tooth passing frequency {number_text(passing)} Hz: sampling at "
            f"{number_text(1.0 / sensor.period)} Hz shifts it to "
            f"{number_text(seen, 3)} Hz, "
            + ("inside the bandwidth, where it looks like torque" if inside else "above the bandwidth")
        )
    return out
