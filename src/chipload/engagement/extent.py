"""Contact height, feed per tooth and radial depth of cut of a step, from its tooth engagement.

Notation as in :mod:`chipload.engagement.tooth_engagement`: an engagement range from phi p to q, s a to b, with the chip
thickness h = along sin(phi) + across cos(phi) + offset; kappa the angle of the profile. The feed per tooth has the
parts hypot(along, across) / sin(kappa) across the axis and offset / cos(kappa) along it. Where the feed is not normal
to a surface of the cutter, that surface does not determine the feed per tooth: the greatest of the engagement ranges is
taken.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chipload.engagement.tooth_engagement import ToothEngagement

Floats = NDArray[np.float64]

#: a sine or cosine of kappa below which a surface does not determine that part of the feed
FLAT = 1e-3


def contact_height(engagement: ToothEngagement) -> Floats:
    """Return the height (n,) [mm] above the tip of the highest point of the edge that cuts; 0 where nothing is cut."""
    s0, _, z0, sine = engagement.slices[engagement.slice, :4].T
    return _greatest(engagement, z0 + sine * (engagement.rows[:, 3] - s0))


def contact_range(engagement: ToothEngagement) -> tuple[Floats, Floats]:
    """Return the heights (n,) [mm] above the tip of the lowest and highest point that cuts; 0 where nothing is cut."""
    s0, _, z0, sine = engagement.slices[engagement.slice, :4].T
    low = np.full(len(engagement), np.inf)
    np.minimum.at(low, _owner(engagement), z0 + sine * (engagement.rows[:, 2] - s0))
    return np.where(np.isfinite(low), low, 0.0), contact_height(engagement)


def tooth_feed(engagement: ToothEngagement) -> Floats:
    """Return the feed per tooth (n,) [mm] of engagement ranges without runout; 0 where nothing is cut.

    Examples
    --------
    >>> import math
    >>> from chipload.cutter.cutter import Cutter
    >>> from chipload.engagement.tooth_engagement import engagement_of_arcs
    >>> slot = engagement_of_arcs([0.0], [math.pi], 0.1, Cutter(10.0, 2, 0.5, 20.0, 30.0, 6e5), 2.0)
    >>> [z.tolist() for z in contact_range(slot)]
    [[0.0], [2.0]]
    >>> tooth_feed(slot).tolist(), radial_depth(slot).round(9).tolist(), contact_height(slot).tolist()
    ([0.1], [10.0], [2.0])
    """
    sine, cosine = np.abs(engagement.slices[engagement.slice, 3:5].T)
    along, offset, across = engagement.rows[:, 4:].T
    lateral = np.divide(np.hypot(along, across), sine, out=np.zeros(len(sine)), where=sine > FLAT)
    axial = np.divide(np.abs(offset), cosine, out=np.zeros(len(sine)), where=cosine > FLAT)
    return np.hypot(_greatest(engagement, lateral), _greatest(engagement, axial))


def radial_depth(engagement: ToothEngagement) -> Floats:
    """Return the radial depth of cut (n,) [mm]: width of all engagement ranges seen along T; 0 where nothing is cut."""
    p, q = engagement.rows[:, :2].T
    rho = engagement.slices[engagement.slice, 1]
    # across = rho cos(phi): its ends, and its extremes at 0 (or 2 pi) and pi where the arc holds them
    ends = rho * np.cos([p, q])
    high, low = ends.max(axis=0, initial=-np.inf), ends.min(axis=0, initial=np.inf)
    high = np.where((q >= 2.0 * np.pi) | (p == 0.0), rho, high)
    low = np.where(((p <= np.pi) & (q >= np.pi)) | (q >= 3.0 * np.pi), -rho, low)
    top, bottom = np.full(len(engagement), -np.inf), np.full(len(engagement), np.inf)
    owner = _owner(engagement)
    np.maximum.at(top, owner, high)
    np.minimum.at(bottom, owner, low)
    return np.asarray(np.where(np.isfinite(top), top - bottom, 0.0))


def _owner(engagement: ToothEngagement) -> NDArray[np.int64]:
    return np.repeat(np.arange(len(engagement)), np.diff(engagement.start))


def _greatest(engagement: ToothEngagement, values: Floats) -> Floats:
    out = np.zeros(len(engagement))
    np.maximum.at(out, _owner(engagement), values)
    return out
