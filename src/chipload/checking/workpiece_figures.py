"""The workpiece in the report: deformed in its worst step, its limits and the best support."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from chipload.checking.bent_workpiece import BentWorkpiece
from chipload.checking.outcome import SimulationResult
from chipload.number_text import number_text, place_text
from chipload.report.sheet import figure, table
from chipload.result.style import FONT, GRID, LIMIT, SCALE
from chipload.structure.cells.followed import FollowedModes

#: the greatest displacement is drawn as this share of the part's diagonal
DRAWN = 0.06


def workpiece_section(simulation: SimulationResult, figures: dict[str, go.Figure]) -> list[str]:
    """Return the report section on the deflection of the workpiece; empty if no [workpiece] is stated."""
    own = simulation.workpiece
    if own is None:
        return []
    c = simulation.removal.columns
    lines, at = np.unique(c["line"], return_inverse=True)
    worst = np.zeros(len(lines))
    np.maximum.at(worst, at.ravel(), c["deflection_workpiece_um"])
    order = np.argsort(-worst, kind="stable")[:12]
    rows = [[str(int(lines[k])), number_text(worst[k])] for k in order if worst[k] > 0.0]
    body = [
        "<h2>Deflection of the workpiece</h2>",
        f"<p>{len(own.steps.states)} states of removal in cells of {own.cell:.3g} mm, {own.unknowns} unknowns; the "
        f"thinnest wall left is {own.wall:.3g} mm. The greatest deflection is known to "
        f"{number_text(100.0 * own.error, 2)} %, of "
        f"which {number_text(100.0 * own.state_change, 2)} % is the change between states.</p>",
        "<h3>Lines with the greatest deflection</h3>",
        table(["line", "deflection [\u00b5m]"], rows, numbers=(0, 1)),
    ]
    if own.modes is not None:
        body += _frequencies(own.modes, figures)
    bent = own.bent
    if bent is not None:
        body += bent_section(bent, f"In line {int(c['line'][bent.step])}", figures)
    return body


def bent_section(bent: BentWorkpiece, where: str, figures: dict[str, go.Figure]) -> list[str]:
    """Return the report section on the workpiece in its worst step; ``where`` begins a sentence."""
    return [
        "<h3>Greatest deflection</h3>",
        f'<p class="note">{where}, under {number_text(float(np.linalg.norm(bent.force)))} N; displacement drawn '
        f"{number_text(_scale(bent), 3)} times.</p>",
        figure("bent", bent_figure(bent), figures),
        f"<p>A support of 10 N/\u00b5m at ({place_text(bent.place)}) lowers the deflection there from "
        f"{1e3 * bent.before:.3g} to {1e3 * bent.after:.3g} \u00b5m.</p>",
    ]


def _frequencies(modes: FollowedModes, figures: dict[str, go.Figure]) -> list[str]:
    """Return the report section on natural frequencies during removal."""
    f = modes.state_frequency
    rows = [
        [str(k + 1), *(number_text(value) for value in (f[0, k], f[:, k].max(), f[-1, k]))] for k in range(f.shape[1])
    ]
    head = ["mode", "before [Hz]", "greatest [Hz]", "after [Hz]"]
    return [
        "<h3>Natural frequencies as material is removed</h3>",
        f'<p class="note">In {len(modes.states)} states, known to {number_text(100.0 * modes.error, 2)} %.</p>',
        table(head, rows, numbers=(0, 1, 2, 3)),
        figure("frequencies", frequency_figure(modes), figures),
    ]


def frequency_figure(modes: FollowedModes) -> go.Figure:
    """Plot the natural frequencies of the workpiece over the removed volume."""
    out = go.Figure()
    for k, f in enumerate(modes.state_frequency.T, 1):
        out.add_trace(
            go.Scatter(
                x=1e-3 * modes.removed, y=f.astype(np.float32), mode="lines+markers", name=f"mode {k}",
                hovertemplate="%{y:.4g} Hz<extra>mode " + str(k) + "</extra>",
            )
        )  # fmt: skip
    out.update_layout(template="none", font=FONT, height=320, margin={"l": 74, "r": 16, "t": 20, "b": 50})
    out.update_xaxes(title_text="removed [cm\u00b3]", gridcolor=GRID, zeroline=False)
    out.update_yaxes(title_text="frequency [Hz]", gridcolor=GRID, rangemode="tozero")
    return out


def _scale(bent: BentWorkpiece) -> float:
    most = float(np.linalg.norm(bent.moved, axis=1).max())
    return DRAWN * float(np.linalg.norm(np.ptp(bent.points, axis=0))) / most if most > 0.0 else 1.0


def bent_figure(bent: BentWorkpiece) -> go.Figure:
    """Plot the deformed part in its worst step, scaled, coloured by displacement, with contact and best support."""
    um = 1e3 * np.linalg.norm(bent.moved, axis=1)
    p = (bent.points + _scale(bent) * bent.moved).astype(np.float32)
    i, j, k = bent.faces.T
    out = go.Figure(
        go.Mesh3d(
            x=p[:, 0], y=p[:, 1], z=p[:, 2], i=i, j=j, k=k, intensity=um.astype(np.float32), colorscale=SCALE,
            flatshading=True, lighting={"ambient": 0.9, "diffuse": 0.3},
            colorbar={"title": {"text": "displacement [\u00b5m]", "side": "right"}, "thickness": 12},
            hovertemplate="%{intensity:.3g} \u00b5m<extra></extra>",
        )
    )  # fmt: skip
    for name, at, colour in (("contact", bent.line.mean(axis=0), LIMIT), ("support", bent.place, "#111111")):
        x, y, z = ([float(v)] for v in at)
        marker = {"size": 5, "color": colour}
        out.add_trace(go.Scatter3d(x=x, y=y, z=z, mode="markers", marker=marker, name=name))
    axes = {f"{axis}axis_title": f"{axis} [mm]" for axis in "xyz"}
    camera = {"eye": {"x": 1.5, "y": -1.3, "z": 1.3}}
    out.update_layout(
        template="none", font=FONT, height=520, margin={"l": 0, "r": 0, "t": 0, "b": 0},
        scene={"aspectmode": "data", "camera": camera, **axes}, legend={"x": 0.0, "y": 1.0},
    )  # fmt: skip
    return out
