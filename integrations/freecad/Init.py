"""FreeCAD runs this file at its start, with and without a window. Nothing is to be done there."""
