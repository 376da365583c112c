"""Roughing programs of an impeller with the results of their simulation: verdict, numbers, table."""

from __future__ import annotations

import math
from dataclasses import dataclass
from html import escape
from typing import Any

import numpy as np

from chipload.jobs.impeller.machine_check import MachineCheck, check_cell, program_verdict
from chipload.jobs.impeller.program_removal import ProgramRemoval
from chipload.jobs.impeller.read_program import ReadProgram
from chipload.lazy import trimesh
from chipload.planning.impeller.rough_settings import RoughingSetting
from chipload.program.gcode.writer import Repeat
from chipload.report.sheet import table
from chipload.result import Verdict
from chipload.simulation.channel.channel import PARTS
from chipload.simulation.channel.gouges import Gouge
from chipload.simulation.channel.stock import ChannelRemoval


@dataclass(frozen=True, eq=False)
class CheckedRough:
    """A roughing program with the results of its simulation.

    Parameters
    ----------
    rough : cutter, table angle, rows, moves
    gouge : deepest that any part of the tool comes below a finished surface, between bounds
    allowed : what of it is allowed [mm]
    stands : least that is left on the blades and on the hub where rows were milled [mm]; None: nowhere within reach
    taken : from the blank as the programs before it leave it, row by row
    touch : [mm3] that a rapid, and what is above the cutting part, may take in one row
    machine_check : what it does on the machine, and what its text shows
    read : the program as its text was read, which was checked
    between : from the end of one channel to the beginning of the next [s]
    repeat : how the text goes through all channels; None: it is of one channel
    blank : what its channel begins with, before any program
    removal : from the stock that the programs before it leave; None: not simulated
    """

    rough: RoughingSetting
    gouge: Gouge
    allowed: float
    stands: tuple[float | None, float | None]
    taken: ChannelRemoval
    touch: float
    machine_check: MachineCheck
    read: ReadProgram
    between: float
    repeat: Repeat | None
    blank: trimesh.Trimesh
    removal: ProgramRemoval | None = None

    @property
    def name(self) -> str:
        """`roughing D 12 r 2 mm at 45 deg`."""
        c = self.rough.cutter
        of = " beside the splitter" if self.rough.index else ""
        return f"roughing{of}: {c.label} mm at {np.degrees(self.rough.table):.6g} deg"

    @property
    def seconds(self) -> float:
        """Time of one channel [s]."""
        return self.read.seconds

    @property
    def verified(self) -> bool:
        """Whether there is no gouge, no motion beyond the machine, and no cut by rapids or above the cutting part."""
        return not (self.fails or self.machine_check.doubts)

    @property
    def missed(self) -> float:
        """Length of rows that are not milled [mm]."""
        refused = {k for k, _ in self.rough.linked.refused}
        tracks = self.rough.tracks
        stopped = sum(t.length for t in self.rough.stopped)
        return sum(x.length for x in tracks.missed) + sum(tracks.tracks[k].length for k in refused) + stopped

    @property
    def length(self) -> float:
        """Length of the rows [mm]."""
        return sum(t.length for t in self.rough.machined)

    @property
    def fails(self) -> tuple[str, ...]:
        """Conditions that do not hold."""
        out = [f"{self.name}: {f}" for f in self.machine_check.fails]
        if self.gouge.bound > self.allowed:
            out.append(f"{self.name}: {self.gouge.message}: gouge_mm = {self.allowed:g} is allowed")
        out += [f"{self.name}: {p}: touch_mm3 = {self.touch:g} is allowed" for p in self.taken.problems(self.touch)]
        if not self.rough.machined:
            out.append(f"{self.name}: no row can be milled")
        return tuple(out)

    def values(self) -> dict[str, Any]:
        """Numbers for summary.json; volumes are those of one channel in a blank with uncut neighbours."""
        c, rough = self.rough.cutter, self.rough
        worst = int(self.taken.above.argmax())
        return {
            "channel": rough.index,
            "diameter_mm": c.diameter,
            "corner_radius_mm": c.corner_radius,
            "table_deg": round(float(np.degrees(rough.table)), 9),
            "verified": self.verified and self.removal is not None and self.removal.verdict is Verdict.HOLDS,
            "fails": [*self.fails, *self.machine_check.doubts],
            "layers": rough.layers,
            "rows": len(rough.program),
            "path_mm": self.length,
            "time_min": self.seconds / 60.0,
            "missed_mm": self.missed,
            "refused_rows": len(rough.linked.refused),
            "stopped_rows": len(rough.stopped),
            "gouge_mm": self.gouge.found,
            "gouge_bound_mm": self.gouge.bound if math.isfinite(self.gouge.bound) else None,
            "stands_on_blades_mm": self.stands[0],
            "stands_on_hub_mm": self.stands[1],
            "removal": None if self.removal is None else self.removal.numbers(),
            "taken_mm3": self.taken.before - self.taken.after,
            "rapids_take_mm3": float(self.taken.rapid.max(initial=0.0)),
            "above_takes_mm3": float(self.taken.above.max(initial=0.0)),
            "above": PARTS[int(self.taken.part[worst])] if self.taken.part[worst] >= 0 else None,
        }


def rough_sections(roughs: tuple[CheckedRough, ...] | None, names: list[str]) -> list[str]:
    """Report sections about roughing; none if the job has none."""
    if roughs is None:
        return []
    head = ["program", "layers", "rows", "path [mm]", "time [min]", "taken [cm3]", "left [mm]"]
    head += ["gouge [mm]", "by rapids, by shank [mm3]", "missed [mm]", "check"]
    rows = []
    for r, name in zip(roughs, names, strict=True):
        v = r.values()
        stands = ", ".join("-" if x is None else f"{x:.2f}" for x in r.stands)
        rows.append(
            [
                f"<code>{escape(name)}</code>", str(v["layers"]), str(v["rows"]), f"{v['path_mm']:.0f}",
                f"{v['time_min']:.2f}", f"{v['taken_mm3'] / 1e3:.2f}", stands, f"{v['gouge_mm']:.3f}",
                f"{v['rapids_take_mm3']:.2f}, {v['above_takes_mm3']:.2f}", f"{v['missed_mm']:.0f}",
                check_cell(program_verdict(r.fails, r.machine_check.doubts, r.removal)),
            ]
        )  # fmt: skip
    return [
        "<h2>Roughing</h2>",
        '<p class="note">Rows in layers from the shroud down to the hub, each from outside inwards. The blank is a '
        "body of revolution that stands over the shroud, its neighbour channels uncut; what every part of the tool "
        "removes of it is counted row by row, program after program. The volumes by rapids and by shank are the most "
        "that a rapid, and that neck, shank or holder remove in one row. Left is the least on the blades, and on the "
        "hub.</p>",
        table(head, rows, numbers=(1, 2, 3, 4, 5, 6, 7, 8, 9)),
    ]
