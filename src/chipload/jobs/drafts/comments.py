"""Reading of cutters, stock and material from the comments and headers of a program.

Read are the forms of common posts: comments about tools (:mod:`chipload.program.tool_comments`), Carbide Create
(``stockMin``), FeatureCAM's APT (``INSERT/14MM CRB 2FL 32 LOC``, ``CSI_SET_FLUTE_LENGTH``, ``INSERT/Stock Size``),
Heidenhain (``BLK FORM``), Sinumerik (``WORKPIECE``), CutViewer (``STOCK/BLOCK``), ``STOCK LOWER`` and ``UPPER``.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field

from chipload.cutter.barrel import tip_of_barrel
from chipload.cutter.bodies import Profile, apt_body
from chipload.cutter.cutter import Cutter
from chipload.errors import InputError
from chipload.program.apt.cutters import Shape, read_cutters
from chipload.program.tool_comments import stated_tools
from chipload.program.tool_words import Stated, describe_tool
from chipload.units import MM_PER

Box = tuple[tuple[float, float, float], tuple[float, float, float]]

_COMMENT = re.compile(r"\(([^()\n]*)\)|;([^\n]*)|^\s*(?:INSERT|PPRINT)\s*/?([^\n]*)", re.MULTILINE)
_NUMBER = r"([-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+))"
_BLK = re.compile(
    rf"BLK\s+FORM\s+0\.([12])\s+(?:[XYZ]\s+)?X\s*{_NUMBER}\s+Y\s*{_NUMBER}\s+Z\s*{_NUMBER}", re.IGNORECASE
)
_WORKPIECE = re.compile(r"WORKPIECE\s*\([^)]*\"(BOX|CYLINDER)\"([^)]*)\)", re.IGNORECASE)
#: radius, length and height of the top of a cylinder
_BLK_CYLINDER = re.compile(
    rf"BLK\s+FORM\s+CYLINDER\s+Z\s+R\s*{_NUMBER}\s+L\s*{_NUMBER}(?:\s+DIST\s*{_NUMBER})?", re.IGNORECASE
)
_STOCK_SIZE = re.compile(rf"Stock\s+Size\s+X{_NUMBER}\s*Y{_NUMBER}\s*Z{_NUMBER}", re.IGNORECASE)
#: Vectric: width, length and thickness
_MATERIAL_SIZE = re.compile(
    rf"Material\s+Size\s*\)?\s*\(?\s*X\s*=\s*{_NUMBER}\s*,?\s*Y\s*=\s*{_NUMBER}\s*,?\s*Z\s*=\s*{_NUMBER}", re.IGNORECASE
)
#: CutViewer: size of a block, and the program's zero from its lower corner
_BLOCK = re.compile(r"\(\s*STOCK/BLOCK\s*,([^()\n]*)\)", re.IGNORECASE)
#: by hand: size of the block; posts: its corners, ``STOCK LOWER X=.. Y=.. Z=..``
_SIDE = rf"\s*=?\s*{_NUMBER}\s*(MM|IN)?"
_SIDES = re.compile(rf"\bSTOCK\b[^()\n]*?\bDX{_SIDE}[ ,]*\bDY{_SIDE}[ ,]*\bDZ{_SIDE}", re.IGNORECASE)
#: by hand: length, width and height, ``STOCK 60 X 40 X 20``, ``(ROHTEIL: 100x80x20 MM)``
_BY_HAND = re.compile(
    r"[(;][^()\n]*?\b(?:STOCK|BLANK|BILLET|MATERIAL|MATL|ROHTEIL|RAW|BLOCK)\b(?:[\s:=-]|\b(?:SIZE|DIMENSIONS?|IS|MATERIAL|STOCK)\b)*"
    rf"{_NUMBER}\s*(MM|IN|\")?\s*[X*]\s*{_NUMBER}\s*(MM|IN|\")?\s*[X*]\s*{_NUMBER}\s*(MM|INCH|IN|\")?(?![0-9.])",
    re.IGNORECASE,
)
_AT = rf"\s*[=:]?\s*{_NUMBER}"
_BOUND = re.compile(rf"\bSTOCK\s+(LOWER|UPPER|MIN|MAX)\b[^()\n;]*?X{_AT}[ ,]+Y{_AT}[ ,]+Z{_AT}", re.IGNORECASE)
#: Carbide Create: corners of the stock
_CORNER = re.compile(r"\(\s*stock(Min|Max)\s*:([^()\n]*)\)", re.IGNORECASE)
#: what is said of a block whose size alone is stated
SIZE_ALONE = "the size that a comment states, with the program's zero on its top"
#: signs that a number is not an alloy: a date, a time, the name of a file or a program
_DATE = re.compile(
    r"\b(?:DATE|TIME|CREATED|OUTPUT|GENERATED|EXPORTED|POSTED|VERSION|COPYRIGHT|FILE|PROGRAM)\b|[0-9]{1,2}:[0-9]{2}|"
    r"(?:JAN|FEB|MAR|APR|MAY|JUN|JUL|AUG|SEP|OCT|NOV|DEC)[A-Z]*[ .-]|[0-9][-./][0-9]+[-./][0-9]",
    re.IGNORECASE,
)
#: a comment about a tool, and one in which a number may be an alloy
_OF_TOOL = re.compile(r"^\W*T\s*[0-9]|\bTOOL|HIGH.SPEED|\bHSS\b|MILL\b|DRILL", re.IGNORECASE)
_ALLOY = re.compile(
    r"MATERIAL|STOCK|WERKSTOFF|WORKPIECE|ALLOY|BILLET|BLANK|PLATE|\b(?:AL|AA|EN|AISI|SAE)|\bT[0-9]{1,4}\b",
    re.IGNORECASE,
)
_NAMED_MATERIAL = re.compile(
    # Z Origin for Material = Material Surface names none
    r"\b(?:MATERIAL|WERKSTOFF|STOCK\s+MATERIAL)\s*[-:=]+\s*(?!MATERIAL\b|TABLE\b|MACHINE\b|.*\bSURFACE)([^-:=\s][^\n]*)",
    re.IGNORECASE,
)
_MATERIALS = (
    (r"\b304L?\b|\b316L?\b|1\.430[0-9]|1\.440[0-9]", "stainless-304-316l-from-group-14"),
    (r"STAINLESS|1\.43\d\d|1\.44\d\d|INOX", "group-14-stainless"),
    (r"INCONEL\s*-?718|\bIN718\b|2\.4668", "nickel-718-from-group-34"),
    (r"INCONEL|NIMONIC|HASTELLOY", "group-34-nickel"),
    (r"TI-?6AL-?4V|TI-?AL6-?V4|3\.7165|TITANIUM\s+GRADE\s*5", "titanium-6al4v-from-group-37"),
    (r"TITANIUM", "group-37-titanium"),
    (r"NODULAR|DUCTILE IRON|\bGGG\d*\b", "group-17-nodular-iron"),
    (r"CAST IRON|GREY IRON|GRAY IRON|\bGG\d\d\b", "grey-iron-from-group-15"),
    (r"(?<![0-9])4140(?![0-9])|42CRMO4", "steel-4140-from-group-7"),
    (r"(?<![0-9])4340(?![0-9])", "group-7-steel"),
    (r"\bH13\b|1\.2344", "steel-h13-from-group-10"),
    (r"\bP20\b|1\.2311", "steel-p20-from-group-8"),
    (r"(?<![0-9])1018(?![0-9])", "steel-1018-from-group-1"),
    (r"(?<![0-9])1045(?![0-9])|\bC45\b", "steel-1045-from-group-2"),
    (r"STEEL|\bS235|\bST37", "group-2-steel"),
    (r"BRASS", "group-27-brass"),
    (r"(?<![0-9])7075(?![0-9])", "al7075-t6"),
    (r"(?<![0-9])6082(?![0-9])", "al6082-t6"),
    (r"(?<![0-9])6061(?![0-9])", "al6061-t6-from-al6082-t6"),
    (r"(?<![0-9])2024(?![0-9])", "al2024-t3-from-group-22"),
    (r"\bALU|\bEN[ -]?AW\b|(?<![0-9])5083(?![0-9])", "group-22-aluminium"),
)


@dataclass(frozen=True)
class Header:
    """Cutters, stock and material that a text states besides its motions.

    Parameters
    ----------
    cutters : by tool number
    stock : corners of a block [mm], and where it stands
    material : a shipped name, and the comment
    unknown_material : what a comment names as the material where none that is shipped is like it
    """

    cutters: Mapping[int, Stated] = field(default_factory=dict)
    stock: tuple[Box, str] | None = None
    material: tuple[str, str] | None = None
    unknown_material: str = ""


def read_header(text: str, apt: bool = False, mm: float = 1.0) -> Header:
    r"""Read comments and declarations of a text; those that cannot be read are left out.

    Parameters
    ----------
    apt : the text is CL data
    mm : in the unit of numbers without one

    >>> read_header("(T1 D=10. CR=0.5 - ZMIN=-5. - bullnose end mill)").cutters[1]["corner_radius_mm"][0]
    0.5
    >>> read_header("BLK FORM 0.1 Z X+0 Y+0 Z-24\nBLK FORM 0.2 X+220 Y+220 Z+0").stock[0]
    ((0.0, 0.0, -24.0), (220.0, 220.0, 0.0))
    """
    cutters = _apt_cutters(text) if apt else stated_tools(text, mm)
    material = _material(text)
    return Header(cutters, _stock(text, mm), material, "" if material else _unknown_material(text))


def _apt_cutters(text: str) -> dict[int, Stated]:
    """Shapes of CUTTER records, and FeatureCAM's lengths and descriptions."""
    try:
        shapes = read_cutters(text)[0]
    except InputError:
        return {}
    out: dict[int, Stated] = {}
    for number, shape in shapes.items():
        d, r, e, f, alpha, beta, _ = shape
        if (tip := tip_of_barrel(shape)) is not None:
            where = f"CUTTER, r {r:g}, e {e:g}, f {f:g}"
            own: Stated = {
                "diameter_mm": (d, "CUTTER"),
                "barrel_radius_mm": (r, where),
                "corner_e_mm": (round(tip, 6), where),
            }
            out[number] = own | ({"taper_deg": (math.degrees(beta), "CUTTER")} if beta > 0.0 else {})
            continue
        if (body := _apt_body(shape)) is not None:
            out[number] = {"body_mm": ([[round(x, 6) for x in p] for p in body], f"CUTTER, r {r:g}, e {e:g}, f {f:g}")}
            continue
        own = {"diameter_mm": (d, "CUTTER")}
        if r > 0.0:
            own["corner_radius_mm"] = (r, "CUTTER")
        if alpha > 0.0:
            own["bottom_deg"] = (math.degrees(alpha), "CUTTER")
        if beta > 0.0:
            own["taper_deg"] = (math.degrees(beta), "CUTTER")
        out[number] = own
    mm = MM_PER["inch"] if re.search(r"^\s*UNITS?\s*/\s*INCH", text, re.MULTILINE) else 1.0
    name, tool = "", None
    for line in text.splitlines():
        word, _, rest = line.strip().partition("/")
        value = re.match(rf"\s*{_NUMBER}", rest)
        if word == "INSERT" and not re.match(r"\s*Stock", rest, re.IGNORECASE):
            name = rest.strip()
        elif word in ("LOAD", "LOADTL") and (found := re.search(r"(\d+)", rest)):
            tool = out.get(int(found[1]))
            if tool is not None and name:
                for key, described in describe_tool(name, mm).items():
                    tool.setdefault(key, described)
            name = ""
        elif tool is not None and value and word == "CSI_SET_FLUTE_LENGTH":
            tool.setdefault("flute_length_mm", (float(value[1]) * mm, word))
        elif tool is not None and value and word == "CSI_SET_EXTENSION_LENGTH":
            tool.setdefault("overhang_mm", (float(value[1]) * mm, word))
    return out


