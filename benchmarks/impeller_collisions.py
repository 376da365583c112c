"""The clearance of impeller programs against closed bodies of tool and blades in another library (Manifold).

    python benchmarks/impeller_collisions.py [JOB] [--rows N] [--seed N] [--sink MM]

runs a job (default: a small piece of both sides of a blade of the example, with a cutter that has a holder) and draws
N instants (default 200) of its programs as their texts were read. In each the whole tool, as a closed mesh turned about
its axis, is compared with the blades and splitters around the channel as closed meshes: the gap of the neck, shank and
holder, and whether the cutting part, smaller all round by the gouge that is allowed, meets a blade. It prints how many
instants contradict the check of the product, and the least gap; the exit code is 1 if any does.

The bodies have facets: chords of the tool lie up to ``CHORD`` inside it. Nothing of the product but the surfaces of the
blades, the profile of a cutter and the motions that were read is used.
"""

from __future__ import annotations

import argparse
import math
import sys
import tempfile
import time
from pathlib import Path

import manifold3d
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from chipload.jobs import load_job, run_job
from chipload.jobs.impeller.blanks import cutting_part, drawn_parts
from chipload.jobs.impeller.programs import cutter_of, table_programs
from impeller_job import impeller_job

#: facets around a tool; points of a side along u and v; bodies on either side of the first blade; search for gaps [mm]
AROUND, SIDE, NEIGHBOURS, FAR = 96, (61, 21), 2, 5.0


#: a cutter with a shank and a holder
CATALOGUE = """name = "one"
[[cutter]]
diameter_mm = 16.0
corner_radius_mm = 2.0
cutting_length_mm = 30.0
reach_mm = 70.0
holder_diameter_mm = 40.0
"""


def body_of(points, faces):
    """A closed body."""
    mesh = manifold3d.Mesh(np.asarray(points, dtype=np.float32), np.asarray(faces, dtype=np.uint32))
    made = manifold3d.Manifold(mesh)
    assert made.status() == manifold3d.Error.NoError, made.status()
    return made if made.volume() > 0.0 else manifold3d.Manifold(
        manifold3d.Mesh(np.asarray(points, dtype=np.float32), np.asarray(faces, dtype=np.uint32)[:, ::-1].copy())
    )  # fmt: skip


def blade_body(blade):
    """A blade between its sides, without the strips at its edges."""
    u, v = np.meshgrid(np.linspace(0.01, 0.99, SIDE[0]), np.linspace(0.0, 1.0, SIDE[1]), indexing="ij")
    plus, minus = (side.at(u.ravel(), v.ravel()) for side in (blade.plus, blade.minus))
    a, b = SIDE
    at = np.arange(a * b).reshape(a, b)
    quads = np.stack([at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]], axis=-1).reshape(-1, 4)
    n = a * b
    rim = np.concatenate([at[:-1, 0], at[-1, :-1], at[:0:-1, -1], at[0, :0:-1]])
    on = np.roll(rim, -1)
    faces = np.concatenate([
        quads[:, [0, 1, 2]], quads[:, [0, 2, 3]], n + quads[:, [2, 1, 0]], n + quads[:, [3, 2, 0]],
        np.column_stack([on, rim, n + rim]), np.column_stack([on, n + rim, n + on]),
    ])  # fmt: skip
    return body_of(np.concatenate([plus, minus]), faces)


def turned_body(profile):
    """A profile of distance and height, turned about z."""
    rho, h = np.maximum(profile[:, 0], 0.0), profile[:, 1]
    ring = [(r, z) for r, z in zip(rho, h, strict=True)]
    section = manifold3d.CrossSection([ring if signed_area(ring) > 0.0 else ring[::-1]])
    return manifold3d.Manifold.revolve(section, AROUND)


def signed_area(ring):
    """Area of a polygon, positive if it turns to the left."""
    x, y = np.array(ring).T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def shrunk(profile, by):
    """The profile of a cutting part that is smaller by ``by`` all round; it ends at the axis."""
    section = manifold3d.CrossSection([[(float(r), float(z)) for r, z in both_sides(profile)]])
    inner = section.offset(-by, manifold3d.JoinType.Round).to_polygons()[0]
    half = manifold3d.CrossSection([[tuple(p) for p in inner]]) ^ manifold3d.CrossSection(
        [[(0.0, -1e4), (1e4, -1e4), (1e4, 1e4), (0.0, 1e4)]]
    )
    return np.array(half.to_polygons()[0])


