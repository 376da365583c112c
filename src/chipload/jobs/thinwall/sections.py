"""Report sections of a thin wall: comparison of the variants, maps, and loads along the path."""

from __future__ import annotations

from html import escape

import numpy as np
import plotly.graph_objects as go

from chipload.jobs.thinwall.outcome import OVER, USED, ThinWallResult, Variant, remedy_text
from chipload.jobs.thinwall.part_shape import PartShape
from chipload.jobs.thinwall.result import verdict_of
from chipload.jobs.thinwall.wall_figures import COLOURS, bars, loads_along_time, maps, space
from chipload.number_text import number_text
from chipload.report.page import state_cell
from chipload.report.programs import program_name
from chipload.report.sheet import figure, items, table, value_text

#: rows that tables list
LISTED = 40
#: passes whose maps are drawn
MAPS = 12


def _operation_sentence(walled: ThinWallResult, number: int) -> str:
    """An operation in a sentence."""
    own = walled.planning.operations[number]
    c = own.cutter
    rows = "rows" if own.rows is None else f"rows of {escape(own.rows)}"
    leaves = f"; {own.leave:g} mm stay for the next cutter" if own.leave else ""
    return (
        f"Cutter {c.number}: D {c.diameter:g} mm, corner {c.corner_radius:g} mm, {c.flutes} flutes; {rows} "
        f"{number_text(own.step_over)} mm apart, {number_text(own.feed_per_tooth)} mm a tooth{leaves}."
    )


def sections_of(walled: ThinWallResult, figures: dict[str, go.Figure]) -> list[str]:
    """The sections of the report; figures are put among ``figures``."""
    used = walled.variants[USED]
    geometry, planning = walled.geometry, walled.planning
    length, height, thickness = geometry.shape.size()
    body = [
        f"<h2>Operation 0: {escape(geometry.shape.name)}</h2>",
        f"<p>{number_text(length)} mm long, {number_text(height)} mm high, at least {number_text(thickness)} mm thick "
        "when finished, "
        f"{'in the clamps of the part' if isinstance(geometry.shape, PartShape) else 'clamped at z = 0'}; "
        f"{' and '.join(f'{a:g}' for a in geometry.allowance)} mm of stock on its sides. "
        f"{' '.join(_operation_sentence(walled, k) for k in range(len(planning.operations)))}</p>",
        f'<p class="note">{escape(", ".join(f"{k} {value_text(v)}" for k, v in walled.settings.items()))}</p>',
        "<h3>Variants</h3>",
        '<p class="note">Variable: the greatest depth that each place allows. Constant: one depth everywhere '
        "under the same limit. Unconstrained: the greatest depth, whatever the deflection. Least error: variable "
        "depths in the time of the constant one. Compensated: the variable plan, its last passes moved against the "
        "form error. Numbers are those of the simulation; the time is that of the machine.</p>",
        _variants(walled),
        figure("bars", _bars(walled), figures),
        "<h3>Allowable normal force</h3>",
        f"<p>{escape(planning.threshold_text[:1].upper() + planning.threshold_text[1:])}. The planner keeps "
        f"{100.0 * planning.last.reserve:g} % below it; its force is corrected, place by place, by what the simulation "
        f"of the plan before found: the simulated force is {_agreement(used)} of the planned one.</p>",
        figure("threshold", _thresholds(used), figures),
        "<h3>Depth of each pass</h3>",
        f'<p class="note">Variable, in the order of cutting; sides {escape(used.plan.order)}.'
        f"{f' The first {MAPS} of {len(used.plan.maps)} passes.' if len(used.plan.maps) > MAPS else ''}</p>",
        figure(
            "depth",
            maps(
                [m.depth for m in used.plan.maps[:MAPS]],
                [m.points for m in used.plan.maps[:MAPS]],
                [f"pass {k + 1}, side {m.side + 1}" for k, m in enumerate(used.plan.maps[:MAPS])],
                "mm",
            ),
            figures,
        ),
        "<h3>Along the path</h3>",
        figure("along", loads_along_time(walled), figures),
        "<h3>The finished surface</h3>",
        '<p class="note">Form error by the deflection of cutter and wall at the moment each point is made; blue: '
        "material is left. Scallops between rows are not in it. Every pass meets what the passes before "
        "were planned to leave.</p>",
    ]
    finish = [(f"{name}, side {f.side + 1}", f) for name, v in walled.variants.items() for f in v.finish]
    if finish:
        drawn = maps(
            [np.where(f.made, 1000.0 * f.error, np.nan) for _, f in finish],
            [f.points for _, f in finish],
            [name for name, _ in finish],
            "µm",
            signed=True,
        )
        body.append(figure("finish", drawn, figures))
    body += [
        "<h3>Path</h3>",
        figure("space", space(walled, used), figures),
        *_infeasible(used),
        *_overload_section(walled),
        "<h3>Geometry</h3>",
        _checked_text(walled),
    ]
    return body


