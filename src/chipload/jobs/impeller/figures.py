"""Presentation of an impeller result: partitions, programs, and each surface with its map and its proof."""

from __future__ import annotations

from functools import partial
from html import escape

import numpy as np
import plotly.graph_objects as go

from chipload.jobs.impeller.blanks import blanks_of
from chipload.jobs.impeller.checks import program_sections
from chipload.jobs.impeller.contact_tables import contact_table
from chipload.jobs.impeller.outcome import ImpellerResult, Searched, for_all, largest, uncertified_text, unreached_text
from chipload.jobs.impeller.partitions import divided_sections
from chipload.jobs.impeller.programs import program_files
from chipload.jobs.impeller.result import failures_of
from chipload.jobs.impeller.scene import scene_bytes
from chipload.jobs.impeller.surface_figures import map_figure, ranges_figure, space_figure, table_figure
from chipload.planning.impeller.impeller import FILLET
from chipload.report.presentation import Presentation
from chipload.report.sheet import figure, items, table

#: contact points that are not reached which the report lists
LISTED = 40


def presentation_of(milled: ImpellerResult) -> Presentation:
    """The presentation of an impeller."""
    return Presentation(
        partial(_sections, milled), partial(scene_bytes, milled), partial(program_files, milled),
        partial(blanks_of, milled),
    )  # fmt: skip


def _sections(milled: ImpellerResult, figures: dict[str, go.Figure]) -> list[str]:
    body = [_overview(milled), *divided_sections(milled, figures), *program_sections(milled, figures)]
    for k, op in enumerate(milled.surfaces):
        body += _surface(k, op, figures)
    return body


def _overview(milled: ImpellerResult) -> str:
    rows = []
    for k, op in enumerate(milled.surfaces):
        one, n = op.one, len(op.place)
        d = op.answer.diameter[op.answer.cutter >= 0]
        rows.append(
            [
                str(k), escape(op.surface.name),
                f"{one.cutter.label}" if one else "none",
                f"{np.degrees(op.table.angle[one.table]):.6g}" if one else "",
                f"{d.min():g} to {d.max():g}", str(n), str(len(op.surface.scene.check)),
                _bad(len(op.answer.unreachable)), _bad(n - int(op.answer.certified.sum())), f"{op.search_s:.2f}",
            ]
        )  # fmt: skip
    head = ["", "surface", "one cutter for all [mm]", "table [deg]", "point by point, D [mm]", "contact points"]
    head += ["check points", "not reached", "not certified", "search [s]"]
    return f"<p>{escape(_sentence(for_all(milled)))}.</p>{table(head, rows, numbers=(3, 4, 5, 6, 7, 8, 9))}"


def _surface(k: int, op: Searched, figures: dict[str, go.Figure]) -> list[str]:
    out = [f"<h2>{escape(_sentence(op.surface.name))}</h2>", f"<p>{escape(_sentence(largest(op)))}.</p>"]
    if failures_of(op):
        out += ["<h3>Exceeded</h3>", items(failures_of(op))]
    out += [
        "<h3>The largest diameter over the surface</h3>",
        '<p class="note">For each contact point the largest cutter of the catalogue at any table and pallet angle.</p>',
        figure(f"map-{k}", map_figure(op), figures),
        "<h3>In space</h3>",
        f'<p class="note">{_space_note(op)}</p>',
        figure(f"space-{k}", space_figure(op), figures),
        "<h3>Table angle</h3>",
        '<p class="note">The largest cutter that mills every reachable contact point at a table angle. The dashed line '
        "is a proved limit: no cutter of that corner radius above it mills all of them.</p>",
        figure(f"table-{k}", table_figure(op), figures),
        "<h3>Contact points at three table angles</h3>",
        '<p class="note">Contact points on the middle line: the largest cutter of the catalogue at three table angles, '
        "and the widest range of pallet angles in which it is clear of every check point.</p>",
        table(*contact_table(op), numbers=(0, 1)),
        "<h3>Pallet angles</h3>",
        f'<p class="note">{_ranges_note(op)}</p>',
        figure(f"ranges-{k}", ranges_figure(op), figures),
        "<h3>The proof</h3>",
        *_proof(op),
        "<h3>Not certified</h3>",
        items(_open(op)),
    ]
    return out


def _space_note(op: Searched) -> str:
    if op.one is None:
        return "No one cutter mills all of it at one table angle: none is drawn."
    return (
        "The cutter stands where it has least room, the red check points stop a larger one there. Click a name to show "
        "or hide it."
    )


