"""FreeCAD runs this file at the start of its window: the workbench of chipload."""

import os

import chipload_freecad
import FreeCADGui

#: FreeCAD runs this file without a name of its own: the icon is found by the package beside it
ICON = os.path.join(os.path.dirname(os.path.dirname(chipload_freecad.__file__)), "icons", "chipload.svg")


class ChiploadWorkbench(FreeCADGui.Workbench):
    """Commands for a CAM job: check it, write better feeds back, settings."""

    MenuText = "chipload"
    ToolTip = "Check a CAM job with chipload"
    Icon = ICON

    def Initialize(self):
        """Add the commands to the menu and the toolbar; the first time that the workbench is chosen."""
        from chipload_freecad import commands

        names = commands.register()
        self.appendToolbar("chipload", names)
        self.appendMenu("chipload", names)

    def GetClassName(self):
        """Return the class of a workbench written in Python."""
        return "Gui::PythonWorkbench"


FreeCADGui.addWorkbench(ChiploadWorkbench())
