"""Write the parts of the examples of thin floors and of several walls as STEP files.

`web.step`: a web of 1.5 mm in a frame that is open at one end. `ribs.step`: a floor with two ribs.

python tools/part_steps.py src/chipload/examples/part/web.step
python tools/part_steps.py src/chipload/examples/part/ribs.step
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
from OCP.gp import gp_Pnt
from OCP.Interface import Interface_Static
from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer
from OCP.TopoDS import TopoDS_Shape

Corner = tuple[float, float, float]

#: corners [mm] of the frame, of the pockets above and below the web, open towards +x
FRAME = ((0, 0, 0), (46, 36, 10))
POCKETS = (((3, 3, 5), (47, 33, 10)), ((3, 3, 0), (47, 33, 3.5)))
#: corners [mm] of the floor and of the ribs on it
FLOOR = ((0, 0, 0), (12, 27, 6))
RIBS = (((0, 3, 6), (12, 6, 18)), ((0, 21, 6), (12, 24, 16)))


def box(low: Corner, high: Corner) -> TopoDS_Shape:
    """A box between two corners [mm]."""
    return BRepPrimAPI_MakeBox(gp_Pnt(*low), gp_Pnt(*high)).Shape()


def write(shape: TopoDS_Shape, path: Path) -> None:
    """Write a file without its date: the same part gives the same bytes."""
    writer = STEPControl_Writer()
    Interface_Static.SetCVal_s("write.step.unit", "MM")
    writer.Transfer(shape, STEPControl_AsIs)
    writer.Write(str(path))
    text = path.read_text()
    path.write_text(re.sub(r"'\d{4}-\d\d-\d\dT[\d:]+'", "'2026-01-01T00:00:00'", text))


def web() -> TopoDS_Shape:
    """A web in a frame."""
    shape = box(*FRAME)
    for pocket in POCKETS:
        shape = BRepAlgoAPI_Cut(shape, box(*pocket)).Shape()
    return shape


def ribs() -> TopoDS_Shape:
    """A floor with two ribs."""
    shape = box(*FLOOR)
    for rib in RIBS:
        shape = BRepAlgoAPI_Fuse(shape, box(*rib)).Shape()
    return shape


if __name__ == "__main__":
    file = Path(sys.argv[1])
    write({"web": web, "ribs": ribs}[file.stem](), file)
