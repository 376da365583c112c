"""The reader of DXF drawings, which returns contours of lines and arcs in mm.

Notation: OCS the frame of a flat entity, WCS that of the drawing; an entity with the extrusion (0, 0, -1) is seen from
below: its x is mirrored and its arcs are reversed. Bulge = tan(sweep / 4). Splines and ellipses become biarcs.

Reference: Autodesk, DXF Reference, group codes of the ENTITIES section.
"""

from __future__ import annotations

import logging
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from chipload.errors import Finding, InputError
from chipload.files import is_file, open_regular
from chipload.geometry.biarc import arcs_along
from chipload.geometry.chains import Drawing, chain_parts
from chipload.geometry.contour import JOIN_MM, Contour, Floats
from chipload.units import MM_PER

#: unit of each value of $INSUNITS in the header
INSUNITS = {1: "inch", 2: "foot", 4: "mm", 5: "cm", 6: "m", 13: "um"}
#: largest file that is read [bytes]
LARGEST_FILE = 500_000_000
#: entities that are curves; all others are dropped and reported
DRAWN = ("LINE", "ARC", "CIRCLE", "LWPOLYLINE", "POLYLINE", "SPLINE", "ELLIPSE")
#: greatest range of z of a flat entity [units of the drawing]
FLAT = 1e-6
_ENTITY = re.compile(
    rb"\n[ \t]*0[ \t]*\r?\n[ \t]*(?:LINE|ARC|CIRCLE|LWPOLYLINE|POLYLINE|VERTEX|SPLINE|ELLIPSE|INSERT|POINT|TEXT|MTEXT|"
    rb"3DFACE|SOLID|HATCH)[ \t]*\r?(?=\n)"
)
_POINT = re.compile(rb"\n[ \t]*10[ \t]*\r?(?=\n)")


