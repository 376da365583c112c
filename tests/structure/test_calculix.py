"""CalculiX on the same mesh."""

from __future__ import annotations

import shutil
import subprocess

import numpy as np
import pytest

from chipload.structure.grid import from_map
from chipload.structure.modes import modes
from chipload.structure.solid import SolidWorkpiece, displacement, factorise

pytestmark = pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX (ccx) is not installed")

E, NU, RHO = 1.14e5, 0.34, 4.43e-9


def twisted():
    def place(p):
        a = 0.4 * p[:, 1]
        x, z = 30.0 * (p[:, 0] - 0.5), (3.0 - p[:, 1]) * (p[:, 2] - 0.5)
        return np.stack([x * np.cos(a) + z * np.sin(a), 40.0 * p[:, 1], z * np.cos(a) - x * np.sin(a)], axis=1)

    return from_map(np.linspace(0, 1, 6), np.linspace(0, 1, 7), [0.0, 0.5, 1.0], place)


def deck(grid, step):
    """A text for ccx: mesh, material, clamped root."""
    lines = ["*NODE, NSET=ALL"]
    lines += [f"{i + 1}, {x:.12e}, {y:.12e}, {z:.12e}" for i, (x, y, z) in enumerate(grid.nodes)]
    lines.append("*ELEMENT, TYPE=C3D20, ELSET=PART")
    for i, e in enumerate(grid.elements + 1):
        lines.append(f"{i + 1}, " + ", ".join(map(str, e[:10])) + ",")
        lines.append(", ".join(map(str, e[10:])))
    lines += ["*MATERIAL, NAME=M", "*ELASTIC", f"{E:.12e}, {NU:.12e}", "*DENSITY", f"{RHO:.12e}"]
    lines += ["*SOLID SECTION, ELSET=PART, MATERIAL=M", "*BOUNDARY"]
    lines += [f"{i + 1}, 1, 3" for i in grid.side("j-")]
    return "\n".join([*lines, "*STEP", *step, "*END STEP", ""])


def run(text, folder):
    (folder / "part.inp").write_text(text)
    subprocess.run(["ccx", "part"], cwd=folder, check=True, stdout=subprocess.DEVNULL)
    return (folder / "part.dat").read_text()


@pytest.mark.parametrize(("kind", "rule"), [("C3D20", 27), ("C3D20R", 8)])
def test_displacements(tmp_path, kind, rule):
    grid = twisted()
    solid = SolidWorkpiece(grid, E, NU, RHO, grid.side("j-"), rule=rule)
    tip = grid.side("j+")
    force = np.zeros(grid.nodes.shape)
    force[tip] = np.random.default_rng(1).standard_normal((len(tip), 3))
    step = ["*STATIC", "*CLOAD"]
    step += [f"{i + 1}, {c + 1}, {force[i, c]:.12e}" for i in tip for c in range(3)]
    text = deck(grid, [*step, "*NODE PRINT, NSET=ALL", "U"]).replace("C3D20", kind)
    rows = [line.split() for line in run(text, tmp_path).splitlines()]
    theirs = np.array([[float(x) for x in r[1:]] for r in rows if len(r) == 4 and r[0].isdigit()])
    assert theirs.shape == grid.nodes.shape
    ours = displacement(factorise(solid), force)
    np.testing.assert_allclose(ours, theirs, rtol=0.0, atol=1e-6 * abs(theirs).max())


def test_frequencies(tmp_path):
    grid = twisted()
    text = run(deck(grid, ["*FREQUENCY", "6"]), tmp_path)
    rows = [line.split() for line in text.split("P A R T I C I P A T I O N")[0].splitlines()]
    theirs = [float(r[3]) for r in rows if len(r) == 5 and r[0].isdigit()]
    assert len(theirs) == 6
    ours, _ = modes(factorise(SolidWorkpiece(grid, E, NU, RHO, grid.side("j-"))), 6)
    np.testing.assert_allclose(ours, theirs, rtol=1e-5)
