"""A result written by hand: the cutter goes round a square, and every number of it is known."""

import hashlib
import json
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import trimesh

ROWS = 200
#: hand-made history: the cutter goes round a square of 40 mm, 0.1 s a step, one line of the program a side
SIDE = np.repeat(np.arange(4), ROWS // 4)
ALONG = np.tile(np.arange(1, ROWS // 4 + 1), 4) * 0.8
X = np.select([SIDE == 0, SIDE == 1, SIDE == 2], [ALONG, np.full(ROWS, 40.0), 40.0 - ALONG], 0.0)
Y = np.select([SIDE == 0, SIDE == 1, SIDE == 2], [np.zeros(ROWS), ALONG, np.full(ROWS, 40.0)], 40.0 - ALONG)
T = 0.1 * np.arange(1, ROWS + 1)
#: force rises to 900 N at row 120 and falls again, feed is 480 mm/min but for the last side
FORCE = 900.0 - 7.0 * np.abs(np.arange(ROWS) - 120.0)
FEED = np.where(SIDE == 3, 240.0, 480.0)
#: line of the program of each side
LINE = np.array([7, 8, 9, 10])[SIDE]
PROGRAM = "(square)\nG21 G90\nT1 M6\nS3000 M3\nG0 X0 Y0 Z5\nG1 Z-2 F480\nX40\nY40\nX0\nY0 F240\nM2\n"
CL = (
    "UNITS/MM\nCUTTER/8,1\nLOADTL/1\nRAPID\nGOTO/0,0,-2\nFEDRAT/480,MMPM\n"
    "GOTO/40,0,-2\nGOTO/40,40,-2\nGOTO/0,40,-2\nGOTO/0,0,-2\nFINI\n"
)


def make_result(folder: Path, job: str = "square", program: bytes = PROGRAM.encode(), scene: bool = True) -> Path:
    """A result of a simulated program, written by hand."""
    folder.mkdir(parents=True)
    columns = {
        "operation": np.zeros(ROWS, dtype=np.int32),
        "strategy": pa.array(["program"] * ROWS),
        "pass": pa.array(["square"] * ROWS),
        "line": LINE,
        "tool": np.ones(ROWS, dtype=np.int64),
        "s_mm": 0.8 * np.arange(1, ROWS + 1),
        "t_s": T,
        "x_mm": X,
        "y_mm": Y,
        "z_mm": np.full(ROWS, -2.0),
        "feed_mm_min": FEED,
        "force_n": FORCE,
        "torque_nm": FORCE / 100.0,
    }
    pq.write_table(pa.table(columns), folder / "history.parquet")
    limits = [
        {"name": "force_n", "limit": 800.0, "worst": 900.0, "line": 9, "at_mm": [23.2, 40.0, -2.0], "holds": False},
        {"name": "torque_nm", "limit": 12.0, "worst": 9.0, "line": 9, "at_mm": [23.2, 40.0, -2.0], "holds": True},
    ]
    fails = ["force 900 N exceeds 800 N in line 9", "line 8: a rapid goes through material"]
    summary = {
        "holds": False,
        "says": "Does not hold: force 900 N exceeds 800 N in line 9; and 1 more.",
        "job": job,
        "program": {"status": "failed"},
        "operations": [
            {"kind": "simulate", "holds": False, "fails": fails, "limits": limits, "unchecked": ["power_w"]}
        ],
        "findings": [{"code": "x", "line": 3, "text": "no tool table"}],
        "provenance": {"inputs": {"program": f"square.ngc sha256 {hashlib.sha256(program).hexdigest()}"}},
    }
    (folder / "summary.json").write_text(json.dumps(summary))
    (folder / "0-program.apt").write_text(CL)
    (folder / "report.html").write_text("<p>the report</p>")
    if scene:
        box = trimesh.creation.box(extents=(60.0, 60.0, 10.0))
        box.apply_translation((20.0, 20.0, -7.0))
        box.visual.face_colors = (168, 122, 58, 255)
        made = trimesh.Scene()
        made.add_geometry(box, node_name="stock", geom_name="stock")
        (folder / "scene.glb").write_bytes(made.export(file_type="glb", extension_webp=False))
    return folder
