"""Files of a sweep: the table of its combinations, a plot of time against use of limits, and the best job."""

from __future__ import annotations

import csv
import io
import os
from html import escape
from pathlib import Path
from typing import Any

import tomlkit

from chipload.files import is_file, read_regular, write_whole
from chipload.jobs import capability_of
from chipload.jobs.override import override
from chipload.sweep.run import Combination, SweepResult
from chipload.tables import LARGEST_FILE

#: names of the files
TABLE, PLOT, BEST = "sweep.csv", "sweep.html", "best.toml"


def write_sweep(result: SweepResult, job: str | Path, out: str | Path) -> list[Path]:
    """Write table, plot and best job into the folder of a sweep and return their paths.

    Raises
    ------
    OutputError
        They cannot be written.
    """
    out = Path(out)
    files = {TABLE: table_text(result), PLOT: plot_page(result)}
    if result.best is not None:
        files[BEST] = job_text(Path(job), result.best, out)
    else:
        (out / BEST).unlink(missing_ok=True)
    for name, text in files.items():
        write_whole(out / name, text.encode())
    return [out / name for name in files]


def state_of(combination: Combination, confidence: float) -> str:
    """`holds`, `refused`, or the state of its worst case."""
    if combination.refused:
        return "refused"
    if combination.probability >= confidence:
        return "holds"
    states = [record["state"] for record in combination.records]
    return "exceeds" if "exceeds" in states else "unproven"


def table_text(result: SweepResult) -> str:
    """Return the table as CSV, with a row for each combination and units in the names of the columns."""
    combinations = result.combinations
    keys = [key for key, _ in combinations[0].values]
    limits = sorted({name for c in combinations for record in c.records for name in record["limits"]})
    out = io.StringIO()
    table = csv.writer(out, lineterminator="\n")
    table.writerow(
        ["combination", *keys, "state", "cases", "holds_probability", "holds_probability_low", "holds_probability_high",
         "time_s", "use_of_limits", *limits, "message"]
    )  # fmt: skip
    for c in combinations:
        low, high = c.interval
        worst: list[Any] = []
        for name in limits:
            values = [record["limits"].get(name, {}).get("worst") for record in c.records]
            known = [v for v in values if v is not None]
            worst.append(max(known) if known else "")
        table.writerow(
            [c.number, *(value for _, value in c.values), state_of(c, result.confidence), len(c.records),
             _number(c.probability), _number(low), _number(high), _number(c.time_s), _number(c.use_of_limits),
             *(_number(v) for v in worst), c.records[0]["message"]]
        )  # fmt: skip
    return out.getvalue()


def _number(value: Any) -> Any:
    return "" if value is None or value == "" else f"{value:.9g}"


def plot_page(result: SweepResult) -> str:
    """A page with time against use of limits, a point for each combination; those that no other beats are joined."""
    import plotly.graph_objects as go

    shown = [c for c in result.combinations if c.time_s is not None and c.use_of_limits is not None]
    figure = go.Figure()
    colours = {"holds": "#1a7f37", "unproven": "#b58900", "exceeds": "#c62828"}
    for state, colour in colours.items():
        own = [c for c in shown if state_of(c, result.confidence) == state]
        figure.add_scatter(
            x=[c.time_s for c in own], y=[100.0 * (c.use_of_limits or 0.0) for c in own], mode="markers", name=state,
            marker={"color": colour, "size": 10, "symbol": {"holds": "circle", "unproven": "diamond"}.get(state, "x")},
            text=[", ".join(f"{escape(k)}={escape(v)}" for k, v in c.values) for c in own],
            hovertemplate="%{text}<br>%{x:.4g} s, %{y:.4g} % of a limit<extra></extra>",
        )  # fmt: skip
    front = pareto(shown)
    figure.add_scatter(
        x=[c.time_s for c in front], y=[100.0 * (c.use_of_limits or 0.0) for c in front], mode="lines",
        name="no other is better in both", line={"color": "#666", "dash": "dot"}, hoverinfo="skip",
    )  # fmt: skip
    figure.add_hline(y=100.0, line={"color": "#c62828", "width": 1})
    figure.update_layout(
        xaxis_title="time of the programs [s]", yaxis_title="greatest use of a limit [%]", template="plotly_white",
        height=560, margin={"l": 64, "r": 16, "t": 24, "b": 48},
    )  # fmt: skip
    body = figure.to_html(full_html=False, include_plotlyjs=True, div_id="sweep")
    return (
        '<!doctype html><html lang="en"><meta charset="utf-8"><title>Sweep</title>'
        f'<body style="font-family: system-ui, sans-serif; margin: 1.5rem"><h1>Sweep</h1>'
        f"<p>{escape(result.message)}</p>{body}</body></html>\n"
    )


def pareto(combinations: list[Combination]) -> list[Combination]:
    """Return the combinations that no other beats in both time and use of limits, by time."""
    out: list[Combination] = []
    for c in sorted(combinations, key=lambda c: (c.time_s or 0.0, c.use_of_limits or 0.0)):
        if not out or (c.use_of_limits or 0.0) < (out[-1].use_of_limits or 0.0):
            out.append(c)
    return out


def job_text(job: Path, best: Combination, out: Path) -> str:
    """Return the job file with the best values and its comments; file names are relative to the folder of the sweep."""
    text = read_regular(job, str(job), LARGEST_FILE, "not a job").decode()
    document = tomlkit.parse(text)
    values = [f"{path}={value}" for path, value in best.values]
    root = capability_of(document, values).root
    for value in values:
        override(document, value, root)
    _move_files(document, job.parent, out)
    return tomlkit.dumps(document)


def _move_files(table: Any, old: Path, new: Path) -> None:
    """Names of files in a table, in place: relative to ``new`` instead of ``old``."""
    for key, value in list(table.items() if hasattr(table, "items") else enumerate(table)):
        if isinstance(value, str):
            if is_file(old / value):
                table[key] = os.path.relpath(old / value, new)
        elif hasattr(value, "items") or isinstance(value, list):
            _move_files(value, old, new)
