"""Stock that a program states: WORKPIECE of a Sinumerik, BLK FORM of a Heidenhain. Oracle: corners by hand."""

import pytest

from chipload.jobs.drafts.comments import read_header


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
