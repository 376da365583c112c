"""Reference loads of a program for the load monitors of controllers: the spindle power of each section of each tool.

A section is what one tool cuts between two rapids. Its reference is its greatest mean power over a revolution; the
bounds are what that power may be by the resolution of the simulation and by twice the standard deviation that the
spread of the coefficients gives. A monitor sees the motor, not the cutter:

    P_motor = P / e + w (i0 + i1 w)        e efficiency, i0 + i1 w idle map, of the file of `chipload spindle --power`

Heidenhain's AFC takes a reference power for a tool, in percent of the rated power (column AFC-LOAD of the tool table),
and makes its file of the program from it without a teach-in cut; AFC-OVLD1 is added to it and reports wear.
Reference: [TNC7], "Basic AFC settings in AFC.tab", "Monitoring tool wear and tool load".
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from chipload.control.spindle_file import read_spindle
from chipload.errors import InputError
from chipload.number_text import number_text
from chipload.result import Result, Track
from chipload.units import rpm_from_rad_s

Floats = NDArray[np.float64]

#: available formats, and the files that they give
MONITORS = {"csv": "load.csv", "heidenhain": "afc-load.tab"}
#: formats that are not published: what there is instead
UNPUBLISHED = {
    "siemens": "the limits of its monitors are entered on pages that the machine's maker designs",
    "sinumerik": "the limits of its monitors are entered on pages that the machine's maker designs",
    "fanuc": "the limits of its monitors are entered on pages that the machine's maker designs",
    "afc.dep": "the control makes this file itself, from the table of format heidenhain",
}
#: limit that knows the rated power of the spindle
POWER_LIMIT = "spindle_power_w"
#: columns that are needed
NEEDED = ("line", "tool", "t_s", "power_w", "torque_mean_nm")


@dataclass(frozen=True)
class Power:
    """Greatest power of a section and what it may be at least and at most [W]; None: the spread is not known."""

    most: float
    low: float | None
    high: float | None


@dataclass(frozen=True)
class LoadSection:
    """A section: the cut of a tool between two rapids.

    Parameters
    ----------
    track : name
    number : in the track, from 1
    tool : its number
    lines : first and last of the program that cut
    times : its begin and end on the machine [s]
    speed : of the spindle [rad/s]
    cutting : at the cutter
    mean : power at the cutter, over the time in cut [W]
    motor : of the motor; None: its spindle is not stated
    rated : power of the spindle [W]; None: the machine does not state it
    """

    track: str
    number: int
    tool: int
    lines: tuple[int, int]
    times: tuple[float, float]
    speed: float
    cutting: Power
    mean: float
    motor: Power | None
    rated: float | None


def sections_of(result: Result, spindle: Path | None = None) -> tuple[LoadSection, ...]:
    """The sections of the tracks in use; ``spindle``: what `chipload spindle --power` wrote.

    Raises
    ------
    InputError
        The result has no spindle power, or the file does not state the motor's.
    """
    out = tuple(section for track in result.in_use for section in _sections(track))
    if not out:
        raise InputError("load monitor: the result has no spindle power: run a job that simulates its program")
    return out if spindle is None else tuple(replace(s, motor=_motor(s, spindle)) for s in out)


def load_csv(sections: Sequence[LoadSection]) -> bytes:
    """A row a section, units in the names; a cell is empty where nothing is known."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    powers = [f"cutting_power_{x}_w" for x in ("mean", "max", "low", "high")]
    powers += [f"motor_power_{x}_w" for x in ("max", "low", "high")] + ["rated_power_w"]
    loads = [f"motor_load_{x}_percent" for x in ("max", "low", "high")]
    head = ["track", "section", "tool", "line_from", "line_to", "t_from_s", "t_to_s", "speed_rpm", *powers, *loads]
    writer.writerow(head)
    for s in sections:
        motor = s.motor or Power(math.nan, None, None)
        three = [motor.most if s.motor else None, motor.low, motor.high]
        percent = [None if x is None or s.rated is None else 100.0 * x / s.rated for x in three]
        numbers = [
            *s.times, rpm_from_rad_s(s.speed), s.mean, s.cutting.most, s.cutting.low, s.cutting.high, *three, s.rated,
            *percent,
        ]  # fmt: skip
        words = [s.track, s.number, s.tool, *s.lines]
        writer.writerow([*words, *("" if x is None else f"{x:.6g}" for x in numbers)])
    return text.getvalue().encode("utf-8")


