"""Report sections of an impeller's programs: the results of the independent check of each."""

from __future__ import annotations

import math
from html import escape

import numpy as np
import plotly.graph_objects as go

from chipload.jobs.impeller.five_axis_outcome import CheckedFlank, CheckedPoints, NoFiveAxisPath
from chipload.jobs.impeller.machine_check import check_cell, program_verdict
from chipload.jobs.impeller.mesh import grid_faces
from chipload.jobs.impeller.names import flank_names, points_names, program_name, rough_names
from chipload.jobs.impeller.outcome import Covered, ImpellerResult
from chipload.jobs.impeller.partitions import COLOURS
from chipload.jobs.impeller.roughing_check import rough_sections
from chipload.jobs.impeller.surface_figures import style_figure
from chipload.planning.impeller.surfaces import BODIES
from chipload.program.program import RAPID
from chipload.report.sheet import figure, table
from chipload.result.style import FONT, GRID, LIMIT

#: rows of one program that the view in space shows at most
ROWS = 20_000


def program_sections(milled: ImpellerResult, figures: dict[str, go.Figure]) -> list[str]:
    """Report sections about programs; none if the job has none."""
    if milled.programs is None:
        return ["<h2>Programs</h2>", "<p>The job has none: state [operation.paths].</p>"]
    head = [
        "",
        "program",
        "rows",
        "path [mm]",
        "time [min]",
        "deepest gouge [mm]",
        "missed by lines [mm]",
        "rest passes",
    ]
    head += ["links direct + over", "check"]
    rows = [
        [
            str(k), f"<code>{escape(program_name(milled, k))}</code>", str(len(p.setting.program)),
            f"{p.setting.length:.1f}", f"{p.seconds / 60.0:.2f}", f"{p.gouge.found:.4f} to {p.gouge.bound:.4f}",
            f"{p.missed:.1f}", str(sum(len(r.tracks) for r in p.setting.rests)),
            f"{p.setting.linked.direct} + {p.setting.linked.retracts}",
            check_cell(program_verdict(p.fails, p.machine_check.doubts, p.removal)),
        ]
        for k, p in enumerate(milled.programs, 1)
    ]  # fmt: skip
    patches = [
        [
            str(k), f"{BODIES[m.patch.body]} {m.patch.side}", str(m.tracks.lines), f"{s.limit:g}", f"{s.greatest:.4f}",
            f"{s.mean:.4f}", f"{100.0 * s.mean / s.limit:.0f}", str(s.count), f"{100.0 * s.covered:.1f}",
        ]
        for k, p in enumerate(milled.programs, 1)
        for m, s in zip(p.setting.millings, p.scallops, strict=True)
    ]  # fmt: skip
    scallop = [
        "program",
        "surface",
        "lines",
        "limit [mm]",
        "greatest between passes [mm]",
        "mean scallop height [mm]",
        "of the limit [%]",
    ]
    scallop += ["scallops", "of the patch within [%]"]
    turn = np.degrees(milled.impeller.pitch)
    left = [
        [
            c.name, str(len(c.left.rest)), f"{c.limit:g}", f"{c.greatest[0]:.4f}", f"{100.0 * c.share:.2f}",
            '<span class="no">above the limit</span>' if c.fails else '<span class="ok">within the limit</span>',
        ]
        for c in milled.covered or ()
    ]  # fmt: skip
    spacing = max((c.spacing for c in milled.covered or ()), default=0.0)
    return [
        *rough_sections(milled.roughs, rough_names(milled)),
        "<h2>Programs</h2>",
        f'<p class="note">One for each cutter at each table angle, for one channel; the pallet turns by {turn:.6g} deg '
        "to the next. The check takes every part of the tool, holder too, through every row along rays on the true "
        "surfaces and uses nothing of the planner. "
        + ("" if milled.roughs is not None else "They finish only: the job states no roughing.")
        + "</p>",
        table(head, rows, numbers=(2, 3, 4, 5, 6, 7, 8)),
        table(scallop, patches, numbers=(0, 2, 3, 4, 5, 6, 7, 8)),
        figure("paths", paths_figure(milled), figures),
        *_flank_section(milled),
        *_points_section(milled),
        "<h2>Material left by all programs</h2>",
        f'<p class="note">Measured along rays on points of every surface, at most {spacing:g} mm apart, as far as its '
        "patches go: the least that any of the programs leaves. Where lines miss, rest passes or a neighbour may have "
        "milled. Values above the limit are red.</p>",
        table(
            ["surface", "points", "limit [mm]", "greatest left [mm]", "area within [%]", ""], left, numbers=(1, 2, 3, 4)
        ),
        *(figure(f"left{k}", left_figure(c), figures) for k, c in enumerate(milled.covered or ())),
    ]


def _flank_section(milled: ImpellerResult) -> list[str]:
    """Flank passes on five axes; none if the job has none."""
    if milled.flanks is None:
        return []
    rows = [
        [f"<code>{escape(name)}</code>", str(len(p.passes)), *_five_axis_cells(p), f"{p.deviation:.4f}"]
        for name, p in flank_names(milled)
    ]
    head = ["program", "passes", *_FIVE_AXIS, "deviation of the flank [mm]"]
    return [
        "<h2>Flank passes on five axes</h2>",
        '<p class="note">Each side with the side of the cutter, beside the programs above; path and time of one '
        "channel.</p>",
        table(head, rows, numbers=(1, 4, 5, 6, 7, 9)) if rows else "",
        *(f"<p>{escape(p.reason)}</p>" for p in milled.flanks if isinstance(p, NoFiveAxisPath)),
    ]