def _apt_body(shape: Shape) -> Profile | None:
    """The body of seven numbers that are no cutter of this program: a lens, a barrel without bottom; None: they are
    one.
    """
    d, r, e, f, alpha, beta, h = shape
    try:
        Cutter(d, 1, 0.0, h or d, h or d, 2.1e5, r, e if r > 0.0 else None, f if r > 0.0 else None, alpha, beta)
    except InputError:
        return apt_body(shape)
    return None


def _stock(text: str, mm: float) -> tuple[Box, str] | None:
    if re.search(r"\bBEGIN\s+PGM\b[^\n]*\bINCH\b", text[:1000], re.IGNORECASE):
        mm = MM_PER["inch"]
    corners = {hit[1]: tuple(mm * float(hit[k]) for k in (2, 3, 4)) for hit in _BLK.finditer(text)}
    if set(corners) == {"1", "2"}:
        low, high = corners["1"], corners["2"]
        if all(a < b for a, b in zip(low, high, strict=True)):
            return ((low[0], low[1], low[2]), (high[0], high[1], high[2])), "BLK FORM"
    stated = {hit[1].lower(): _corner(hit[2], mm) for hit in _CORNER.finditer(text)}
    if set(stated) == {"min", "max"}:
        low, high = stated["min"], stated["max"]
        if len(low) == len(high) == 3 and all(a < b for a, b in zip(low, high, strict=True)):
            return ((low[0], low[1], low[2]), (high[0], high[1], high[2])), "stockMin, stockMax"
    if (commented := _block_of_comments(text, mm)) is not None:
        return commented
    if (hit := _WORKPIECE.search(text)) and (box := _workpiece(hit[1].upper(), hit[2], mm)):
        return box, "WORKPIECE" if hit[1].upper() == "BOX" else "the box around the cylinder of WORKPIECE"
    if (hit := _BLK_CYLINDER.search(text)) and float(hit[1]) > 0.0 and float(hit[2]) > 0.0:
        r, length, top = (float(x or 0.0) * mm for x in hit.groups())
        return ((-r, -r, top - length), (r, r, top)), "the box around the cylinder of BLK FORM"
    if hit := _MATERIAL_SIZE.search(text):
        x, y, z = (float(hit[k]) * mm for k in (1, 2, 3))
        if min(x, y, z) > 0.0:
            return ((0.0, 0.0, -z), (x, y, 0.0)), "Material Size, with the program's zero at its lower left and top"
    if hit := _STOCK_SIZE.search(text):
        x, y, z = (float(hit[k]) * mm for k in (1, 2, 3))
        if min(x, y, z) > 0.0:
            return ((0.0, 0.0, -z), (x, y, 0.0)), "Stock Size, with the program's zero at its upper corner"
    return None


