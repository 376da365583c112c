"""The commands of the workbench: they ask and show; what they do is in the other modules."""

import FreeCAD
import FreeCADGui
from PySide import QtCore, QtGui

from chipload_freecad import feeds, job_folder, shown
from chipload_freecad.client import ChiploadError

#: where the command of chipload is kept
SETTINGS = "User parameter:BaseApp/Preferences/Mod/chipload"
#: columns by which the path can be coloured
COLUMNS = ("force_n", "deflection_um", "torque_nm", "power_w", "chip_max_mm", "feed_mm_min")


def command():
    """The command line of chipload."""
    return FreeCAD.ParamGet(SETTINGS).GetString("Command", "chipload")


def chosen_job():
    """The CAM job that is selected, or the only one of the document.

    Raises
    ------
    ChiploadError
        There is none, or several and none is selected.
    """
    document = FreeCAD.ActiveDocument
    jobs = job_folder.jobs_of(document) if document is not None else []
    selected = [o for o in FreeCADGui.Selection.getSelection() if o in jobs]
    if len(selected or jobs) != 1:
        raise ChiploadError("select one CAM job in the tree" if jobs else "the document has no CAM job")
    return (selected or jobs)[0]


class _Command:
    """A command that shows what it cannot do in a message."""

    text, tip = "", ""

    def GetResources(self):
        """Return the text of the menu and of the tool tip."""
        return {"MenuText": self.text, "ToolTip": self.tip}

    def IsActive(self):
        """Return whether there is a document with a CAM job."""
        return FreeCAD.ActiveDocument is not None and bool(job_folder.jobs_of(FreeCAD.ActiveDocument))

    def Activated(self):
        """Do it; a refusal of chipload is shown."""
        QtGui.QApplication.setOverrideCursor(QtGui.QCursor(QtCore.Qt.WaitCursor))
        try:
            text = self.work(chosen_job())
        except ChiploadError as err:
            text = str(err)
        finally:
            QtGui.QApplication.restoreOverrideCursor()
        if text:
            QtGui.QMessageBox.information(FreeCADGui.getMainWindow(), "chipload", text)

    def work(self, job):
        """Do the work for a job; return what is shown."""
        raise NotImplementedError


class Check(_Command):
    """Check with chipload."""

    text = "Check with chipload"
    tip = "Simulate the operations of the job in its stock: chips, forces, deflection, gouges; show them on the path"

    def work(self, job):
        """Check the job and show the result."""
        result = job_folder.check(job, job_folder.folder_of(job.Document), command())
        kept = FreeCAD.ParamGet(SETTINGS).GetString("Column", COLUMNS[0])
        column = kept if kept in result.columns else COLUMNS[0]
        shown.show(job.Document, result, column)
        job.Document.recompute()
        return result.message


class Feeds(_Command):
    """Look for better feeds and write them back."""

    text = "Optimise feeds with chipload"
    tip = "Feeds as fast as the limits allow, proven by a second simulation, written into the operations"

    def work(self, job):
        """Find feeds, show the result with them, write them into the operations."""
        folder = job_folder.folder_of(job.Document)
        result = job_folder.check(job, folder, command(), feeds=True)
        shown.show(job.Document, result, "feed_mm_min")
        job.Document.openTransaction("chipload: feeds")
        try:
            count = feeds.write_feeds(job, folder, result)
        except ChiploadError:
            job.Document.abortTransaction()
            raise
        job.Document.commitTransaction()
        return f"{count} commands have a new feed. {result.message}"


class Settings(_Command):
    """Command of chipload, colours, and what the document cannot state."""

    text = "Settings of chipload"
    tip = (
        "The command of chipload, the column of the colours, and flutes, overhang, material, machine, limits of the job"
    )

    def work(self, job):
        """Ask for them, one after another."""
        window, kept = FreeCADGui.getMainWindow(), FreeCAD.ParamGet(SETTINGS)
        text, fine = QtGui.QInputDialog.getText(window, "chipload", "Command:", text=command())
        if fine:
            kept.SetString("Command", text)
        text, fine = QtGui.QInputDialog.getItem(window, "chipload", "Colours by:", list(COLUMNS), 0, False)
        if fine:
            kept.SetString("Column", text)
        lines = "\n".join(job_folder.settings_of(job))
        ask = "Keys of job.toml, a line each, as cutter.0.flutes = 3:"
        text, fine = QtGui.QInputDialog.getMultiLineText(window, "chipload", ask, lines)
        if fine:
            setattr(job, job_folder.SETTINGS, text.splitlines())
        return ""


def register():
    """Add the commands to FreeCAD; return their names."""
    names = []
    for kind in (Check, Feeds, Settings):
        names.append(f"Chipload_{kind.__name__}")
        FreeCADGui.addCommand(names[-1], kind())
    return names
