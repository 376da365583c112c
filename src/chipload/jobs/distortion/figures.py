"""The presentation of a distortion job: plans, stress of the plate, flatness of the faces, and the part."""

from __future__ import annotations

from html import escape

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from chipload.jobs.distortion.outcome import Banded, DistortionResult
from chipload.jobs.distortion.result import UM, note, shape_map
from chipload.lazy import trimesh
from chipload.number_text import number_text
from chipload.report.presentation import Presentation
from chipload.report.scene import WALL
from chipload.report.shape_figure import shape_figure, shape_note
from chipload.report.sheet import definitions, figure, table
from chipload.result.style import FONT, GRID, INK

Floats = NDArray[np.float64]

#: plans that the table lists
LISTED = 16
COLOURS = ("#0b7a75", "#c9821a")


def presentation_of(done: DistortionResult) -> Presentation:
    """Return the presentation of a distortion job."""
    return Presentation(lambda figures: sections(done, figures), lambda: scene_bytes(done))


def scene_bytes(done: DistortionResult) -> bytes:
    """The file scene.glb: the part."""
    mesh = trimesh.Trimesh(done.mesh.vertices, done.mesh.faces, process=False)
    mesh.visual.face_colors = np.tile(np.array(WALL, dtype=np.uint8), (len(mesh.faces), 1))
    scene = trimesh.Scene()
    scene.add_geometry(mesh, node_name="0-part", geom_name="0-part")
    glb: bytes = scene.export(file_type="glb", extension_webp=False)
    return glb


def sections(done: DistortionResult, figures: dict[str, go.Figure]) -> list[str]:
    """Return the sections of the report."""
    known = {
        "plate": f"{number_text(done.job.profile.thickness)} mm",
        "source of the stress": done.job.table.residual_stress.source,
        "thinnest wall or floor": f"{number_text(done.wall, 3)} mm",
        "cells": f"{number_text(done.cell, 3)} mm, {done.used.unknowns} unknowns; flatness known to "
        f"{number_text(100.0 * done.cell_error, 2)} % by the cells",
    }
    rows = [
        [str(rank), escape(plan.name), _text(flat), _range(flat), _text(dist)]
        for rank, (plan, flat, dist) in enumerate(done.others[:LISTED], 1)
    ]
    used = [plan == done.used.plan for plan, _, _ in done.others[:LISTED]]
    head = ["rank", "plan", "flatness [µm]", "from plate to plate [µm]", "distortion [µm]"]
    more = (
        f"<p class='note'>The {LISTED} flattest of {len(done.others)} plans.</p>" if len(done.others) > LISTED else ""
    )
    faces = [[escape(name), _text(value), _range(value)] for name, value in done.used.faces.items()]
    shape = shape_map(done)
    return [
        "<h2>Distortion after release</h2>",
        f"<p>{escape(note(done))}</p>",
        definitions(known),
        "<h2>Shape after release</h2>",
        f"<p>{escape(shape_note(shape))}</p>",
        figure("shape", shape_figure(shape), figures),
        "<h2>Plans</h2>",
        "<p>Compared in wider cells; the plan in use is computed again in finer ones.</p>",
        table(head, rows, numbers=(2, 3, 4), used=used) + more,
        "<h2>Flat faces of the plan in use</h2>",
        table(["face", "flatness [µm]", "from plate to plate [µm]"], faces, numbers=(1, 2)),
        "<h2>Residual stress of the plate</h2>",
        figure("stress", _stress(done), figures),
    ]


def _text(value: Banded) -> str:
    return number_text(UM * value.value, 3)


def _range(value: Banded) -> str:
    return f"{number_text(UM * value.low, 3)} to {number_text(UM * value.high, 3)}"


def _stress(done: DistortionResult) -> go.Figure:
    """Plot the stress over the height in the plate, and where the part lies in it."""
    plan, profile = done.used.plan, done.job.profile
    shown = profile.upside_down() if plan.flipped else profile
    out = go.Figure()
    for name, values, colour in zip(("along x", "along y"), (shown.along_x, shown.along_y), COLOURS, strict=True):
        out.add_trace(go.Scatter(x=values, y=shown.height, name=name, mode="lines", line={"color": colour, "width": 2}))
    height = float(np.ptp(done.mesh.bounds[:, 2]))
    out.add_hrect(y0=plan.offset, y1=plan.offset + height, fillcolor=INK, opacity=0.06, line_width=0)
    out.update_xaxes(title_text="stress [MPa]", gridcolor=GRID)
    out.update_yaxes(title_text="height in the plate [mm]", gridcolor=GRID)
    margin = {"l": 64, "r": 16, "t": 24, "b": 48}
    out.update_layout(height=360, font=FONT, plot_bgcolor="white", paper_bgcolor="white", margin=margin)
    return out