def _block_of_comments(text: str, mm: float) -> tuple[Box, str] | None:
    """The block that a comment states by its corners, or by its size with the zero of the program."""
    bounds = {hit[1].upper(): tuple(mm * float(hit[k]) for k in (2, 3, 4)) for hit in _BOUND.finditer(text)}
    low, high = bounds.get("LOWER", bounds.get("MIN")), bounds.get("UPPER", bounds.get("MAX"))
    if low is not None and high is not None and all(a < b for a, b in zip(low, high, strict=True)):
        return ((low[0], low[1], low[2]), (high[0], high[1], high[2])), "stock of a comment, its corners"
    if (hit := _BLOCK.search(text)) is not None:
        numbers = _corner(hit[1], mm)
        if len(numbers) >= 6 and min(numbers[:3]) > 0.0:
            zero = [-x for x in numbers[3:6]]
            top = [a + b for a, b in zip(zero, numbers, strict=False)]
            return ((zero[0], zero[1], zero[2]), (top[0], top[1], top[2])), "stock of STOCK/BLOCK"
    if (hit := _SIDES.search(text)) is not None:
        own = next((MM_PER["mm" if u.upper() == "MM" else "inch"] for u in (hit[2], hit[4], hit[6]) if u), mm)
        x, y, z = (own * float(hit[k]) for k in (1, 3, 5))
        if min(x, y, z) > 0.0:
            return ((0.0, 0.0, -z), (x, y, 0.0)), "DX DY DZ, with the program's zero at its lower left and top"
    if (hit := _BY_HAND.search(text)) is not None:
        own = next((MM_PER["mm" if u.upper() == "MM" else "inch"] for u in (hit[2], hit[4], hit[6]) if u), mm)
        x, y, z = (own * float(hit[k]) for k in (1, 3, 5))
        if min(x, y, z) > 0.0:
            return ((0.0, 0.0, -z), (x, y, 0.0)), SIZE_ALONE
    return None


