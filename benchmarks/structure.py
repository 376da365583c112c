"""Normal compliance of a wall, layer by layer of its removal: low-rank correction, refactoring, CalculiX.

    python benchmarks/structure.py [ROWS [LAYERS]]

A wall of 120 x 60 mm, finish 2 mm and stock 1 mm on one side, of titanium, clamped below; ROWS (24) x 2 ROWS x 2 elements.
From the free edge down the stock is taken off row by row (a layer), LAYERS (6) of them; after each, C_nn at 61 places of the
finish wall. All three do the same on the same mesh in the same run:

* correction: ``cut`` and ``compliance``; what was solved ahead (columns of the stock of these layers, the 61 forces) is
  given beside it, once for all layers
* refactoring: assemble, factor, solve 61 forces, with our own factors
* CalculiX: one run of ``ccx`` for one force; times 61 where every force is a step of its own. Both are given

Then: how the solution of many right-hand sides compares with that of SuperLU itself, and at which rank a correction
without columns solved ahead costs as much as factoring again.
"""

import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from chipload.structure.grid import from_map
from chipload.structure.places import normals_of, on_side
from chipload.structure.removal import cut, prepare, start
from chipload.structure.solid import Solid, compliance, factorise, loads
from chipload.structure.watched import compliance as corrected
from chipload.structure.watched import watch

PLACES = 61


def timed(call):
    begun = time.perf_counter()
    value = call()
    return value, time.perf_counter() - begun


def wall(rows: int) -> Solid:
    u, v = np.linspace(0.0, 120.0, 2 * rows + 1), np.linspace(0.0, 60.0, rows + 1)
    grid = from_map(u, v, [0.0, 2.0, 3.0], lambda p: p)
    return Solid(grid, 1.14e5, 0.34, 4.43e-9, grid.side("j-"))


def deck(solid: Solid, steps: int, F) -> str:
    """Text for ccx with the first forces, one a step."""
    grid = solid.grid
    lines = ["*NODE, NSET=ALL", *(f"{i + 1}, {x:.12e}, {y:.12e}, {z:.12e}" for i, (x, y, z) in enumerate(grid.nodes))]
    lines.append("*ELEMENT, TYPE=C3D20, ELSET=PART")
    for i in solid.there:
        e = [str(k + 1) for k in grid.elements[i]]
        lines += [f"{i + 1}, " + ", ".join(e[:10]) + ",", ", ".join(e[10:])]
    lines += ["*MATERIAL, NAME=M", "*ELASTIC", f"{solid.modulus:.12e}, {solid.poisson:.12e}"]
    lines += ["*SOLID SECTION, ELSET=PART, MATERIAL=M", "*BOUNDARY", *(f"{i + 1}, 1, 3" for i in grid.side("j-"))]
    lines += ["*NSET, NSET=SEEN", "1"]
    for k in range(steps):
        column = F[:, k]
        lines += ["*STEP", "*STATIC", "*CLOAD, OP=NEW"]
        lines += [f"{d // 3 + 1}, {d % 3 + 1}, {column[d]:.12e}" for d in np.flatnonzero(column)]
        lines += ["*NODE PRINT, NSET=SEEN", "U", "*END STEP"]
    return "\n".join([*lines, ""])


def by_calculix(solid: Solid, F, steps: int) -> float:
    with tempfile.TemporaryDirectory() as name:
        (Path(name) / "part.inp").write_text(deck(solid, steps, F))
        run = ["ccx", "part"]
        return timed(lambda: subprocess.run(run, cwd=name, check=True, stdout=subprocess.DEVNULL))[1]


def main() -> None:
    rows = int(sys.argv[1]) if len(sys.argv) > 1 else 24
    layers = int(sys.argv[2]) if len(sys.argv) > 2 else 6
    solid = wall(rows)
    grid = solid.grid
    places = on_side(grid, "k-", np.linspace(0.0, 1.0, PLACES), np.full(PLACES, 0.9))
    normals = normals_of(grid, places, "k-")
    every = np.arange(2 * rows)
    stock = [grid.element(every, np.full(2 * rows, rows - 1 - k), 1) for k in range(layers)]
    factorise(wall(3)).solve(np.ones((len(factorise(wall(3)).free), 8)), np.arange(3))  # compile
    base, t_factor = timed(lambda: factorise(solid))
    n = len(base.free)
    state = start(base, np.concatenate(stock), limit=10**9)
    watched, t_watch = timed(lambda: watch(state, places, normals))
    lazy = timed(lambda: cut(state, stock[0]))
    state, t_ahead = timed(lambda: prepare(state))
    print(f"{n} degrees of freedom; factored once {t_factor:.2f} s; {PLACES} forces {t_watch:.2f} s; ", end="")
    print(f"{len(state.columns.known)} columns ahead {t_ahead:.2f} s\n")
    has = shutil.which("ccx") is not None
    print("| layer | rank | correction [s] | refactoring [s] | ratio | ccx, 1 force [s] | ratio | difference |")
    print("|---|---|---|---|---|---|---|---|")
    total = np.zeros(3)
    for k, elements in enumerate(stock):

        def correction(elements=elements):
            new = cut(state, elements)
            return new, corrected(new, watched)

        (state, ours), t_ours = timed(correction)
        now = replace(solid, kept=state.solid.kept)
        anew, t_anew = timed(lambda now=now: compliance(factorise(now), places, normals))
        line = f"| {k + 1} | {state.rank} | {t_ours:.4f} | {t_anew:.2f} | {t_anew / t_ours:.1f} "
        t_ccx = 0.0
        if has:
            F = np.zeros((3 * len(grid.nodes), 1))
            F[base.free] = loads(base, places, normals)[:, [0]].toarray()
            t_ccx = by_calculix(now, F, 1)
            line += f"| {t_ccx:.2f} | {t_ccx / t_ours:.0f} "
        else:
            line += "| not here | "
        print(line + f"| {abs(ours / anew - 1.0).max():.1e} |", flush=True)
        total += (t_ours, t_anew, t_ccx)
    print(f"\nall layers: refactoring / correction {total[1] / total[0]:.1f}; ", end="")
    print(f"with what was solved ahead {(total[1] + t_watch) / (total[0] + t_ahead + t_watch):.1f}")
    if has:
        F = np.zeros((3 * len(grid.nodes), 3))
        F[base.free] = loads(base, places, normals)[:, [0, 1, 2]].toarray()
        more = (by_calculix(solid, F, 3) - by_calculix(solid, F[:, :1], 1)) / 2.0
        per_layer = total[2] / layers + (PLACES - 1) * more
        print(f"CalculiX, each further force {more:.2f} s; {PLACES} forces {per_layer:.0f} s a layer; ", end="")
        print(f"ratio to the correction {per_layer * layers / total[0]:.0f}")
    right = np.random.default_rng(0).standard_normal((n, 64))
    t_theirs = timed(lambda: base.factors.lu.solve(right))[1] / 64.0
    t_ours = timed(lambda: base.solve(right))[1] / 64.0
    print(f"one right-hand side of 64: ours {1e3 * t_ours:.1f} ms, SuperLU {1e3 * t_theirs:.1f} ms")
    rank, t_lazy = lazy[0].rank, lazy[1]
    even = rank * t_anew / t_lazy
    print(f"nothing solved ahead: rank {rank} in {t_lazy:.2f} s; as long as refactoring at rank {even:.0f} ", end="")
    print(f"= {even / np.sqrt(n):.1f} sqrt(n)")


if __name__ == "__main__":
    main()
