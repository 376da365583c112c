"""Block delete: blocks that begin with ``/`` are skipped where its switch on the panel is on, else carried out.

Which of both happens is up to the operator, so a program must be right either way.
"""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np

from chipload.errors import Finding
from chipload.program.program import Program

#: where it stands in the text of a finding
WITH = "with block delete on"
_DELETED = re.compile(r"^[ \t]*/.*$", re.MULTILINE)


def without_deleted_blocks(text: str) -> str:
    r"""The text with an empty line for each block that block delete skips.

    >>> without_deleted_blocks("G0 Z2\n/G0 Z9\n/2 M0\nM2")
    'G0 Z2\n\n\nM2'
    """
    return _DELETED.sub("", text)


def same_motions(one: Program, other: Program) -> bool:
    """Whether two programs move, turn the spindle and change tools alike, line by line."""
    names = ("motion", "p_work", "axis", "centre", "turns", "feed", "spindle", "tool", "line")
    return len(one) == len(other) and all(np.array_equal(getattr(one, n), getattr(other, n)) for n in names)


def with_block_delete(finding: Finding) -> Finding:
    """A finding on the program with block delete on."""
    return replace(finding, text=f"{WITH}, {finding.text}")
