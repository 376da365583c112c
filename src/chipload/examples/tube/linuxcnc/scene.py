"""A round pass outside a tube: the program, and the torque along it as planned and as it really is.

Notation: R_t radius of the finished tube [mm], a radial depth of cut [mm]; the cutter goes round at R_t + 5, down a
helix in the first round, flat in the second, clockwise (it climbs).

Planned: a = 2 mm, 4 mm over a lug. Really: the tube stands off its centre, so that it is 30 % thicker on one side, and
a hard spot of 30 mm asks for 20 % more. The torque is that of the chips that the layered stock loses, step by step; the
part of the edge is what remains of it with coefficients of the edge alone.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
from shapely import LineString, Point, Polygon, box

from chipload.control.linuxcnc.path import ToolPath, tool_path, write_path
from chipload.control.plant import Surprise, surprised
from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material, material_named
from chipload.machine.machine import machine_named
from chipload.program.program import Program
from chipload.program.read import read_program
from chipload.simulation.chips import Resolution, remove
from chipload.stock.layers import LayeredStock
from chipload.units import mm_min_from_mm_s, mm_s_from_mm_min

RADIUS, DEPTH, LUG, OFF = 12.0, 2.0, 2.0, 0.6
CUTTER = Cutter(10.0, 3, math.radians(30.0), 22.0, 30.0, 580e3)
FEED_MM_MIN, SPEED_RPM, DEEP = 1440.0, 6000.0, 6.0
HARD = Surprise(95.0, 125.0, cut=1.2, edge=1.2, ramp=8.0)
STEP = 0.5

PROGRAM = f"""\
(round pass outside a tube)
G21 G90 G17 G94 G40 G64 P0.005
M52 P1 (adaptive feed: without it the override is not taken)
T1 M6
S{SPEED_RPM:.0f} M3
G0 X{RADIUS + 5:.3f} Y15.000 Z10.000
G0 Z0.000
G1 Y0.000 F{FEED_MM_MIN:.0f}
G2 X{-RADIUS - 5:.3f} Y0.000 Z{-0.5 * DEEP:.3f} I{-RADIUS - 5:.3f} J0.000
G2 X{RADIUS + 5:.3f} Y0.000 Z{-DEEP:.3f} I{RADIUS + 5:.3f} J0.000
G2 X{-RADIUS - 5:.3f} Y0.000 I{-RADIUS - 5:.3f} J0.000
G2 X{RADIUS + 5:.3f} Y0.000 I{RADIUS + 5:.3f} J0.000
G1 Y-15.000
M2
"""


def stock(off: float) -> LayeredStock:
    """The tube with its lug, its centre ``off`` [mm] towards +X -Y."""
    block = LayeredStock.block((-25.0, -25.0, -10.0), (25.0, 25.0, 0.0), 0.5, 25.0)
    centre = Point(off * math.sqrt(0.5), -off * math.sqrt(0.5))
    ring = centre.buffer(RADIUS + DEPTH, 128).difference(centre.buffer(RADIUS - 2.0, 128))
    a = np.radians(np.linspace(150.0, 200.0, 40))
    arc = (RADIUS + DEPTH + LUG - 0.01) * np.column_stack([np.cos(a), np.sin(a)])
    lug = Polygon([(0.0, 0.0), *arc]).difference(Point(0.0, 0.0).buffer(RADIUS, 128))
    air = box(-25.0, -25.0, 25.0, 25.0).difference(ring.union(lug))
    block.remove_many(range(block.layers), [air] * block.layers)
    return block


def _torque(program: Program, off: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Ends of the steps (n, 3) [mm], which of them feed, torque (n, 2) [N mm]: edge, cut."""
    whole: Material = replace(material_named("al7075-t6"), spread=None, covariance=None)
    edge = replace(whole, Ktc=10.0, Krc=0.0, Kac=0.0)
    resolution = Resolution(STEP, 0.005, 1, 1.0)
    found = [remove(program, stock(off), {1: CUTTER}, m, resolution).columns for m in (whole, edge)]
    # the coefficient of the chip cannot be 0: two of them give both parts
    both, little = (1e3 * c["torque_mean_nm"] for c in found)
    cut = (both - little) * whole.Ktc / (whole.Ktc - edge.Ktc)
    points = np.column_stack([found[0][f"{x}_mm"] for x in "xyz"])
    return points, ~found[0]["rapid"], np.column_stack([np.maximum(both - cut, 0.0), np.maximum(cut, 0.0)])


def scene(folder: Path) -> ToolPath:
    """Write ``program.ngc`` and ``path.csv`` into a folder."""
    file = folder / "program.ngc"
    file.write_text(PROGRAM, "ascii")
    program = read_program(file, machine_named("vmc")).program
    points, feeds, planned = _torque(program, 0.0)
    _, _, real = _torque(program, OFF)
    first = int(np.flatnonzero(feeds)[0])
    start = points[first - 1]
    points = np.vstack([start, points[first:]])
    # a step's torque is that of its middle: rows at the ends are the mean of both sides
    planned, real = (_at_ends(x[first:]) for x in (planned, real))
    path = tool_path(points, np.full(len(points), mm_s_from_mm_min(FEED_MM_MIN)), planned, real)
    path = replace(path, truth=surprised(path.truth, (HARD,)))
    (folder / "path.csv").write_text(write_path(path), "ascii")
    return path


def _at_ends(torque: np.ndarray) -> np.ndarray:
    padded = np.vstack([torque[:1], torque, torque[-1:]])
    return np.asarray(0.5 * (padded[1:] + padded[:-1]))


if __name__ == "__main__":
    made = scene(Path())
    length = LineString(made.points).length
    print(f"{length:.1f} mm at {mm_min_from_mm_s(made.model.feed[0]):g} mm/min, {len(made.points)} rows")
    for name, x in (("planned", made.model), ("real", made.truth)):
        print(f"{name}: torque up to {1e-3 * x.torque(1.0).max():.3f} N m at the programmed feed")
