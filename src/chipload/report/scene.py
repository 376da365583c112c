"""Colours and numbers of rows that the scenes of all capabilities share."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

#: shades of engagement on a path
SHADES = 24
WALL, STOCK, TOOL = (86, 96, 112, 255), (214, 170, 110, 110), (178, 186, 196, 255)
FIXTURE = (92, 122, 150, 255)
#: rows of a history that the scene shows at most
ROWS = 40_000


def legend(
    title: str, stops: Sequence[tuple[float, Sequence[int]]], words: Sequence[tuple[str, Sequence[int]]] = ()
) -> dict[str, Any]:
    """Return the legend of a coloured body for the metadata of its mesh: ``mesh.metadata["legend"]``.

    Parameters
    ----------
    title : quantity and unit
    stops : rising values with their colours (red, green, blue)
    words : what is no value, with its colour

    >>> legend("gouge [mm]", [(0.0, (255, 255, 255)), (0.1, (178, 24, 43))])["stops"]
    [[0.0, '#ffffff'], [0.1, '#b2182b']]
    """
    return {
        "title": title,
        "stops": [[float(value), _hex(colour)] for value, colour in stops],
        "words": [[word, _hex(colour)] for word, colour in words],
    }


def engagement_legend(title: str, highest: float) -> dict[str, Any]:
    """The legend of :func:`engagement_colours`."""
    values = np.linspace(0.0, highest, 5)
    return legend(title, list(zip(values.tolist(), engagement_colours(values, highest)[:, :3].tolist(), strict=True)))


def _hex(colour: Sequence[int]) -> str:
    red, green, blue = (int(c) for c in colour[:3])
    return f"#{red:02x}{green:02x}{blue:02x}"


def engagement_colours(engagement: Floats, highest: float) -> NDArray[np.uint8]:
    """(n, 4) colours from dark (none) to bright (``highest``), in :data:`SHADES` steps.

    >>> engagement_colours(np.array([0.0, 90.0]), 90.0)[:, 0].tolist() == [
    ...     engagement_colours(np.array([0.0]), 90.0)[0, 0], engagement_colours(np.array([90.0]), 90.0)[0, 0]]
    True
    """
    stops = np.array([[48, 36, 92], [53, 96, 141], [34, 168, 132], [155, 217, 60], [251, 182, 26]], dtype=np.float64)
    share = np.clip(np.asarray(engagement) / highest, 0.0, 1.0) if highest > 0.0 else np.zeros(len(engagement))
    share = np.round(share * (SHADES - 1)) / (SHADES - 1)
    rgb = [np.interp(share, np.linspace(0.0, 1.0, len(stops)), stops[:, k]) for k in range(3)]
    return np.column_stack([*rgb, np.full(len(share), 255.0)]).round().astype(np.uint8)
