"""Check of the rigid model: the deflection compared with the feed per tooth and the radial depth of cut.

The loads are those of a rigid cutter and a rigid workpiece. Notation: delta [mm] deflection, f_z feed per tooth, a_e
radial depth of cut, mu = delta / f_z.

Where the engagement changes, tooth j deflects by x_j and cuts h_j = f_z - x_j + x_(j-1), the force being linear in h:
x_j = mu h_j, so that x_j = (f_z + x_(j-1)) mu / (1 + mu). The chip settles to f_z by the factor mu / (1 + mu) a tooth,
however soft the cutter; the first tooth cuts f_z / (1 + mu). With mu = 2 it is within 30 % after three teeth and
20 % after four, about a revolution: less than the usual spread of the coefficients. In a steady cut the deflection
changes the radial depth of cut, and so the force, by delta / a_e at most.

    share = max(delta / (of_feed f_z), delta / (of_depth a_e)),   of_feed = 2, of_depth = 0.25,

above 1 the rigid model is not valid, and the loads are not proved. The check is static; chatter is checked separately.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.engagement.extent import radial_depth, tooth_feed
from chipload.engagement.tooth_engagement import ToothEngagement
from chipload.errors import InputError

Floats = NDArray[np.float64]

#: deflection in feeds per tooth, and as a share of the radial depth, up to which the rigid model is held to be right
OF_FEED, OF_DEPTH = 2.0, 0.25


def deflection_share(
    engagement: ToothEngagement, deflection_um: ArrayLike, of_feed: float = OF_FEED, of_depth: float = OF_DEPTH
) -> Floats:
    """Return the column ``deflection_share`` (n,): deflection over the greatest for which the rigid model is valid.

    Parameters
    ----------
    engagement : without runout
    deflection_um : (n,) float
    of_feed : greatest deflection over the feed per tooth
    of_depth : greatest deflection over the radial depth

    Raises
    ------
    InputError
        A factor is not above 0.

    Examples
    --------
    >>> import math
    >>> from chipload.cutter.cutter import Cutter
    >>> from chipload.engagement.tooth_engagement import engagement_of_arcs
    >>> slot = engagement_of_arcs([0.0], [math.pi], 0.1, Cutter(10.0, 2, 0.5, 20.0, 30.0, 6e5), 2.0)
    >>> deflection_share(slot, [50.0]).tolist()
    [0.25]
    """
    for name, value in (("deflection_of_feed", of_feed), ("deflection_of_depth", of_depth)):
        if not value > 0.0:
            raise InputError(f"checks.{name} = {value:g}: must be above 0")
    delta = np.asarray(deflection_um, dtype=np.float64) / 1000.0
    room = np.minimum(of_feed * tooth_feed(engagement), of_depth * radial_depth(engagement))
    return np.asarray(np.divide(delta, room, out=np.zeros(len(delta)), where=room > 0.0))
