"""Tool bits of a FreeCAD library, LinuxCNC tool tables, and CUTTER and CIRCLE statements of a CAM system."""

from __future__ import annotations

import math
import os
import re
from pathlib import Path

import pytest

from chipload.cutter.cutter import Cutter
from chipload.cutter.fctb import SHAPES, read_fctb
from chipload.cutter.table import cutter_from_table
from chipload.cutter.tooltable import read_tool_table
from chipload.errors import InputError
from chipload.program.apt.writer import cutter_statement

DATA = Path(os.environ.get("CHIPLOAD_DATA", Path(__file__).parents[3] / "shared" / "data"))
TOOLS, APT = DATA / "machines_tools", DATA / "nc" / "apt_dmu50" / "apt"
BITS = sorted(TOOLS.glob("**/*.fctb"))
TABLES = sorted(TOOLS.glob("**/*.tbl"))
pytestmark = pytest.mark.skipif(not BITS, reason=f"no real files in {DATA}: set CHIPLOAD_DATA")


def test_every_tool_bit_is_read_or_refused():
    read = {}
    for path in BITS:
        shape = re.search(r'"shape": "(\w+)\.fcstd"', path.read_text())[1]
        if shape in SHAPES:
            read[path.stem[:8]] = read_fctb(path)
        else:
            with pytest.raises(InputError, match=f"shape {shape}: must be one of endmill, ballend, torus, bullnose"):
                read_fctb(path)
    assert len(BITS) == 16
    assert len(read) == 14  # all but a probe and a chamfer mill; six of them since points, V-bits and bodies are read
    assert sorted(name for name, own in read.items() if "body_mm" in own) == [
        "2a2863e0", "4515b6a2", "861cf098", "ecf494c4"
    ]  # fmt: skip
    assert read["b4643d72"]["bottom_deg"] == 30.5  # 119 deg
    assert read["4f1877a0"] == {
        "name": "New Torus",
        "diameter_mm": 5.0,
        "flute_length_mm": 30.0,
        "shank_diameter_mm": 3.0,
        "overhang_mm": 33.0,
        "flutes": 1,
        "corner_radius_mm": 1.0,
    }
    assert read["f1f77e26"]["corner_radius_mm"] == 1.25
    assert read["fd6e7498"]["overhang_mm"] == 10.0  # "1 cm"
    assert read["fd6e7498"]["shank_diameter_mm"] == 3.175


def test_a_real_tool_bit_makes_a_cutter():
    path = next(p for p in BITS if p.stem.startswith("f8bf7824"))
    job = {"number": 1, "file": path.name, "helix_deg": 0.0, "overhang_mm": 40.0, "modulus_gpa": 210.0}
    c = cutter_from_table(job, path.parent)
    assert (c.diameter, c.flutes, c.flute_length, c.shank_diameter) == (12.65, 2, 26.0, 8.0)


def test_every_tool_table_is_read():
    count = 0
    for path in TABLES:
        numbers = [int(n) for n in re.findall(r"^T(\d+)", path.read_text(errors="replace"), re.M)]
        for n in set(numbers):
            if numbers.count(n) > 1:
                with pytest.raises(InputError, match=f"tool {n} appears twice"):
                    read_tool_table(path, n, "mm")
            else:
                assert read_tool_table(path, n, "mm")["number"] == n
                count += 1
    assert count == 94
    gantry = next(p for p in TABLES if "Gantry" in str(p))
    assert read_tool_table(gantry, 22, "mm") == {"number": 22, "name": "Messerkopf Zweischneider", "diameter_mm": 16.15}


def test_cutter_statements_are_reproduced():
    """Corner centre e, f of every CUTTER statement of the CAM system, from d, r, alpha and beta alone."""
    seen = 0
    for path in sorted(APT.glob("*.apt")):
        for line in set(re.findall(r"^CUTTER/\s*([-0-9., ]+)", path.read_text(errors="replace"), re.M)):
            d, r, e, f, alpha, beta, h = (float(x) for x in line.strip().strip(",").split(","))
            c = Cutter(d, 2, 0.0, h, h, 6e5, r, bottom=math.radians(alpha), taper=math.radians(beta))
            assert c.apt[2:4] == pytest.approx((e, f), abs=2e-6)
            again = [float(x) for x in cutter_statement(c).partition("/")[2].split(",")]
            assert again == pytest.approx([d, r, e, f, alpha, beta, h], abs=2e-6)
            Cutter(d, 2, 0.0, h, h, 6e5, r, e, f, math.radians(alpha), math.radians(beta))
            seen += 1
    assert seen > 40


def test_circle_records_mean_what_we_write():
    """The sense that we write, +1 counter-clockwise, is the CAM system's: its fillets then turn by under 180 deg."""
    short = long = 0
    for path in sorted(APT.glob("*.apt")):
        lines = path.read_text(errors="replace").splitlines()
        for a, b, c in zip(lines, lines[1:], lines[2:], strict=False):
            if not (a.startswith("GOTO/") and b.startswith("CIRCLE/") and c.startswith("GOTO/")):
                continue
            (x0, y0), (x1, y1) = ([float(x) for x in s.partition("/")[2].split(",")[:2]] for s in (a, c))
            cx, cy, _, i, j, sense = (float(x) for x in b.partition("/")[2].split(","))
            if i or j:
                continue
            turn = math.atan2(y1 - cy, x1 - cx) - math.atan2(y0 - cy, x0 - cx)
            turn = (sense * turn) % math.tau
            short += turn < math.pi + 1e-3
            long += turn >= math.pi + 1e-3
    assert short > 300
    assert long < 0.1 * short