def afc_table(sections: Sequence[LoadSection]) -> bytes:
    """The columns of Heidenhain's tool table that AFC takes its reference from, a row a tool, in percent.

    Raises
    ------
    InputError
        The motor's power, its spread or the rated power is not known, or the rated power is exceeded.
    """
    rows = ["T".ljust(8) + "AFC-LOAD".ljust(10) + "AFC-OVLD1".ljust(11) + "AFC-OVLD2"]
    for tool in sorted({s.tool for s in sections}):
        load, over = _percent(tool, [s for s in sections if s.tool == tool])
        rows.append(f"{tool:<8d}{load:<10.1f}{over:<11.1f}0.0")
    return "\n".join(["BEGIN AFC-LOAD.TAB MM", *rows, "[END]"]).encode("ascii") + b"\n"


def _percent(tool: int, own: Sequence[LoadSection]) -> tuple[float, float]:
    """Load of a tool and what is added to it until wear is reported [% of the rated power], rounded up."""
    at = f"load monitor heidenhain: tool {tool}"
    load = high = 0.0
    for s in own:
        if s.rated is None:
            raise InputError(f"{at}: the rated power is not known: state spindle.power_w of the machine, and its check")
        if s.motor is None:
            raise InputError(
                f"{at}: the control measures the motor, its idle power with it: name the spindle, --spindle FILE, that "
                "chipload spindle --power has identified"
            )
        if s.motor.high is None:
            raise InputError(f"{at}: the spread of the coefficients is not known: state spread in the material")
        load, high = max(load, 100.0 * s.motor.most / s.rated), max(high, 100.0 * s.motor.high / s.rated)
    if load > 100.0:
        raise InputError(f"{at}: takes {number_text(load)} % of the rated power: must be at most 100: cut less")
    up = math.ceil(10.0 * load - 1e-9) / 10.0
    return up, max(0.1, math.ceil(10.0 * (high - up) - 1e-9) / 10.0)


def _sections(track: Track) -> Iterator[LoadSection]:
    blocks = [block for block in track.blocks() if all(name in block for name in NEEDED)]
    if not blocks:
        return
    names = [n for n in (*NEEDED, "rapid", "power_sd_w") if all(n in block for block in blocks)]
    c = {n: np.concatenate([np.asarray(block[n]) for block in blocks]) for n in names}
    limit = next((check for check in track.limits if check.name == POWER_LIMIT), None)
    error = 0.0 if limit is None else limit.error
    rapid = c["rapid"].astype(bool) if "rapid" in c else np.zeros(len(c["tool"]), dtype=bool)
    ends = np.flatnonzero(np.diff(c["tool"]) != 0) + 1
    borders = np.union1d(ends, np.flatnonzero(np.diff(rapid.astype(int)) != 0) + 1)
    number = 0
    for rows in np.split(np.arange(len(rapid)), borders):
        power = c["power_w"][rows]
        cuts = np.flatnonzero(power > 0.0)
        if rapid[rows[0]] or not len(cuts):
            continue
        number += 1
        first, last, top = int(rows[cuts[0]]), int(rows[cuts[-1]]), int(rows[np.argmax(power)])
        before = np.concatenate([[0.0], c["t_s"][:-1]])
        spent = (c["t_s"] - before)[rows[cuts]]
        yield LoadSection(
            track.name, number, int(c["tool"][top]),
            (int(c["line"][rows[cuts]].min()), int(c["line"][rows[cuts]].max())),
            (float(before[first]), float(c["t_s"][last])),
            float(c["power_w"][top] / c["torque_mean_nm"][top]),
            _cutting_power(power, c["power_sd_w"][rows] if "power_sd_w" in c else None, error),
            float(power[cuts] @ spent / spent.sum()) if spent.sum() > 0.0 else float(power[cuts].mean()),
            None, None if limit is None else limit.limit,
        )  # fmt: skip


def _cutting_power(power: Floats, deviation: Floats | None, error: float) -> Power:
    most = float(power.max())
    if deviation is None:
        return Power(most, None, None)
    # the greatest of the section is at least the greatest of what each row is at least
    low = max(0.0, float((power * (1.0 - error) - 2.0 * deviation).max()))
    return Power(most, low, float((power * (1.0 + error) + 2.0 * deviation).max()))


def _motor(section: LoadSection, file: Path) -> Power:
    """The motor's power for that at the cutter; efficiency and idle power may differ by what the file states."""
    found = read_spindle(file, section.speed)
    if found.source != "power":
        raise InputError(f"--spindle {file}: input = {found.source}: must be power: run chipload spindle with --power")
    values = found.values
    efficiency, wrong = values["torque_constant_nm_a"], values.get("torque_constant_error_share", 0.0)
    free = section.speed * (values["idle_a"][0] + values["idle_a"][1] * section.speed)
    drift = values.get("idle_error_share", 0.0)
    cut = section.cutting
    return Power(
        cut.most / efficiency + free,
        None if cut.low is None else cut.low / (efficiency * (1.0 + wrong)) + free * (1.0 - drift),
        None if cut.high is None else cut.high / (efficiency * (1.0 - wrong)) + free * (1.0 + drift),
    )