def read_dxf(
    path: str | Path,
    *,
    units: str | None = None,
    units_if_unstated: str | None = None,
    layers: Sequence[str] | None = None,
    join_mm: float = 0.01,
    tolerance_mm: float = 0.001,
    max_entities: int = 200_000,
) -> Drawing:
    """Contours of the model space of a DXF file; the lines of each layer are joined separately.

    Parameters
    ----------
    path : the file, text or binary DXF
    units : unit of the numbers (``mm``, ``inch`` ...), whatever the header states; a disagreement is a finding
    units_if_unstated : unit where the header names none
    layers : names of the layers to read, ignoring case; by default all layers that are neither off nor frozen
    join_mm : widest gap [mm] that is closed
    tolerance_mm : greatest deviation [mm] of the arcs from a spline or an ellipse
    max_entities : greatest number of entities that are read

    Returns
    -------
    Drawing in mm. Blocks are exploded. Text, dimensions, points and other entities are dropped with a finding.

    Raises
    ------
    InputError
        The file is missing, is no DXF, is too large, has no such layer, no geometry, no unit, an entity that is not
        parallel to the XY plane, or a number that is not finite.

    Examples
    --------
    The corner of the example ``contour``: one open contour.

    >>> from importlib.resources import files
    >>> drawing = read_dxf(files("chipload") / "examples" / "contour" / "corner.dxf", units_if_unstated="mm")
    >>> [contour.closed for contour in drawing.contours]
    [False]
    """
    file = Path(path)
    if not (np.isfinite(tolerance_mm) and tolerance_mm > 0.0):
        raise InputError(f"part.tolerance_mm = {tolerance_mm:g}: must be a finite number above 0")
    for key, value in (("part.units", units), ("part.units_if_unstated", units_if_unstated)):
        if value is not None and value not in MM_PER:
            raise InputError(f"{key} = {value!r}: must be one of {', '.join(MM_PER)}")
    _scan(file, max_entities)
    findings: list[Finding] = []
    doc = _load(file, findings)
    unit = _unit(doc, file, units, units_if_unstated, findings)

    skipped: Counter[str] = Counter()
    parts: dict[str, list[Floats]] = {}
    table = list(_sound(doc.layers, findings))
    known = {str(layer.dxf.get("name", "0")) for layer in table}
    hidden, left_out = _hidden(table), Counter[str]()
    wanted = None if layers is None else {name.casefold() for name in layers}
    drawn = _Reader(file, MM_PER[unit], tolerance_mm)
    for count, (entity, layer) in enumerate(_entities(_modelspace(doc, file), None, findings)):
        if count >= max_entities:
            raise InputError(_too_many(file, f"more than {max_entities}", max_entities))
        known.add(layer)
        if entity is None:
            continue
        if wanted is not None and layer.casefold() not in wanted:
            continue
        if wanted is None and layer.casefold() in hidden:
            left_out[layer] += 1
            continue
        rows = drawn.rows(entity, layer, findings)
        if rows is not None and len(rows):
            parts.setdefault(layer, []).append(rows)
        elif rows is None:
            skipped[f"{entity.dxftype()} on layer {layer!r}"] += 1
    names = ", ".join(sorted(known)) or "none"
    if layers is not None:
        for name in layers:
            if name.casefold() not in {k.casefold() for k in known}:
                raise InputError(f"part.layers: no layer {name!r} in {file.name}; layers there are: {names}")
    findings += [Finding("dxf-skipped", 0, f"{n} {what} dropped: not a line") for what, n in sorted(skipped.items())]

    findings += _left_out(left_out, hidden)

    contours: list[Contour] = []
    owner: list[str] = []
    for layer, rows_of in parts.items():
        made, seen = chain_parts(rows_of, join_mm, f"layer {layer!r}: ")
        contours += made
        owner += [layer] * len(made)
        findings += seen
    if not contours:
        on = "" if layers is None else f" on {', '.join(layers)}"
        layouts = _sound(doc.layouts, findings)
        sheets = [layout.name for layout in layouts if layout.name != "Model" and len(layout) > 1]
        also = f"; the sheets {', '.join(sheets)} are not read, only the model space" if sheets else ""
        also += f"; {', '.join(sorted(left_out))} off or frozen, read if part.layers names them" if left_out else ""
        raise InputError(f"part.file = {file.name}: no lines or arcs{on}; layers there are: {names}{also}")
    return Drawing(tuple(contours), tuple(owner), unit, tuple(findings))


def _hidden(layers: Sequence[Any]) -> dict[str, str]:
    """Names of the layers that are hidden, in lower case, each with `off` or `frozen`."""
    out = {}
    for layer in layers:
        how = "off" if layer.is_off() else "frozen" if layer.is_frozen() else ""
        if how:
            out[str(layer.dxf.get("name", "0")).casefold()] = how
    return out


def _left_out(count: Counter[str], hidden: dict[str, str]) -> Iterator[Finding]:
    """A finding for each hidden layer whose entities were not read."""
    for layer, n in sorted(count.items()):
        what = f"layer {layer!r} is {hidden[layer.casefold()]}: {n} entit{'y' if n == 1 else 'ies'} not read"
        yield Finding("dxf-hidden", 0, f"{what}; part.layers = [{layer!r}] reads it")


def _too_many(file: Path, count: str, most: int, what: str = "entities") -> str:
    return f"part.file = {file.name}: {count} {what}: must be at most {most}; keep only the part there"