def _workpiece(kind: str, arguments: str, mm: float) -> Box | None:
    """The block of WORKPIECE: a mask, Z0, Z1, ZB, then X0, Y0, X1, Y1 of a box or the diameter of a cylinder.

    Bits 16, 32 and 64 of the mask say that X1, Y1 and Z1 are coordinates; else they are lengths from X0, Y0, Z0.

    Reference: Siemens, SINUMERIK Operate, "Blank input" (WORKPIECE).
    """
    try:
        numbers = [float(part.strip() or 0.0) for part in arguments.split(",")[1:]]
    except ValueError:
        return None
    mask, z0, z1, _, *rest = [*numbers, *[0.0] * (8 - len(numbers))]
    x0, y0, x1, y1 = rest[:4] if kind == "BOX" else (-0.5 * rest[0], -0.5 * rest[0], rest[0], rest[0])
    bits = int(mask) if kind == "BOX" else int(mask) & 64
    x1, y1, z1 = (b if bits & bit else a + b for a, b, bit in ((x0, x1, 16), (y0, y1, 32), (z0, z1, 64)))
    low = min(x0, x1) * mm, min(y0, y1) * mm, min(z0, z1) * mm
    high = max(x0, x1) * mm, max(y0, y1) * mm, max(z0, z1) * mm
    return (low, high) if all(a < b for a, b in zip(low, high, strict=True)) else None