def _ranges_note(op: Searched) -> str:
    if op.one is None:
        return "Of each contact point's own largest cutter at its own table angle."
    c, alpha = op.one.cutter, np.degrees(op.table.angle[op.one.table])
    name = f"{c.label} mm"
    return f"Where {name} is clear at the table angle {alpha:.6g} deg, exact at both ends."


def _certified_between(op: Searched) -> str:
    """What is certified between the check points."""
    answer, covering = op.answer, op.surface.scene.covering
    if covering is None:
        return "Between the check points nothing is certified: no cutter has a corner radius."
    return (
        f"For {int(answer.certified.sum())} no wall lies deeper in the cutter than {covering.tolerance:g} mm between "
        f"the check points either, at any pallet angle of its ranges: {len(covering.points)} points cover the walls, "
        f"no point of a wall farther than {covering.reach:.3f} mm from one of them."
    )


def _proof(op: Searched) -> list[str]:
    answer = op.answer
    used = int(sum(len(b) for b in answer.blockers))
    text = (
        f"For {int(answer.bounded.sum())} of {len(op.place)} contact points it is proved that no larger cutter of "
        f"the catalogue goes at any of {len(answer.tables)} table angles and any pallet angle: the arcs of pallet "
        f"angle that a few check points forbid, found exactly, cover all of them. {used} check points do it for all "
        f"contact points together; proof.npz has them, with every bound. {_certified_between(op)}"
    )
    rows = []
    shown = [x for x in op.limiting if not op.one or x.corner_radius == op.one.cutter.corner_radius]
    for x in shown:
        least = (
            "any up to the catalogue's largest" if x.capped else "turned away" if x.most is None else f"{x.most:.3f}"
        )
        taken = op.one is not None and (x.corner_radius, x.table) == (op.one.cutter.corner_radius, op.one.table)
        names = sorted({_surface_name(op, i) for i in x.blockers})
        rows.append(
            (
                [
                    f"{x.corner_radius:g}", f"{np.degrees(op.table.angle[x.table]):.6g}", str(x.point), least,
                    "" if x.size is None else f"{x.size:g}", escape("; ".join(names)),
                    '<span class="ok">yes</span>' if x.certified else '<span class="no">no</span>',
                ],
                taken,
            )
        )  # fmt: skip
    head = ["r [mm]", "table [deg]", "tightest contact point", "none above D [mm]", "catalogue D [mm]"]
    head += ["what stops a larger one there", "proved"]
    out = [f"<p>{text}</p>", table(head, [r for r, _ in rows], numbers=(0, 1, 2, 3, 4), used=[t for _, t in rows])]
    if len(shown) < len(op.limiting):
        out.append('<p class="note">Other corner radii in summary.json.</p>')
    missed = answer.unreachable
    if missed:
        out += ["<h3>Not reached</h3>", items(unreached_text(op, u) for u in missed[:LISTED])]
        if len(missed) > LISTED:
            out.append(f'<p class="note">{len(missed) - LISTED} more in summary.json.</p>')
    return out


def _open(op: Searched) -> list[str]:
    s = op.settings
    out = [
        *([uncertified_text(op)] if uncertified_text(op) else []),
        "The faces at the tip and at the leading and trailing edge of a blade: sides, fillets and hub are walls, each "
        "with its edges.",
        "The upper rim of a cutting part over a narrower neck.",
        f"The rest of the surface: contact points lie at {s['along'][0]:g} to {s['along'][1]:g} along it and at "
        f"{s['up'][0]:g} to {s['up'][1]:g} up it; between contact points nothing is claimed.",
        "Fillets, fixtures, pallet and the machine's linear axes: they are not in this search.",
    ]
    if any(c.cutting_length is None for c in op.answer.catalogue.cutters):
        out.append(
            "Neck, shank and holder of catalogue cutters that state none: their cutting part is extended without end."
        )
    return out


def _surface_name(op: Searched, check: int) -> str:
    """What a check point lies on."""
    if check < 0:
        return "own curvature at the contact"
    number = int(op.surface.scene.check_surface[check])
    if number >= FILLET:
        return "a fillet"
    own, far = ("hub", "wall beyond") if op.surface.side == "floor" else ("own side", "facing side")
    names = {0: own, 1: far, 2: "wall" if op.surface.side == "floor" else "hub", 3: "other side of the own body"}
    return names.get(number, "bodies beyond")


def _bad(count: int) -> str:
    return f'<span class="no">{count}</span>' if count else "0"


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:]
