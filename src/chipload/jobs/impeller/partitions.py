"""Report sections of the partitions: patches over each surface, and one, two, three cutters in comparison."""

from __future__ import annotations

from html import escape

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from chipload.jobs.impeller.machine_check import check_cell, verdict_of
from chipload.jobs.impeller.outcome import PICKED, ImpellerResult, Searched
from chipload.jobs.impeller.surface_figures import style_figure
from chipload.planning.impeller.compare import Partition
from chipload.planning.impeller.patch import Patch
from chipload.report.sheet import figure, table
from chipload.result.style import FONT, GRID

Ints = NDArray[np.int64]

#: colours of the cutters of a partition; lighter for the second table angle, lighter still for the third
COLOURS = ("#3457a6", "#c9821a", "#0b7a75", "#8a4f9e", "#5b8c2a", "#a8793a")
#: shades of one cutter, by table angle
SHADES = 5


def divided_sections(milled: ImpellerResult, figures: dict[str, go.Figure]) -> list[str]:
    """Report sections about all surfaces: the partition that is milled, and its patches."""
    out = [
        "<h2>Partitions with one, two and three cutters</h2>",
        '<p class="note">All channels; path and feed time of the contact points at the stated scallop, with changes of '
        "cutter and table, without lead-in, links and rapids. No sequence of the same strips, with as many cutters, "
        "takes less than the least time; patches of other shapes on the same contact points might. The reached share "
        "is of the area that has contact points.</p>",
        _comparison_table(milled),
        figure("partitions", partitions_figure(milled), figures),
    ]
    if milled.checked:
        out += [
            "<h3>Programs of the partitions</h3>",
            '<p class="note">Every partition is written, checked and timed. All channels, without roughing: cut, leads '
            "and links, changes of cutter and table.</p>",
            _program_table(milled),
        ]
    used = milled.used
    if used is None or used.divided is None:
        return [*out, '<p class="no">No partition mills all that can be reached.</p>']
    out.append(f"<h3>Patches: {escape(used.name)}</h3>")
    for k, op in enumerate(milled.surfaces):
        out.append(figure(f"patches-{k}", patch_figure(milled, used, op), figures))
    rows = [
        [
            str(n), escape(milled.searched(p).surface.name), _size(used, p), f"{np.degrees(p.table):.6g}",
            f"{p.order} {p.low:.3f} to {p.high:.3f}", f"{100.0 * p.area / milled.area:.1f}", f"{p.path:.1f}",
            f"{p.time / 60.0:.2f}",
        ]
        for n, p in enumerate(used.divided.patches, 1)
    ]  # fmt: skip
    head = ["", "surface", "cutter [mm]", "table [deg]", "strips", "area [%]", "path of one [mm]", "time of one [min]"]
    return [*out, table(head, rows, numbers=(0, 3, 5, 6, 7))]


def _comparison_table(milled: ImpellerResult) -> str:
    rows, used = [], []
    base = milled.picked.divided if milled.picked is not None else None
    for partition in milled.partitions:
        d = partition.divided
        name = escape(partition.name)
        used.append(partition is milled.used)
        if d is None:
            rows.append([name, '<span class="no">these cutters do not reach all points</span>', *[""] * 8])
            continue
        cutters = ", ".join(partition.catalogue.cutters[k].label for k in d.cutters)
        less = ["", ""]
        if base is not None and partition.name != PICKED:
            less = [f"{100.0 * (a / b - 1.0):+.1f}" for a, b in ((d.path, base.path), (d.total, base.total))]
        rows.append(
            [
                name, cutters, f"{100.0 * partition.share:.4g}", f"{d.path:.0f}", less[0],
                f"{d.total / 60.0:.1f}", less[1], f"{d.cutter_changes} + {d.table_changes}", f"{d.bound / 60.0:.1f}",
                f"{100.0 * d.above_bound:.1f}",
            ]
        )  # fmt: skip
    head = [
        "partition",
        "cutters [mm]",
        "reached [%]",
        "path [mm]",
        "[%]",
        "time [min]",
        "[%]",
        "changes of cutter + table",
    ]
    head += ["least time [min]", "above least [%]"]
    return table(head, rows, numbers=(2, 3, 4, 5, 6, 7, 8, 9), used=used)


def _program_table(milled: ImpellerResult) -> str:
    """Table of the programs of each partition."""
    rows = [
        [
            escape(w.name), ", ".join(f"{c.label}" for c in w.cutters), f"{w.path:.0f}",
            *(f"{x / 60.0:.1f}" for x in (w.cutting, w.links, w.changes, w.seconds, w.predicted)),
            "" if w.scallop is None else f"{100.0 * w.scallop:.0f}",
            check_cell(verdict_of(w.fails, w.doubts)),
        ]
        for w in milled.checked or ()
    ]  # fmt: skip
    head = ["partition", "cutters [mm]", "path [mm]", "cut [min]", "links [min]", "changes [min]", "time [min]"]
    head += ["predicted [min]", "mean scallop of limit [%]", "check"]
    used = [w is milled.used_checked for w in milled.checked or ()]
    return table(head, rows, numbers=(2, 3, 4, 5, 6, 7, 8), used=used)


