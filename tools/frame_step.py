"""Write the STEP model of the example frame: 50 x 30 x 12 mm, two pockets with corners of R 4, walls and rib 1.2 mm.

    python tools/frame_step.py FILE

The origin is at the lower left corner of the top, the floor is 1.5 mm thick. It needs the CAD kernel of chipload.
"""

from __future__ import annotations

import sys
from pathlib import Path

LENGTH, WIDTH, HEIGHT, WALL, FLOOR, CORNER = 50.0, 30.0, 12.0, 1.2, 1.5, 4.0


def write_frame(path: Path) -> None:
    """Write the model."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
    from OCP.BRepFilletAPI import BRepFilletAPI_MakeFillet
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
    from OCP.gp import gp_Pnt
    from OCP.Message import Message, Message_Fail
    from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer
    from OCP.TopAbs import TopAbs_EDGE
    from OCP.TopExp import TopExp, TopExp_Explorer
    from OCP.TopoDS import TopoDS

    for printer in Message.DefaultMessenger_s().Printers():
        printer.SetTraceLevel(Message_Fail)
    body = BRepPrimAPI_MakeBox(gp_Pnt(0.0, 0.0, -HEIGHT), gp_Pnt(LENGTH, WIDTH, 0.0)).Shape()
    middle = 0.5 * LENGTH
    for x0, x1 in ((WALL, middle - 0.5 * WALL), (middle + 0.5 * WALL, LENGTH - WALL)):
        low, high = gp_Pnt(x0, WALL, FLOOR - HEIGHT), gp_Pnt(x1, WIDTH - WALL, 1.0)
        pocket = BRepPrimAPI_MakeBox(low, high).Shape()
        rounded, edges = BRepFilletAPI_MakeFillet(pocket), TopExp_Explorer(pocket, TopAbs_EDGE)
        while edges.More():
            edge = TopoDS.Edge(edges.Current())
            ends = TopExp.FirstVertex_s(edge), TopExp.LastVertex_s(edge)
            if abs(_height(ends[0]) - _height(ends[1])) > 1.0:
                rounded.Add(CORNER, edge)
            edges.Next()
        body = BRepAlgoAPI_Cut(body, rounded.Shape()).Shape()
    writer = STEPControl_Writer()
    writer.Transfer(body, STEPControl_AsIs)
    writer.Write(str(path))


def _height(vertex: object) -> float:
    from OCP.BRep import BRep_Tool

    return float(BRep_Tool.Pnt_s(vertex).Z())


if __name__ == "__main__":
    write_frame(Path(sys.argv[1]))
