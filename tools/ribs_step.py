"""Write the part of the example of several walls: a floor with two ribs, as a STEP file.

python tools/ribs_step.py examples/part/ribs.step
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

from OCP.BRepAlgoAPI import BRepAlgoAPI_Fuse
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
from OCP.gp import gp_Pnt
from OCP.Interface import Interface_Static
from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer

#: corners [mm] of the floor and of the ribs
BOXES = (((0, 0, 0), (12, 27, 6)), ((0, 3, 6), (12, 6, 18)), ((0, 21, 6), (12, 24, 16)))


def main(path: Path) -> None:
    """Write the file; its date is left out, so that it is the same every time."""
    whole = None
    for low, high in BOXES:
        box = BRepPrimAPI_MakeBox(gp_Pnt(*low), gp_Pnt(*high)).Shape()
        whole = box if whole is None else BRepAlgoAPI_Fuse(whole, box).Shape()
    writer = STEPControl_Writer()
    Interface_Static.SetCVal_s("write.step.unit", "MM")
    writer.Transfer(whole, STEPControl_AsIs)
    writer.Write(str(path))
    text = path.read_text()
    path.write_text(re.sub(r"'\d{4}-\d\d-\d\dT[\d:]+'", "'2026-01-01T00:00:00'", text))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
