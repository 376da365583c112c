"""How the result of a torque-controlled program is presented: sections of the report, scene, files."""

from __future__ import annotations

from dataclasses import asdict
from functools import partial
from html import escape

import numpy as np
import plotly.graph_objects as go

from chipload.control.fuzzy import FuzzyTable
from chipload.jobs.simulation.workpiece_figures import bent_section
from chipload.jobs.torque import torque_figures as drawn
from chipload.jobs.torque.files import HAL, PATH, program_files
from chipload.jobs.torque.numbers import operation_numbers
from chipload.jobs.torque.outcome import (
    HELD,
    PLAIN,
    ClampedWorkpiece,
    ControllerCase,
    ShellWall,
    SpindleEstimate,
    TorqueResult,
)
from chipload.jobs.torque.result import track_name
from chipload.jobs.torque.scene import scene_bytes
from chipload.jobs.torque.unrolled_figure import unrolled
from chipload.report.presentation import Blank, Presentation
from chipload.report.sheet import figure, items, table

SETS = ("NB", "NM", "NS", "Z", "PS", "PM", "PB")


def presentation_of(outcome: TorqueResult) -> Presentation:
    """The presentation of a torque-controlled program."""
    return Presentation(
        partial(_sections, outcome),
        partial(scene_bytes, outcome),
        partial(program_files, outcome),
        partial(_blanks, outcome),
    )


def _blanks(outcome: TorqueResult) -> dict[str, Blank]:
    """The real stock, of the controller in use and the one that it is compared with."""
    if not outcome.control.cases:
        return {}
    return {track_name(outcome.control.cases[-1], name): outcome.blank for name in (HELD, PLAIN)}


def _sections(outcome: TorqueResult, figures: dict[str, go.Figure]) -> list[str]:
    body = _limit(outcome, figures)
    if outcome.control.cases:
        body += _controllers(outcome, figures)
    body += (
        _wall(outcome.wall, outcome, figures)
        if isinstance(outcome.wall, ShellWall)
        else _workpiece(outcome.wall, figures)
    )
    if outcome.control.estimate is not None:
        body += _estimate(outcome.control.estimate, outcome, figures)
    body += _rules(outcome.control.table, figures)
    return [
        *body,
        "<h2>On a machine</h2>",
        f"<p><code>0-override</code> beside <code>chipload hal {HAL}</code> holds the torque along "
        f"<code>{PATH}</code>, which has the path, its planned torque in two parts, the true one for a "
        "trial without a spindle, and the allowable torque over the limit (<code>relief</code>). "
        "<code>--current-pin</code> and <code>--speed-pin</code> name where HAL has the current and the speed of the "
        "spindle. <code>0-feedforward</code> has the feeds that the planned "
        "torque allows written into it, for a machine that measures nothing.</p>",
    ]


def _limit(outcome: TorqueResult, figures: dict[str, go.Figure]) -> list[str]:
    what = operation_numbers(outcome)
    where = what["torque_limit"]
    why = {
        "deflection": f"its deflection of {outcome.job.limits['form_error_um']:g} µm",
        "strength": f"{outcome.job.limits['strength_share']:g} of its strength of {outcome.wall.strength:g} MPa",
        "workpiece deflection": f"its own deflection of {outcome.job.limits.get('deflection_workpiece_um', 0.0):g} µm",
        "stated": "the limit that the job states",
    }[outcome.source]
    place = ", ".join(f"{round(x, 3) + 0.0:g}" for x in where["place"])
    body = ["<h2>Allowable torque</h2>"]
    if outcome.attainable and isinstance(outcome.wall, ClampedWorkpiece):
        line = (
            f"<p>The limit is <b>{what['torque_limit_nm']:.4g} N m</b>, mean over a revolution. It comes from {why}, "
            f"at ({place}) mm, where the workpiece allows a force of {where['force_n']:.4g} N. Its compliance there is "
            f"known to {100.0 * outcome.wall.planned.error:.2g} %: the limit is made for one that is greater by as "
            f"much. Elsewhere the workpiece allows more, up to {where['relief_max']:.3g} times as much torque; the "
            "controller holds the same share of what is allowable everywhere, "
            f"{where['held_nm']:.4g} N m here. The workpiece as it really is would allow "
            f"{where['true_wall_nm']:.4g} N m.</p>"
        )
        body.append(line)
    if outcome.attainable and isinstance(outcome.wall, ShellWall):
        body.append(
            f"<p>The limit is <b>{what['torque_limit_nm']:.4g} N m</b>, mean over a revolution. It comes from {why}, "
            f"at ({place}) mm: the wall of {outcome.wall.thinnest:.4g} mm (as thin as the tolerance lets it be) and "
            f"the cutter allow {where['force_n']:.4g} N along the normal there. Elsewhere the wall allows more, up to "
            f"{where['relief_max']:.3g} times as much torque; the controller holds the same share of what is allowable "
            f"everywhere, {where['held_nm']:.4g} N m here. The wall as it really is, {outcome.wall.real:.4g} mm, would "
            f"allow {where['true_wall_nm']:.4g} N m. The closed formula of one tooth, which knows no engagement, says "
            f"{where['one_tooth_formula_nm']:.3g} N m.</p>"
        )
    said = what.get("surface_off_um")
    if said is not None:
        body.append(
            f"<p>What the program leaves lies {said['min']:.3g} to {said['max']:.3g} µm from the finished surface of "
            "the job, without deflection.</p>"
        )
    spindle = [f"spindle: {name} {value:+g}" for name, value in asdict(outcome.control.deviation).items() if value]
    surprises = [*outcome.job.surprises, *spindle] or ["none"]
    return [
        *body,
        figure("allowable", drawn.allowable(outcome), figures),
        *_unrolled(outcome, figures),
        "<h3>Deviations from the plan</h3>",
        items(surprises),
    ]


