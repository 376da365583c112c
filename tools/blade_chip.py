"""Write the blade of the example chips: a side of an impeller's blade with its allowance, and its flank pass.

    python tools/blade_chip.py examples/chips

The blade is that of the example impeller near its outlet, in a frame whose Z is the mean axis of the pass: blade.stl,
0.5 mm thicker on the side that is milled, and blade.cls, the pass that deviates least from the side.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import trimesh

from chipload.cutter.catalogue import CatalogueCutter
from chipload.planning.impeller.flank import flank_pass
from chipload.planning.impeller.parametric import ImpellerShape, impeller_of

#: range of the side along the flow and from hub to shroud, beyond which the pass goes; of the blade; allowance [mm]
ALONG, UP, BLADE, ALLOWANCE = (0.55, 0.97), (0.35, 0.98), (0.6, 0.92), 0.5
CUTTER = CatalogueCutter(12.0, 1.0, 40.0)
FEED_MM_MIN, SPEED_RPM, ABOVE = 600.0, 4000.0, 45.0


def main(folder: Path) -> None:
    """Write both files."""
    body = impeller_of(ImpellerShape()).bodies[0]
    found = flank_pass(body.plus, ALONG, UP, CUTTER, 0.005)
    z = found.axis.mean(axis=0)
    z /= np.linalg.norm(z)
    x = found.tip[-1] - found.tip[0]
    x -= (x @ z) * z
    x /= np.linalg.norm(x)
    turn, origin = np.stack([x, np.cross(z, x), z]), found.tip[len(found.tip) // 2]
    tip, axis = (found.tip - origin) @ turn.T, found.axis @ turn.T

    u, v = (c.ravel() for c in np.meshgrid(np.linspace(*BLADE, 33), np.linspace(0.2, 1.0, 9), indexing="ij"))
    sides = [body.plus.at(u, v) + ALLOWANCE * body.plus.normal(u, v), body.minus.at(u, v)]
    mesh = closed(*[((p - origin) @ turn.T).reshape(33, 9, 3) for p in sides])
    (folder / "blade.stl").write_bytes(trimesh.exchange.stl.export_stl(mesh))

    places = np.vstack([tip[0] + ABOVE * axis[0], tip, tip[-1] + ABOVE * axis[-1]])
    lines = [
        f"GOTO/{','.join(f'{c:.6f}' for c in p)},{','.join(f'{c:.9f}' for c in a)}"
        for p, a in zip(places, np.vstack([axis[0], axis, axis[-1]]), strict=True)
    ]
    head = ["PARTNO/FLANK OF A BLADE", "UNITS/MM", "LOADTL/1", f"SPINDL/{SPEED_RPM:g},RPM,CLW", "MULTAX/ON", "RAPID"]
    feed = [f"FEDRAT/{FEED_MM_MIN:g},MMPM"]
    text = [*head, lines[0], *feed, *lines[1:-1], "RAPID", lines[-1], "SPINDL/OFF", "FINI"]
    (folder / "blade.cls").write_text("\n".join(text) + "\n")


def closed(plus: np.ndarray, minus: np.ndarray) -> trimesh.Trimesh:
    """The body between two grids (a, b, 3) of points that stand opposite to each other."""
    a, b = plus.shape[:2]
    k = np.arange(2 * a * b).reshape(2, a, b)

    def strip(p: np.ndarray, q: np.ndarray) -> np.ndarray:
        """Triangles between two rows of points."""
        return np.concatenate([np.stack([p[:-1], p[1:], q[1:]], axis=1), np.stack([p[:-1], q[1:], q[:-1]], axis=1)])

    faces = [strip(k[0, i], k[0, i + 1]) for i in range(a - 1)]
    faces += [strip(k[1, i + 1], k[1, i]) for i in range(a - 1)]
    faces += [
        strip(k[1, 0], k[0, 0]),
        strip(k[0, -1], k[1, -1]),
        strip(k[0, :, 0], k[1, :, 0]),
        strip(k[1, :, -1], k[0, :, -1]),
    ]
    mesh = trimesh.Trimesh(
        np.concatenate([plus.reshape(-1, 3), minus.reshape(-1, 3)]), np.concatenate(faces), process=False
    )
    if mesh.volume < 0.0:
        mesh.invert()
    return mesh


if __name__ == "__main__":
    main(Path(sys.argv[1]))
