"""What is found in a model that is milled from above: pockets, walls and floors, in sentences."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np

from chipload.errors import ChiploadError
from chipload.geometry.mesh import read_mesh
from chipload.geometry.pocketed_part import Pocket, find_pockets, level_faces
from chipload.number_text import number_text
from chipload.stock.layers import LayeredStock
from chipload.structure.cells.thickness import thinnest_floor, thinnest_wall

#: [mm] greatest deviation of the facets of a model
CHORD = 0.01
#: longest side of a part over the thickest wall that is named
THICK = 12.0
#: [mm] walls and floors below which their deflection and distortion are named, and pockets that are listed
THIN, LISTED = 2.0, 8


def found_lines(file: Path, face_z: float, diameter: float) -> tuple[str, ...]:
    """Sentences on the pockets, walls and floors of a model, and on what a draft of one face leaves out.

    Parameters
    ----------
    face_z, diameter : [mm] height of the face that the draft clears, and its cutter
    """
    try:
        mesh = read_mesh(file, chord_mm=CHORD, key="part.file")
    except ChiploadError:
        # a model that is not closed still has faces to mill
        return ()
    pockets = find_pockets(mesh)
    if not pockets:
        return ()
    side = float(np.ptp(mesh.bounds, axis=0).max())
    stock = LayeredStock.of_mesh(mesh, level_faces(mesh), 2.0 * side)
    wall, floor = thinnest_wall(stock, side / 1000.0, side / THICK), thinnest_floor(stock, side / THICK)
    deepest = max(p.depth_mm for p in pockets)
    beside = f" beside pockets {number_text(deepest)} mm deep"
    out = [list_pockets(pockets)]
    thin = [
        f"{name} of {number_text(t, 2)} mm{more}"
        for name, t, more in (
            ("walls", wall, beside),
            ("a floor", floor, ""),
        )
        if t < side / THICK
    ]
    if thin:
        text = f"the part has {' and '.join(thin)}"
        if min(wall, floor) < THIN * (1.0 + 1e-3):
            text += ": simulate the program with [workpiece] for their deflection, and write a job with "
            text += "[residual_stress] for the distortion after release; this draft checks neither"
        out.append(text)
    tight = [p for p in pockets if abs(p.floor_mm - face_z) < 1e-3 and p.corner_mm < 0.5 * diameter * (1.0 - 1e-3)]
    if tight:
        least = min(p.corner_mm for p in tight)
        reach = "sharp corners" if least == 0.0 else f"corners of R {number_text(least, 3)} mm"
        after = "" if least == 0.0 else f": clear them with rest_of and a cutter below {number_text(2.0 * least, 3)} mm"
        out.append(f"the cutter of {diameter:g} mm leaves {reach}{after}")
    others = sorted({round(p.floor_mm, 3) for p in pockets if abs(p.floor_mm - face_z) >= 1e-3}, reverse=True)
    if others:
        heights = ", ".join(f"{z:g}" for z in others)
        out.append(
            f"floors at z = {heights} mm are not in this draft: copy it for each, with its face_z_mm and depth_mm"
        )
    return tuple(out)


def list_pockets(pockets: tuple[Pocket, ...]) -> str:
    """Pockets in a sentence, those that are alike together."""
    kinds = Counter(
        (round(p.floor_mm, 3), round(p.depth_mm, 3), "" if p.open else number_text(p.corner_mm, 2), p.open)
        for p in pockets
    )
    parts = []
    for (floor, depth, corner, is_open), count in list(kinds.items())[:LISTED]:
        text = f"{count} with the floor at z = {floor:g} mm, {depth:g} mm deep"
        shape = (
            "with an open side" if is_open else "with sharp corners" if corner == "0" else f"corners of R {corner} mm"
        )
        parts.append(f"{text}, {shape}")
    more = f"; {len(kinds) - LISTED} other kinds" if len(kinds) > LISTED else ""
    return f"{len(pockets)} pocket{'s' if len(pockets) > 1 else ''}: {'; '.join(parts)}{more}"
