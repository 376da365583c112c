"""Table of calibration cuts: proposed by the planner, filled in at the machine, and read back.

Notation: F [N] normal force and w [mm] deflection of a cut, delta [mm] allowed deflection; a series is the cuts at one
place, depth by depth.

A cut with a reported deflection gives the threshold F delta / w. A series that only reports which cuts were too much
gives the greatest acceptable force below the least unacceptable one; the width of this bracket is a reserve.

Reference: [Yan2018] for the calibration.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from chipload.errors import Finding, InputError
from chipload.files import read_regular, write_whole
from chipload.number_text import number_text
from chipload.planning.thinwall.experiments import Proposal
from chipload.planning.thinwall.threshold import Experiments
from chipload.tables import LARGEST_FILE

#: columns of the table; the last three are filled in at the machine
GIVEN = ("cut", "site", "repeat", "u", "v", "x_mm", "y_mm", "z_mm", "depth_mm", "expected_normal_force_n")
FILLED = ("normal_force_n", "deflection_um", "too_much")
#: values of the last column
ANSWERS = {"yes": True, "y": True, "1": True, "true": True, "no": False, "n": False, "0": False, "false": False}


def cuts_bytes(proposal: Proposal) -> bytes:
    """The table as CSV, its last three columns empty."""
    text = io.StringIO(newline="")
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow([*GIVEN, *FILLED])
    for k, (i, repeat, d, f) in enumerate(
        zip(proposal.site.tolist(), proposal.repeat.tolist(), proposal.depth, proposal.force, strict=True)
    ):
        u, v = proposal.place[i]
        x, y, z = proposal.point[i]
        given = [f"{u:.9g}", f"{v:.9g}", f"{x:.4f}", f"{y:.4f}", f"{z:.4f}", f"{d:.4f}", f"{f:.4g}"]
        rows.writerow([k + 1, i + 1, repeat + 1, *given, "", "", ""])
    return text.getvalue().encode("ascii")


def write_cuts(path: str | Path, proposal: Proposal) -> None:
    """Write the table of proposed cuts, to be filled in at the machine."""
    write_whole(path, cuts_bytes(proposal))


@dataclass(frozen=True)
class _Row:
    """One cut that was made."""

    line: int
    series: tuple[float, float, str]
    force: float
    deflection: float | None
    too_much: bool | None


def read_cuts(path: str | Path, deflection: float) -> tuple[Experiments, tuple[Finding, ...]]:
    """Read a table that was filled in at the machine.

    A row counts if ``deflection_um`` or ``too_much`` (yes, no) is filled in. If ``normal_force_n`` is empty, the
    expected force is used and a finding states it. Columns may stand in any order, and others may be added. The
    separator is a comma, or a semicolon with decimal commas.

    Parameters
    ----------
    deflection : delta [mm] that is allowed

    Returns
    -------
    Experiments: one for each cut with a deflection and one for each series with answers; findings ``cut-not-made``,
    ``force-expected``,
    ``series-never-too-much``, ``series-overlaps``.

    Raises
    ------
    InputError
        The file cannot be read, a column is missing, a value is no number, a series begins too deep, fewer than three
        places are left.
    """
    if not 0.0 < deflection < math.inf:
        raise InputError(f"threshold.deflection_mm = {deflection:g}: must be above 0")
    label = f"experiments {Path(path).name}"
    try:
        text = read_regular(path, label, LARGEST_FILE, "keep the cuts alone").decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(f"{label}: cannot be read: not UTF-8 text") from None
    rows, findings = _rows(text, label)
    place: list[tuple[float, float]] = []
    force: list[float] = []
    series: dict[tuple[float, float, str], list[_Row]] = {}
    for row in rows:
        if row.deflection is not None:
            place.append(row.series[:2])
            force.append(row.force * deflection / row.deflection)
        else:
            series.setdefault(row.series, []).append(row)
    for key, cuts in series.items():
        place.append(key[:2])
        force.append(_allowable_force(cuts, label, findings))
    if len(set(place)) < 3:
        raise InputError(
            f"{label}: {len(set(place))} places filled in: must be at least 3, not on a line: fill in deflection_um, "
            "or too_much with yes or no, of more cuts"
        )
    return Experiments(np.array(place), np.array(force)), tuple(findings)


def _allowable_force(cuts: list[_Row], label: str, findings: list[Finding]) -> float:
    """Greatest acceptable force of a series, below the least one that was too much."""
    failed = [c.force for c in cuts if c.too_much]
    least = min(failed, default=math.inf)
    below = [c.force for c in cuts if not c.too_much and c.force < least]
    line, (u, v, _) = cuts[0].line, cuts[0].series
    if not below:
        raise InputError(
            f"{label}: line {line}: u = {u:g}, v = {v:g}: the least force {number_text(least)} N was too "
            "much already: cut "
            "shallower there"
        )
    if not failed:
        text = f"u = {u:g}, v = {v:g}: no cut was too much: {number_text(max(below))} N is taken; it may allow more"
        findings.append(Finding("series-never-too-much", line, text))
    if any(not c.too_much and c.force >= least for c in cuts):
        text = f"u = {u:g}, v = {v:g}: {number_text(least)} N was too much, and a greater force was not"
        findings.append(Finding("series-overlaps", line, text))
    return max(below)


def _rows(text: str, label: str) -> tuple[list[_Row], list[Finding]]:
    first = text.split("\n", 1)[0]
    mark = ";" if first.count(";") > first.count(",") else ","
    table = list(csv.reader(io.StringIO(text, newline=""), delimiter=mark))
    names = [n.strip().lower() for n in table[0]] if table else []
    for name in ("u", "v", "repeat", "expected_normal_force_n", *FILLED):
        if name not in names:
            raise InputError(f"{label}: line 1: column {name} is missing: keep the columns of the proposed table")
    out: list[_Row] = []
    findings: list[Finding] = []
    for line, cells in enumerate(table[1:], start=2):
        if not any(c.strip() for c in cells):
            continue
        if len(cells) != len(names):
            raise InputError(f"{label}: line {line}: {len(cells)} values: must be {len(names)}, one a column")
        cell = {n: c.strip() for n, c in zip(names, cells, strict=True)}

        def number(name: str, cell: dict[str, str] = cell, line: int = line) -> float:
            try:
                value = float(cell[name].replace(",", ".") if mark == ";" else cell[name])
            except ValueError:
                value = math.nan
            if not math.isfinite(value):
                raise InputError(f"{label}: line {line}: {name} = {cell[name][:40]!r}: must be a number")
            return value

        def above_0(name: str, number: Callable[[str], float] = number, line: int = line) -> float:
            value = number(name)
            if not value > 0.0:
                raise InputError(f"{label}: line {line}: {name} = {value:g}: must be above 0")
            return value

        answer = cell["too_much"].lower()
        if answer and answer not in ANSWERS:
            raise InputError(f"{label}: line {line}: too_much = {cell['too_much'][:40]!r}: must be yes or no")
        if not answer and not cell["deflection_um"]:
            findings.append(Finding("cut-not-made", line, "neither deflection_um nor too_much: left out"))
            continue
        force = above_0("normal_force_n" if cell["normal_force_n"] else "expected_normal_force_n")
        if not cell["normal_force_n"]:
            findings.append(Finding("force-expected", line, f"no normal_force_n: the expected {force:g} N is taken"))
        moved = above_0("deflection_um") / 1000.0 if cell["deflection_um"] else None
        series = (number("u"), number("v"), cell["repeat"])
        out.append(_Row(line, series, force, moved, ANSWERS.get(answer)))
    return out, findings
