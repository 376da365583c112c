"""Drafts from FreeCAD documents: a CAM job becomes a simulation of its operations, a part alone a pocket or a wall.

Differs from FreeCAD's own posts: lengths are mm, feeds mm/s in the document; here they are written as mm/min.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from chipload.cutter.tool_bits import SPECIAL, special_shape
from chipload.errors import InputError
from chipload.geometry.brep import step_of_brep
from chipload.geometry.mesh import read_mesh
from chipload.jobs.drafts.comments import Box
from chipload.jobs.drafts.document import Document, DocumentObject, read_document
from chipload.jobs.drafts.draft import Draft, DraftTable, Entry
from chipload.jobs.drafts.drawing import draft_model
from chipload.jobs.drafts.program import Known, draft_program
from chipload.program.tool_words import Stated

_FEED = re.compile(r"\bF\s*([-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?)")
#: [mm] how far a triangle may leave a surface of the stock
CHORD_MM = 0.01
#: file next to the program: of which command of which operation each line is
ORIGINS = "program_lines.csv"
#: keys of a tool bit and of the ``[[cutter]]``
_BIT = (
    ("Diameter", "diameter_mm"),
    ("CuttingEdgeHeight", "flute_length_mm"),
    ("ShankDiameter", "shank_diameter_mm"),
)


def draft_freecad(file: Path, folder: Path, machine: str | None = None, job: str | None = None) -> Draft:
    """Return the draft of a job for a FreeCAD document.

    Parameters
    ----------
    job : name or label of the CAM job in the document; None: the first one

    Raises
    ------
    InputError
        The document cannot be read, holds neither a CAM job with paths nor a shape, or no CAM job of that name.
    """
    document = read_document(file)
    jobs = [o for o in document.objects.values() if "Stock" in o.properties and "Operations" in o.properties]
    if job is not None:
        known, jobs = jobs, [o for o in jobs if job in (o.name, o.label)]
        if not jobs:
            raise InputError(f"{file.name}: no CAM job {job}: has {', '.join(o.label for o in known) or 'none'}")
    if jobs:
        return _of_job(file, folder, document, jobs[0], machine)
    return _of_part(file, folder, document, machine)


def _of_job(file: Path, folder: Path, document: Document, job: DocumentObject, machine: str | None) -> Draft:
    controllers: dict[str, DocumentObject] = {}
    lines = ["(written from the operations of a FreeCAD document: mm, mm/min)", "G21 G90 G94 G17 G54"]
    origins: list[tuple[int, str, int]] = []
    now = ""
    for operation in _operations(document, job):
        controller = _controller(document, operation)
        commands = _commands(document, operation)
        if not commands or operation.properties.get("Active") is False:
            continue
        if controller is None:
            raise InputError(f"{file.name}: operation {operation.label}: has no tool controller")
        if controller.name != now:
            now = controller.name
            controllers[now] = controller
            number = int(controller.number("ToolNumber") or 0)
            speed = abs(controller.number("SpindleSpeed") or 0.0)
            turn = "M4" if controller.text("SpindleDir").lower().startswith("rev") else "M3"
            lines += [f"T{number} M6 ({_plain(controller.label)})", f"G43 H{number}"]
            if speed > 0.0:
                lines.append(f"S{speed:g} {turn}")
        lines.append(f"({_plain(operation.label)})")
        origins += [(len(lines) + k + 1, operation.name, k) for k in range(len(commands))]
        lines += commands
    if not controllers:
        raise InputError(
            f"{file.name}: job {job.label}: no operation has a path: recompute the job in FreeCAD and save"
        )
    text = "\n".join([*lines, "M5", "M2", ""])
    cutters = {
        int(c.number("ToolNumber") or 0): _cutter(document, c, file.name) for c in controllers.values()
    }  # fmt: skip
    known = Known(cutters, _stock(document, job, file.name), machine, text=text, origin=file.name)
    draft = draft_program(folder / "program.ngc", folder, known)
    rows = ["line,operation,command", *(f"{line},{name},{number}" for line, name, number in origins)]
    files = {"program.ngc": text.encode("ascii", "replace"), ORIGINS: ("\n".join(rows) + "\n").encode("utf-8")}
    return Draft(draft.title, draft.tables, draft.notes, files)


def _operations(document: Document, job: DocumentObject) -> list[DocumentObject]:
    group = document.objects.get(job.text("Operations"))
    names = group.properties.get("Group") if group is not None else None
    return [document.objects[n] for n in (names or []) if n in document.objects]


def _controller(document: Document, operation: DocumentObject) -> DocumentObject | None:
    """The tool controller of an operation, or of what a dress-up changes."""
    seen: set[str] = set()
    here: DocumentObject | None = operation
    while here is not None and here.name not in seen:
        seen.add(here.name)
        found = document.objects.get(here.text("ToolController"))
        if found is not None:
            return found
        here = document.objects.get(here.text("Base"))
    return None


def _commands(document: Document, operation: DocumentObject) -> list[str]:
    """A line for each command of an operation's path, feeds in mm/min."""
    path = operation.properties.get("Path")
    raw = path if isinstance(path, list) else []
    if isinstance(path, str) and path in document.parts:
        raw = document.parts[path].decode("utf-8", "replace").splitlines()
    out = []
    for line in raw:
        text = str(line).strip()
        if text and not text.startswith("("):
            text = re.sub(r"^G0*([01])\b", r"G\1", text)
            text = re.sub(r"\s*\bF\s*[-+.0-9eE]+", "", text) if text.startswith("G0 ") else text
            out.append(_FEED.sub(lambda hit: f"F{60.0 * float(hit[1]):.4f}", text))
        elif text:
            out.append(f"({_plain(text)})")
    return out


