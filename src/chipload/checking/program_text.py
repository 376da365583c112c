"""The text of a program whose F or S words can be changed."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from chipload.checking.outcome import ChangedText
from chipload.errors import InputError
from chipload.files import decode_text, is_utf16, read_regular
from chipload.machine.machine import Machine
from chipload.program import heidenhain
from chipload.program.control import control_named, is_cl_data
from chipload.program.gcode.feed_words import with_feeds
from chipload.program.gcode.reader import LARGEST_FILE
from chipload.program.program import Program
from chipload.program.read import dialect_of
from chipload.program.release import Release

#: characters of a comment at most, and of the least one that is worth writing; of a line where the control states no
#: limit; kept for the end of a line
LONGEST_COMMENT, LEAST_COMMENT, LONGEST_LINE, LINE_END = 160, 24, 255, 4
#: blocks that take no comment: the head of a conversational program, and a block that goes on
_NO_COMMENT = re.compile(r"^\s*\d*\s*(?:BEGIN PGM|BLK FORM)\b|~$", re.IGNORECASE)


def changeable(path: Path, machine: Machine, dialect: str | None, key: str) -> tuple[str, str]:
    """Return the text of a program whose words can be changed, unchanged byte by byte, and its dialect.

    Parameters
    ----------
    key : of the job that requires the change; its last word names what is changed

    Raises
    ------
    InputError
        The text cannot be changed; the message states the remedy.
    """
    words = key.split(".")[-1]
    kind = dialect_of(path, machine, dialect)
    if is_cl_data(kind) or (words != "feeds" and not has_blocks(kind)):
        raise InputError(
            f"{key}: {path.name} is {kind}: {words} are changed in NC texts of LinuxCNC, Fanuc or Sinumerik: "
            "convert it first (chipload convert)"
        )
    data = read_regular(path, path.name, LARGEST_FILE)
    # bytes that are no UTF-8 are written as they were
    text = decode_text(data) if is_utf16(data) else data.decode("utf-8", "surrogateescape")
    lone = text.replace("\r\n", "\n").find("\r")
    if lone >= 0:
        raise InputError(f"{path.name}: a line ends with CR alone: write LF or CR LF to change its {words}")
    text_with_feeds(text, kind, {})
    return text, kind


def has_blocks(dialect: str) -> bool:
    """Whether the lines of a text are blocks of words with G codes; else they are conversational."""
    return control_named(dialect).lines.form == "blocks"


def text_with_feeds(text: str, dialect: str, lines: Mapping[int, float]) -> str:
    """Return the text with other feeds, as :func:`chipload.program.gcode.with_feeds` and that of Heidenhain do."""
    return (with_feeds if has_blocks(dialect) else heidenhain.with_feeds)(text, lines)


def read_as(text: str) -> str:
    """Return the text as a reader of the file receives it."""
    return decode_text(text.encode("utf-8", "surrogateescape"))


def straight(program: Program, words: str) -> None:
    """Refuse a program that runs a line twice, because each of its ``words`` has one value.

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


def rows_that_differ(old: Program, new: Program, *names: str) -> NDArray[np.bool_]:
    """Return a mask (n,) of the rows of two programs of equal length in which a named column differs."""
    off = np.zeros(len(old), dtype=np.bool_)
    for name in names:
        differs = np.asarray(getattr(old, name)) != np.asarray(getattr(new, name))
        off |= differs if differs.ndim == 1 else differs.any(axis=1)
    return off


def program_text(changed: ChangedText, release: Release) -> str:
    """Return the text of a program; if it is not verified, a comment on its first line states why.

    A line of ``%`` alone, Sinumerik's paths and the head of a conversational program do not count as the first line,
    nor does one that the comment would make longer than the control reads: LinuxCNC leaves such a line out and goes on.
    """
    if release.verified:
        return changed.text
    plain = "".join(ch if ch.isascii() and ch.isprintable() and ch not in "()" else "_" for ch in release.text)
    control = control_named(changed.dialect)
    begin, end = control.lines.comment
    longest = control.text.longest_line or LONGEST_LINE
    lines = changed.text.split("\n")
    for k, line in enumerate(lines):
        body = line.rstrip()
        room = min(longest - LINE_END - len(body) - len(begin) - len(end) - 1, LONGEST_COMMENT)
        if body and not body.startswith(("%", ";$")) and not _NO_COMMENT.search(body) and room >= LEAST_COMMENT:
            lines[k] = f"{body} {begin}{plain[:room].rstrip()}{end}{line[len(body) :]}"
            break
    return "\n".join(lines)