def partitions_figure(milled: ImpellerResult) -> go.Figure:
    """Time of each partition: milling, changes; its least time as a line."""
    able = [(partition, partition.divided) for partition in milled.partitions if partition.divided is not None]
    names = [partition.name for partition, _ in able]
    out = go.Figure()
    for label, values, colour in (
        ("milling", [d.milling / 60.0 for _, d in able], COLOURS[0]),
        ("changes of cutter and table", [(d.total - d.milling) / 60.0 for _, d in able], "#c3cad3"),
    ):
        out.add_trace(
            go.Bar(
                y=names, x=values, name=label, orientation="h", marker={"color": colour}, hovertemplate="%{x:.2f} min"
            )
        )
    out.add_trace(
        go.Scatter(
            y=names, x=[d.bound / 60.0 for _, d in able], mode="markers", name="no sequence of strips takes less",
            marker={"symbol": "line-ns-open", "size": 26, "color": "#1f2933", "line": {"width": 2}},
            hovertemplate="%{x:.2f} min",
        )
    )  # fmt: skip
    style_figure(out, 110 + 42 * len(able))
    out.update_layout(barmode="stack", bargap=0.35, legend={"orientation": "h", "y": 1.16, "x": 0.0})
    out.update_layout(margin={"l": 110, "r": 20, "t": 36, "b": 48})
    out.update_xaxes(title="time of all channels [min]", rangemode="tozero")
    out.update_yaxes(autorange="reversed")
    return out


def patch_grid(milled: ImpellerResult, partition: Partition, op: Searched) -> Ints:
    """Number of the patch of each contact point of a surface, (a, b); -1: none."""
    out = np.full(op.surface.shape, -1, dtype=np.int64)
    for n, p in enumerate(partition.divided.patches if partition.divided is not None else ()):
        if milled.searched(p) is op:
            i = np.abs(op.surface.u[:, None] - p.at[None, :, 0]).argmin(axis=0)
            j = np.abs(op.surface.v[:, None] - p.at[None, :, 1]).argmin(axis=0)
            out[i, j] = n
    out.ravel()[op.answer.cutter < 0] = -1
    return out


def shade_of(partition: Partition, patch: Patch) -> tuple[int, int, int]:
    """A colour by cutter, its shade by table angle."""
    d = partition.division
    base = COLOURS[d.cutters.index(patch.cutter) % len(COLOURS)]
    rgb = np.array([int(base[k : k + 2], 16) for k in (1, 3, 5)], dtype=np.float64)
    angles = sorted({p.table for p in d.patches if p.cutter == patch.cutter})
    share = 0.6 * (angles.index(patch.table) % SHADES) / max(min(len(angles), SHADES) - 1, 1)
    r, g, b = np.round(rgb + share * (255.0 - rgb)).astype(int).tolist()
    return r, g, b


def patch_figure(milled: ImpellerResult, partition: Partition, op: Searched) -> go.Figure:
    """Patches of a surface, unrolled; a colour a cutter, its shade a table angle."""
    grid = patch_grid(milled, partition, op)
    numbers = [int(n) for n in np.unique(grid) if n >= 0]
    d = partition.division
    order = {n: k for k, n in enumerate(numbers)}
    z = np.vectorize(lambda n: order.get(n, np.nan), otypes=[float])(grid)
    colours = [f"rgb{shade_of(partition, d.patches[n])}" for n in numbers] or ["#ffffff"]
    count = len(colours)
    scale = [(e, c) for k, c in enumerate(colours) for e in (k / count, (k + 1) / count)]
    label = {
        n: f"{n + 1}: {_size(partition, d.patches[n])} at {np.degrees(d.patches[n].table):.6g} deg" for n in numbers
    }
    text = np.vectorize(lambda n: label.get(n, "not reached"), otypes=[object])(grid)
    out = go.Figure(
        go.Heatmap(
            x=op.surface.u.round(4), y=op.surface.v.round(4), z=z.T, text=text.T, colorscale=scale, zmin=-0.5,
            zmax=count - 0.5, showscale=False, xgap=1, ygap=1, hovertemplate="%{text}<extra></extra>",
        )
    )  # fmt: skip
    for n in numbers:
        i, j = (x.mean() for x in np.nonzero(grid == n))
        u, v = (
            np.interp(i, np.arange(grid.shape[0]), op.surface.u),
            np.interp(j, np.arange(grid.shape[1]), op.surface.v),
        )
        out.add_annotation(x=u, y=v, text=f"<b>{n + 1}</b>", showarrow=False, font={"color": "#1f2933", "size": 13},
                           bgcolor="rgba(255,255,255,0.72)")  # fmt: skip
    style_figure(out, 230)
    out.update_layout(font=FONT, title={"text": op.surface.name, "font": {"size": 13}, "x": 0.01, "y": 0.98})
    out.update_layout(margin={"l": 60, "r": 20, "t": 28, "b": 44})
    out.update_xaxes(title="u", gridcolor=GRID)
    out.update_yaxes(title="v")
    return out


def _size(partition: Partition, patch: Patch) -> str:
    return partition.catalogue.cutters[patch.cutter].label