def _cutter(document: Document, controller: DocumentObject, name: str) -> Stated:
    """Return the values that the tool bit of a tool controller states."""
    bit = document.objects.get(controller.text("Tool"))
    if bit is None:
        return {}
    where = f"tool bit {bit.label} of {name}"
    out: Stated = {"name": (bit.label, where)}
    for key, own in _BIT:
        value = bit.number(key)
        if value is not None and 0.0 < value < 1e4:
            out[own] = (value, where)
    flutes = bit.number("Flutes")
    if flutes is not None and 1 <= flutes <= 200:
        out["flutes"] = (int(flutes), where)
    shape = (bit.text("ShapeName") or bit.text("ShapeID") or bit.text("ShapeType") or bit.text("BitShape")).lower()
    diameter = out.get("diameter_mm", (0.0, ""))[0]
    corner = next((v for k in ("TorusRadius", "CornerRadius") if (v := bit.number(k)) is not None), None)
    special = shape.removesuffix(".fcstd").rsplit("/", 1)[-1]
    if special in SPECIAL:
        shaped = {key: (value, where) for key, value in special_shape(special, bit.number, where).items()}
        if "body_mm" in shaped:
            out = {k: v for k, v in out.items() if k in ("name", "shank_diameter_mm")}
            shaped = {"body_mm": shaped["body_mm"]}
        out |= shaped
    elif "ball" in shape and diameter:
        out["corner_radius_mm"] = (0.5 * diameter, where)
    elif corner is not None and 0.0 < corner <= 0.5 * diameter:
        out["corner_radius_mm"] = (corner, where)
    material = bit.text("Material").lower()
    if material == "hss":
        out["modulus_gpa"] = (210.0, f"high-speed steel: {where}")
    elif material == "carbide":
        out["modulus_gpa"] = (580.0, f"carbide: {where}")
    return out


def _stock(document: Document, job: DocumentObject, name: str) -> tuple[Box, str] | None:
    """The box of the stock object: of its own numbers, or of its shape."""
    stock = document.objects.get(job.text("Stock"))
    if stock is None:
        return None
    where = f"stock of {name}"
    size = [stock.number(key) for key in ("Length", "Width", "Height")]
    place: Any = stock.properties.get("Placement")
    straight = isinstance(place, dict) and abs(abs(place["Q3"]) - 1.0) < 1e-9
    if all(s is not None and s > 0.0 for s in size) and straight:
        low = (place["Px"], place["Py"], place["Pz"])
        return (low, (low[0] + float(size[0] or 0), low[1] + float(size[1] or 0), low[2] + float(size[2] or 0))), where
    data = document.parts.get(stock.text("Shape"))
    if data is None:
        return None
    try:
        with TemporaryDirectory(prefix="chipload-") as folder:
            step = Path(folder) / "stock.step"
            step.write_bytes(step_of_brep(data, f"{name}: stock"))
            mesh = read_mesh(step, unit=None, key="stock", chord_mm=CHORD_MM)
    except InputError:
        return None
    # a stock that is not a box has more room in its box than material: a guess
    box = abs(float(mesh.volume) / float(np.prod(np.ptp(mesh.bounds, axis=0))) - 1.0) < 1e-6
    return (
        _corner(mesh.bounds[0]),
        _corner(mesh.bounds[1]),
    ), where if box else f"the box around the {where}, which is not a box"


def _corner(values: Iterable[float]) -> tuple[float, float, float]:
    x, y, z = (round(float(value), 6) for value in values)
    return x, y, z


def _of_part(file: Path, folder: Path, document: Document, machine: str | None) -> Draft:
    """The last shape that has faces, as STEP next to the job."""
    shown = [o for o in document.objects.values() if o.text("Shape") in document.parts]
    bodies = [o for o in shown if o.kind in ("PartDesign::Body", "App::Part")] or shown
    reason = "it holds no shape"
    for one in reversed(bodies):
        try:
            step = step_of_brep(document.parts[one.text("Shape")], f"{file.name}: {one.label}")
        except InputError as err:
            reason = str(err)
            continue
        with TemporaryDirectory(prefix="chipload-") as above:
            path = Path(above) / "part.step"
            path.write_bytes(step)
            made = draft_model(path, Path(above), machine)
        named = f"{one.label} of {file.name}"
        tables = tuple(
            DraftTable(t.name, tuple(_note_entry(e, named) for e in t.entries), t.repeated, t.note) for t in made.tables
        )
        title = made.title.replace("part.step", named)
        return Draft(title, tables, made.notes, {"part.step": step})
    raise InputError(f"{file.name}: neither a CAM job nor a part: {reason}")


def _note_entry(entry: Entry, named: str) -> Entry:
    if entry.key == "file" and entry.value == "part.step":
        return Entry("file", "part.step", named)
    return entry


def _plain(text: str) -> str:
    """A text as the comment of a program holds it."""
    kept = "".join(c if c.isprintable() and c.isascii() else "?" for c in text)
    return kept.replace("(", "[").replace(")", "]")[:80]