def _scan(file: Path, max_entities: int) -> None:
    """Refuse a file that is missing, is not DXF or is too large, without parsing it."""
    if not is_file(file):
        raise InputError(f"part.file = {file}: no such file")
    entities = points = 0
    started = False
    tail = b""
    with open_regular(file, f"part.file = {file.name}", LARGEST_FILE, "keep only the part there") as stream:
        while block := stream.read(1 << 22):
            data = tail + block
            if not started:
                if data[:18] == b"AutoCAD Binary DXF":
                    return
                if b"SECTION" not in data or b"\0" in data[:4096]:
                    raise InputError(f"part.file = {file.name}: not a DXF drawing")
                started = True
            # a match across two blocks is counted with the later block
            cut = data.rfind(b"\n", 0, max(len(data) - 64, 0)) if len(block) == 1 << 22 else len(data)
            cut = len(data) if cut < 0 else cut
            entities += sum(1 for m in _ENTITY.finditer(data) if m.start() < cut)
            points += sum(1 for m in _POINT.finditer(data) if m.start() < cut)
            tail = data[cut:]
    if not started:
        raise InputError(f"part.file = {file.name}: the file is empty")
    if entities > max_entities:
        raise InputError(_too_many(file, str(entities), max_entities))
    if points > 5 * max_entities:
        raise InputError(_too_many(file, str(points), 5 * max_entities, "points"))


def _load(file: Path, findings: list[Finding]) -> Any:
    """The ezdxf document; a damaged file is recovered."""
    import ezdxf
    from ezdxf import recover

    logging.getLogger("ezdxf").addHandler(logging.NullHandler())
    # on a damaged file the parser also raises errors that are not its own
    try:
        return ezdxf.readfile(file)
    except Exception as err:
        first = _line(err)
    try:
        doc, auditor = recover.readfile(file)
    except Exception as err:
        raise InputError(f"part.file = {file.name}: not a DXF drawing that can be read: {_line(err)}") from err
    repairs = len(auditor.errors) + len(auditor.fixes)
    findings.append(Finding("dxf-recovered", 0, f"the file is damaged ({first}); read with {repairs} repairs"))
    return doc


def _modelspace(doc: Any, file: Path) -> Any:
    try:
        return doc.modelspace()
    except Exception as err:  # errors of the parser have several base classes
        raise InputError(f"part.file = {file.name}: damaged: no model space: {_line(err)}") from None


def _line(err: Exception) -> str:
    text = " ".join(str(err).split()) or type(err).__name__
    return text[:120].rstrip(".")


def _unit(doc: Any, file: Path, units: str | None, if_unstated: str | None, findings: list[Finding]) -> str:
    try:
        code = int(doc.header.get("$INSUNITS", 0) or 0)
    except Exception:  # errors of the parser have several base classes
        code = 0
    stated = INSUNITS.get(code)
    if units is not None:
        if stated is not None and stated != units:
            text = f"the header states {stated}; read as {units}, as part.units states"
            findings.append(Finding("dxf-units", 0, text))
        return units
    if stated is not None:
        return stated
    if code != 0:
        raise InputError(f"part.file = {file.name}: $INSUNITS = {code} is not read: state part.units")
    if if_unstated is None:
        raise InputError(
            f"part.file = {file.name}: the header names no unit: state part.units_if_unstated or part.units"
        )
    findings.append(Finding("dxf-units", 0, f"the header names no unit: read as {if_unstated}"))
    return if_unstated


def _entities(space: Any, inside: str | None, findings: list[Finding], depth: int = 0) -> Iterator[tuple[Any, str]]:
    """Entities with their layers; None stands for a reference to a block, so that references are counted too.

    Entities of a block on layer 0 belong to the layer of the reference.
    """
    for entity in _sound(space, findings):
        try:
            layer = str(entity.dxf.get("layer", "0"))
            layer = inside if inside is not None and layer == "0" else layer
            is_block = entity.dxftype() == "INSERT" and depth < 16
            repeated = entity.multi_insert() if is_block and entity.mcount > 1 else (entity,)
        except Exception as err:
            findings.append(Finding("dxf-skipped", 0, f"an entity is damaged, dropped: {_line(err)}"))
            continue
        if is_block:
            for reference in _sound(repeated, findings):
                yield None, layer
                yield from _entities(reference.virtual_entities(), layer, findings, depth + 1)
        else:
            yield entity, layer


