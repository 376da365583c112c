"""Normal compliance of a wall while it is cut: low-rank correction, refactoring, CalculiX.

    python benchmarks/structure.py [ROWS]

A wall of 120 x 60 mm, finish 2 mm and stock 1 mm on one side, of titanium, clamped below; ROWS (20) x 2 ROWS x 2
elements. The stock is taken from the free edge downwards, along the rows, in layers of 1, 4 and 12 elements and of a
whole row, four layers of each; after each layer C_nn at 61 places of the finish wall. All do the same on the same mesh
in the same run:

* correction: ``cut`` and ``compliance``; what was solved ahead (columns of the stock of these rows, the 61 forces) is
  given above the table, once for all layers
* refactoring: assemble, factor, solve the 61 forces, with our own factors
* CalculiX: ``ccx`` with the 61 forces, each a step of its own (one and three steps are run, the rest is extrapolated)

Then whole rows again, all states of a pass at once by elimination from both sides (``tests/row_elimination.py``): a
layer of two that goes, and a wall of one layer that is thinned, as the planner has it. ``all`` is everything that it
takes, a state; ``join`` what one more state takes once both sides are eliminated.

Times are processor seconds of this process and of ``ccx``; with OPENBLAS_NUM_THREADS=1 they do not depend on what else
the computer does.

Then: how the solution of many right-hand sides compares with that of SuperLU itself, and at which rank a correction
without columns solved ahead takes as long as factoring again.
"""

import os
import shutil
import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from chipload.structure.grid import from_map
from chipload.structure.places import normals_of, on_side
from chipload.structure.removal import cut, prepare, start
from chipload.structure.solid import SolidWorkpiece, compliance, factorise, loads
from chipload.structure.unit_loads import compliance as corrected
from chipload.structure.unit_loads import watch
from row_elimination import row_compliances

PLACES = 61


def spent() -> float:
    """Processor seconds of this process and of those that it has waited for."""
    used = os.times()
    return used.user + used.system + used.children_user + used.children_system


def timed(call):
    begun = spent()
    value = call()
    return value, spent() - begun


def wall(rows: int, layers: int = 2) -> SolidWorkpiece:
    u, v = np.linspace(0.0, 120.0, 2 * rows + 1), np.linspace(0.0, 60.0, rows + 1)
    grid = from_map(u, v, [0.0, 2.0, 3.0] if layers == 2 else [0.0, 3.0], lambda p: p)
    return SolidWorkpiece(grid, 1.14e5, 0.34, 4.43e-9, grid.side("j-"))


def deck(solid: SolidWorkpiece, steps: int, F) -> str:
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


def by_calculix(solid: SolidWorkpiece, F, steps: int) -> float:
    with tempfile.TemporaryDirectory() as name:
        (Path(name) / "part.inp").write_text(deck(solid, steps, F))
        run = ["ccx", "part"]
        return timed(lambda: subprocess.run(run, cwd=name, check=True, stdout=subprocess.DEVNULL))[1]


def calculix_times(solid: SolidWorkpiece, F) -> tuple[float, float]:
    """Seconds of one force, and of each further one."""
    one, three = by_calculix(solid, F, 1), by_calculix(solid, F, 3)
    return one, (three - one) / 2.0


def row(solid: SolidWorkpiece, below: int):
    """Stock of one row, counted from the free edge."""
    columns, rows, _ = solid.grid.counts
    return solid.grid.element(np.arange(columns), np.full(columns, rows - 1 - below), 1)


def by_rows(name: str, solid: SolidWorkpiece, left: float, ccx: float) -> None:
    """A line of the table of whole rows."""
    grid = solid.grid
    _, rows, layers = grid.counts
    places = on_side(grid, "k-", np.linspace(0.0, 1.0, PLACES), np.full(PLACES, 0.9))
    normals = normals_of(grid, places, "k-")
    after = np.tile([0.0, 1.0], (len(grid.elements), 1))
    after[layers - 1 :: layers] = [0.0, left]
    _, t_ends = timed(lambda: row_compliances(solid, after, places, normals, side="j+", cut=[0, rows]))
    found, t_all = timed(lambda: row_compliances(solid, after, places, normals, side="j+"))
    kept = np.tile([0.0, 1.0], (len(grid.elements), 1))
    half = rows // 2
    top = np.arange(len(grid.elements)).reshape(grid.counts)[:, rows - half :].ravel()
    kept[top] = after[top]
    now = replace(solid, kept=kept)
    expected, t_anew = timed(lambda: compliance(factorise(now), places, normals))
    each, join = t_all / (rows + 1), max(t_all - t_ends, 0.0) / (rows - 1)
    other = f"{ccx / each:.0f}" if ccx else "not run"
    print(f"| {name} | {each:.3f} | {1e3 * join:.0f} | {t_anew:.2f} | {t_anew / each:.1f} | ", end="")
    print(
        f"{t_anew / join if join else np.inf:.0f} | {other} | {abs(found[half] / expected - 1.0).max():.0e} |",
        flush=True,
    )


