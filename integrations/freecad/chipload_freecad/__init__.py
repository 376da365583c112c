"""chipload inside FreeCAD: a CAM job is written to a folder, checked by `chipload` and shown on its path.

The modules import neither chipload nor the window of FreeCAD, `commands` aside: they run in `freecadcmd` too.
"""
