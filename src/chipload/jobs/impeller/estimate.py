"""Estimate of the contact points, passes and processor time of an impeller run.

Measured (docs/design/impeller_paths.md, processor time of all cores): the search and the division of a contact point
take 0.05 s on a KJ66, 0.06 s on the example, up to 0.4 s on HECC with necks and holders; the programs of one channel
with their check 6 to 10 s a metre of passes. The estimate names the range with a margin of a half.
"""

from __future__ import annotations

from collections.abc import Sequence

from chipload.planning.impeller.rest_machining import corner_step

#: processor time of a contact point [s], of a metre of passes [s], least and greatest; of the start and the report [s]
POINT, METRE, START = (0.03, 0.4), (4.0, 15.0), 6.0


def estimate(points: int, areas: Sequence[float], scallop: float, corner: float, partitions: int) -> str:
    """Contact points, passes and processor time of a run, in a sentence.

    Parameters
    ----------
    points : contact points
    areas : of the surfaces [mm2], one channel; empty: there are no programs
    scallop : greatest height [mm]
    corner : least corner radius of the cutters [mm]
    partitions : that are compared

    Examples
    --------
    >>> estimate(600, [2000.0, 1000.0], 0.1, 1.5, 4)
    'estimate: 600 contact points, 4 partitions, each with 2.79 m of passes a channel; 1.1 to 6.9 min of processor time'
    >>> estimate(40, [], 0.1, 1.5, 2)
    'estimate: 40 contact points, 2 partitions; 7.2 to 22 s of processor time'
    """
    step = max(corner_step(corner, scallop), scallop)
    metres = sum(areas) / step / 1e3
    low, high = (START + a * points + b * partitions * metres for a, b in zip(POINT, METRE, strict=True))
    unit, name = (60.0, "min") if high > 300.0 else (1.0, "s")
    passes = f", each with {metres:.3g} m of passes a channel" if areas else ""
    return (
        f"estimate: {points} contact points, {partitions} partitions{passes}; {low / unit:.2g} to {high / unit:.2g} "
        f"{name} of processor time"
    )
