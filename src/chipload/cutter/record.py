"""A cutter as a record of numbers for compiled loops: the only form in which they know one.

A record is a row of an array of cutters: a loop takes the cutter of a move by its number and reads its fields by name,
``c.wide``, ``c.radius[i]`` of segment i. Notation: as in :mod:`chipload.cutter.profile`.

Fields
------
kind : BALL, FLAT or any other shape, for loops that have a shorter way for the first two
wide, height : greatest radius, height of the teeth [mm]
cylinder : height above which the cutter is a cylinder of radius ``wide`` [mm], inf: nowhere
count, arcs : number of segments, and of those that are arcs or sharp corners
line : of each segment 0 an arc or sharp corner, BOTTOM_LINE a line that is cut as a bottom is, FLANK_LINE the last one
radius, e, f : of an arc its radius and centre [mm]
rho, z, kappa, sin, cos : at the lower end of a segment, sine and cosine of kappa; ``rho_to`` and so on at the upper end
rise, run : of a line dz/drho and drho/dz
s : length along the profile at the lower end [mm], 0 where the bottom line ends
by, q, q_to : the parameter of places on a segment, BY_KAPPA, BY_RHO, BY_Z or BY_LESS_RHO, and its value at both ends

Row ``count`` of the segments is the ring above the teeth at which material is looked for: the neck of an undercut
cutter, else the end of the profile.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter

#: kinds
BALL, FLAT, OTHER = 0.0, 1.0, 2.0
#: kinds of a line
BOTTOM_LINE, FLANK_LINE = 1, 2
#: parameters of a place on a segment
BY_KAPPA, BY_RHO, BY_Z, BY_LESS_RHO = range(4)
#: room for segments: two lines and three arcs with sharp corners between them, and the ring above the teeth
MOST = 8
#: height of that ring of an undercut cutter above its teeth [mm]
ABOVE = 1e-6

_NUMBERS = ("kind", "wide", "height", "cylinder")
_ENDS = ("rho", "z", "kappa", "sin", "cos")
_OF_SEGMENTS = ("radius", "e", "f", *_ENDS, *(f"{name}_to" for name in _ENDS), "rise", "run", "s", "q", "q_to")

CUTTER = np.dtype(
    [
        *((name, np.float64) for name in _NUMBERS),
        ("count", np.int64),
        ("arcs", np.int64),
        *((name, np.float64, (MOST,)) for name in _OF_SEGMENTS),
        ("line", np.int64, (MOST,)),
        ("by", np.int64, (MOST,)),
    ],
    align=True,
)


def cutter_record(cutter: Cutter) -> NDArray[np.void]:
    """Return the record (1,) of a cutter.

    >>> bull = cutter_record(Cutter(10.0, 2, 0.5, 20.0, 30.0, 6e5, corner_radius=1.0))[0]
    >>> bull["kind"].item(), bull["wide"].item(), bull["rho_to"][:3].tolist(), bull["s"][:3].round(3).tolist()
    (2.0, 5.0, [4.0, 5.0, 5.0], [-4.0, 0.0, 1.571])
    """
    segments = cutter.segments
    out = np.zeros(1, CUTTER)
    count = len(segments)
    shapes = [(segment.straight, segment.radius) for segment in segments]
    right = 0.5 * math.pi
    upright = segments[-1].straight and abs(segments[-1].kappa[0] - right) < 1e-12
    kind = OTHER
    if upright and segments[0].kappa[0] == 0.0:
        if count <= 2 and not segments[0].straight and abs(segments[0].centre[0]) <= 1e-9 * cutter.diameter:
            kind = BALL
        elif shapes == [(True, 0.0), (False, 0.0), (True, 0.0)]:
            kind = FLAT
    elif count == 1 and not segments[0].straight and abs(segments[0].kappa[1] - right) < 1e-12:
        kind = BALL
    out["kind"], out["count"] = kind, count
    out["arcs"] = sum(not segment.straight for segment in segments)
    out["wide"] = max(segment.widest for segment in segments)
    out["height"] = segments[-1].z[1]
    out["cylinder"] = segments[-1].z[0] if upright else math.inf
    s = 0.0
    if segments[0].straight and segments[0].rho[0] == 0.0 and count > 1:
        s = -segments[0].length
    for i, segment in enumerate(segments):
        _fill(out, i, segment.rho, segment.z, segment.kappa)
        out["radius"][0, i] = segment.radius
        out["e"][0, i], out["f"][0, i] = segment.centre
        out["s"][0, i] = s
        s = 0.0 if i == 0 and s < 0.0 else s + segment.length
        out["by"][0, i] = BY_KAPPA
        ends = segment.kappa
        if segment.straight:
            last = i == count - 1 and i > 0
            out["line"][0, i] = FLANK_LINE if last else BOTTOM_LINE
            sine, cosine = float(out["sin"][0, i]), float(out["cos"][0, i])
            out["rise"][0, i] = sine / cosine if cosine != 0.0 else math.inf
            out["run"][0, i] = cosine / sine if sine != 0.0 else math.inf
            if cosine < -abs(sine):
                out["by"][0, i], ends = BY_LESS_RHO, (-segment.rho[0], -segment.rho[1])
            elif last or (i > 0 and abs(sine) >= abs(cosine)):
                out["by"][0, i], ends = BY_Z, segment.z
            else:
                out["by"][0, i], ends = BY_RHO, segment.rho
        out["q"][0, i], out["q_to"][0, i] = ends
    end = segments[-1]
    if cutter.undercut:
        neck = 0.5 * (cutter.shank_diameter or 0.0)
        _fill(out, count, (neck, neck), (end.z[1] + ABOVE,) * 2, (right, right))
    else:
        _fill(out, count, (end.rho[1],) * 2, (end.z[1],) * 2, (end.kappa[1],) * 2)
    out["line"][0, count], out["by"][0, count], out["s"][0, count] = FLANK_LINE, BY_Z, s
    out["q"][0, count] = out["q_to"][0, count] = out["z"][0, count]
    return out


def _fill(
    out: NDArray[np.void], i: int, rho: tuple[float, float], z: tuple[float, float], kappa: tuple[float, float]
) -> None:
    """Write both ends of segment i."""
    for k, end in enumerate(("", "_to")):
        upright = abs(kappa[k] - 0.5 * math.pi) < 1e-12
        out["rho" + end][0, i], out["z" + end][0, i], out["kappa" + end][0, i] = rho[k], z[k], kappa[k]
        out["sin" + end][0, i] = 1.0 if upright else math.sin(kappa[k])
        out["cos" + end][0, i] = 0.0 if upright else math.cos(kappa[k])
