"""Finished parts of an impeller run in its checkpoint: searches, paths, links, checks."""

from __future__ import annotations

from typing import Any

from chipload.cutter.catalogue import Catalogue, CatalogueCutter
from chipload.jobs import kept_parts
from chipload.jobs.impeller.five_axis_outcome import NoFiveAxisPath
from chipload.jobs.impeller.point_milling import PlannedPoints
from chipload.planning.impeller.answer import Answer, Unreachable
from chipload.planning.impeller.five_axis_program import LinkedPath
from chipload.planning.impeller.flank import FlankPass
from chipload.planning.impeller.lines import Tracks, UnreachedSpan
from chipload.planning.impeller.links import Linked, Moves
from chipload.planning.impeller.pallet_ranges import Ranges
from chipload.planning.impeller.point_milling import PointPath
from chipload.planning.impeller.rest_machining import RestPasses
from chipload.planning.impeller.search import SearchLimits
from chipload.planning.impeller.track import ToolTrack
from chipload.simulation.channel.gouges import Gouge
from chipload.simulation.checkpoint import Checkpoint
from chipload.workers import Team

#: what a part may be made of besides arrays and plain values
RECORDS = (
    Answer, Catalogue, CatalogueCutter, FlankPass, Gouge, Linked, LinkedPath, Moves, NoFiveAxisPath, PlannedPoints,
    PointPath, Ranges, RestPasses, SearchLimits, ToolTrack, Tracks, Unreachable, UnreachedSpan,
)  # fmt: skip


class KeptParts(kept_parts.KeptRecords):
    """Kept parts of a run by their keys; a :class:`chipload.planning.impeller.kept.Keep`."""

    def __init__(self, checkpoint: Checkpoint | None, key: str, team: Team | None = None) -> None:
        super().__init__(checkpoint, key, RECORDS, team)


def part_bytes(value: object) -> bytes:
    """A part of an impeller run as bytes."""
    return kept_parts.part_bytes(value, RECORDS)


def read_part(data: bytes) -> Any:
    """The part from the bytes of :func:`part_bytes`."""
    return kept_parts.read_part(data, RECORDS)
