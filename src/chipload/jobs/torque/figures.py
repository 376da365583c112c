"""The report of a torque job: sections, scene, files."""

from __future__ import annotations

from dataclasses import asdict
from functools import partial
from html import escape

import numpy as np
import plotly.graph_objects as go

from chipload.checking.workpiece_figures import bent_section
from chipload.control.fuzzy import FuzzyTable
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
from chipload.jobs.torque.unrolled_figure import unrolled_torques
from chipload.number_text import number_text
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
        f"<p>Run the program <code>0-override</code> together with <code>chipload hal {HAL}</code>, which limits the "
        f"torque along <code>{PATH}</code>. That file holds the path, its planned torque in two parts, the true torque "
        "for a trial without a spindle, and the allowable torque over the limit (<code>relief</code>). "
        "<code>--current-pin</code> and <code>--speed-pin</code> name the HAL pins with the current and the speed of "
        "the spindle. <code>0-feedforward</code> contains the feeds that the planned torque allows, for a machine "
        "without measurement.</p>",
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
            f"<p>The torque limit is <b>{number_text(what['torque_limit_nm'])} N m</b>, mean over a "
            "revolution. It comes from "
            f"{why}, at ({place}) mm, where the workpiece allows a force of "
            f"{number_text(where['force_n'])} N. The compliance "
            f"there is known to {number_text(100.0 * outcome.wall.planned.error, 2)} %; the limit includes "
            "that error. Elsewhere "
            f"the workpiece allows up to {number_text(where['relief_max'], 3)} times as much torque. The "
            "set point of the "
            "controller is the same share of the allowable torque everywhere, "
            f"{number_text(where['held_nm'])} N m here. The real workpiece would allow "
            f"{number_text(where['true_wall_nm'])} N m.</p>"
        )
        body.append(line)
    if outcome.attainable and isinstance(outcome.wall, ShellWall):
        body.append(
            f"<p>The torque limit is <b>{number_text(what['torque_limit_nm'])} N m</b>, mean over a "
            "revolution. It comes from "
            f"{why}, at ({place}) mm, where the wall of {number_text(outcome.wall.thinnest)} mm (the "
            f"least that the tolerance allows) and the cutter allow {number_text(where['force_n'])} N along the "
            "normal. Elsewhere the wall allows up to "
            f"{number_text(where['relief_max'], 3)} times as much torque. The set point of the controller "
            "is the same share of the "
            f"allowable torque everywhere, {number_text(where['held_nm'])} N m here. The real wall of "
            f"{number_text(outcome.wall.real)} "
            f"mm would allow {number_text(where['true_wall_nm'])} N m. The closed formula for one tooth, "
            "which neglects the "
            f"engagement, gives {number_text(where['one_tooth_formula_nm'], 3)} N m.</p>"
        )
    off = what.get("surface_off_um")
    if off is not None:
        body.append(
            f"<p>Without deflection, the surface that the program leaves lies {off['min']:.3g} to {off['max']:.3g} "
            "µm from the finished surface of the job.</p>"
        )
    spindle = [f"spindle: {name} {value:+g}" for name, value in asdict(outcome.control.deviation).items() if value]
    surprises = [*outcome.job.surprises, *spindle] or ["none"]
    return [
        *body,
        figure("allowable", drawn.allowable(outcome), figures),
        *_unrolled_figures(outcome, figures),
        "<h3>Deviations from the plan</h3>",
        items(surprises),
    ]


def _unrolled_figures(outcome: TorqueResult, figures: dict[str, go.Figure]) -> list[str]:
    """Only a tube or a cone has angles round it."""
    if not isinstance(outcome.wall, ShellWall):
        return []
    return [
        "<h3>On the unrolled wall</h3>",
        '<p class="note">Each point of the path by its angle and height, with one colour scale; dashed: the angle of a '
        "surprise.</p>",
        figure("unrolled", unrolled_torques(outcome), figures),
    ]


def _controllers(outcome: TorqueResult, figures: dict[str, go.Figure]) -> list[str]:
    body = ["<h2>Controllers</h2>"]
    for case in outcome.control.cases:
        by = outcome.compared(case)
        title = (
            f"{1e3 * case.loop.latency:g} ms latency, steps of {100.0 * case.quantum:g} %"
            if case.quantum or case.loop.latency
            else "Without latency, continuous override"
        )
        body += [
            f"<h3>{title}</h3>",
            _table(outcome, case),
            f"<p>{drawn.NAMES[HELD]}: {number_text(by['shorter_percent'], 3)} % shorter than the greatest "
            "constant feed that keeps "
            f"the limit, {number_text(by['shorter_than_model_percent'], 3)} % shorter than the model's "
            "derated schedule, "
            f"{number_text(by['of_possible_percent'], 3)} % of the physically possible gain; form error "
            f"{by['form_error_change_percent']:+.3g} % compared with the constant feed.</p>",
        ]
    plain, late = outcome.control.cases
    time_cost = late.runs[HELD].outcome.time - plain.runs[HELD].outcome.time
    body += [
        f"<p>Latency and override steps cost {number_text(time_cost, 3)} s with the model, and change its "
        "greatest torque from "
        f"{number_text(1e-3 * plain.runs[HELD].outcome.load_max)} to "
        f"{number_text(1e-3 * late.runs[HELD].outcome.load_max)} N m.</p>",
        '<p class="note">The constant feed and the derated schedule are the fastest that keep the limit everywhere '
        "with all deviations, which are unknown beforehand. The last row is the shortest time that is physically "
        "possible: the torque is at its limit at every instant.</p>",
        f"<h3>Along the path, {1e3 * late.loop.latency:g} ms latency</h3>",
        figure("path", drawn.torques_along(outcome, late, "path"), figures),
        "<h3>Over time</h3>",
        figure("time", drawn.torques_along(outcome, late, "time"), figures),
    ]
    return body


