"""The files of a torque job for the machine: path and controller for `chipload hal`, and two programs.

`0-override.ngc` has the programmed feeds and takes the override. `0-feedforward.ngc` has the feeds that the model
allows written into it, for a machine without a controller, where nothing is measured: it belongs to the feed schedule
of the model, a variant beside the controller of the verdict, and is not released.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from chipload.control.fuzzy import write_fuzzy
from chipload.control.hal import HalJob
from chipload.control.hal_file import write_hal
from chipload.control.linuxcnc.path import write_path
from chipload.control.override import Override
from chipload.jobs.torque.outcome import TorqueResult
from chipload.jobs.torque.written_program import override_file, override_text
from chipload.machine.machine import Machine
from chipload.program.gcode.writer import write_gcode
from chipload.program.motions import is_arc
from chipload.program.program import DWELL, RAPID, Program
from chipload.program.release import release_of_text
from chipload.report.programs import ENDINGS
from chipload.result import Result, release_of

Floats = NDArray[np.float64]

#: feeds are written in steps of so much of the programmed one
FEED_STEP = 0.05
#: an arc is written in pieces of at most this [rad]
LONGEST = 0.5 * np.pi
#: ends of rows and of steps agree within [mm]
SAME_MM = 1e-6
#: the machine's place is searched so far from its last place, and is off the path beyond [mm]
WINDOW_MM, AWAY_MM = 5.0, 0.3
PATH, TABLE, HAL = "path.csv", "controller.toml", "hal.toml"
#: files that the controller in use takes besides its program
CONTROLLER_FILES = (PATH, TABLE, HAL)


def program_files(outcome: TorqueResult, result: Result) -> dict[str, bytes]:
    """All files by name."""
    machine = outcome.job.machine
    name = override_file(machine)
    written = outcome.job.written
    release = replace(release_of(result, name), condition="with chipload hal")
    text = override_text(outcome.job.title, written.planned, machine, release)
    given = release_of_text(text, written.text, release)
    if given is not release:
        text = override_text(outcome.job.title, written.planned, machine, given)
    out = {name: text.encode("ascii")}
    if not outcome.attainable or outcome.control.controller is None:
        return out
    fed = feed_forward(outcome, outcome.control.controller)
    title = f"{outcome.job.title}, feeds that the planned torque allows, nothing is measured"
    name = feed_forward_file(machine)
    out[name] = write_gcode(fed, machine, title=title, release=release_of(result, name)).encode("ascii")
    case = outcome.control.cases[-1]
    job = HalJob(
        path=outcome.allowable.path, override=case.runs["fuzzy_feedforward"].config, table=outcome.control.table,
        source="plant", spindle=outcome.control.spindle, acceleration=case.loop.acceleration, period=case.loop.period,
        latency=case.loop.latency, modelled=True, window=WINDOW_MM, away=AWAY_MM,
        deviation=outcome.control.deviation, identified_from=outcome.control.identified_from,
    )  # fmt: skip
    out[PATH] = write_path(outcome.allowable.path).encode("ascii")
    out[TABLE] = write_fuzzy(outcome.control.table).encode("ascii")
    out[HAL] = write_hal(job, PATH, TABLE).encode("ascii")
    return out


def feed_forward_file(machine: Machine) -> str:
    """Name of the file of the program with the feeds that the model allows."""
    return f"0-feedforward.{ENDINGS[machine.dialect]}"


def planned_override(outcome: TorqueResult, config: Override) -> Floats:
    """Override of each step that the model alone allows, (n,): in whole steps, rounded down but not below the floor."""
    profile = outcome.allowable.path.over_relief
    with np.errstate(divide="ignore", invalid="ignore"):
        rows = np.where(profile.cut > 0.0, (config.torque_ref - profile.edge) / profile.cut, np.inf)
    rows = np.where((profile.cut == 0.0) & (profile.edge > config.torque_ref), 0.0, rows)
    least = np.minimum(rows[1:], rows[:-1])
    whole = np.floor(np.clip(least, config.floor, config.cap) / FEED_STEP + 1e-9) * FEED_STEP
    return np.asarray(np.maximum(whole, config.floor))


def feed_forward(outcome: TorqueResult, config: Override) -> Program:
    """Program with its cutting rows split into parts of one feed each; arcs stay arcs."""
    p, override = outcome.job.written.program, planned_override(outcome, config)
    arc, points, at = is_arc(p), outcome.allowable.path.points, 0
    row_of, end, feed = [], [], []
    for k in range(len(p)):
        if p.motion[k] in (RAPID, DWELL) or k == 0:
            row_of.append(k)
            end.append(p.p_work[k])
            feed.append(p.feed[k])
            if at > 0 and at + 1 < len(points) and np.abs(points[at + 1 :] - p.p_work[k]).max(axis=1).min() <= SAME_MM:
                at = _next(points, at, p.p_work[k])
            continue
        last = _next(points, at, p.p_work[k])
        for j in range(at, last):
            ends = (
                j + 1 == last
                or override[j + 1] != override[j]
                or _swept_angle(p, k, arc[k], points, at, j + 2) > LONGEST
            )
            if ends:
                row_of.append(k)
                end.append(p.p_work[k] if j + 1 == last else _on_arc(p, k, arc[k], points[j + 1]))
                feed.append(p.feed[k] * override[j])
                at = j + 1
        at = last
    rows = np.array(row_of)
    names = ("motion", "axis", "centre", "normal", "spindle", "tool", "line", "label")
    columns = {name: getattr(p, name)[rows] for name in names}
    return Program(
        **columns, p_work=np.array(end), turns=np.zeros(len(rows), dtype=np.int64), feed=np.array(feed), labels=p.labels
    )


def _next(points: Floats, at: int, end: Floats) -> int:
    """The next row of the path that is the end of a row of the program."""
    return at + 1 + int(np.argmax(np.abs(points[at + 1 :] - end).max(axis=1) <= SAME_MM))


def _swept_angle(p: Program, k: int, arc: bool, points: Floats, first: int, last: int) -> float:
    if not arc or last >= len(points):
        return 0.0
    a, b = ((x - p.centre[k]) - ((x - p.centre[k]) @ p.normal[k]) * p.normal[k] for x in (points[first], points[last]))
    return float(np.arccos(np.clip(a @ b / (np.linalg.norm(a) * np.linalg.norm(b)), -1.0, 1.0)))


def _on_arc(p: Program, k: int, arc: bool, point: Floats) -> Floats:
    """A place of a chord put on its arc."""
    if not arc:
        return point
    up = ((point - p.centre[k]) @ p.normal[k]) * p.normal[k]
    flat = point - p.centre[k] - up
    whole = p.p_work[k] - p.centre[k]
    radius = np.linalg.norm(whole - (whole @ p.normal[k]) * p.normal[k])
    return np.asarray(p.centre[k] + up + flat * (radius / np.linalg.norm(flat)))
