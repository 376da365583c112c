"""Conversion of a shape in the CAD kernel's own format (`.brp`, as in files of FreeCAD) to STEP, in mm.

The kernel runs in a separate process, see :mod:`chipload.geometry.isolated`.
"""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from chipload.errors import InputError
from chipload.geometry.isolated import Isolated
from chipload.geometry.step import LARGEST_FILE, Part


def step_of_brep(data: bytes, name: str) -> bytes:
    """The shape as the text of a STEP file.

    Raises
    ------
    InputError
        The data are too large, the kernel cannot read them, or the shape has no faces.
    """
    if len(data) > LARGEST_FILE:
        raise InputError(f"{name}: {len(data)} bytes: must be at most {LARGEST_FILE}")
    with TemporaryDirectory(prefix="chipload-") as folder:
        file = Path(folder) / "shape.brp"
        file.write_bytes(data)
        target = Path(folder) / "shape.step"
        with Isolated(file, name, "brep.read_shape") as part:
            part.call("brep.write_step", str(target))
        text = target.read_bytes()
    # the time of day in the header would differ from run to run
    return b"\n".join(line for line in text.splitlines() if not line.startswith(b"FILE_NAME")).replace(
        b"FILE_SCHEMA", b"FILE_NAME('part','',(''),(''),'','','');\nFILE_SCHEMA", 1
    )


# -- in the process of the CAD kernel ---------------------------------------------------------------------------
def read_shape(path: str, key: str) -> Part:
    """The shape of a file.

    Raises
    ------
    InputError
        The kernel cannot read the file, or the shape has no faces.
    """
    from OCP.BRep import BRep_Builder
    from OCP.BRepTools import BRepTools
    from OCP.TopoDS import TopoDS_Shape

    shape: Any = TopoDS_Shape()
    if not BRepTools.Read_s(shape, path, BRep_Builder()) or shape.IsNull():
        raise InputError(f"{key}: the CAD kernel cannot read this shape")
    part = Part(shape)
    if not part.faces:
        raise InputError(f"{key}: the shape has no faces")
    return part


def write_step(part: Part, path: str) -> bool:
    """Write the shape as STEP.

    Raises
    ------
    InputError
        The kernel cannot write the shape.
    """
    import OCP.IFSelect
    from OCP.Message import Message, Message_Fail
    from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer

    for printer in Message.DefaultMessenger_s().Printers():
        printer.SetTraceLevel(Message_Fail)
    writer = STEPControl_Writer()
    done = OCP.IFSelect.IFSelect_RetDone
    if writer.Transfer(part.shape, STEPControl_AsIs) != done or writer.Write(path) != done:
        raise InputError("the CAD kernel cannot write this shape as STEP")
    return True
