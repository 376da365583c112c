"""FreeCAD documents (`.FCStd`) without FreeCAD: a ZIP of `Document.xml`, shapes and paths.

Notation: an object has a name, a type and properties; a property is one XML element, as ``Float`` with ``value`` or
``Link``. Read are numbers, texts, links, the placement, and the names of the files of shapes and paths.
"""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from chipload.arrays import UNREADABLE
from chipload.errors import InputError
from chipload.files import open_regular

#: [bytes] of the document, and of one file in it
LARGEST_FILE, LARGEST_PART = 500_000_000, 200_000_000


@dataclass(frozen=True)
class DocumentObject:
    """An object of a document: its name, type, and properties by name."""

    name: str
    kind: str
    properties: Mapping[str, Any]

    def number(self, key: str) -> float | None:
        """A property that is a finite number."""
        value = self.properties.get(key)
        return float(value) if isinstance(value, (int, float)) and not isinstance(value, bool) else None

    def text(self, key: str) -> str:
        """A property that is a text; empty where there is none."""
        value = self.properties.get(key)
        return value if isinstance(value, str) else ""

    @property
    def label(self) -> str:
        """The label that the user sees."""
        return self.text("Label") or self.name


@dataclass(frozen=True)
class Document:
    """A document: its objects by name in their order, and the files in it."""

    objects: Mapping[str, DocumentObject]
    parts: Mapping[str, bytes]


def read_document(path: Path) -> Document:
    """Read a document.

    Raises
    ------
    InputError
        The file cannot be read, is no such document, or is damaged.
    """
    with open_regular(path, path.name, LARGEST_FILE, "save the part alone") as stream:
        try:
            with zipfile.ZipFile(stream) as archive:
                names = [i for i in archive.infolist() if i.filename == "Document.xml" or _is_part_file(i.filename)]
                for info in names:
                    if info.file_size > LARGEST_PART:
                        raise InputError(f"{path.name}: {info.filename}: must be at most {LARGEST_PART} bytes")
                parts = {info.filename: archive.read(info) for info in names}
        except UNREADABLE as err:
            raise InputError(f"{path.name}: not a FreeCAD document: {str(err)[:100]}") from None
    text = parts.get("Document.xml")
    if text is None:
        raise InputError(f"{path.name}: not a FreeCAD document: it holds no Document.xml")
    if b"<!DOCTYPE" in text or b"<!ENTITY" in text:
        raise InputError(f"{path.name}: Document.xml: entities are not read")
    try:
        root = ElementTree.fromstring(text)
    except (ElementTree.ParseError, ValueError) as err:
        raise InputError(f"{path.name}: Document.xml: not XML: {err}") from None
    kinds = {o.get("name", ""): o.get("type", "") for o in root.iterfind("Objects/Object")}
    objects = {}
    for element in root.iterfind("ObjectData/Object"):
        name = element.get("name", "")
        values = {p.get("name", ""): _value(p) for p in element.iterfind("Properties/Property")}
        objects[name] = DocumentObject(name, kinds.get(name, ""), values)
    return Document(objects, parts)


def _is_part_file(name: str) -> bool:
    return name.lower().endswith((".brp", ".brep", ".nc", ".gcode"))


def _value(element: ElementTree.Element) -> Any:
    """The value of a property; None where it is of a kind that is not read."""
    inner = next(iter(element), None)
    if inner is None:
        return None
    tag = inner.tag
    try:
        if tag == "Float":
            return float(inner.get("value", "nan"))
        if tag == "Integer":
            if inner.get("CustomEnum") is not None:
                listed = [e.get("value", "") for e in element.iterfind("CustomEnumList/Enum")]
                return listed[int(inner.get("value", "0"))]
            return int(inner.get("value", "0"))
        if tag in ("Bool", "String", "Link"):
            value = inner.get("value", "")
            return value == "true" if tag == "Bool" else value
        if tag == "XLink":
            return inner.get("name", "")
        if tag in ("LinkList", "XLinkList"):
            return [e.get("value", e.get("name", "")) for e in inner.iterfind("*")]
        if tag == "PropertyPlacement":
            return {k: float(inner.get(k, "0")) for k in ("Px", "Py", "Pz", "Q0", "Q1", "Q2", "Q3")}
        if tag in ("Part", "Path"):
            return inner.get("file", "") or [c.get("gcode", "") for c in inner.iterfind("Command")]
    except (ValueError, IndexError, OverflowError):
        return None
    return None
