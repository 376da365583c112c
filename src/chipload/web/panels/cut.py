"""The panel of the cut at the current step: chip, chip thickness, force and torque over a revolution.

The browser draws it from the document of the 3D view (viewer/src/cut.ts) and follows it by itself.
"""

from __future__ import annotations

from nicegui import ui


class CutPanel:
    """The cut at the step."""

    def __init__(self) -> None:
        self.box = (
            ui.element("div").classes("cl-scroll cl-cut").props('tabindex=0 role=region aria-label="cut at the step"')
        )
        self.box.set_visibility(False)

    def show(self, view: str) -> None:
        """Follow the view in an element; empty: show nothing."""
        self.box.set_visibility(bool(view))
        if view:
            ui.run_javascript(
                f"requestAnimationFrame(() => window.chiploadViewer && chiploadViewer.cut('c{self.box.id}', '{view}'))"
            )
