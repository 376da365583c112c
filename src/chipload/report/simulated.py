"""What running a program through its stock gives: chips, forces, torque and power along it, and its limits.

Notation: means are over the time in which something is cut at a feed; greatest and least values are those of any
rotation of the spindle in any step. Forces are on the cutter, in the work frame.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from html import escape
from typing import Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray
from plotly.subplots import make_subplots

from chipload.cutting.material import Material
from chipload.machine.machine import Machine
from chipload.report import surface
from chipload.report.diagram import diagram_figure
from chipload.report.figures import FONT, GRID, INK, LIMIT, LINE_POINTS, STOCK
from chipload.report.held import LIMITS, Held, held_limits
from chipload.report.shape import thinned
from chipload.report.sheet import figure, table
from chipload.simulation.chips import Removal
from chipload.simulation.surface import Collision, Difference
from chipload.simulation.unfinished import in_rows
from chipload.stock.layers import LayeredStock

Floats = NDArray[np.float64]

#: rows of history.parquet that are held in memory together
HISTORY_ROWS = 65_536
SURE = "\u00b1 is twice the standard deviation that the spread of the material's coefficients gives."
UNSURE = "How sure these are cannot be said: the material states neither a spread nor a covariance of its coefficients."
#: rows of the figure: lines (column, name, colour) and the title of their axis, and the limit
ROWS = (
    (
        (
            ("force_x_mean_n", "x, mean", "#3457a6"),
            ("force_y_mean_n", "y, mean", "#0b7a75"),
            ("force_z_mean_n", "z, mean", "#c9821a"),
            ("force_n", "greatest size", INK),
        ),
        "force [N]",
        "force_n",
    ),
    ((("torque_mean_nm", "mean", "#8a8f98"), ("torque_nm", "greatest", INK)), "torque [N m]", "torque_nm"),
    ((("power_w", "mean over a turn", INK),), "power [W]", "power_w"),
    ((("chip_max_mm", "thickest", INK),), "chip [mm]", "chip_mm"),
    ((("deflection_um", "tool from work", INK),), "deflection [\u00b5m]", "deflection_um"),
    ((("rate", "removed", STOCK),), "removal [mm\u00b3/s]", ""),
)


@dataclass(frozen=True, eq=False)
class Simulated:
    """A program that was run through a stock.

    Parameters
    ----------
    removal : what every step removed and what it cost
    stock : as it is afterwards
    machine : whose spindle has to give torque and power
    material : whose coefficients were used
    limits, unchecked : stated limits by name, and names of those that are not stated
    settings : the keys of the operation
    left : what is left on the part; None: no part is stated
    collisions : what ran into what
    held_against : names of what shank and holder were held against
    no_holder : tools whose holder is not stated
    rigid : what was not stated of what gives way, and counts as rigid
    """

    removal: Removal
    stock: LayeredStock
    machine: Machine
    material: Material
    limits: Mapping[str, float]
    unchecked: tuple[str, ...]
    settings: Mapping[str, Any]
    left: Difference | None = None
    collisions: tuple[Collision, ...] = ()
    held_against: tuple[str, ...] = ()
    no_holder: tuple[int, ...] = ()
    rigid: tuple[str, ...] = ()

    @cached_property
    def held(self) -> tuple[Held, ...]:
        """Every stated limit, and those of the spindle."""
        return held_limits(self.limits, self.machine, self.removal.columns, self.left, self.rigid)

    @cached_property
    def fails(self) -> tuple[str, ...]:
        """What does not hold."""
        found = [h.says for h in self.held if h.holds is False]
        rapids = (f"line {f.line}: {f.text}" for f in self.removal.findings)
        touched = (
            f"line {c.line}: {c.what} goes {c.depth_mm:.3g} mm into {c.into}, tip at "
            f"({c.at[0]:.4g}, {c.at[1]:.4g}, {c.at[2]:.4g})"
            for c in self.collisions
        )
        return (*found, *rapids, *touched)

    @cached_property
    def unproven(self) -> tuple[str, ...]:
        """What nothing speaks against, and what could still fail."""
        return (*(h.says for h in self.held if h.holds is None), *_extrapolated(self))

    @property
    def verdict(self) -> str:
        """`fails`, `unproven` or `holds`."""
        return "fails" if self.fails else "unproven" if self.unproven else "holds"


def _extrapolated(simulated: Simulated) -> tuple[str, ...]:
    """Chips that are thicker than those that the coefficients were measured with."""
    chip, c = simulated.material.chip, simulated.removal.columns
    k = int(np.argmax(c["chip_max_mm"]))
    thickest = float(c["chip_max_mm"][k])
    if chip is None or thickest <= chip[1] * (1.0 + 1e-9):
        return ()
    line = f" in line {c['line'][k]}" if c["line"][k] else ""
    return (
        f"chips are up to {thickest:.4g} mm thick{line}: the coefficients of {simulated.material.name} hold up to "
        f"{chip[1]:g} mm, what the loads are beyond it is not known",
    )


def operation(simulated: Simulated, time_s: float) -> dict[str, Any]:
    """The operation in summary.json; ``time_s`` is its time on the machine, with rapids and accelerations."""
    removal = simulated.removal
    c = removal.columns
    cuts = (c["chip_volume_mm3"] > 0.0) & ~c["rapid"]
    seconds = np.where(cuts, c["seconds"], 0.0)
    whole = float(seconds.sum())

    def mean(name: str) -> float:
        return float((c[name] * seconds).sum() / whole) if whole > 0.0 else 0.0

    force: dict[str, dict[str, float | None]] = {
        x: {
            "mean": mean(f"force_{x}_mean_n"),
            "max": float(c[f"force_{x}_max_n"].max(initial=0.0)),
            "min": float(c[f"force_{x}_min_n"].min(initial=0.0)),
        }
        for x in "xyz"
    }
    band = removal.mean_band
    for x, sd in zip("xyz", band[:3] if band is not None else (None,) * 3, strict=True):
        force[x]["mean_sd"] = sd
    normal = float(c["force_normal_n"].max(initial=0.0))
    torque = {"mean": mean("torque_mean_nm"), "max": float(c["torque_nm"].max(initial=0.0))}
    return {
        "kind": "simulate",
        "verdict": simulated.verdict,
        "holds": simulated.verdict == "holds",
        "fails": list(simulated.fails),
        "unproven": list(simulated.unproven),
        "steps": len(c["line"]),
        "chip_pieces_max": int(c["chip_pieces"].max(initial=0)),
        "chip_volume_mm3": float(c["chip_volume_mm3"].sum()),
        "films_mm3": float(c["chip_volume_mm3"][c["chip_pieces"] == 0].sum()),
        "stock_before_mm3": removal.volume_before,
        "removed_mm3": removal.volume_before - removal.volume_after,
        "time_s": time_s,
        "cutting_s": whole,
        "air_cut_s": float(c["seconds"][~cuts & ~c["rapid"]].sum()),
        "force_n": {**force, "max": float(c["force_n"].max(initial=0.0)), "normal_max": normal},
        "torque_nm": torque | {"mean_sd": band[3] if band is not None else None},
        "power_w": {"mean": mean("power_w"), "max": float(c["power_w"].max(initial=0.0))},
        "chip_mm": {"max": float(c["chip_max_mm"].max(initial=0.0))},
        "deflection_um": deflection(simulated),
        "form_error_um": form_error(simulated),
        "limits": [
            {
                "name": h.name,
                "limit": h.limit,
                "worst": h.worst,
                "line": h.line,
                "at_mm": list(h.at),
                "t_s": h.t_s,
                "holds": h.holds,
            }
            for h in simulated.held
        ],
        **surface.numbers(simulated.left, c),
        "collisions": surface.listed(simulated.collisions, c),
        "held_against": list(simulated.held_against),
        "no_holder": list(simulated.no_holder),
        "unchecked": list(simulated.unchecked),
        "settings": dict(simulated.settings),
    }


def deflection(simulated: Simulated) -> dict[str, Any]:
    """How far tool and work give way, in summary.json; what was not stated counts as rigid."""
    c = simulated.removal.columns
    k = int(np.argmax(c["deflection_um"]))
    return {
        "max": float(c["deflection_um"][k]),
        "cutter_max": float(c["deflection_cutter_um"].max()),
        "work_max": float(c["deflection_work_um"].max()) if "deflection_work_um" in c else None,
        "line": int(c["line"][k]),
        "at_mm": [float(c[f"{x}_mm"][k]) for x in "xyz"],
        "not_stated": list(simulated.rigid),
    }


def form_error(simulated: Simulated) -> dict[str, Any]:
    """What giving way leaves on the part (below 0: takes), in summary.json; None: no finished point of a part."""
    c = simulated.removal.columns
    points = int(c["form_points"].sum()) if "form_points" in c else 0
    if not points:
        return {"max": None, "greatest": None, "least": None, "line": 0, "at_mm": None, "points": 0}
    error = c["form_error_um"]
    k = int(np.argmax(np.abs(error)))
    ends = {"max": abs(float(error[k])), "greatest": float(error.max()), "least": float(error.min())}
    return {**ends, "line": int(c["line"][k]), "at_mm": [float(c[f"{x}_mm"][k]) for x in "xyz"], "points": points}


def history(simulated: Simulated) -> Iterator[dict[str, NDArray[Any]]]:
    """The columns of history.parquet, a row a step, some ten thousand rows at a time."""
    names = np.array([label or "program" for label in simulated.removal.labels], dtype=object)
    at = 0
    for columns in in_rows(simulated.removal.columns, HISTORY_ROWS):
        count = len(columns["label"])
        if simulated.left is not None:
            columns["gouge_mm"] = np.maximum(-simulated.left.deepest[at : at + count], 0.0)
        yield {"pass": names[columns.pop("label")], **columns}
        at += count


def along(simulated: Simulated) -> go.Figure:
    """Force, torque, power, chip thickness, deflection and removal against time."""
    columns = simulated.removal.columns
    seconds, of = columns["seconds"], columns["line"]
    t = columns["t_s"] - 0.5 * seconds
    out = make_subplots(rows=len(ROWS), cols=1, shared_xaxes=True, vertical_spacing=0.03)
    for row, (lines, title, limit) in enumerate(ROWS, start=1):
        for column, name, colour in lines:
            if column == "rate":
                y = np.where(seconds > 0.0, columns["chip_volume_mm3"] / np.where(seconds > 0.0, seconds, 1.0), 0.0)
            else:
                y = np.asarray(columns[column], dtype=np.float64)
            keep = thinned(y, LINE_POINTS)
            out.add_trace(
                go.Scatter(
                    x=t[keep].astype(np.float32),
                    y=y[keep].astype(np.float32),
                    name=name,
                    mode="lines",
                    line={"color": colour, "width": 1.3},
                    customdata=of[keep],
                    hovertemplate=f"{name}: %{{y:.4g}}, line %{{customdata}}<extra>{title}</extra>",
                    showlegend=row == 1,
                ),
                row=row,
                col=1,
            )
        if limit in simulated.limits:
            said = {"text": f"limit {simulated.limits[limit]:g}", "font": {"color": LIMIT, "size": 11}}
            line = {"color": LIMIT, "width": 1.2, "dash": "dash"}
            out.add_hline(
                y=simulated.limits[limit],
                line=line,
                annotation=said,
                annotation_position="top left",
                row=row,
                col=1,
            )
        out.update_yaxes(title_text=title, row=row, col=1)
    out.update_xaxes(gridcolor=GRID, zeroline=False)
    out.update_yaxes(gridcolor=GRID, zerolinecolor=GRID)
    out.update_xaxes(title_text="time at the commanded feed [s]", row=len(ROWS), col=1)
    out.update_layout(
        template="none",
        height=1050,
        font=FONT,
        margin={"l": 74, "r": 16, "t": 30, "b": 46},
        legend={"orientation": "h", "y": 1.01, "yanchor": "bottom", "x": 0.0},
    )
    return out


def _mean(values: Mapping[str, Any]) -> str:
    """A mean, with twice its standard deviation where that is known."""
    sd = values["mean_sd"]
    return f"{values['mean']:.4g}" if sd is None else f"{values['mean']:.4g} \u00b1 {2.0 * sd:.2g}"


def _limits(simulated: Simulated) -> str:
    """Every limit against its worst step."""
    rows = []
    for h in simulated.held:
        word = {True: "holds", False: '<span class="no">does not hold</span>', None: "unproven"}[h.holds]
        unit = LIMITS[h.name][1]
        name = " ".join(h.name.split("_")[:-1]) + (f" [{unit}]" if unit else "")
        t = "" if h.t_s is None else f"{h.t_s:.4g}"
        place = ", ".join(f"{x:.4g}" for x in h.at) if h.worst > 0.0 else ""
        rows.append([name, word, f"{h.limit:g}", f"{h.worst:.4g}", str(h.line or ""), t, place])
    if not rows:
        return ""
    heads = ["limit", "", "at most", "worst", "line", "time [s]", "tip at x, y, z [mm]"]
    return table(heads, rows, numbers=(2, 3, 4, 5))


def _rigid(simulated: Simulated) -> str:
    """What deflections leave out."""
    if not simulated.rigid:
        return ""
    return f" Deflections are at least these: {escape(', '.join(simulated.rigid))} not stated and taken as rigid."


def sections(simulated: Simulated, time_s: float, figures: dict[str, go.Figure]) -> list[str]:
    """The part of the page that shows chips and forces; figures are put among ``figures``."""
    what, c = operation(simulated, time_s), simulated.removal.columns
    force, torque, power = what["force_n"], what["torque_nm"], what["power_w"]
    sure = torque["mean_sd"] is not None
    rows = [
        [f"force {x} on the cutter [N]", _mean(force[x]), f"{force[x]['max']:.4g}", f"{force[x]['min']:.4g}"]
        for x in "xyz"
    ]
    rows += [["force on the surface that is left, along its normal [N]", "", f"{force['normal_max']:.4g}", ""]]
    rows += [["torque [N m]", _mean(torque), f"{torque['max']:.4g}", ""]]
    rows += [["power [W]", f"{power['mean']:.4g}", f"{power['max']:.4g}", ""]]
    if what["form_error_um"]["points"]:
        ends = (f"{what['form_error_um'][key]:.4g}" for key in ("greatest", "least"))
        rows += [["form error of the part by giving way [\u00b5m]", "", *ends]]
    rows += [["tool and work part by [\u00b5m]", "", f"{what['deflection_um']['max']:.4g}", ""]]
    body = [
        "<h2>Chips, force, torque, power</h2>",
        f"<p>{what['steps']} steps; {what['chip_volume_mm3']:.6g} mm\u00b3 of chips, stock less by "
        f"{what['removed_mm3']:.6g} mm\u00b3; {what['cutting_s']:.4g} s in cut, {what['air_cut_s']:.4g} s "
        f"in air; thickest chip {what['chip_mm']['max']:.4g} mm; in films too thin to be told from the tolerance "
        f"{what['films_mm3']:.2g} mm\u00b3.</p>",
        table(["", "mean", "greatest", "least"], rows, numbers=(1, 2, 3)),
        _limits(simulated),
        f'<p class="note">{SURE if sure else UNSURE}{_rigid(simulated)}</p>',
        figure("loads", along(simulated), figures),
    ]
    piece = simulated.removal.piece
    if piece is not None:
        title = f"step {piece.step}, layer at z = {piece.height:.4g} mm"
        drawn = diagram_figure(piece.move, piece.cutter, piece.height, piece.before, title=title)
        body += [
            "<h3>A chip</h3>",
            f'<p class="note">The chip that falls into most pieces ({len(piece.chips)}): how the covered area is built '
            "(left: around the edge across, time in the step up) and what of it was still there (right).</p>",
            figure("chip", drawn, figures),
        ]
    body += surface.section(simulated.left, simulated.collisions, c, simulated.held_against, figures)
    return body
