"""A draft of a job: its tables, where each value comes from, and its text.

Notation: an entry is stated (by the file that the draft is made from, or a rule without choice) or guessed; a table
with a guess has ``confirm = true``, see :mod:`chipload.jobs.confirm`.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from chipload.errors import InputError
from chipload.files import cannot_write, fresh_folder, write_whole
from chipload.jobs.confirm import MARK

#: column of the comments behind values
COMMENT_COLUMN = 32


@dataclass(frozen=True)
class Entry:
    """A key of a table.

    Parameters
    ----------
    key, value : as the job file has them; a value None is written as a comment, as an example of an optional key
    note : where the value comes from, or why it was guessed
    guess : whether the user must confirm it; without a value, that it is left out
    example : of an optional key that is left out, as TOML; only without a value
    """

    key: str
    value: Any = None
    note: str = ""
    guess: bool = False
    example: str = ""

    def line(self) -> str:
        """Return the line of the job file."""
        if self.value is None:
            text = f"# {self.key} = {self.example}"
            return f"{text:{COMMENT_COLUMN}} # {self.note}" if self.note else text
        text = f"{self.key} = {toml(self.value)}"
        if not self.note:
            return text
        return f"{text:{COMMENT_COLUMN}} {MARK if self.guess else '# '}{self.note}"


@dataclass(frozen=True)
class DraftTable:
    """A table of the job.

    Parameters
    ----------
    name : as ``cutter``
    entries : its keys in their order
    repeated : whether it is one of a list, ``[[cutter]]``
    note : what stands above it
    """

    name: str
    entries: tuple[Entry, ...]
    repeated: bool = False
    note: str = ""

    @property
    def guesses(self) -> tuple[Entry, ...]:
        """The entries that were guessed."""
        return tuple(e for e in self.entries if e.guess)

    def text(self) -> str:
        """Return its lines in the job file."""
        head = f"[[{self.name}]]" if self.repeated else f"[{self.name}]"
        confirm = ["confirm = true"] if self.guesses else []
        note = [f"# {line}" for line in self.note.splitlines()]
        return "\n".join([*note, head, *confirm, *(e.line() for e in self.entries)])


@dataclass(frozen=True)
class Draft:
    """A job that a file proposes.

    Parameters
    ----------
    title : what the job does and the file that it is made from
    tables : of the job
    notes : findings in the file
    files : files next to the job by name, made from the file
    """

    title: str
    tables: tuple[DraftTable, ...]
    notes: tuple[str, ...] = ()
    files: Mapping[str, bytes] = field(default_factory=dict)

    @property
    def guesses(self) -> tuple[str, ...]:
        """A line for each guess."""
        out, count = [], dict[str, int]()
        for table in self.tables:
            name = table.name
            if table.repeated:
                name = f"{table.name}.{count.get(table.name, 0)}"
                count[table.name] = count.get(table.name, 0) + 1
            out += [
                f"{name}.{e.key}{'' if e.value is None else f' = {toml(e.value)}'}: {e.note}" for e in table.guesses
            ]
        return tuple(out)

    @property
    def questions(self) -> tuple[str, ...]:
        """What the user is asked before a first verdict, see :mod:`chipload.jobs.drafts.questions`."""
        from chipload.jobs.drafts.questions import questions

        return questions(self.tables)

    def text(self) -> str:
        """The whole job file."""
        head = [
            self.title,
            "",
            "Every value is one that the file states, or a guess. A guess is marked by a comment; correct it, then",
            "delete `confirm = true` of its table. `chipload run --accept` runs with all guesses as they are.",
            "All keys: chipload's docs/jobs.md.",
        ]
        notes = ["", "Found in the file:", *(f"* {note}" for note in self.notes)] if self.notes else []
        comments = "\n".join(f"# {plain_line(line)}".rstrip() for line in (*head, *notes))
        return "\n\n".join([comments, *(t.text() for t in self.tables)]) + "\n"


def plain_line(text: str) -> str:
    """Return a text on one line without control characters, for a comment."""
    return "".join(c if c.isprintable() else " " for c in text)


def toml(value: Any) -> str:
    r"""Return a value as TOML text.

    >>> toml([1, 2.5, "a\"b"]), toml(True), toml(1e-05)
    ('[1, 2.5, "a\\"b"]', 'true', '1e-05')
    """
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        if not math.isfinite(value):
            raise InputError(f"{value}: a draft holds finite numbers only")
        return repr(round(value, 6) + 0.0)
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_key(k)} = {toml(v)}" for k, v in value.items()) + " }"
    if isinstance(value, Sequence):
        return f"[{', '.join(toml(v) for v in value)}]"
    raise InputError(f"{type(value).__name__}: is not a value that a job can hold")


def _key(key: str) -> str:
    return key if key.replace("_", "").replace("-", "").isalnum() and key.isascii() else json.dumps(key)


def relative(path: Path, folder: Path) -> str:
    """Return the name of a file relative to the folder of a job."""
    return Path(os.path.relpath(path.absolute(), folder.absolute())).as_posix()


def write_draft(draft: Draft, folder: Path) -> Path:
    """Write the job and its files, whole or not at all; return the job file.

    Raises
    ------
    InputError
        The folder has a job or one of the files already.
    OutputError
        It cannot be written.
    """
    return write_drafts({"job": draft}, folder)[0]


def write_drafts(drafts: Mapping[str, Draft], folder: Path) -> list[Path]:
    """Write jobs by their names, and their files, whole or not at all; return the job files. Errors as of a draft."""
    jobs = {f"{name}.toml": draft.text().encode() for name, draft in drafts.items()}
    contents = {**{name: data for draft in drafts.values() for name, data in draft.files.items()}, **jobs}
    paths = [folder / name for name in jobs]
    for name in contents:
        if (folder / name).exists():
            raise InputError(f"{folder / name}: already exists and is not overwritten: name another folder")
    try:
        if folder.exists():
            if not folder.is_dir():
                raise InputError(f"{folder}: is not a folder: name another one")
            done: list[Path] = []
            try:
                for name, data in contents.items():
                    write_whole(folder / name, data)
                    done.append(folder / name)
            except BaseException:
                for path in done:
                    path.unlink(missing_ok=True)
                raise
            return paths
        folder.parent.mkdir(parents=True, exist_ok=True)
        with fresh_folder(folder.parent) as fresh:
            for name, data in contents.items():
                write_whole(fresh / name, data)
            fresh.chmod(0o755)
            fresh.rename(folder)
    except OSError as err:
        raise cannot_write(folder, err) from None
    return paths
