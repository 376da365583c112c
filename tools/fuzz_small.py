"""The examples of chipload made so small that each runs within a moment, for tools/fuzz.py.

Contour and pocket are among the small jobs of ``fuzz_jobs``; ``hecc``, which has the keys of ``impeller`` and eleven
sections a blade, takes too long and is loaded and checked only.
"""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path

from chipload.examples import copy_example

#: a short cut of one tool, for examples whose own program takes long
CUT = "G21 G90 G17\nT{tool} M6\nS6000 M3\nG0 X{x} Y{y} Z5\nG0 Z1\nG1 Z-2 F900\nX{to}\nG0 Z5\nM30\n"


@dataclass(frozen=True)
class Small:
    """An example, with overrides that make it small, and texts that stand for its files.

    Parameters
    ----------
    example : its name
    sets : overrides
    files : texts by name of the file
    cut : tables of the job that are left out, the last ones, beginning with this heading
    """

    example: str
    sets: tuple[str, ...] = ()
    files: tuple[tuple[str, str], ...] = ()
    cut: str = ""

    def write(self, folder: Path) -> None:
        """Copy the example into a new folder and make it small, but for its overrides."""
        copy_example(self.example, folder)
        for name, text in self.files:
            (folder / name).write_text(text, "utf-8")
        if self.cut:
            job = folder / "job.toml"
            text = job.read_text("utf-8")
            job.write_text(text[: text.index(self.cut)], "utf-8")
        for left in ("linuxcnc", "README.md"):
            shutil.rmtree(folder / left, ignore_errors=True)


_WALL = (
    "wall.foot_mm=4.0", "wall.elements=[3, 4]", "operation.0.scallop_um=60.0", "operation.0.step_mm=4.0",
    "operation.0.least_error=false", "operation.0.corner_slices=24", "operation.0.reserve=0.1",
    "operation.0.layer_mm=1.0",
)  # fmt: skip
_TORQUE = ("simulation.step_mm=6.0", "simulation.layer_mm=4.0", "simulation.tolerance_mm=0.02", "loop.period_ms=50.0")
_IMPELLER = ("operation.0.check_mm=8", "operation.0.most_cutters=1")

SMALL: dict[str, Small] = {
    "blade": Small(
        "blade",
        (*_WALL, "wall.height_mm=8.0", "wall.chord_root_mm=9.0", "wall.chord_tip_mm=8.0", "wall.elements=[4, 4]",
         "wall.allowance_mm=[0.2, 0.2]", "operation.0.depth_max_mm=0.2"),
    ),
    "bracket": Small(
        "bracket",
        ("operation.0.step_mm=6.0", "stock.layer_mm=4.0", "part.spacing_mm=6.0", "fixture.0.spacing_mm=6.0",
         "operation.0.stock_points_mm=8.0"),
        (("bracket.nc", CUT.format(tool=1, x=-8, y=20, to=12)),),
    ),
    "chatter": Small(
        "chatter", ("operation.0.step_mm=3.0", "stock.layer_mm=4.0"),
        (("cover.nc", CUT.format(tool=3, x=-8, y=13, to=8)),),
    ),
    "chips": Small("chips", ("operation.0.step_mm=6.0", "stock.layer_mm=4.0")),
    "cone": Small("cone", _TORQUE),
    "feeds": Small(
        "feeds", ("operation.0.step_mm=4.0", "stock.layer_mm=4.0"),
        (("pocket.nc", CUT.format(tool=1, x=-42, y=0, to=-22)),),
    ),
    "impeller": Small(
        "impeller", (*_IMPELLER, *(f"surface.{k}.points=[5, 4]" for k in range(3)), "surface.2.up=[0.05, 0.75]"),
        cut="[operation.rough]",
    ),
    "notebooks": Small(
        "notebooks", ("operation.0.step_mm=6.0",), (("corner.ngc", CUT.format(tool=1, x=-6, y=10, to=12)),),
    ),
    "part": Small(
        "part",
        ("operation.0.step_mm=4.0", "stock.layer_mm=4.0", "part.spacing_mm=8.0", "workpiece.states=2",
         "workpiece.cell_mm=8.0"),
        (("housing.nc", CUT.format(tool=1, x=-6, y=3, to=8)),),
    ),
    "plate": Small(
        "plate",
        (*_WALL, "wall.length_mm=8.0", "wall.height_mm=9.0", "wall.thickness_mm=1.7", "wall.allowance_mm=[0.2, 0.2]",
         "operation.0.depth_max_mm=0.2"),
    ),
    "trunnion": Small("trunnion"),
    "tube": Small("tube", _TORQUE),
}  # fmt: skip
