"""The statement in the first line of a program text: whether an independent simulation has verified the program."""

from __future__ import annotations

import re
from dataclasses import dataclass

#: a comment of RS-274, and the number of a program
COMMENT, NUMBER = re.compile(r"\([^)]*\)"), re.compile(r"O\d+$")


@dataclass(frozen=True)
class Release:
    """Whether a program is verified.

    Only :func:`chipload.result.release.release_of` makes one that is, from the verdict of the whole job.

    Parameters
    ----------
    reason : why the program is not verified; empty: it is
    condition : how the program must be run for this; empty: as it is

    Examples
    --------
    >>> Release("").text, Release("force 812 N exceeds 500 N in line 12").text
    ('verified by independent simulation', 'NOT VERIFIED: force 812 N exceeds 500 N in line 12')
    """

    reason: str
    condition: str = ""

    @property
    def verified(self) -> bool:
        """Whether an independent simulation has verified the program and its whole job holds."""
        return not self.reason

    @property
    def text(self) -> str:
        """The statement in one line."""
        if self.reason:
            return f"NOT VERIFIED: {self.reason}"
        return " ".join(filter(None, ("verified by independent simulation", self.condition)))


#: of a program that was only written
NOT_SIMULATED = Release("no simulation has checked this program")


def release_of_text(text: str, simulated: str, release: Release) -> Release:
    r"""Return what a text may state: ``release`` if it has the blocks of the ``simulated`` text, comments aside.

    >>> release_of_text("(a)\nG0 X1\nM2", "(b)\nG0 X1\nM2", Release("")).verified
    True
    >>> release_of_text("(a)\nG0 X2\nM2", "(b)\nG0 X1\nM2", Release("")).text
    'NOT VERIFIED: its text is not the one that was simulated'
    """
    return release if same_blocks(text, simulated) else Release("its text is not the one that was simulated")


def same_blocks(text: str, other: str) -> bool:
    """Return whether two texts have the same blocks, comments and program numbers aside."""
    return _blocks(text) == _blocks(other)


def _blocks(text: str) -> list[str]:
    blocks = (COMMENT.sub("", line).strip() for line in text.splitlines())
    return [block for block in blocks if block and not NUMBER.match(block)]