def _table(outcome: TorqueResult, case: ControllerCase) -> str:
    rows = []
    torque_nm = 1e-3 * outcome.allowable.torque
    most = torque_nm * (1.0 + 1e-2 * outcome.job.limits["torque_over_percent"])
    for name, run in case.runs.items():
        n = outcome.numbers_of(run)

        def cell(value: float, limit: float, digits: str = ".4g") -> str:
            return f'<span class="{"ok" if value <= limit else "no"}">{value:{digits}}</span>'

        rows.append([
            f'<span class="dot" style="background:{drawn.COLOURS[name]}"></span>{drawn.NAMES[name]}',
            f"{n['time_s']:.2f}",
            cell(100.0 * n["torque_nm_max"] / torque_nm, 100.0 * most / torque_nm),
            number_text(n['torque_raw_nm_max']),
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
        f'<p class="note">Limits: torque {number_text(100.0 * most / torque_nm)} % of the allowable torque; form '
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
        f"thinnest wall left is {own.wall:.3g} mm. The deflection is known to "
        f"{number_text(100.0 * own.error, 2)} %. The greatest "
        f"stress is {number_text(wall.strained[1], 3)} MPa per newton; its yield stress {wall.strength:g} MPa.</p>",
    ]
    return body if own.bent is None else [*body, *bent_section(own.bent, "In the worst step", figures)]


def _wall(wall: ShellWall, outcome: TorqueResult, figures: dict[str, go.Figure]) -> list[str]:
    solid, whole = wall.solid, float(wall.oval.share.sum())
    rows = [
        [
            number_text(p.s),
            number_text(1e3 * p.shell),
            number_text(1e3 * p.solid),
            f"{100.0 * (p.solid / p.shell - 1.0):+.2f}",
        ]
        for p in solid.places
    ]
    a, b, c = solid.counts
    share = 100.0 * float(wall.oval.share[1]) / whole
    beam = (
        f"A beam with shear gives {number_text(1e3 * wall.oval.beam, 3)} µm, {whole / wall.oval.beam:.3g} "
        "times too little."
        if wall.oval.beam is not None
        else f"There is no beam model of a cone; its first harmonic, the bending of a beam, is "
        f"{number_text(share, 3)} % of it."
    )
    return [
        "<h2>Compliance of the wall</h2>",
        f"<p>A force of 1 N at the free end deflects the wall of {number_text(wall.thinnest)} mm by "
        f"{number_text(1e3 * whole)} µm, "
        f"nearly all of it because the section becomes oval. {beam}</p>",
        figure("oval", drawn.ovalisation_figure(wall), figures),
        "<h3>Comparison with finite elements</h3>",
        f'<p class="note">Half of the wall by {a} x {b} x {c} hexahedra of 20 nodes (half round, along, through), '
        f"{solid.nodes} nodes; the same force on the same area, displacement of the end of the depth of cut.</p>",
        table(
            ("from the clamp [mm]", "shell [µm/N]", "hexahedra [µm/N]", "difference [%]"), rows, numbers=(0, 1, 2, 3)
        ),
    ]


def _estimate(e: SpindleEstimate, outcome: TorqueResult, figures: dict[str, go.Figure]) -> list[str]:
    rows = [
        ["noise of the estimate, from its sensor, closed form [N m]", f"{1e-3 * e.noise:.3g}"],
        ["noise of the estimate in the simulated run [N m]", f"{1e-3 * e.seen:.3g}"],
        ["lag of sensor and filter [ms]", f"{1e3 * e.lag:.3g}"],
        ["greatest error by that lag, while the torque changes [N m]", f"{1e-3 * e.behind:.3g}"],
        ["bandwidth of both [Hz]", f"{e.bandwidth:.3g}"],
        ["resolution: noise, quantisation, idle map [N m]", f"{1e-3 * e.resolution:.3g}"],
        ["uncertainty of the torque constant [%]", f"{100.0 * e.constant_error:.3g}"],
        ["valid for torques from, to [N m]", f"{1e-3 * e.range[0]:.3g}, {1e-3 * e.range[1]:.3g}"],
        [
            f"tooth passing frequency {number_text(e.aliased[0])} Hz, as the readings show it [Hz]",
            number_text(e.aliased[1], 3),
        ],
        ["torque below which the estimate is not trusted and the feed does not rise [N m]", f"{1e-3 * e.light:.3g}"],
        ["share of the cutting time below that torque [%]", f"{100.0 * e.light_share:.3g}"],
    ]
    return [
        "<h2>Torque estimate from the spindle</h2>",
        table(("", ""), rows, numbers=(1,)),
        f"<p>Do not trust torques below {number_text(1e-3 * e.light, 3)} N m"
        f"; changes within {3e3 * e.lag:.3g} ms; speeds other than the programmed one, for which the idle current is "
        "not stated.</p>",
        figure("measured", drawn.measured_torque_figure(outcome), figures),
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
        '<p class="note">Triangular sets, minimum, maximum and centroid. The output changes the trim: the share of '
        "the limit that the model may use.</p>",
        table(head, rows),
        figure("surface", drawn.answers(fuzzy), figures),
    ]
