"""Initial blanks of impeller programs, for display: the blank of their channel, and the cutters with holders."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.catalogue import CatalogueCutter
from chipload.cutter.cutter import Cutter
from chipload.jobs.impeller.names import finish_names, flank_names, rough_names
from chipload.jobs.impeller.outcome import ImpellerResult
from chipload.lazy import trimesh
from chipload.report.presentation import Blank

Floats = NDArray[np.float64]

#: a cutting part without end is drawn so long, of the outer diameter; a holder so long, of its diameter
ENDLESS, HOLDER = 0.4, 1.5
#: modulus [MPa] of a shape whose stiffness is not used
MODULUS = 2e5


def blanks_of(milled: ImpellerResult) -> dict[str, Blank]:
    """Cutter of every program, and the blank before each program of the partition that is milled.

    Stock is shown where the job roughs the channel, and of the channel beside the blade.
    """
    end = ENDLESS * milled.stated.outer_diameter
    out: dict[str, Blank] = {}
    done: dict[int, list[str]] = {}
    mesh: dict[int, trimesh.Trimesh | None] = {}
    for name, r in zip(rough_names(milled), milled.roughs or (), strict=True):
        channel = r.rough.index
        mesh.setdefault(channel, r.blank)
        earlier = done.setdefault(channel, [])
        out[name] = _blank(r.rough.cutter, r.rough.program.tool, end, mesh[channel], earlier)
        earlier.append(name)
    used = {id(p) for p in milled.programs or ()}
    earlier = done.get(0, [])
    for name, p in finish_names(milled):
        cut = earlier if id(p) in used and not name.startswith("way-") else None
        own = None if cut is None else mesh.get(0)
        out[name] = _blank(p.setting.cutter, p.setting.program.tool, end, own, cut or [])
        if cut is not None:
            cut.append(name)
    for name, f in flank_names(milled):
        out[name] = _blank(f.cutter, f.program.tool, end, None, [])
    return out


def _blank(
    cutter: CatalogueCutter, tool: NDArray[np.int64], end: float, mesh: trimesh.Trimesh | None, before: list[str]
) -> Blank:
    number = int(tool[0]) if len(tool) else 1
    shape = {number: drawn_parts(cutter, end)}
    return Blank(mesh, {number: cutting_part(cutter, end)}, shape, tuple(before))


def cutting_part(cutter: CatalogueCutter, end: float) -> Cutter:
    """The part that cuts, ``end`` [mm] long where it has no end."""
    if not cutter.straight:
        return cutter.shape
    length = end if cutter.cutting_length is None else cutter.cutting_length
    return Cutter(cutter.diameter, 1, 0.0, length, length, MODULUS, corner_radius=cutter.corner_radius)


def drawn_parts(cutter: CatalogueCutter, end: float) -> list[tuple[str, Floats]]:
    """Cutting part, neck, shank and holder as profiles of distance from the axis and height over the tip [mm].

    >>> parts = drawn_parts(CatalogueCutter(10.0, 1.0, 20.0, 8.0, 30.0, 10.0, 50.0, 40.0), 90.0)
    >>> [(kind, float(p[:, 1].min()), float(p[:, 1].max()), float(p[:, 0].max())) for kind, p in parts]
    [('flutes', 0.0, 20.0, 5.0), ('shank', 20.0, 30.0, 4.0), ('shank', 30.0, 50.0, 5.0), ('holder', 50.0, 110.0, 20.0)]
    """
    profile = cutting_part(cutter, end).profile(0.02)
    if profile[0, 0] > 0.0:
        profile = np.vstack([[0.0, profile[0, 1]], profile])
    out: list[tuple[str, Floats]] = [("flutes", profile)]
    top, reach = float(profile[-1, 1]), cutter.reach
    if cutter.cutting_length is not None:
        if cutter.neck_length is not None and cutter.neck_diameter is not None and cutter.neck_length > top:
            out.append(("shank", _cylinder(0.5 * cutter.neck_diameter, top, cutter.neck_length)))
            top = cutter.neck_length
        shank = cutter.top_diameter if cutter.shank_diameter is None else cutter.shank_diameter
        if (end if reach is None else reach) > top:
            out.append(("shank", _cylinder(0.5 * shank, top, end if reach is None else reach)))
    if reach is not None and cutter.holder_diameter is not None:
        wide = cutter.holder_diameter
        out.append(("holder", _cylinder(0.5 * wide, reach, reach + HOLDER * wide)))
    return out


def _cylinder(radius: float, low: float, high: float) -> Floats:
    return np.array([[0.0, low], [radius, low], [radius, high], [0.0, high]])
