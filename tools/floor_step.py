"""Write the part of the example of a thin floor: a web of 1.5 mm in a frame that is open at one end, as a STEP file.

python tools/floor_step.py examples/part/web.step
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
from OCP.gp import gp_Pnt
from OCP.Interface import Interface_Static
from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer

#: corners [mm] of the frame, of the pockets above and below the web, open towards +x
FRAME = ((0, 0, 0), (46, 36, 10))
POCKETS = (((3, 3, 5), (47, 33, 10)), ((3, 3, 0), (47, 33, 3.5)))


def main(path: Path) -> None:
    """Write the file; its date is left out, so that it is the same every time."""
    whole = BRepPrimAPI_MakeBox(*(gp_Pnt(*p) for p in FRAME)).Shape()
    for low, high in POCKETS:
        whole = BRepAlgoAPI_Cut(whole, BRepPrimAPI_MakeBox(gp_Pnt(*low), gp_Pnt(*high)).Shape()).Shape()
    writer = STEPControl_Writer()
    Interface_Static.SetCVal_s("write.step.unit", "MM")
    writer.Transfer(whole, STEPControl_AsIs)
    writer.Write(str(path))
    text = path.read_text()
    path.write_text(re.sub(r"'\d{4}-\d\d-\d\dT[\d:]+'", "'2026-01-01T00:00:00'", text))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
