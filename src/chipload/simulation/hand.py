"""Cuts with the spindle turning against the hand of the cutter.

Notation: spindle [rad/s], positive clockwise seen from the spindle (M3). A right-hand cutter cuts clockwise, a
left-hand cutter counter-clockwise (M4); turned the other way, its teeth meet the material with their flanks.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from chipload.cutter.cutter import Cutter
from chipload.errors import Finding, Severity
from chipload.simulation.removal import Columns
from chipload.simulation.steps import StepBlocks


def reversed_cuts(steps: StepBlocks, columns: Columns, cutters: Mapping[int, Cutter]) -> tuple[Finding, ...]:
    """Return a finding for each tool that cuts against its hand, at its first such step.

    Parameters
    ----------
    steps : of the program, one for each row of ``columns``
    columns : of the removal; a step that cuts has an engaged surface, and without loads no force
    """
    left = np.array(sorted(n for n, c in cutters.items() if c.left_hand), dtype=np.int64)
    if not len(left) and not (np.asarray(steps.program.spindle) < 0.0).any():
        return ()
    pieces, out, at = np.asarray(columns["chip_areas"]), dict[int, Finding](), 0
    for block in steps:
        own = np.where(np.isin(block.tool, left), -1.0, 1.0)
        wrong = (own * block.spindle < 0.0) & ~block.rapid & (pieces[at : at + len(block)] > 0)
        for number, k in zip(*np.unique(block.tool[wrong], return_index=True), strict=True):
            row = int(np.flatnonzero(wrong)[k])
            out.setdefault(
                int(number), _hand_finding(cutters[int(number)], int(number), int(block.line[row]), at + row)
            )
        at += len(block)
    return tuple(out.values())


def _hand_finding(cutter: Cutter, number: int, line: int, row: int) -> Finding:
    turns, hand, start, key = (
        ("clockwise (M3)", "left", "M4", "leave left_hand out of the [[cutter]]")
        if cutter.left_hand
        else ("counter-clockwise (M4)", "right", "M3", "state left_hand = true in its [[cutter]]")
    )
    text = (
        f"tool {number} is a {hand}-hand cutter and cuts while the spindle turns {turns}: start it by {start} or {key}"
    )
    return Finding("spindle-reversed", line, text, Severity.EXCEEDS, None, row)
