"""The cutters that CL data describes.

Notation: CUTTER/d,r,e,f,alpha,beta,h as in :mod:`~chipload.cutter.cutter`, lengths in the unit of the text, angles in
degrees. A CUTTER belongs to the tool that is loaded after it before the next motion, else to the one in the spindle.
"""

from __future__ import annotations

import math
from typing import Literal

from chipload.errors import Finding
from chipload.program.apt.records import AptRecord, records
from chipload.units import MM_PER

Shape = tuple[float, float, float, float, float, float, float]

UNITS = {"MM": "mm", "CM": "cm", "INCH": "inch", "INCHES": "inch"}
LOADS = ("LOAD", "LOADTL", "TOOLNO", "TURRET")
#: largest tool number
LARGEST_TOOL = 99_999_999


def read_cutters(text: str, *, units: Literal["mm", "inch"] = "mm") -> tuple[dict[int, Shape], tuple[Finding, ...]]:
    r"""(d, r, e, f, alpha, beta, h) [mm, rad] of each tool number, and the findings.

    Of a CUTTER of fewer numbers e = d/2 - r, f = r, and alpha, beta, h are 0. A tool that is described anew keeps its
    first shape: a finding.

    Parameters
    ----------
    text : CL data
    units : of lengths before the first UNITS

    Raises
    ------
    InputError
        A CUTTER, UNITS or tool record is malformed.

    >>> read_cutters("UNITS/MM\nCUTTER/10,1\nLOADTL/3\nGOTO/0,0,0\nFINI")[0]
    {3: (10.0, 1.0, 4.0, 1.0, 0.0, 0.0, 0.0)}
    """
    mm, tool = MM_PER[units], 0
    pending: tuple[Shape, AptRecord] | None = None
    out: dict[int, Shape] = {}
    findings: list[Finding] = []

    def settle() -> None:
        if pending is not None and out.setdefault(tool, pending[0]) != pending[0]:
            text = f"{pending[1]}: tool {tool} already has a cutter: the first one is kept"
            findings.append(Finding("apt-cutter", pending[1].line, text))

    for record in records(text):
        if record.word in ("UNITS", "UNIT"):
            mm = MM_PER[length_unit(record)]
        elif record.word in ("CUTTER", "TLDATA"):
            numbers = nx_shape(record, mm) if record.word == "TLDATA" else shape(record, mm)
            if numbers is not None:
                settle()
                pending = (numbers, record)
        elif record.word in LOADS:
            tool = tool_number(record)
        elif record.word in ("GOTO", "FROM", "GODLTA"):
            settle()
            pending = None
        elif record.word in ("FINI", "END"):
            break
    settle()
    return out, tuple(findings)


def shape(record: AptRecord, mm: float) -> Shape:
    """The seven numbers of a CUTTER record; ``mm`` in one unit of its lengths."""
    v = record.numbers(1, 2, 3, 4, 5, 6, 7)
    d, r = v[0] * mm, (v[1] * mm if len(v) > 1 else 0.0)
    e, f = (v[2] * mm if len(v) > 2 else 0.5 * d - r), (v[3] * mm if len(v) > 3 else r)
    alpha, beta, h = (*v[4:], 0.0, 0.0, 0.0)[:3]
    return (d, r, e, f, math.radians(alpha), math.radians(beta), h * mm)


def nx_shape(record: AptRecord, mm: float) -> Shape | None:
    """The seven numbers of a TLDATA/MILL of NX: d, r, length, taper, tip angle; None: another kind of tool.

    A taper or a tip is not taken: where the diameter of such a tool is measured is not stated.
    """
    if record.args[:1] != ("MILL",):
        return None
    v = [record.number(k) for k in range(1, len(record.args))]
    if not 2 <= len(v) <= 5 or any(v[3:]):
        return None
    d, r = v[0] * mm, v[1] * mm
    return (d, r, 0.5 * d - r, r, 0.0, 0.0, v[2] * mm if len(v) > 2 else 0.0)


def length_unit(record: AptRecord) -> str:
    """The unit that a UNITS record names."""
    unit = UNITS.get(",".join(record.args))
    if unit is None:
        raise record.error("must be MM, CM or INCHES")
    return unit


def tool_number(record: AptRecord) -> int:
    """The tool that LOAD/TOOL,n, LOADTL/n, TOOLNO/n or TURRET/n names."""
    value = record.number(1 if record.args[:1] == ("TOOL",) else 0)
    if not (0.0 <= value <= LARGEST_TOOL and value == int(value)):
        raise record.error(f"must be a whole number from 0 to {LARGEST_TOOL}")
    return int(value)
