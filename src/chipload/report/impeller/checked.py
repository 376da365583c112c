"""The programs of an impeller on its page: what the independent check found in each."""

from __future__ import annotations

from html import escape

import numpy as np
import plotly.graph_objects as go

from chipload.planning.sectional.surfaces import BODIES
from chipload.program.program import RAPID
from chipload.report.figures import FONT, GRID, LIMIT
from chipload.report.impeller.mesh import grid_faces
from chipload.report.impeller.outcome import Milled
from chipload.report.impeller.programs import program_name
from chipload.report.impeller.ways import COLOURS
from chipload.report.sheet import figure, table

#: rows of one program that the view in space shows at most
ROWS = 20_000


def program_sections(milled: Milled, figures: dict[str, go.Figure]) -> list[str]:
    """The part of the page about programs; none where the job asks for none."""
    if milled.programs is None:
        return ["<h2>Programs</h2>", "<p>The job asks for none: state [operation.paths].</p>"]
    head = [
        "",
        "cutter and table",
        "program",
        "rows",
        "path [mm]",
        "time [min]",
        "deepest gouge [mm]",
        "not milled [mm]",
    ]
    head += ["links direct + over", "check"]
    rows = [
        [
            str(k), escape(p.name), f"<code>{escape(program_name(p, k))}</code>", str(len(p.setting.program)),
            f"{sum(m.tracks.length for m in p.setting.millings):.1f}", f"{p.seconds / 60.0:.2f}", f"{p.gouge:.4f}",
            f"{p.missed:.1f}", f"{p.setting.linked.direct} + {p.setting.linked.retracts}",
            '<span class="ok">verified</span>' if p.verified else '<span class="no">not verified</span>',
        ]
        for k, p in enumerate(milled.programs, 1)
    ]  # fmt: skip
    patches = [
        [
            str(k), f"{BODIES[m.patch.body]} {m.patch.side}", str(m.tracks.lines), f"{s.asked:g}", f"{s.greatest:.4f}",
            f"{s.mean:.4f}", f"{100.0 * s.mean / s.asked:.0f}", str(s.crests), f"{100.0 * s.covered:.1f}",
        ]
        for k, p in enumerate(milled.programs, 1)
        for m, s in zip(p.setting.millings, p.scallops, strict=True)
    ]  # fmt: skip
    scallop = [
        "program",
        "surface",
        "lines",
        "asked [mm]",
        "most between passes [mm]",
        "mean crest [mm]",
        "of asked [%]",
    ]
    scallop += ["crests", "of the patch within [%]"]
    turn = np.degrees(milled.impeller.pitch)
    return [
        "<h2>Programs</h2>",
        f'<p class="note">One for each cutter at each table angle, for one channel; the pallet turns by {turn:.6g} deg '
        "to the next. The check takes every part of the tool, holder too, through every row along rays on the true "
        "surfaces and uses nothing of the planner. The programs finish: roughing is not planned.</p>",
        table(head, rows, numbers=(3, 4, 5, 6, 7, 8)),
        table(scallop, patches, numbers=(0, 2, 3, 4, 5, 6, 7, 8)),
        figure("paths", paths_figure(milled), figures),
    ]


def paths_figure(milled: Milled) -> go.Figure:
    """The way of the tip in space, a colour a program; rapids in red."""
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
