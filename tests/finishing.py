"""The finishing that tests of contours plan, and the contours of a corner and a pocket."""

import math

from chipload.geometry.contour import Contour
from chipload.planning.contour.plan import Finishing

QUARTER = math.tan(math.pi / 8)
CORNER = Contour.from_bulges([(0, 0), (20, 0), (28, 8), (28, 28)], [0, QUARTER, 0, 0])
POCKET = Contour.from_bulges(
    [(8, 0), (40, 0), (48, 8), (48, 30), (40, 38), (8, 38), (0, 30), (0, 8)], [0, QUARTER] * 4, closed=True
)
FINISHING = Finishing(
    side="inside",
    milling="down",
    strategies=("plain", "backward"),
    use="backward",
    joint="sharp",
    radial_depth=0.1,
    axial_depth=5.0,
    semifinish_depth=0.5,
    passes=1,
    feed=10.0,
    spindle_speed=314.0,
    tolerance=0.05,
    step=0.1,
    lead=3.0,
    top=0.0,
    clearance=5.0,
)
