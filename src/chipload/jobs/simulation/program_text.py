"""The text of a program whose F or S words can be changed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.files import read_regular
from chipload.jobs.simulation.outcome import ChangedText
from chipload.machine.machine import Machine
from chipload.program.gcode.feed_words import with_feeds
from chipload.program.gcode.reader import LARGEST_FILE
from chipload.program.program import Program
from chipload.program.read import dialect_of

#: dialects whose texts take new F and S words
WORDS = ("linuxcnc", "fanuc", "sinumerik")


def changeable(path: Path, machine: Machine, dialect: str | None, key: str) -> tuple[str, str]:
    """The text of a program whose words can be changed, byte by byte as in the file, and its dialect.

    Parameters
    ----------
    key : of the job that asks for it; its last word says what is changed

    Raises
    ------
    InputError
        The text cannot be changed; the message says what to do.
    """
    words = key.split(".")[-1]
    kind = dialect_of(path, machine, dialect)
    if kind not in WORDS:
        raise InputError(
            f"{key}: {path.name} is {kind}: {words} are changed in NC texts of LinuxCNC, Fanuc or Sinumerik: "
            "convert it first (chipload convert)"
        )
    text = read_regular(path, path.name, LARGEST_FILE).decode("utf-8", "surrogateescape")
    lone = text.replace("\r\n", "\n").find("\r")
    if lone >= 0:
        raise InputError(f"{path.name}: a line ends with CR alone: write LF or CR LF to change its {words}")
    with_feeds(text, {})
    return text, kind


def read_as(text: str) -> str:
    """The text as a reader of the file gets it."""
    return text.encode("utf-8", "surrogateescape").decode("utf-8", "replace")


def straight(program: Program, words: str) -> None:
    """Refuse what runs a line twice: it has one word for each of its ``words``.

    Raises
    ------
    InputError
        A line comes again after another one.
    """
    back = np.flatnonzero(np.diff(program.line[program.line > 0]) < 0)
    if len(back):
        line = int(program.line[program.line > 0][back[0]])
        raise InputError(
            f"line {line}: the program jumps back past it: {words} are changed only in a program without jumps: "
            "convert it first (chipload convert)"
        )


def differing(old: Program, new: Program, *names: str) -> NDArray[np.bool_]:
    """(n,) rows of two programs of one length of which one of the named columns differs."""
    off = np.zeros(len(old), dtype=np.bool_)
    for name in names:
        differs = np.asarray(getattr(old, name)) != np.asarray(getattr(new, name))
        off |= differs if differs.ndim == 1 else differs.any(axis=1)
    return off


def program_text(changed: ChangedText, unless: str | None) -> str:
    """The text; where it does not hold, ``unless`` says why behind the words of its first line; no line is added.

    A line of ``%`` alone is passed over, and Sinumerik's paths.
    """
    if unless is None:
        return changed.text
    plain = "".join(ch if ch.isascii() and ch.isprintable() and ch not in "()" else "_" for ch in unless)
    comment = f"; NOT VERIFIED: {plain}" if changed.dialect == "sinumerik" else f"(NOT VERIFIED: {plain})"
    lines = changed.text.split("\n")
    for k, line in enumerate(lines):
        body = line.rstrip()
        if body and not body.startswith(("%", ";$")):
            lines[k] = f"{body} {comment}{line[len(body) :]}"
            break
    return "\n".join(lines)