def _variants(walled: ThinWallResult) -> str:
    head = [
        "variant",
        "passes",
        "time [min]",
        "workpiece deflection [µm]",
        "form error [µm]",
        "its rms [µm]",
        "force [N]",
    ]
    head += ["force over allowable", "stress [MPa]", "limits", "program"]
    rows = []
    for name, one in walled.variants.items():
        status = state_cell(verdict_of(walled, one))
        rows.append(
            [
                f'<span class="dot" style="background:{COLOURS[name]}"></span>{name}'
                + (" <b>in use</b>" if name == USED else ""),
                str(len(one.plan.maps)),
                number_text(one.seconds / 60.0),
                number_text(1000.0 * one.deflection),
                number_text(1000.0 * one.error),
                number_text(1000.0 * one.error_rms),
                number_text(one.force),
                f"{one.columns['force_over_allowable'].max(initial=0.0):.3f}",
                number_text(one.stress),
                status,
                f"<code>{program_name(0, name)}</code>",
            ]
        )
    return table(head, rows, numbers=(1, 2, 3, 4, 5, 6, 7, 8), used=[name == USED for name in walled.variants])


def _bars(walled: ThinWallResult) -> go.Figure:
    v = walled.variants
    return bars(
        {
            "time [min]": {n: o.seconds / 60.0 for n, o in v.items()},
            "passes": {n: float(len(o.plan.maps)) for n, o in v.items()},
            "workpiece deflection [µm]": {n: 1000.0 * o.deflection for n, o in v.items()},
            "form error [µm]": {n: 1000.0 * o.error for n, o in v.items()},
        }
    )


def _agreement(one: Variant) -> str:
    c = one.columns
    known = (c["force_normal_n"] > 0.0) & (c["force_normal_planned_n"] > 0.0) & (c["depth_mm"] > 0.0)
    if not known.any():
        return "not known to be a share"
    low, middle, high = (
        100.0 * x
        for x in np.percentile(
            (c["force_normal_n"] / np.where(known, c["force_normal_planned_n"], 1.0))[known], [5, 50, 95]
        )
    )
    return f"{low:.3g} to {number_text(high, 3)} % (5 to 95 % of the contact points, median {number_text(middle, 3)} %)"


def _thresholds(one: Variant) -> go.Figure:
    """The last pass of each side, on the finished wall, and the first."""
    chosen, titles = [], []
    for side in sorted({m.side for m in one.plan.maps}):
        own = [(k, m) for k, m in enumerate(one.plan.maps) if m.side == side]
        for word, (k, m) in (("first", own[0]), ("last", own[-1])):
            chosen.append(m)
            titles.append(f"side {m.side + 1}, {word} pass ({k + 1})")
    return maps([m.threshold for m in chosen], [m.points for m in chosen], titles, "N", logarithmic=True)


def _infeasible(one: Variant) -> list[str]:
    if not one.plan.infeasible:
        return ["<h3>Places that allow no cut</h3>", "<p>None: every place allows at least the smallest depth.</p>"]
    rows = [
        [
            f"{h.side + 1}",
            ", ".join(f"{x:.2f}" for x in h.at),
            number_text(h.force_allowable_n),
            number_text(h.force_n),
            "" if h.feed_per_tooth_mm is None else number_text(h.feed_per_tooth_mm),
            "" if h.diameter_mm is None else number_text(h.diameter_mm),
            escape(remedy_text(h)),
        ]
        for h in sorted(one.plan.infeasible, key=lambda h: h.force_allowable_n)[:LISTED]
    ]
    head = [
        "side",
        "place x, y, z [mm]",
        "allowable [N]",
        "needed [N]",
        "feed a tooth [mm]",
        "cutter D [mm]",
        "remedy",
    ]
    more = len(one.plan.infeasible) - len(rows)
    note = [f'<p class="note">{more} more in summary.json.</p>'] if more > 0 else []
    return ["<h3>Places that allow no cut</h3>", table(head, rows, numbers=(0, 1, 2, 3, 4, 5)), *note]


def _overload_section(walled: ThinWallResult) -> list[str]:
    out = [f"<h3>Contact points over their allowable force by more than {100.0 * OVER:g} %</h3>"]
    rows = []
    for name, one in walled.variants.items():
        c = one.columns
        rows += [
            [
                name,
                escape(str(c["pass"][k])),
                str(int(c["line"][k])),
                ", ".join(f"{c[f'contact_{x}_mm'][k]:.2f}" for x in "xyz"),
                f"{c['depth_mm'][k]:.3f}",
                number_text(c["force_normal_n"][k]),
                number_text(c["force_allowable_n"][k]),
                f"{c['force_over_allowable'][k]:.3f}",
            ]
            for k in one.over[: LISTED if name == USED else 5]
        ]
    counts = ", ".join(
        f"{name} {len(o.over)} of {int((o.columns['force_normal_n'] > 0.0).sum())}"
        for name, o in walled.variants.items()
    )
    out.append(f"<p>{counts}.</p>")
    if rows:
        head = ["variant", "pass", "row", "place x, y, z [mm]", "depth [mm]", "force [N]", "allowable [N]", "ratio"]
        out.append(table(head, rows, numbers=(2, 3, 4, 5, 6, 7)))
    return out


def _checked_text(walled: ThinWallResult) -> str:
    used = walled.variants[USED]
    s = used.shape
    texts = [
        f"Path of {USED} against the finished wall: the cutter comes no nearer than "
        f"{number_text(1000.0 * s.nearest, 3)} µm "
        f"(below 0 it would gouge; {walled.settings['gouge_tolerance_mm']:g} mm is allowed for chords).",
        f"Remaining stock against the finished wall: at most {number_text(1000.0 * s.gouge, 3)} µm into it, "
        f"{number_text(1000.0 * s.left, 3)} µm over it above the foot ({s.points} points of its sections).",
    ]
    return items(texts)
