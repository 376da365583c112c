"""Stock that a program states: WORKPIECE of a Sinumerik, BLK FORM of a Heidenhain. Oracle: corners by hand."""

from pathlib import Path

import pytest

from chipload.jobs.drafts.comments import read_header
from chipload.jobs.drafts.program import draft_program


@pytest.mark.parametrize(
    ("statement", "low", "high"),
    [
        ('WORKPIECE(,"",,"BOX",112,0,-23,,92,59,-92,-59)', (-92, -59, -23), (92, 59, 0)),
        ('WORKPIECE(,,,"BOX",112,1,-20,-80,0,0,100,50)', (0, 0, -20), (100, 50, 1)),
        ('WORKPIECE(,"",,"BOX",0,0,-20,,-5,-5,100,60)', (-5, -5, -20), (95, 55, 0)),
        ('WORKPIECE(,"",,"BOX",64,2,-20,,0,0,40,30)', (0, 0, -20), (40, 30, 2)),
        ('WORKPIECE(,,,"CYLINDER",192,0,-30,-80,50)', (-25, -25, -30), (25, 25, 0)),
        ("BLK FORM 0.1 Z X+0 Y-120 Z-28\nBLK FORM 0.2 X+120 Y+0 Z+0", (0, -120, -28), (120, 0, 0)),
        ("BLK FORM CYLINDER Z R50 L80 DIST+1", (-50, -50, -79), (50, 50, 1)),
        (
            "BEGIN PGM A INCH\nBLK FORM 0.1 Z X+0 Y+0 Z-1\nBLK FORM 0.2 X+4 Y+2 Z+0",
            (0, 0, -25.4),
            (101.6, 50.8, 0),
        ),
    ],
)
def test_a_stated_block(statement, low, high):
    stock = read_header(statement).stock
    assert stock is not None
    assert stock[0] == (pytest.approx(low), pytest.approx(high))


def test_inches():
    stock = read_header('WORKPIECE(,"",,"BOX",112,0,-1,,0,0,4,2)', mm=25.4).stock
    assert stock is not None
    assert stock[0][1] == pytest.approx((101.6, 50.8, 0.0))


def test_a_tool_whose_cycle_is_left_out_has_its_cutter(tmp_path: Path):
    """It cuts, though not in what is read: the job names it, and what it does is unproven."""
    path = tmp_path / "part.mpf"
    head = "G71 G90 G17 G94 G54\n"
    path.write_text(
        f"{head}T1\nM6\nS900 M3\nG0 X0 Y0 Z9\nG1 Z-1 F90\nX9\nG0 Z9\nT2\nM6\nS900 M3\nG0 X50 Y50 Z9\n"
        'CYCLE72("CONTOUR",20,0,2,-10)\nG0 Z50\nT3\nM6\nG0 X0\nM30\n'
    )
    draft = draft_program(path, tmp_path)
    assert [{e.key: e.value for e in t.entries}["number"] for t in draft.tables if t.name == "cutter"] == [1, 2]