def both_sides(profile):
    """A profile with its mirror image, as a ring that turns to the left."""
    right = profile[profile[:, 0] > 0.0]
    ring = np.concatenate([right, (right * (-1.0, 1.0))[::-1]])
    return ring if signed_area(ring) > 0.0 else ring[::-1]


def at_pose(body, tip, axis):
    """A body whose tip lies at the origin, moved to a pose."""
    x = np.cross(axis, (1.0, 0.0, 0.0) if abs(axis[0]) < 0.9 else (0.0, 1.0, 0.0))
    x /= np.linalg.norm(x)
    return body.transform(np.column_stack([x, np.cross(axis, x), axis, tip]))


def small_job(folder):
    """A piece of both sides of a blade, with a cutter that has a shank and a holder."""
    path = impeller_job(folder)
    path.write_text(path.read_text().replace('name = "wu2019"', 'file = "cutters.toml"'))
    (folder / "cutters.toml").write_text(CATALOGUE)
    return path


def main() -> int:
    """Compare, and print the counts."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("job", nargs="?", type=Path)
    parser.add_argument("--rows", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--sink", type=float, default=0.0, help="move the tool so far along its axis: must be seen")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        loaded = load_job(given.job or small_job(Path(folder)))
        outcome = run_job(loaded).outcome
    op, impeller = loaded.job.operation, outcome.impeller
    kinds = len(impeller.bodies)
    blades = [blade_body(impeller.body(k)) for k in range(-NEIGHBOURS * kinds, NEIGHBOURS * kinds + 1)]
    used = {id(p) for p in (*(outcome.programs or ()), *(outcome.roughs or ()))}
    programs = [(name, one) for name, one in table_programs(outcome) if id(one) in used]
    rng, begin = np.random.default_rng(given.seed), time.process_time()
    gouges = near = drawn = 0
    least = math.inf
    end = 0.4 * outcome.stated.outer_diameter
    for _, one in programs:
        cutter, program = cutter_of(one), one.read.program
        allowed = op.paths.gouge_mm
        part = shrunk(cutting_part(cutter, end).profile(0.01), allowed)
        cutting, above = turned_body(part), [turned_body(p) for kind, p in drawn_parts(cutter, end) if kind != "flutes"]
        count = given.rows // len(programs)
        row, share = rng.integers(1, len(program), count), rng.uniform(size=count)
        for k, t in zip(row, share, strict=True):
            tip = (1.0 - t) * program.p_work[k - 1] + t * program.p_work[k]
            axis = (1.0 - t) * program.axis[k - 1] + t * program.axis[k]
            axis /= np.linalg.norm(axis)
            tip -= given.sink * axis
            drawn += 1
            moved = at_pose(cutting, tip, axis)
            gouges += any((moved ^ blade).volume() > 1e-6 for blade in blades)
            for body in above:
                posed = at_pose(body, tip, axis)
                gap = min(posed.min_gap(blade, FAR) for blade in blades)
                least, near = min(least, gap), near + (gap < op.clearance_mm - chord(body))
    held = "no gouge" if all(p.gouge.bound <= p.allowed for _, p in programs) else "a gouge"
    print(f"{drawn} instants of {len(programs)} programs, {len(blades)} blades and splitters; the product finds {held}")
    print(f"cutting part deeper than {op.paths.gouge_mm:g} mm in a blade: {gouges}")
    print(f"neck, shank or holder nearer than {op.clearance_mm:g} mm: {near}; least gap {least:.3f} mm")
    print(f"{1e3 * (time.process_time() - begin) / max(drawn, 1):.1f} ms of processor time an instant")
    return int(gouges > 0 or near > 0)


def chord(body):
    """By how much the facets of a turned body may lie inside it [mm]."""
    low = np.array(body.bounding_box())
    return float(low[3:].max()) * (1.0 - math.cos(math.pi / AROUND))


if __name__ == "__main__":
    sys.exit(main())