def _corner(text: str, mm: float) -> tuple[float, ...]:
    """Coordinates [mm] of a corner: ``0.00mm, 0.00mm, -12.70mm``."""
    found = re.finditer(rf"{_NUMBER}\s*(MM|IN)?", text, re.IGNORECASE)
    return tuple(
        float(hit[1]) * (mm if hit[2] is None else MM_PER["mm" if hit[2].upper() == "MM" else "inch"]) for hit in found
    )


def _material(text: str) -> tuple[str, str] | None:
    comments = [" ".join((hit[1] or hit[2] or hit[3] or "").split()) for hit in _COMMENT.finditer(text)]
    for comment in comments:
        # a tool of high-speed steel is no workpiece of steel, and 2024 may be a year
        if _OF_TOOL.search(comment):
            continue
        bare = _ALLOY.search(comment) is not None and _DATE.search(comment) is None
        for pattern, name in _MATERIALS:
            hit = re.search(pattern, comment, re.IGNORECASE)
            if hit is not None and (bare or not hit[0].isdigit()):
                return name, comment[:60]
    return None


def _unknown_material(text: str) -> str:
    """What a comment names as the material."""
    for hit in _COMMENT.finditer(text):
        comment = " ".join((hit[1] or hit[2] or hit[3] or "").split())
        if found := _NAMED_MATERIAL.search(comment):
            return found[1].strip()[:60]
    return ""
