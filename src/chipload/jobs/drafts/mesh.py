"""Drafts of jobs for a mesh (STL): the pockets of one floor, whose outline is written as a drawing beside the job."""

from __future__ import annotations

import io
import tempfile
from collections.abc import Sequence
from pathlib import Path

import shapely

from chipload.errors import InputError
from chipload.geometry.contour import Contour
from chipload.geometry.dxf import read_dxf
from chipload.geometry.mesh import read_mesh
from chipload.geometry.pocketed_part import Pocket, find_pockets
from chipload.jobs.drafts.draft import Draft, DraftTable, Entry
from chipload.jobs.drafts.drawing import axial_depth, cutter_for, machine_of, planned_tables
from chipload.jobs.drafts.found import list_pockets
from chipload.jobs.drafts.wheel import draft_wheel
from chipload.number_text import number_text

#: what a mesh without a pocket needs
REMEDY = (
    "export STEP or DXF, or post the program of your CAM and name the mesh in its job: [part] or [stock] file"
)  # fmt: skip
#: greatest distance [mm] of an outline from the edges of the facets: points along a straight edge go
STRAIGHT = 1e-4


def draft_mesh(file: Path, folder: Path, machine: str | None = None) -> Draft:
    """Return the draft of the blades of a wheel, or of the pockets of a mesh at the height with the largest floors.

    Raises
    ------
    InputError
        The mesh cannot be read or is not closed, or it has no pocket with closed sides.
    """
    if file.suffix.lower() != ".stl":
        raise InputError(f"{file}: a mesh of this kind has no faces or contours to plan from: {REMEDY}")
    wheel = draft_wheel(file, folder, machine)
    if wheel is not None:
        return wheel
    mesh = read_mesh(file, unit="mm", key="part.file")
    found = find_pockets(mesh)
    closed = [p for p in found if not p.open and p.floor_thickness_mm > 0.0]
    if not closed:
        raise InputError(f"{file}: no pocket with a level floor and closed sides to plan from: {REMEDY}")
    areas: dict[float, float] = {}
    for p in closed:
        areas[p.floor_mm] = areas.get(p.floor_mm, 0.0) + p.area_mm2
    level = max(areas, key=lambda z: areas[z])
    chosen = [p for p in closed if p.floor_mm == level]
    name = f"{file.stem}-floor.dxf"
    drawing = outline_drawing(chosen)
    size, area, narrow = cutter_for(_contours(drawing))
    depth = chosen[0].depth_mm
    axial = min(axial_depth(size), depth)
    sides = " x ".join(f"{side:.5g}" for side in mesh.extents)
    why = f"an STL file states no unit; the part is {sides} mm then"
    part = DraftTable(
        "part",
        (Entry("file", name, f"outline of the floor at z = {level:g} mm of {file.name}"),
         Entry("units", "mm", why, True)),
    )  # fmt: skip
    stock = DraftTable("stock", (Entry("top_mm", round(level + depth, 6), "the top of the mesh", True),))
    more = depth if depth > axial + 1e-3 else 0.0
    tables = planned_tables(machine_of(machine), machine, size, axial, "pocket", narrow=narrow, depth=more)
    return Draft(
        f"Clear the floor at z = {level:g} mm of {file.name}: {number_text(area)} mm2.",
        (part, stock, *tables),
        (list_pockets(found),),
        {name: drawing},
    )


def outline_drawing(pockets: Sequence[Pocket]) -> bytes:
    """The outlines of floors, and of what stands within them, as a drawing (DXF R12) in the plane of the floor."""
    from ezdxf.addons import r12writer

    text = io.StringIO()
    with r12writer(text) as drawing:
        for pocket in pockets:
            floor = pocket.outline.simplify(STRAIGHT)
            for ring in (floor.exterior, *floor.interiors):
                points = shapely.get_coordinates(ring)[:-1].round(6).tolist()
                drawing.add_polyline_2d(points, closed=True, layer="FLOOR")
    return text.getvalue().encode("ascii")


# -- parts ------------------------------------------------------------------------------------------------------
def _contours(drawing: bytes) -> Sequence[Contour]:
    """The contours of a drawing, as its job reads them."""
    with tempfile.TemporaryDirectory(prefix="chipload-") as folder:
        path = Path(folder) / "floor.dxf"
        path.write_bytes(drawing)
        return read_dxf(path, units="mm").contours
