"""Verification of programs that mill the walls and the floor of a channel: gouges, excess and removal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.simulation.channel.channel import Remainder, SurfacePoints, left_on, scallop_numbers, wall
    from chipload.simulation.channel.gouges import Gouge, deepest_gouge
    from chipload.simulation.channel.stock import ChannelRemoval, sector, taken_from

__all__ = [
    "ChannelRemoval",
    "Gouge",
    "Remainder",
    "SurfacePoints",
    "deepest_gouge",
    "left_on",
    "scallop_numbers",
    "sector",
    "taken_from",
    "wall",
]

__getattr__, __dir__ = attach(
    __name__,
    {
        "channel": "Remainder SurfacePoints left_on scallop_numbers wall",
        "gouges": "Gouge deepest_gouge",
        "stock": "ChannelRemoval sector taken_from",
    },
)