def _unrolled(outcome: TorqueResult, figures: dict[str, go.Figure]) -> list[str]:
    """Only a tube or a cone has angles round it."""
    if not isinstance(outcome.wall, ShellWall):
        return []
    return [
        "<h3>On the unrolled wall</h3>",
        '<p class="note">Each place of the path by its angle and height, all in one scale; dashed: the angle of a '
        "surprise.</p>",
        figure("unrolled", unrolled(outcome), figures),
    ]


def _controllers(outcome: TorqueResult, figures: dict[str, go.Figure]) -> list[str]:
    body = ["<h2>Controllers</h2>"]
    for case in outcome.control.cases:
        by = outcome.compared(case)
        title = (
            f"{1e3 * case.loop.latency:g} ms latency, steps of {100.0 * case.quantum:g} %"
            if case.quantum or case.loop.latency
            else "Without latency, any override"
        )
        body += [
            f"<h3>{title}</h3>",
            _table(outcome, case),
            f"<p>{drawn.NAMES[HELD]}: {by['shorter_percent']:.3g} % shorter than the constant feed that respects the "
            f"limit everywhere, {by['shorter_than_model_percent']:.3g} % shorter than the model's derated schedule; "
            f"{by['of_possible_percent']:.3g} % of what is physically possible; form error "
            f"{by['form_error_change_percent']:+.3g} % against the constant feed's.</p>",
        ]
    plain, late = outcome.control.cases
    lost = late.runs[HELD].outcome.time - plain.runs[HELD].outcome.time
    body += [
        f"<p>Latency and steps cost {lost:.3g} s with the model, and move its greatest torque from "
        f"{1e-3 * plain.runs[HELD].outcome.load_max:.4g} to {1e-3 * late.runs[HELD].outcome.load_max:.4g} N m.</p>",
        '<p class="note">The constant feed and the derated schedule are the fastest that respect the limit everywhere, '
        "deviations and all, which nobody knows beforehand. The last row is the shortest time that is physically "
        "possible: the torque at its limit at every instant.</p>",
        f"<h3>Along the path, {1e3 * late.loop.latency:g} ms latency</h3>",
        figure("path", drawn.along(outcome, late, "path"), figures),
        "<h3>Over time</h3>",
        figure("time", drawn.along(outcome, late, "time"), figures),
    ]
    return body


def _table(outcome: TorqueResult, case: ControllerCase) -> str:
    rows = []
    torque_nm = 1e-3 * outcome.allowable.torque
    most = torque_nm * (1.0 + 1e-2 * outcome.job.limits["torque_over_percent"])
    for name, run in case.runs.items():
        n = run.numbers()

        def cell(value: float, limit: float, digits: str = ".4g") -> str:
            return f'<span class="{"ok" if value <= limit else "no"}">{value:{digits}}</span>'

        rows.append([
            f'<span class="dot" style="background:{drawn.COLOURS[name]}"></span>{drawn.NAMES[name]}',
            f"{n['time_s']:.2f}",
            cell(100.0 * n["torque_nm_max"] / torque_nm, 100.0 * most / torque_nm),
            f"{n['torque_raw_nm_max']:.4g}",
            f"{n['torque_over_limit_s']:.3f}",
            cell(n["form_error_um_max"], outcome.job.limits["form_error_um"], ".3g"),
            cell(n["stress_mpa_max"], outcome.job.limits["strength_share"] * outcome.wall.strength, ".3g"),
            f"{n['override_min']:.2f} to {n['override_max']:.2f}",
            str(n["ended"]),
        ])  # fmt: skip
    head = (
        "controller", "time [s]", "torque of allowable [%]", "torque [N m]", "over limit [s]", "form error", "stress",
        "override", "ended",
    )  # fmt: skip
    units = (
        f'<p class="note">Torque at most {100.0 * most / torque_nm:.4g} % of what is allowable; form '
        "error in µm, at most "
        f"{outcome.job.limits['form_error_um']:g}; stress in MPa, at most "
        f"{outcome.job.limits['strength_share'] * outcome.wall.strength:g}.</p>"
    )
    rows.append(["torque at its limit at every instant", f"{outcome.control.ideal_time:.2f}", "100", *[""] * 6])
    used = [*(name == HELD for name in case.runs), False]
    return table(head, rows, numbers=(1, 2, 3, 4, 5, 6), used=used) + units


