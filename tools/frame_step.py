"""Write the STEP model of a frame with two pockets: walls and a rib around them, a floor below.

    python tools/frame_step.py FILE [LENGTH WIDTH HEIGHT WALL FLOOR CORNER]

The origin is at the lower left corner of the top. Without sizes [mm] it is 50 x 30 x 12 with walls of 1.2, a floor of
1.5 and corners of R 4; the example has `40 24 10 1.5 2 4`. It needs the CAD kernel of chipload.
"""

from __future__ import annotations

import sys
from pathlib import Path

#: [mm] length, width, height, thickness of walls and floor, radius of the corners
SIZES = (50.0, 30.0, 12.0, 1.2, 1.5, 4.0)


def write_frame(path: Path, sizes: tuple[float, ...] = SIZES) -> None:
    """Write the model of the sizes [mm] in the order of :data:`SIZES`."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
    from OCP.BRepFilletAPI import BRepFilletAPI_MakeFillet
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
    from OCP.gp import gp_Pnt
    from OCP.Message import Message, Message_Fail
    from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer
    from OCP.TopAbs import TopAbs_EDGE
    from OCP.TopExp import TopExp, TopExp_Explorer
    from OCP.TopoDS import TopoDS

    length, width, height, wall, floor, corner = sizes
    for printer in Message.DefaultMessenger_s().Printers():
        printer.SetTraceLevel(Message_Fail)
    body = BRepPrimAPI_MakeBox(gp_Pnt(0.0, 0.0, -height), gp_Pnt(length, width, 0.0)).Shape()
    middle = 0.5 * length
    for x0, x1 in ((wall, middle - 0.5 * wall), (middle + 0.5 * wall, length - wall)):
        low, high = gp_Pnt(x0, wall, floor - height), gp_Pnt(x1, width - wall, 1.0)
        pocket = BRepPrimAPI_MakeBox(low, high).Shape()
        rounded, edges = BRepFilletAPI_MakeFillet(pocket), TopExp_Explorer(pocket, TopAbs_EDGE)
        while edges.More():
            edge = TopoDS.Edge(edges.Current())
            ends = TopExp.FirstVertex_s(edge), TopExp.LastVertex_s(edge)
            if abs(_height(ends[0]) - _height(ends[1])) > 1.0:
                rounded.Add(corner, edge)
            edges.Next()
        body = BRepAlgoAPI_Cut(body, rounded.Shape()).Shape()
    writer = STEPControl_Writer()
    writer.Transfer(body, STEPControl_AsIs)
    writer.Write(str(path))


def _height(vertex: object) -> float:
    from OCP.BRep import BRep_Tool

    return float(BRep_Tool.Pnt_s(vertex).Z())


if __name__ == "__main__":
    write_frame(Path(sys.argv[1]), tuple(map(float, sys.argv[2:])) or SIZES)
