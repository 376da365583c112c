"""The report of a simulated program: sections, scene, programs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from html import escape
from types import MappingProxyType
from typing import Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray
from plotly.subplots import make_subplots

from chipload.checking import part_figures
from chipload.checking.numbers import operation_numbers, program_numbers
from chipload.checking.outcome import ChangedText, ProgramResult, SimulationResult, SpeedResult
from chipload.checking.program_text import program_text
from chipload.checking.result import APT
from chipload.checking.rows import motion_rows
from chipload.checking.stability_figures import stability_sections
from chipload.checking.workpiece_figures import workpiece_section
from chipload.number_text import number_text
from chipload.program.apt.writer import write_apt
from chipload.program.program import RAPID, Program
from chipload.report.diagram import diagram_figure
from chipload.report.gltf import GltfScene
from chipload.report.presentation import Blank, Content, Presentation
from chipload.report.scene import FIXTURE
from chipload.report.sheet import figure, table
from chipload.result import Result, release_of
from chipload.result.motions import chords_of
from chipload.result.style import FONT, GRID, INK, LIMIT, LINE_POINTS, SPACE_POINTS, STOCK
from chipload.result.thinning import thin_rows
from chipload.simulation.engagement_samples import EngagementSamples
from chipload.stock.solid import prisms
from chipload.stock.tile_grid import polygons

Floats = NDArray[np.float64]

SPREAD = "\u00b1 is two standard deviations, from the spread of the material's coefficients."
NO_SPREAD = "The material states neither a spread nor a covariance of its coefficients, so the forces have no interval."
#: rows of the figure: lines (column, name, colour), the title of their axis, and the limit
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
    ((("chip_max_mm", "thickest", INK),), "chip [mm]", "chip_max_mm"),
    ((("deflection_um", "cutter from workpiece", INK),), "deflection [\u00b5m]", "deflection_um"),
    ((("rate", "removed", STOCK),), "removal [mm\u00b3/s]", ""),
)
#: lines that the report lists as slowest
SLOWEST = 12


def program_presentation(
    program: ProgramResult,
    result: Result,
    changed: Mapping[str, ChangedText] = MappingProxyType({}),
    sections: Callable[[dict[str, go.Figure]], list[str]] = lambda figures: [],
) -> Presentation:
    """Return the presentation of a program's result.

    Parameters
    ----------
    changed : program texts with changed words, by the name of their file
    sections : report sections before those that every program has
    """
    speeds = next((text for text in changed.values() if isinstance(text, SpeedResult)), None)
    return Presentation(
        lambda figures: [*sections(figures), *_sections(program, speeds, figures)],
        lambda: scene_bytes(program),
        partial(_files, program, changed),
        lambda: _blanks(program, result),
        lambda: _samples(program, result),
    )


def _blanks(program: ProgramResult, result: Result) -> dict[str, Blank]:
    """Return the initial stock and the cutters for the page, the same for every track."""
    simulated = program.simulated
    if simulated is None:
        return {}
    return {track.name: Blank(simulated.collisions.stock.blank, program.cutters) for track in result.tracks}


def _samples(program: ProgramResult, result: Result) -> dict[str, EngagementSamples]:
    """Return the tooth engagement of the program that was simulated last, which is the track in use."""
    found = None if program.simulated is None else program.simulated.removal.samples
    return {} if found is None else {track.name: found for track in result.tracks if track.in_use}


def _files(program: ProgramResult, changed: Mapping[str, ChangedText], result: Result) -> dict[str, Content]:
    """Return the files of the result: CL data of the program, its remaining stock, and its text if that is new."""
    path = program.reading.program
    tools = set(np.unique(path.tool).tolist())
    known = program.cutters if tools - {0} <= set(program.cutters) else None
    text = write_apt(path, known, title=f"{program.title}, {program.name}", release=release_of(result, APT))
    files: dict[str, Content] = {APT: text.encode("ascii")}
    files |= {
        name: program_text(own, release_of(result, name)).encode("utf-8", "surrogateescape")
        for name, own in changed.items()
    }
    if program.simulated is not None:
        files["stock.npz"] = program.simulated.stock.to_bytes()
    return files


def _sections(program: ProgramResult, speeds: SpeedResult | None, figures: dict[str, go.Figure]) -> list[str]:
    what, time_s = program_numbers(program), float(program.seconds.sum())
    low, high = what["box_mm"]["low"], what["box_mm"]["high"]
    box = ", ".join(f"{x} {number_text(a)} to {number_text(b)}" for x, a, b in zip("XYZ", low, high, strict=True))
    body = [
        f"<h2>{escape(program.name)} on {escape(program.machine.name)}</h2>",
        f"<p>{what['motions']} motions, {number_text(what['cutting_mm'])} mm at feed and "
        f"{number_text(what['rapid_mm'])} mm of rapids, "
        f"{number_text(time_s / 60.0)} min; {box} mm; tools {escape(', '.join(map(str, what['tools'])))}.</p>",
        "<h3>Feed over time</h3>",
        figure("feed", feed_figure(program), figures),
        "<h3>Slowest lines</h3>",
        _slowest(program),
    ]
    if program.simulated is not None:
        body += _load_sections(program.simulated, time_s, figures)
        body += stability_sections(program.simulated, speeds, figures)
    return body


def _load_sections(simulation: SimulationResult, time_s: float, figures: dict[str, go.Figure]) -> list[str]:
    """Return the report sections on chips, forces, torque, power, deflection, the part and collisions."""
    what, c = operation_numbers(simulation, time_s), simulation.removal.columns
    force, torque, power = what["force_n"], what["torque_nm"], what["power_w"]
    rows = [
        [f"force {x} on the cutter [N]", _mean(force[x]), number_text(force[x]["max"]), number_text(force[x]["min"])]
        for x in "xyz"
    ]
    rows += [["normal force on the surface that is left [N]", "", number_text(force["normal_max"]), ""]]
    rows += [["torque [N m]", _mean(torque), number_text(torque["max"]), ""]]
    rows += [["power [W]", number_text(power["mean"]), number_text(power["max"]), ""]]
    if what["form_error_um"]["points"]:
        ends = (number_text(what["form_error_um"][key]) for key in ("greatest", "least"))
        rows += [["form error of the part [\u00b5m]", "", *ends]]
    rows += [["deflection [\u00b5m]", "", number_text(what["deflection_um"]["max"]), ""]]
    rigid = ""
    if simulation.rigid:
        rigid = f" Deflections are lower bounds: {', '.join(simulation.rigid)} not stated and taken as rigid."
    body = [
        "<h2>Chips, force, torque, power</h2>",
        f"<p>{what['steps']} steps; {number_text(what['chip_volume_mm3'])} mm\u00b3 of chips, stock less by "
        f"{number_text(what['removed_mm3'])} mm\u00b3; greatest chip thickness "
        f"{number_text(what['chip_max_mm']['max'])} mm; "
        f"{what['films_mm3']:.2g} mm\u00b3 in films thinner than the tolerance.</p>",
        f"<p>Time on the machine: {number_text(what['cutting_s'])} s in cut, {number_text(what['air_cut_s'])} "
        "s in air, "
        f"{number_text(what['rapid_s'])} s of rapids, {number_text(what['dwell_s'])} s of dwells, "
        f"{number_text(what['other_s'])} s of tool "
        f"changes and start-up; {number_text(what['time_s'])} s in all.</p>",
        table(["", "mean", "greatest", "least"], rows, numbers=(1, 2, 3)),
        f'<p class="note">{SPREAD if torque["mean_sd"] is not None else NO_SPREAD}{escape(rigid)}</p>',
        figure("loads", loads_along_time(simulation), figures),
    ]
    body += workpiece_section(simulation, figures)
    chip = simulation.removal.piece
    if chip is not None:
        title = f"step {chip.step}, layer at z = {number_text(chip.height)} mm"
        drawn = diagram_figure(chip.move, chip.cutter, chip.height, chip.before, title=title)
        body += [
            "<h3>A chip</h3>",
            f'<p class="note">The chip with most pieces ({len(chip.chips)}): how the covered area is built (left: '
            "angle around the edge across, time in the step up) and which part of it was material (right).</p>",
            figure("chip", drawn, figures),
        ]
    body += part_figures.section(
        simulation.left, simulation.collisions.found, c, simulation.collisions.compared_with, figures
    )
    return body


def _mean(values: Mapping[str, Any]) -> str:
    """Return a mean as a text, with twice its standard deviation if that is known."""
    sd = values["mean_sd"]
    return number_text(values["mean"]) if sd is None else f"{number_text(values['mean'])} \u00b1 {2.0 * sd:.2g}"


def loads_along_time(simulation: SimulationResult) -> go.Figure:
    """Plot force, torque, power, chip thickness, deflection and removal against time."""
    columns = simulation.removal.columns
    seconds, of = columns["seconds"], columns["line"]
    t = columns["t_s"] - 0.5 * columns["duration_s"]
    out = make_subplots(rows=len(ROWS), cols=1, shared_xaxes=True, vertical_spacing=0.03)
    for row, (lines, title, limit) in enumerate(ROWS, start=1):
        for column, name, colour in lines:
            if column == "rate":
                y = np.where(seconds > 0.0, columns["chip_volume_mm3"] / np.where(seconds > 0.0, seconds, 1.0), 0.0)
            else:
                y = np.asarray(columns[column], dtype=np.float64)
            keep = thin_rows(y, LINE_POINTS)
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
        if limit in simulation.limits:
            text = {"text": f"limit {simulation.limits[limit]:g}", "font": {"color": LIMIT, "size": 11}}
            line = {"color": LIMIT, "width": 1.2, "dash": "dash"}
            out.add_hline(
                y=simulation.limits[limit],
                line=line,
                annotation=text,
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


def feed_figure(read: ProgramResult) -> go.Figure:
    """Plot the programmed feed of each motion against time."""
    columns = motion_rows(read)
    t, feed = np.asarray(columns["t_s"]) / 60.0, np.asarray(columns["feed_mm_min"])
    step = -(-len(t) // SPACE_POINTS)
    out = go.Figure(
        go.Scatter(
            x=t[::step].astype(np.float32), y=feed[::step].astype(np.float32), mode="lines", line_shape="vh",
            line={"color": STOCK, "width": 1.2},
            customdata=columns["line"][::step], hovertemplate="line %{customdata}: %{y:.5g} mm/min<extra></extra>",
        )
    )  # fmt: skip
    out.update_layout(template="none", height=260, font=FONT, margin={"l": 70, "r": 20, "t": 10, "b": 50})
    out.update_xaxes(title="time [min]", gridcolor=GRID)
    out.update_yaxes(title="feed [mm/min]", gridcolor=GRID, rangemode="tozero")
    return out


def _path_points(program: Program) -> tuple[Floats, NDArray[np.bool_]]:
    """Return the points of the path with arcs as chords, and whether a rapid leads to each."""
    chords = chords_of(program)
    return np.asarray(chords.p_work), np.asarray(chords.motion == RAPID)


def _runs(chosen: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return (first, past the last) of each run of chosen rows that has a row before it."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], chosen, [False]]).astype(np.int8)))
    return [(max(int(a), 1), int(b)) for a, b in edges.reshape(-1, 2) if b > 1]


def _slowest(read: ProgramResult) -> str:
    order = np.argsort(-read.seconds, kind="stable")[:SLOWEST]
    whole = max(float(read.seconds.sum()), 1e-300)
    rows = [
        [str(int(read.lines[k])), number_text(read.seconds[k]), f"{100.0 * read.seconds[k] / whole:.3g}"]
        for k in order
        if read.seconds[k] > 0.0
    ]
    return table(["line", "time [s]", "of all [%]"], rows, numbers=(1, 2))


def scene_bytes(read: ProgramResult) -> bytes:
    """Return scene.glb: rapids and cutting motions as lines, and the remaining stock; lengths in mm, Z up."""
    points, rapid = _path_points(read.reading.program)
    scene = GltfScene()
    for name, chosen, colour in (("rapids", rapid, (179, 38, 30, 255)), ("path", ~rapid, (34, 120, 132, 255))):
        scene.add_lines(name, points, _runs(chosen), colour)
    if read.simulated is not None:
        stock = read.simulated.stock
        # layer by layer, as LayeredStock.mesh makes them all
        layers = (prisms([polygons(stock.section(i))], stock.bounds[i : i + 2]) for i in range(stock.layers))
        scene.add_mesh_of_parts("stock", ((mesh.vertices, mesh.faces) for mesh in layers), (168, 122, 58, 255))
        for name, mesh in read.simulated.collisions.fixtures.items():
            scene.add_mesh(name, mesh.vertices, mesh.faces, FIXTURE)
        left, columns = read.simulated.left, read.simulated.removal.columns
        if left is not None:
            part = part_figures.coloured_mesh(left, part_figures.span_of(left, columns))
            scene.add_mesh("part", part.vertices, part.faces, part.visual.vertex_colors, part.metadata)
    return scene.to_bytes()
