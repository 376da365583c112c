"""Compliance and natural modes of a cutter as a beam, of a clamped plate and of a clamped part."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from chipload.api.mechanics.cut import Floats, read_only, straight_cutter
from chipload.api.values import AnyCutter
from chipload.checking.clamped import Workpiece, elastic_of, placed_clamps, stock_cells
from chipload.checking.workpiece import Stock
from chipload.cutter.cutter import Cutter
from chipload.cutter.table import CutterTable
from chipload.errors import InputError
from chipload.lazy import trimesh
from chipload.ranges import number_field, require_ranges
from chipload.stock.layers import LayeredStock
from chipload.structure import beam
from chipload.structure import modes as solid_modes
from chipload.structure.cells.vibration import vibration_modes
from chipload.structure.cells.workpiece import CellWorkpiece, cell_workpiece, displacements, mode_weights
from chipload.structure.grid import plate
from chipload.structure.places import MeshPlaces, on_side, weights
from chipload.structure.solid import Factored, SolidWorkpiece, factorise, loads

#: edges of a plate and sides of its mesh
EDGES = {"left": "i-", "right": "i+", "bottom": "j-", "top": "j+"}
#: MPa in 1 GPa, t/mm^3 in 1 kg/m^3
PER_GPA, T_MM3 = 1000.0, 1e-12
#: kg in 1 t
KG_PER_T = 1000.0


@dataclass(frozen=True, kw_only=True)
class Plate:
    """A flat plate of constant thickness, clamped at some of its edges: x along its length, y along its height.

    Parameters
    ----------
    length_mm, height_mm, thickness_mm : of the plate
    modulus_gpa, poisson : Young's modulus, 0.1 to 2000, and Poisson's ratio, 0 to below 0.5
    density_kg_m3 : 100 to 30,000; natural modes need it
    clamped : edges that are clamped, of ``left``, ``right``, ``bottom`` and ``top``
    elements : of the mesh along length, height and thickness, hexahedra of 20 nodes

    Raises
    ------
    InputError
        A number is out of range, or an edge is unknown.

    Examples
    --------
    >>> Plate(length_mm=100, height_mm=40, thickness_mm=2, modulus_gpa=70, poisson=0.3).clamped
    ('bottom',)
    """

    length_mm: float = number_field(above=0.0)
    height_mm: float = number_field(above=0.0)
    thickness_mm: float = number_field(above=0.0)
    modulus_gpa: float = number_field(least=0.1, most=2000.0)
    poisson: float = number_field(least=0.0, below=0.5)
    density_kg_m3: float | None = number_field(None, least=100.0, most=30_000.0)
    clamped: tuple[str, ...] = ("bottom",)
    elements: tuple[int, int, int] = (20, 12, 1)

    def __post_init__(self) -> None:
        """Refuse numbers out of range and unknown edges."""
        require_ranges(self, "plate.")
        unknown = [edge for edge in self.clamped if edge not in EDGES]
        if unknown or not self.clamped:
            found = repr(unknown[0]) if unknown else "()"
            raise InputError(f"plate.clamped = {found}: must be one or more of {', '.join(EDGES)}")
        if len(self.elements) != 3 or min(self.elements) < 1:
            raise InputError(f"plate.elements = {self.elements}: must be three whole numbers of at least 1")


@dataclass(frozen=True, eq=False)
class ClampedPart:
    """A part of any shape in its clamps.

    Parameters
    ----------
    stock : the body: a block, a closed mesh with ``layer_mm``, or layers
    workpiece : elastic properties and clamps; ``cell_mm`` is required

    Raises
    ------
    InputError
        ``cell_mm`` or ``layer_mm`` is missing.
    """

    stock: Stock
    workpiece: Workpiece

    def __post_init__(self) -> None:
        """Refuse a body or cells of no stated fineness."""
        if self.workpiece.cell_mm is None:
            raise InputError("part.workpiece.cell_mm: missing: state the side of the cells")
        if isinstance(self.stock.body, trimesh.Trimesh) and self.stock.layer_mm is None:
            raise InputError("part.stock.layer_mm: missing: state the thickness of the layers of a mesh")


@dataclass(frozen=True, eq=False)
class NaturalModes:
    """Lowest natural modes of a clamped body.

    Parameters
    ----------
    frequency_hz : (k,) float, rising
    shape_per_root_kg : (k, p, 3) float, displacement of each mode at the points, with a modal mass of 1 kg. The modal
        stiffness at a point along d is (2 pi f)^2 / (shape . d)^2 in N/m; its sign is free
    """

    frequency_hz: Floats
    shape_per_root_kg: Floats


def compliance(
    body: AnyCutter | Plate | ClampedPart, force_at_mm: ArrayLike, point_at_mm: ArrayLike | None = None
) -> Floats:
    """Return the displacement at points of a body for each newton of a force, [um/N].

    A cutter is a stepped cantilever that is clamped at the holder, C(a, b) = integral of (z - a)(z - b) / (E I) in
    closed form; its fluted part has the diameter ``fluted_factor`` (0.8 unless stated) times that of the teeth. A plate
    is meshed with hexahedra of 20 nodes; under a point force its displacement grows by about 1 / (E h) as the elements
    of the size h are refined. A part is divided into cells of any share of material, and a force on it is spread over a
    contact line. All calls factor the body once for all places: give them in one call.

    Parameters
    ----------
    body : a cutter, a :class:`chipload.Plate` or a :class:`chipload.ClampedPart`
    force_at_mm : where the force acts. Cutter: (n,) float, heights above the tip, from 0 to the overhang. Plate: (n, 2)
        float, x and y on the face. Part: (n, 2, 3) float, lower and upper end of a contact line
    point_at_mm : where the displacement is calculated; cutter (n,), plate (n, 2), part (n, 3). None: at the force, for
        a part in the middle of the line

    Returns
    -------
    float [um/N]
        Cutter: (n,), across the axis. Plate: (n,), normal to the face. Part: (n, 3, 3), displacement along x, y, z
        (first) for forces along x, y, z.

    Raises
    ------
    InputError
        A place does not lie on the body, shapes do not agree, or the body is not clamped.

    References
    ----------
    [Altintas2012] ch. 2 and [Kops1990] for the cutter, [Zienkiewicz2005] for the plate, [Parvizian2007] for the part.

    Examples
    --------
    A plain bar, d 10, l 30, E 600 GPa, loaded at the tip: l^3 / (3 E I) = 27000 / (3 * 600000 * 490.874) mm/N.

    >>> import chipload
    >>> bar = chipload.Cutter(diameter_mm=10, flutes=4, helix_deg=0, flute_length_mm=30, overhang_mm=30,
    ...                       modulus_gpa=600, fluted_factor=1.0)
    >>> compliance(bar, [0.0]).round(5).tolist()
    [0.03056]
    """
    if isinstance(body, Plate):
        return _of_plate(body, force_at_mm, point_at_mm)
    if isinstance(body, ClampedPart):
        return _of_part(body, force_at_mm, point_at_mm)
    _require_cutter(body, "compliance")
    at = np.atleast_1d(np.asarray(force_at_mm, dtype=np.float64))
    point = at if point_at_mm is None else np.atleast_1d(np.asarray(point_at_mm, dtype=np.float64))
    if at.ndim != 1 or point.shape != at.shape:
        raise InputError(f"compliance: force_at_mm {at.shape}, point_at_mm {point.shape}: must be (n,) both")
    return read_only(1000.0 * beam.compliance(straight_cutter(body), at, point))


def modes(body: Plate | ClampedPart, count: int = 4, points_mm: ArrayLike = ()) -> NaturalModes:
    """Return the lowest natural modes of a clamped plate or part, K x = w^2 M x.

    Parameters
    ----------
    body : a :class:`chipload.Plate` or a :class:`chipload.ClampedPart`, with its density
    count : number of modes k, at least 1
    points_mm : where the shapes are calculated; plate (p, 2) float, x and y on the face, part (p, 3) float; none:
        frequencies alone

    Returns
    -------
    NaturalModes

    Raises
    ------
    InputError
        The density is missing, the body is not clamped, or a point does not lie on it. The modes of a cutter in its
        holder are measured: see ``chipload tap``.

    References
    ----------
    [Zienkiewicz2005] for the plate, [Parvizian2007] for the part.

    Examples
    --------
    A cantilever 100 long and 4 thick, of steel: f = 1.8751^2 / (2 pi l^2) sqrt(E t^2 / (12 rho)) = 334 Hz, less 0.1 %
    for shear.

    >>> strip = Plate(length_mm=10, height_mm=100, thickness_mm=4, modulus_gpa=210, poisson=0.0, density_kg_m3=7850,
    ...               elements=(1, 10, 1))
    >>> round(float(modes(strip, 1).frequency_hz[0]))
    334
    """
    if isinstance(body, Plate):
        if body.density_kg_m3 is None:
            raise InputError("plate.density_kg_m3: missing: natural modes need the mass of the plate")
        factored = _factor_mesh(body)
        frequency, nodes = solid_modes.modes(factored, count)
        found = weights(factored.solid.grid, _on_face(body, factored, _points(points_mm, 2)))
        shape = np.einsum("pn,knc->kpc", found.toarray(), nodes)
    elif isinstance(body, ClampedPart):
        work = _cells(body)
        each = vibration_modes(work, count)
        at = mode_weights(work, _points(points_mm, 3)) if np.size(points_mm) else np.zeros((0, len(work.modes)))
        frequency, shape = each.frequency, (at @ each.shapes.reshape(len(work.modes), -1)).reshape(-1, 3, count)
        shape = np.moveaxis(shape, 2, 0)
    else:
        raise InputError(
            f"modes: {type(body).__name__}: give a chipload.Plate or a chipload.ClampedPart; those of a cutter in its "
            "holder are measured: chipload tap"
        )
    return NaturalModes(read_only(frequency), read_only(shape / np.sqrt(KG_PER_T)))


def _require_cutter(body: object, what: str) -> None:
    if not isinstance(body, (Cutter, CutterTable)):
        raise InputError(
            f"{what}: {type(body).__name__}: give a chipload.Cutter, a chipload.Plate or a chipload.ClampedPart"
        )


def _points(points_mm: ArrayLike, columns: int) -> Floats:
    """Return points (p, columns); none of them is (0, columns)."""
    points = np.asarray(points_mm, dtype=np.float64)
    if points.size == 0:
        return np.zeros((0, columns))
    if points.ndim != 2 or points.shape[1] != columns or not np.isfinite(points).all():
        raise InputError(f"points of shape {points.shape}: must be (n, {columns}) finite numbers in mm")
    return points


# -- plate ------------------------------------------------------------------------------------------------------
def _factor_mesh(body: Plate) -> Factored:
    """Return the mesh of a plate, factored; a density that is not stated has no effect on its stiffness."""
    grid = plate(body.length_mm, body.height_mm, body.thickness_mm, body.elements)
    fixed = np.unique(np.concatenate([grid.side(EDGES[edge]) for edge in body.clamped]))
    density = T_MM3 * (1000.0 if body.density_kg_m3 is None else body.density_kg_m3)
    return factorise(SolidWorkpiece(grid, PER_GPA * body.modulus_gpa, body.poisson, density, fixed))


def _on_face(body: Plate, factored: Factored, points: Floats) -> MeshPlaces:
    """Return places on the face at z = thickness."""
    size = np.array([body.length_mm, body.height_mm])
    off = np.flatnonzero(((points < 0.0) | (points > size)).any(axis=1))
    if len(off):
        x, y = points[off[0]]
        raise InputError(
            f"point {off[0]} ({x:g}, {y:g}) mm: must lie on the plate, x from 0 to {size[0]:g}, y from 0 to {size[1]:g}"
        )
    return on_side(factored.solid.grid, "k+", *(points / size).T)


def _of_plate(body: Plate, force_at_mm: ArrayLike, point_at_mm: ArrayLike | None) -> Floats:
    force = _points(force_at_mm, 2)
    point = force if point_at_mm is None else _points(point_at_mm, 2)
    if len(point) != len(force):
        raise InputError(f"compliance: {len(force)} forces and {len(point)} points: must be as many")
    factored = _factor_mesh(body)
    normals = np.tile([0.0, 0.0, 1.0], (len(force), 1))
    acting, seen = (loads(factored, _on_face(body, factored, at), normals).toarray() for at in (force, point))
    return read_only(1000.0 * np.einsum("fp,fp->p", seen, factored.solve(acting)))


# -- part -------------------------------------------------------------------------------------------------------
def _cells(body: ClampedPart) -> CellWorkpiece:
    """Return a part in its cells, factored."""
    stock, cell = body.stock, body.workpiece.cell_mm
    if cell is None:
        raise InputError("part.workpiece.cell_mm: missing: state the side of the cells")
    if isinstance(stock.body, LayeredStock):
        layers = stock.body
    elif isinstance(stock.body, trimesh.Trimesh):
        layers = LayeredStock.of_mesh(stock.body, stock.layer_mm or cell, float(stock.body.extents.max()))
    else:
        low, high = stock.body
        layers = LayeredStock.block(
            low, high, stock.layer_mm or high[2] - low[2], max(high[0] - low[0], high[1] - low[1])
        )
    grid = stock_cells(layers, cell, body.workpiece.order)
    return cell_workpiece(layers, grid, elastic_of(body.workpiece), placed_clamps(body.workpiece, layers))


def _of_part(body: ClampedPart, force_at_mm: ArrayLike, point_at_mm: ArrayLike | None) -> Floats:
    lines = np.asarray(force_at_mm, dtype=np.float64)
    if lines.ndim != 3 or lines.shape[1:] != (2, 3) or not np.isfinite(lines).all():
        raise InputError(f"compliance: force_at_mm of shape {lines.shape}: must be (n, 2, 3), ends of contact lines")
    points = lines.mean(axis=1) if point_at_mm is None else _points(point_at_mm, 3)
    if len(points) != len(lines):
        raise InputError(f"compliance: {len(lines)} forces and {len(points)} points: must be as many")
    work = _cells(body)
    return read_only([1000.0 * displacements(work, line, at)[0] for line, at in zip(lines, points, strict=True)])
