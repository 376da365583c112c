"""TOML tables that a job names: a file of the user's, or one that comes with chipload."""

from __future__ import annotations

import difflib
import tomllib
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from chipload.errors import InputError

#: what a message calls the table, and its values
Labelled = tuple[str, dict[str, Any]]


def read_table(kind: str, path: str | Path) -> Labelled:
    """The table of a TOML file; ``kind`` (`machine`, `material`) begins its label.

    Raises
    ------
    InputError
        The file cannot be read or is not TOML.
    """
    try:
        data = Path(path).read_bytes()
    except OSError as err:
        raise InputError(f"{kind} {path}: cannot be read: {err.strerror}") from None
    return _parsed(f"{kind} {path}", data)


def shipped_names(kind: str) -> tuple[str, ...]:
    """Names of the tables of a kind that come with chipload, sorted."""
    return tuple(sorted(_shipped(kind)))


def shipped_table(kind: str, name: str) -> Labelled:
    """The table of that name that comes with chipload.

    Raises
    ------
    InputError
        There is none; the message names the nearest and all.
    """
    shipped = _shipped(kind)
    if name not in shipped:
        near = nearest(name, sorted(shipped))
        known = ", ".join(sorted(shipped))
        raise InputError(f"{kind} {name}: not known: the nearest is {near} (known: {known}), or give a file")
    return _parsed(f"{kind} {name}", shipped[name].read_bytes())


def nearest(name: str, known: list[str]) -> str:
    """The known name that ``name`` is most like.

    >>> nearest("diametr", ["diameter", "flutes"])
    'diameter'
    """
    return difflib.get_close_matches(name, known, 1, 0.0)[0]


def _shipped(kind: str) -> dict[str, Traversable]:
    folder = resources.files("chipload") / "data" / f"{kind}s"
    return {x.name.removesuffix(".toml"): x for x in folder.iterdir() if x.name.endswith(".toml")}


def _parsed(label: str, data: bytes) -> Labelled:
    try:
        return label, tomllib.loads(data.decode("utf-8"))
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as err:
        raise InputError(f"{label}: not a TOML file: {err}") from None