def _sound(entities: Any, findings: list[Finding]) -> Iterator[Any]:
    """Entities up to the first on which the parser fails; a finding reports that the rest is dropped."""
    remaining = iter(entities)
    while True:
        try:
            entity = next(remaining)
        except StopIteration:
            return
        except Exception as err:
            findings.append(Finding("dxf-skipped", 0, f"a block is damaged, its rest is dropped: {_line(err)}"))
            return
        yield entity


class _Reader:
    """Conversion of entities to rows of segments in mm."""

    def __init__(self, file: Path, mm: float, tolerance_mm: float) -> None:
        self.file, self.mm, self.tolerance_mm = file, mm, tolerance_mm

    def rows(self, entity: Any, layer: str, findings: list[Finding]) -> Floats | None:
        """(n, 7) segments [mm] of an entity, n = 0 if it has no length; None if it is not a curve."""
        kind = entity.dxftype()
        if kind not in DRAWN or (kind == "POLYLINE" and not (entity.is_2d_polyline or entity.is_3d_polyline)):
            return None
        what = f"part.file = {self.file.name}: {kind} on layer {layer!r}"
        try:
            made = getattr(self, "_" + kind.lower())(entity, what)
        except InputError:
            raise
        except Exception as err:  # errors of the parser, and those that damaged values cause
            findings.append(Finding("dxf-skipped", 0, f"{kind} on layer {layer!r} is damaged, dropped: {_line(err)}"))
            return np.zeros((0, 7))
        if made is None:
            findings.append(Finding("dxf-empty", 0, f"{kind} on layer {layer!r} has no length, dropped"))
            return np.zeros((0, 7))
        rows = np.array(made, dtype=np.float64).reshape(-1, 7)
        if not np.isfinite(rows).all():
            raise InputError(f"{what} has a coordinate that is not a finite number")
        return rows

    def _flat(self, points: Sequence[Any], what: str) -> Floats:
        """(n, 2) points [mm] of an entity; refuses points that are not at one height."""
        p = np.array([tuple(q) for q in points], dtype=np.float64).reshape(-1, 3)
        if not np.isfinite(p).all():
            raise InputError(f"{what} has a coordinate that is not a finite number")
        if len(p) and np.ptp(p[:, 2]) > max(FLAT, 1e-9 * np.abs(p).max()):
            x, y = p[0, :2] * self.mm
            raise InputError(f"{what} at ({x:.6g}, {y:.6g}) is not parallel to the XY plane: a flat drawing is needed")
        return p[:, :2] * self.mm

    def _side(self, entity: Any, what: str) -> float:
        """1 if the entity is seen from above, -1 if from below."""
        e = np.array(tuple(entity.dxf.extrusion), dtype=np.float64)
        if not np.isfinite(e).all() or np.hypot(e[0], e[1]) > 1e-6 * abs(e[2]):
            raise InputError(
                f"{what} is not parallel to the XY plane (extrusion {e.tolist()}): a flat drawing is needed"
            )
        return 1.0 if e[2] > 0.0 else -1.0

    def _line(self, entity: Any, what: str) -> Any:
        p, q = self._flat([entity.dxf.start, entity.dxf.end], what)
        return [*p, *q, 0.0, 0.0, 0.0]

    def _circle(self, entity: Any, what: str) -> Any:
        side = self._side(entity, what)
        x, y = self._flat([entity.dxf.center], what)[0] * (side, 1.0)
        r = abs(float(entity.dxf.radius)) * self.mm
        return [x + r, y, x + r, y, x, y, 2.0 * np.pi] if r != 0.0 else None

    def _arc(self, entity: Any, what: str) -> Any:
        side = self._side(entity, what)
        x, y = self._flat([entity.dxf.center], what)[0]
        r = abs(float(entity.dxf.radius)) * self.mm
        a, b = np.radians([float(entity.dxf.start_angle), float(entity.dxf.end_angle)])
        sweep = (b - a) % (2.0 * np.pi)
        sweep = 2.0 * np.pi if sweep <= 1e-12 else sweep
        p, q = (x + r * np.cos(a), y + r * np.sin(a)), (x + r * np.cos(b), y + r * np.sin(b))
        if sweep >= 2.0 * np.pi - 1e-12:
            q = p
        return [side * p[0], p[1], side * q[0], q[1], side * x, y, side * sweep] if r != 0.0 else None

    def _lwpolyline(self, entity: Any, what: str) -> Any:
        v = np.array(entity.get_points("xyb"), dtype=np.float64).reshape(-1, 3)
        return self._rows_of_bulges(v, bool(entity.closed), self._side(entity, what), what)

    def _polyline(self, entity: Any, what: str) -> Any:
        # control points of a spline fit (flag 16) are not on the curve
        vertices = [v for v in entity.vertices if not v.dxf.flags & 16]
        p = self._flat([v.dxf.location for v in vertices], what) / self.mm
        flat = bool(entity.is_2d_polyline)
        b = [float(v.dxf.get("bulge", 0.0)) if flat else 0.0 for v in vertices]
        side = self._side(entity, what) if flat else 1.0
        return self._rows_of_bulges(np.column_stack([p, b]), bool(entity.is_closed), side, what)

    def _rows_of_bulges(self, v: Floats, closed: bool, side: float, what: str) -> Any:
        if not np.isfinite(v).all():
            raise InputError(f"{what} has a coordinate that is not a finite number")
        p = v[:, :2] * (side * self.mm, self.mm)
        ends = np.roll(p, -1, axis=0) if closed else np.vstack([p[1:], p[-1:]])
        if len(p) < 2 or np.hypot(*(ends - p).T).max() <= JOIN_MM:
            return None
        return Contour.from_bulges(p, side * v[:, 2], closed).segments

    def _ellipse(self, entity: Any, what: str) -> Any:
        self._side(entity, what)
        tool = entity.construction_tool()
        c, major, minor = (
            self._flat([x, (0, 0, x[2])], what)[0] for x in (tool.center, tool.major_axis, tool.minor_axis)
        )
        if max(np.hypot(*major), np.hypot(*minor)) <= JOIN_MM:
            return None
        a, b = float(tool.start_param), float(tool.end_param)
        b = a + 2.0 * np.pi if (b - a) % (2.0 * np.pi) <= 1e-12 else a + (b - a) % (2.0 * np.pi)

        def curve(t: float) -> tuple[Floats, Floats]:
            cos, sin = np.cos(t), np.sin(t)
            return c + cos * major + sin * minor, cos * minor - sin * major

        made = arcs_along(curve, np.linspace(a, b, max(3, 1 + int(np.ceil((b - a) / (np.pi / 4))))), self.tolerance_mm)
        return None if made is None else self._ring(made.segments, b - a >= 2.0 * np.pi - 1e-12)

    def _spline(self, entity: Any, what: str) -> Any:
        tool = entity.construction_tool()
        self._flat(tool.control_points, what)

        def curve(t: float) -> tuple[Floats, Floats]:
            p, d = tool.derivatives([t], 1).__next__()
            return np.array([p.x, p.y]) * self.mm, np.array([d.x, d.y]) * self.mm

        knots = np.unique(np.asarray(tool.knots(), dtype=np.float64))
        order = tool.order
        lo, hi = tool.knots()[order - 1], tool.knots()[-order]
        spans = knots[(knots >= lo) & (knots <= hi)]
        made = arcs_along(curve, spans, self.tolerance_mm)
        if made is None:
            return None
        ends = np.hypot(*(curve(lo)[0] - curve(hi)[0]))
        return self._ring(made.segments, bool(ends <= 1e-6))

    @staticmethod
    def _ring(seg: Floats, closed: bool) -> Floats:
        """Segments of a curve; the end of a closed curve is set to its start."""
        out = seg.copy()
        if closed:
            out[-1, 2:4] = out[0, 0:2]
        return out