def _points_section(milled: ImpellerResult) -> list[str]:
    """Point milling on five axes; none if the job has none."""
    if milled.points is None:
        return []
    rows = [
        [
            f"<code>{escape(name)}</code>", str(p.path.lines), *_five_axis_cells(p),
            "" if p.scallop is None else f"{100.0 * p.scallop / p.most:.0f}", f"{math.degrees(p.path.turn):.2f}",
        ]
        for name, p in points_names(milled)
    ]  # fmt: skip
    head = ["program", "lines", *_FIVE_AXIS, "mean scallop of the limit [%]", "greatest turn of the axis [deg/mm]"]
    return [
        "<h2>Point milling on five axes</h2>",
        '<p class="note">Each surface in one path with a smooth axis, beside the programs above; path and time of one '
        "channel.</p>",
        table(head, rows, numbers=(1, 4, 5, 6, 7, 9, 10)) if rows else "",
        *(f"<p>{escape(p.reason)}</p>" for p in milled.points if isinstance(p, NoFiveAxisPath)),
    ]


#: columns of every program on five axes, after its name and its passes
_FIVE_AXIS = ("machine", "cutter [mm]", "path [mm]", "time [min]", "greatest left [mm]", "deepest gouge [mm]", "check")


def _five_axis_cells(p: CheckedFlank | CheckedPoints) -> list[str]:
    return [
        p.machine.name,
        p.cutter.label,
        f"{p.length:.1f}",
        f"{p.seconds / 60.0:.2f}",
        f"{p.excess:.4f}",
        f"{p.gouge.found:.4f} to {p.gouge.bound:.4f}",
        check_cell(p.verdict),
    ]


def left_figure(covered: Covered) -> go.Figure:
    """Excess on a surface, unrolled."""
    w = covered.left.wall
    u, v = w.u.reshape(w.shape)[:, 0], w.v.reshape(w.shape)[0]
    over = 2.0 * covered.limit
    out = go.Figure(
        go.Heatmap(
            x=u.round(4), y=v.round(4), z=covered.left.rest.reshape(w.shape).T.round(4), zmin=0.0, zmax=over,
            colorscale=[(0.0, "#f3f6f9"), (0.5, "#0072b2"), (0.5, LIMIT), (1.0, LIMIT)],
            colorbar={"title": "left [mm]"}, hovertemplate="u %{x} v %{y}: %{z} mm<extra></extra>",
        )
    )  # fmt: skip
    style_figure(out, 230)
    out.update_layout(font=FONT, title={"text": covered.name, "font": {"size": 13}, "x": 0.01, "y": 0.98})
    out.update_layout(margin={"l": 60, "r": 20, "t": 28, "b": 44})
    out.update_xaxes(title="u", gridcolor=GRID)
    out.update_yaxes(title="v")
    return out


def paths_figure(milled: ImpellerResult) -> go.Figure:
    """Path of the tip in space, one colour for each program; rapids in red."""
    out = go.Figure()
    for op in milled.surfaces:
        f, q = grid_faces(*op.surface.shape), op.place.astype(np.float32)
        out.add_trace(
            go.Mesh3d(
                x=q[:, 0], y=q[:, 1], z=q[:, 2], i=f[:, 0].astype(np.int32), j=f[:, 1].astype(np.int32),
                k=f[:, 2].astype(np.int32), color="#cdd3da", opacity=0.9, hoverinfo="skip", name=op.surface.name,
            )
        )  # fmt: skip
    for k, p in enumerate(milled.programs or ()):
        program = p.setting.program
        keep = np.unique(np.linspace(0, len(program) - 1, min(len(program), ROWS)).astype(np.int64))
        tip, rapid = program.p_work[keep].astype(np.float32), program.motion[keep] == RAPID
        for fast, colour, name in ((False, COLOURS[k % len(COLOURS)], p.name), (True, LIMIT, "rapids")):
            shown = np.where((rapid == fast)[:, None], tip, np.nan)
            begins = np.flatnonzero((rapid[1:] == fast) & (rapid[:-1] != fast))
            shown[begins] = tip[begins]
            out.add_trace(
                go.Scatter3d(
                    x=shown[:, 0], y=shown[:, 1], z=shown[:, 2], mode="lines", name=name, legendgroup=name,
                    line={"color": colour, "width": 1 if fast else 3}, showlegend=not fast or k == 0, hoverinfo="skip",
                )
            )  # fmt: skip
    axes = {f"{x}axis": {"title": f"{x.upper()} [mm]", "gridcolor": GRID} for x in "xyz"}
    out.update_layout(
        template="none", height=560, font=FONT, margin={"l": 0, "r": 0, "t": 10, "b": 0}, showlegend=True,
        scene={"aspectmode": "data", "camera": {"eye": {"x": 1.3, "y": -1.3, "z": 1.1}}, **axes},
        legend={"x": 0.0, "y": 1.0},
    )  # fmt: skip
    return out
