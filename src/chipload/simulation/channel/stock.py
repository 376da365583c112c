"""Removal of a channel program from its blank, row by row; rapids and parts above the cutting part must remove nothing.

Notation: the blank is the part of a body of revolution between two meridional curves, inner and outer, and two angles
theta, as triangles. It is stored as dexels, an independent calculation of the removed volume.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.catalogue import CatalogueCutter
from chipload.errors import InputError
from chipload.lazy import trimesh
from chipload.program.motions import is_arc
from chipload.program.program import RAPID, Program
from chipload.progress import Progress, silent
from chipload.simulation.channel.channel import PARTS, tool_parts
from chipload.stock.dexel import TriDexel

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class ChannelRemoval:
    """Material that a program removes from a blank.

    Parameters
    ----------
    before, after : volume [mm3]
    rapid : (n,) volume [mm3] that each rapid removes, 0 for feed moves
    above : (n,) greatest volume [mm3] that neck, shank or holder removes in each row
    part : (n,) the part (:data:`PARTS`) that removes it; -1: none
    """

    before: float
    after: float
    rapid: Floats
    above: Floats
    part: Ints

    def problems(self, least: float) -> tuple[str, ...]:
        """Messages on rapids, and on parts above the cutting part, that remove more than ``least`` [mm3].

        Each names the worst row of its kind.
        """
        out = []
        if self.rapid.max(initial=0.0) > least:
            k = int(self.rapid.argmax())
            out.append(f"row {k}: a rapid takes {self.rapid[k]:.1f} mm3 of the blank")
        if self.above.max(initial=0.0) > least:
            k = int(self.above.argmax())
            out.append(f"row {k}: the {PARTS[int(self.part[k])]} takes {self.above[k]:.1f} mm3 of the blank")
        return tuple(out)


def sector(inner: Floats, outer: Floats, first: float, last: float, turn: float = math.radians(2.0)) -> trimesh.Trimesh:
    """Blank between two meridional curves (n, 2) of r, z [mm], n points each, from theta ``first`` to ``last`` [rad].

    >>> straight = np.array([[0.0, 0.0], [0.0, 10.0]])
    >>> half = sector(straight + [10.0, 0.0], straight + [20.0, 0.0], 0.0, np.pi)
    >>> bool(abs(half.volume / (np.pi / 2 * 3000.0) - 1.0) < 1e-3)
    True
    """
    a, b = np.asarray(inner, dtype=np.float64), np.asarray(outer, dtype=np.float64)
    if a.shape != b.shape or a.ndim != 2 or a.shape[1] != 2 or not last > first or last - first >= math.tau:
        raise InputError("blank: must be two curves (n, 2) of as many points, angles ascending, less than a turn apart")
    count = max(2, math.ceil((last - first) / turn) + 1)
    theta = np.linspace(first, last, count)
    n = len(a)
    grid = np.stack([a, b])[:, :, None, :] * np.ones((1, 1, count, 1))
    p = np.stack([grid[..., 0] * np.cos(theta), grid[..., 0] * np.sin(theta), grid[..., 1]], axis=-1)
    index = np.arange(2 * n * count).reshape(2, n, count)
    faces = [
        *_quads(index[0]), *_quads(index[1]), *_quads(index[:, 0]), *_quads(index[:, -1]),
        *_quads(index[:, :, 0]), *_quads(index[:, :, -1]),
    ]  # fmt: skip
    mesh = trimesh.Trimesh(p.reshape(-1, 3), np.array(faces), process=False)
    mesh.update_faces(mesh.nondegenerate_faces())
    trimesh.repair.fix_normals(mesh)
    return mesh


def _quads(index: Ints) -> list[list[int]]:
    a, b, c, d = (x.ravel() for x in (index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]))
    out: list[list[int]] = [*np.column_stack([a, b, c]).tolist(), *np.column_stack([a, c, d]).tolist()]
    return out


def taken_from(
    blank: trimesh.Trimesh | TriDexel,
    program: Program,
    cutter: CatalogueCutter,
    pitch: float,
    progress: Progress = silent,
) -> ChannelRemoval:
    """Return the removal of a program from a blank, with rays ``pitch`` [mm] apart; dexels are cut with their own rays.

    Raises
    ------
    InputError
        The program has arcs.
    """
    if is_arc(program).any():
        raise InputError("channel: the program has arcs: must be of straight rows")
    stock = blank if isinstance(blank, TriDexel) else TriDexel.of_mesh(blank, pitch)
    starts, shapes, kinds = tool_parts(cutter)
    n = len(program)
    rapid, above, part = np.zeros(n), np.zeros(n), np.full(n, -1)
    before = stock.volume()
    p, a = program.p_work, program.axis
    for k in range(1, n):
        if np.array_equal(p[k], p[k - 1]) and np.array_equal(a[k], a[k - 1]):
            continue
        for j, (start, shape) in enumerate(zip(starts, shapes, strict=True)):
            apt = (2.0 * shape[9], shape[0], shape[1], shape[2], 0.0, 0.0, shape[8])
            if j == 0 and not cutter.straight:
                apt = (*cutter.shape.apt[:6], shape[8], *cutter.shape.outline[7:])
            tips = p[k - 1] + start * a[k - 1], p[k] + start * a[k]
            lost = stock.remove_move(tips[0], a[k - 1], tips[1], a[k], apt, error_mm=0.05)
            if j > 0 and lost > above[k]:
                above[k], part[k] = lost, kinds[j]
            elif j == 0 and program.motion[k] == RAPID:
                rapid[k] = lost
        progress(k / n, "blank")
    return ChannelRemoval(before, stock.volume(), rapid, above, part)