def main() -> None:
    solid = wall(int(sys.argv[1]) if len(sys.argv) > 1 else 20)
    grid = solid.grid
    places = on_side(grid, "k-", np.linspace(0.0, 1.0, PLACES), np.full(PLACES, 0.9))
    normals = normals_of(grid, places, "k-")
    small = factorise(wall(3))
    small.solve(np.ones((len(small.free), 8)), np.arange(3))  # compiles
    base, t_factor = timed(lambda: factorise(solid))
    n = len(base.free)
    first = start(base, np.concatenate([row(solid, k) for k in range(4)]), limit=10**9)
    watched, t_watch = timed(lambda: watch(first, places, normals))
    lazy, t_lazy = timed(lambda: cut(first, row(solid, 0)))
    ready, t_ahead = timed(lambda: prepare(first))
    print(f"{n} degrees of freedom; factored once {t_factor:.2f} s; {PLACES} forces {t_watch:.2f} s; ", end="")
    print(f"{len(ready.columns.known)} columns ahead {t_ahead:.2f} s")
    ccx = 0.0
    if shutil.which("ccx"):
        F = np.zeros((3 * len(grid.nodes), 3))
        F[base.free] = loads(base, places, normals)[:, [0, 1, 2]].toarray()
        one, further = calculix_times(solid, F)
        ccx = one + (PLACES - 1) * further
        print(f"CalculiX: one force {one:.2f} s, each further {further:.2f} s, {PLACES} forces {ccx:.0f} s")
    print(
        "\n| elements a layer | rank | correction [ms] | refactoring [s] | ratio | CalculiX / correction | difference |"
    )
    print("|---|---|---|---|---|---|---|")
    for size in (1, 4, 12, grid.counts[0]):
        state, ours, anew, ranks, worst = ready, 0.0, 0.0, [], 0.0
        order = np.concatenate([row(solid, k) for k in range(4)])
        for k in range(4):
            elements = order[k * size : (k + 1) * size]
            state, t_cut = timed(lambda state=state, elements=elements: cut(state, elements))
            values, t_read = timed(lambda state=state: corrected(state, watched))
            now = replace(solid, kept=state.solid.kept)
            expected, t_anew = timed(lambda now=now: compliance(factorise(now), places, normals))
            ours, anew = ours + (t_cut + t_read) / 4, anew + t_anew / 4
            ranks.append(state.rank)
            worst = max(worst, abs(values / expected - 1.0).max())
        other = f"{ccx / ours:.0f}" if ccx else "not here"
        print(f"| {size} | {min(ranks)} to {max(ranks)} | {1e3 * ours:.0f} | {anew:.2f} | {anew / ours:.1f} ", end="")
        print(f"| {other} | {worst:.0e} |", flush=True)
    print(
        "\n| pass | all [s a state] | join [ms] | refactoring [s] | ratio, all | ratio, join | CalculiX / all ", end=""
    )
    print("| difference |\n|---|---|---|---|---|---|---|---|")
    for name, part, left in (("layer gone", solid, 0.0), ("thinned by a third", wall(grid.counts[1], 1), 2.0 / 3.0)):
        by_rows(name, part, left, ccx if part is solid else 0.0)
    right = np.random.default_rng(0).standard_normal((n, 64))
    t_theirs = timed(lambda: base.factors.lu.solve(right))[1] / 64.0
    t_ours = timed(lambda: base.solve(right))[1] / 64.0
    print(f"\none right-hand side of 64: ours {1e3 * t_ours:.1f} ms, SuperLU {1e3 * t_theirs:.1f} ms")
    even = lazy.rank * anew / t_lazy
    print(
        f"nothing solved ahead: rank {lazy.rank} in {t_lazy:.2f} s; refactoring takes as long as rank {even:.0f} ",
        end="",
    )
    print(f"= {even / np.sqrt(n):.1f} sqrt(n)")


if __name__ == "__main__":
    main()
