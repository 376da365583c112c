"""From patches to moves: one program for each cutter at each table angle, every patch finished in its turn.

Notation: a setting is a cutter at a table angle with the patches that are milled so; alpha table angle [rad]. In the
scene of a channel the surfaces are numbered as :meth:`Impeller.scene` does for the plus side of the blade.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from chipload.cutter.catalogue import Catalogue, CatalogueCutter
from chipload.planning.sectional.floor import patch_of
from chipload.planning.sectional.impeller import FILLET, Impeller
from chipload.planning.sectional.lines import Tracks
from chipload.planning.sectional.links import Link, Linked, linked
from chipload.planning.sectional.patch import Patch
from chipload.planning.sectional.paths import Finish, finishing
from chipload.planning.sectional.programs import program_of
from chipload.planning.sectional.scene import Scene
from chipload.planning.sectional.surfaces import BODIES, Sampled, counts, hub_range
from chipload.planning.sectional.tables import IndexTable
from chipload.program.program import Program
from chipload.progress import Progress, silent

#: number of each surface in the scene of the blade's plus side
NUMBERS = {(0, "plus"): 0, (1, "minus"): 1, (0, "minus"): 3, (1, "plus"): 4}
NUMBERS |= {(body, f"{side} fillet"): FILLET + n for (body, side), n in NUMBERS.items()}
_FLOOR = 2


@dataclass(frozen=True, eq=False)
class Milling:
    """A patch with its finishing path.

    Parameters
    ----------
    patch : the patch
    along : `u` or `v`, which its lines run along
    box : (low, high) of u, of v
    tracks : what is milled, and what is missed
    """

    patch: Patch
    along: str
    box: tuple[tuple[float, float], tuple[float, float]]
    tracks: Tracks


@dataclass(frozen=True, eq=False)
class Setting:
    """A cutter at a table angle.

    Parameters
    ----------
    cutter, table : which, alpha [rad]
    millings : its patches in their order
    linked : all moves; tracks that cannot be come to
    program : in the frame of the impeller, of one channel
    """

    cutter: CatalogueCutter
    table: float
    millings: tuple[Milling, ...]
    linked: Linked
    program: Program


def channel_scene(impeller: Impeller, how: Sampled) -> Scene:
    """Check points of the channels beside the blade, as fine as ``how`` says."""
    check, hub = counts(impeller, how)
    return impeller.scene(
        0, "plus", ([0.5], [0.5]), check, how.near, max(how.around, 1), hub, hub_range(impeller, how.ahead)
    )


def settings_of(
    impeller: Impeller,
    patches: Sequence[Patch],
    catalogue: Catalogue,
    scene: Scene,
    how: Finish,
    link: Link,
    spindle: float,
    table: IndexTable,
    ahead: float = 0.0,
    workers: int = 1,
    progress: Progress = silent,
) -> tuple[Setting, ...]:
    """The settings of patches, in the order in which their first patches stand.

    Parameters
    ----------
    scene : of :func:`channel_scene`
    spindle : [rad/s]
    ahead : how far the hub goes on ahead of the blade's leading edge [mm]
    """
    groups: dict[tuple[int, float], list[Patch]] = {}
    for patch in patches:
        groups.setdefault((patch.cutter, patch.table), []).append(patch)
    out: list[Setting] = []
    done = 0
    for (index, alpha), members in groups.items():
        cutter, millings = catalogue.cutters[index], []
        for patch in members:
            number = NUMBERS.get((patch.body, patch.side), _FLOOR)
            strips, part = (patch.low, patch.high), patch.part
            along, box = ("v", (strips, part)) if patch.order == "u" else ("u", (part, strips))
            if patch.part == (0.0, 1.0):
                other = np.unique(patch.at[:, 1 if patch.order == "u" else 0])
                whole = (float(other[0]), float(other[-1]))
                box = (strips, whole) if patch.order == "u" else (whole, strips)
            surface = patch_of(impeller, BODIES[patch.body], patch.side, ahead)
            tracks = finishing(
                surface, along, box, scene, number, cutter, alpha, how,
                tuple((float(a), float(b)) for a, b in table.spans), workers,
            )  # fmt: skip
            millings.append(Milling(patch, along, box, tracks))
            done += 1
            progress(done / len(patches), f"paths of {done} patches")
        tracks_of_all = tuple(t for m in millings for t in m.tracks.tracks)
        moves = linked(
            tracks_of_all, scene, cutter, alpha, how.motion.feed, link, how.motion.clearance, rate=how.motion.rate
        )
        out.append(Setting(cutter, alpha, tuple(millings), moves, program_of(moves.moves, spindle, len(out) + 1)))
    return tuple(out)