def _workpiece(wall: ClampedWorkpiece, figures: dict[str, go.Figure]) -> list[str]:
    own = wall.real
    body = [
        "<h2>Deflection of the workpiece</h2>",
        f"<p>{len(own.steps.states)} states of removal in cells of {own.cell:.3g} mm, {own.unknowns} unknowns; the "
        f"thinnest wall left is {own.wall:.3g} mm. The deflection is known to {100.0 * own.error:.2g} %. The greatest "
        f"stress is {wall.strained[1]:.3g} MPa per newton; its yield stress {wall.strength:g} MPa.</p>",
    ]
    return body if own.bent is None else [*body, *bent_section(own.bent, "In the worst step", figures)]


def _wall(wall: ShellWall, outcome: TorqueResult, figures: dict[str, go.Figure]) -> list[str]:
    solid, whole = wall.solid, float(wall.oval.share.sum())
    rows = [
        [f"{p.s:.4g}", f"{1e3 * p.shell:.4g}", f"{1e3 * p.solid:.4g}", f"{100.0 * (p.solid / p.shell - 1.0):+.2f}"]
        for p in solid.places
    ]
    a, b, c = solid.counts
    share = 100.0 * float(wall.oval.share[1]) / whole
    beam = (
        f"A beam with shear gives {1e3 * wall.oval.beam:.3g} µm: it is wrong by {whole / wall.oval.beam:.3g} times."
        if wall.oval.beam is not None
        else f"There is no beam for a cone; its first harmonic, which a beam would have, is {share:.3g} % of it."
    )
    return [
        "<h2>Compliance of the wall</h2>",
        f"<p>Under 1 N at the free end the wall of {wall.thinnest:.4g} mm is deflected by "
        f"{1e3 * whole:.4g} µm, nearly all of it by becoming oval. {beam}</p>",
        figure("oval", drawn.ovalised(wall), figures),
        "<h3>Second opinion: the same wall by finite elements</h3>",
        f'<p class="note">Half of the wall by {a} x {b} x {c} hexahedra of 20 nodes (half round, along, through), '
        f"{solid.nodes} nodes; the same force on the same area, displacement of the end of the depth of cut.</p>",
        table(("from the clamp [mm]", "shell [µm/N]", "hexahedra [µm/N]", "apart [%]"), rows, numbers=(0, 1, 2, 3)),
    ]


def _estimate(e: SpindleEstimate, outcome: TorqueResult, figures: dict[str, go.Figure]) -> list[str]:
    rows = [
        ["noise of the estimate, from its sensor, closed form [N m]", f"{1e-3 * e.noise:.3g}"],
        ["the same, seen in the run [N m]", f"{1e-3 * e.seen:.3g}"],
        ["lag of sensor and filter [ms]", f"{1e3 * e.lag:.3g}"],
        ["greatest error by that lag, while the torque changes [N m]", f"{1e-3 * e.behind:.3g}"],
        ["bandwidth of both [Hz]", f"{e.bandwidth:.3g}"],
        ["resolution: noise, quantisation, idle map [N m]", f"{1e-3 * e.resolution:.3g}"],
        ["share by which the torque constant may be wrong [%]", f"{100.0 * e.constant_error:.3g}"],
        ["valid for torques from, to [N m]", f"{1e-3 * e.range[0]:.3g}, {1e-3 * e.range[1]:.3g}"],
        [f"tooth passing frequency {e.aliased[0]:.4g} Hz, as the readings show it [Hz]", f"{e.aliased[1]:.3g}"],
        ["lighter than this is not trusted: nothing is sped up on it [N m]", f"{1e-3 * e.light:.3g}"],
        ["share of the time in cut that is lighter [%]", f"{100.0 * e.light_share:.3g}"],
    ]
    return [
        "<h2>Torque estimate from the spindle</h2>",
        table(("", ""), rows, numbers=(1,)),
        f"<p>Not to be trusted: torques below {1e-3 * e.light:.3g} N m"
        f"; changes within {3e3 * e.lag:.3g} ms; speeds other than the programmed one, for which the idle current is "
        "not stated.</p>",
        figure("measured", drawn.measured(outcome), figures),
    ]


def _rules(fuzzy: FuzzyTable, figures: dict[str, go.Figure]) -> list[str]:
    named = len(fuzzy.output) == len(SETS)
    head = ["error \\ change", *(f"{x:.3g}" for x in fuzzy.change)]
    rows = [
        [f"{e:.3g}", *((SETS[k] if named else f"{fuzzy.output[k]:.3g}") for k in row)]
        for e, row in zip(fuzzy.error, np.asarray(fuzzy.rules), strict=True)
    ]
    return [
        f"<h2>The fuzzy controller: {escape(fuzzy.name)}</h2>",
        '<p class="note">Triangles over the centres; min, max and centroid. The answer moves the trim: the share of '
        "the limit that the model may plan with.</p>",
        table(head, rows),
        figure("surface", drawn.answers(fuzzy), figures),
    ]
