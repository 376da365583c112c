"""Contact and profile of a tapered or barrel cutter that mills by points.

Notation: kappa [rad] angle of the outward normal of the profile with the downward axis, which at a contact is the angle
of cutter axis T and surface normal N, n = N.T = cos(kappa); (r, e, f) radius and centre of an arc of the profile, e
from the axis, below 0 for the flank arc of a barrel, f above the tip; beta half angle of the taper.

The contact lies on one arc: on the corner of a straight or tapered cutter, on the flank arc of a barrel. The support of
the body of revolution of an arc in a unit direction u that is kappa from the downward axis is, from the tip,
H = f u.T + r + e sin(kappa): of the profile it is that of the arc to which kappa belongs, and beyond the flank line, or
beyond the end of an arc at the top, that of the rim of the top.
"""

from __future__ import annotations

import math

import numpy as np

from chipload.cutter.catalogue import CatalogueCutter
from chipload.planning.impeller.scene import Floats

#: how far a contact stays from the ends of its arc where an axis is chosen [rad]; at most this share of the arc
_INSIDE, _SHARE = math.radians(2.0), 0.2


def profile_numbers(cutter: CatalogueCutter) -> Floats:
    """The numbers (11,) of the profile for the kernels, of a cutter whose cutting part has an end.

    >>> import math
    >>> ball = CatalogueCutter(2.0 * math.tan(math.radians(42.5)) * 2.0, 2.0, 20.0, taper=math.radians(5.0))
    >>> profile_numbers(ball)[:5].round(9).tolist()
    [2.0, 0.0, 2.0, 0.0, 2.0]
    """
    body = cutter.shape
    _, r, e, f, _, beta, top = body.apt
    R, E, F = (r, e, f) if body.flank_arc is None else (body.flank_arc.radius, body.flank_arc.e, body.flank_arc.f)
    end = body.corner_end
    return np.array([
        r, e, R, E, F, math.sin(end), math.cos(end), math.sin(beta), math.cos(beta), top, 0.5 * cutter.top_diameter
    ])  # fmt: skip


def contact_band(cutter: CatalogueCutter, lean: float, chosen: bool = True) -> tuple[float, float]:
    """Least and greatest n at which the contact lies on its arc, below the top, and the axis leans by ``lean`` [rad].

    ``chosen`` : for axes that are chosen, of a barrel some way inside the ends of its arc; else up to its very ends.

    >>> contact_band(CatalogueCutter(10.0, 5.0), 0.5)[0]
    0.0
    >>> barrel = CatalogueCutter(12.0, 3.0, 28.0, barrel_radius=85.0)
    >>> [round(math.degrees(math.acos(n)), 2) for n in contact_band(barrel, 0.2, False)]
    [90.0, 74.45]
    """
    if cutter.straight:
        return 0.0, math.cos(lean)
    body = cutter.shape
    arc, last = body.flank_arc, 0.5 * math.pi - cutter.taper
    first = 0.0 if arc is None else arc.kappa_from
    if arc is not None:
        last = min(last, arc.kappa_at(body.flute_length))
    inside = min(_INSIDE, _SHARE * (last - first)) if chosen and arc is not None else 0.0
    return math.cos(last - inside), math.cos(max(first + inside, lean))


def support(cutter: CatalogueCutter, uN: Floats, uV: Floats, uT: Floats) -> Floats:
    """Support of a tapered or barrel cutter from its contact in directions u of these parts in N, V and T.

    V is the unit vector across T towards N.
    """
    r, e, f = cutter.contact_arc
    own = r * uN + e * uV - f * uT
    kappa = np.arccos(np.clip(-uT, -1.0, 1.0))
    s = np.sin(kappa)
    R, E, F = profile_numbers(cutter)[2:5]
    body = cutter.shape
    _, corner, off, high, _, beta, top = body.apt
    last = 0.5 * math.pi - beta
    if body.flank_arc is not None:
        last = min(last, body.flank_arc.kappa_at(top))
    rim = top * uT + 0.5 * cutter.top_diameter * s
    H = np.where(kappa <= body.corner_end, high * uT + corner + off * s, F * uT + R + E * s)
    return np.asarray(own + np.where(kappa <= last, H, rim))
