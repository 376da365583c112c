"""Names of program files."""

from __future__ import annotations

#: ending of a program file by the dialect of the machine
ENDINGS = {"linuxcnc": "ngc", "fanuc": "nc"}


def program_name(operation: int, track: str) -> str:
    """File name of a program without its ending.

    >>> program_name(0, "backward")
    '0-backward'
    """
    return f"{operation}-{track}"
