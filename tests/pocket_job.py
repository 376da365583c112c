"""Jobs that clear a pocket, written, run and measured: what their tests share."""

from __future__ import annotations

import math
from pathlib import Path

import ezdxf
import numpy as np
import shapely

from chipload.jobs import load_job
from chipload.jobs.contour.run import check, run
from chipload.program.program import ARC_CCW, ARC_CW, LINE
from chipload.result import Verdict

JOB = """
[part]
file = "part.dxf"
units = "mm"
{part}
[stock]
top_mm = 0.0
[machine]
name = "vmc"
[material]
name = "al7075-t6"
[[cutter]]
number = 1
diameter_mm = 8.0
flutes = 3
helix_deg = 30.0
flute_length_mm = 20.0
overhang_mm = 28.0
modulus_gpa = 580.0
[[cutter]]
number = 2
diameter_mm = 5.0
flutes = 3
helix_deg = 30.0
flute_length_mm = 15.0
overhang_mm = 20.0
modulus_gpa = 580.0
{operations}
[limits]
{limits}
"""
OPERATION = """
[[operation]]
kind = "pocket"
cutter = {cutter}
milling = "down"
axial_depth_mm = 4.0
feed_mm_min = 955.0
speed_rpm = 7960.0
step_mm = 0.4
clearance_mm = 5.0
{more}
"""
SQUARE = [(0, 0), (30, 0), (30, 24), (0, 24)]
#: where the room for an island is not needed: half the passes
SMALL = [(0, 0), (22, 0), (22, 18), (0, 18)]


def written(folder: Path, drawn, *operations: str, part: str = "", limits: str = "engagement_deg = 60.0") -> Path:
    """A job in ``folder``; ``drawn`` are closed outlines by layer, a circle as (x, y, radius)."""
    doc = ezdxf.new()
    for layer, outlines in drawn.items():
        for outline in outlines:
            if len(outline) == 3 and not isinstance(outline[0], tuple):
                doc.modelspace().add_circle(outline[:2], outline[2], dxfattribs={"layer": layer})
            else:
                doc.modelspace().add_lwpolyline(outline, close=True, dxfattribs={"layer": layer})
    doc.saveas(folder / "part.dxf")
    path = folder / "job.toml"
    path.write_text(JOB.format(part=part, operations="".join(operations), limits=limits))
    return path


def operation(more: str, cutter: int = 1) -> str:
    return OPERATION.format(cutter=cutter, more=more)


def done(path: Path):
    job = load_job(path)
    outcome = run(getattr(job, "job", job))
    for op in outcome.operations:
        for found in op.verifications.values():
            assert found.verdict is Verdict.HOLDS, found.text
        for strategy in op.result.strategies.values():
            assert not [e.text for e in strategy.events if e.failure]
    return [op.result.strategies[op.result.use] for op in outcome.operations], outcome


def checked(path: Path):
    job = load_job(path)
    return check(getattr(job, "job", job))


def swept(program, radius, z):
    """What the level motions at height z sweep, arcs by chords."""
    lines = []
    p = program.p_work
    for k in np.flatnonzero(np.isin(program.motion, (LINE, ARC_CW, ARC_CCW))):
        if k == 0 or abs(p[k, 2] - z) > 1e-6 or abs(p[k - 1, 2] - z) > 1e-6:
            continue
        a, b, c = p[k - 1, :2], p[k, :2], program.centre[k, :2]
        if program.motion[k] == LINE:
            lines.append(shapely.linestrings([a, b]) if np.hypot(*(b - a)) > 0 else shapely.points(a))
            continue
        t0, t1 = (math.atan2(*(x - c)[::-1]) for x in (a, b))
        sweep = (t1 - t0) % math.tau if program.motion[k] == ARC_CCW else -((t0 - t1) % math.tau)
        t = t0 + sweep * np.linspace(0.0, 1.0, 33)
        lines.append(shapely.linestrings(c + math.hypot(*(a - c)) * np.column_stack([np.cos(t), np.sin(t)])))
    return shapely.union_all(shapely.buffer(np.array(lines), radius, quad_segs=64))
