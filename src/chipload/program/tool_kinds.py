"""Cutters of a job compared with the kind of tool, the corner and the number of teeth that comments of a text state."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from chipload.cutter.cutter import Cutter
from chipload.errors import Finding, Severity
from chipload.program.reconcile import WEAR_MM
from chipload.program.tool_words import Stated, ToolKind

#: tools with a point, which cut along their axis
_POINTED = (ToolKind.DRILL, ToolKind.SPOT, ToolKind.COUNTERSINK, ToolKind.CHAMFER)


def compare_kinds(cutters: Mapping[int, Cutter], described: Mapping[int, Stated]) -> tuple[Finding, ...]:
    """Return a finding for each cutter whose kind, corner radius or number of teeth is not that of its comment.

    Parameters
    ----------
    cutters : of the job, by tool
    described : what comments state about each tool
    """
    return tuple(
        Finding(
            "tool-kind", 0,
            f"{where} states {stated} for tool {number}, the [[cutter]] has {own}: correct whichever is wrong, or set "
            "program.tool_comments = false",
            Severity.UNPROVEN,
        )
        for number in sorted(cutters.keys() & described.keys())
        for stated, own, where in _differences(cutters[number], described[number])
    )  # fmt: skip


def _differences(cutter: Cutter, described: Stated) -> Iterator[tuple[str, str, str]]:
    """What is stated, what the cutter has instead, and where it is stated."""
    kind, where = described.get("kind", (None, ""))
    if kind is ToolKind.TAP and cutter.thread_pitch is None:
        yield "a tap", "no thread_pitch_mm", where
    if kind in _POINTED and cutter.bottom == 0.0 and not cutter.body:
        yield f"a {kind.value}", "a flat bottom (bottom_deg = 0)", where
    if cutter.body or cutter.barrel_radius is not None or cutter.shape:
        return
    radius, where = described.get("corner_radius_mm", (None, ""))
    if radius is not None and abs(radius - cutter.corner_radius) > WEAR_MM:
        shape = "a ball nose, a corner radius" if kind is ToolKind.BALL else "a corner radius"
        yield f"{shape} of {radius:.4g} mm", f"corner_radius_mm = {cutter.corner_radius:.4g}", where
    teeth, where = described.get("flutes", (None, ""))
    if teeth is not None and teeth != cutter.flutes:
        yield f"{teeth} teeth", f"flutes = {cutter.flutes}", where
