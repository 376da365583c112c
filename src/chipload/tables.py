"""TOML tables that a job names: a file of the user's, or one that comes with chipload."""

from __future__ import annotations

import difflib
import tomllib
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from chipload.errors import InputError
from chipload.files import read_regular

#: least similarity of a name that is suggested; greater for materials, as another metal is not a typing error
ALIKE = {"material": 0.6}
#: greatest size of a file [bytes]
LARGEST_FILE = 10_000_000
#: greatest whole number
LARGEST = (1 << 63) - 1
#: greatest depth of nested tables and lists
DEEPEST = 50
#: name of a table in messages, and its values
Labelled = tuple[str, dict[str, Any]]


def read_table(kind: str, path: str | Path) -> Labelled:
    """The table of a TOML file; ``kind`` (`machine`, `material`) begins its label.

    Raises
    ------
    InputError
        The file cannot be read or is not TOML.
    """
    label = f"{kind} {path}"
    return label, parse_toml(label, read_regular(path, label, LARGEST_FILE, "not a table of chipload"))


def shipped_names(kind: str) -> tuple[str, ...]:
    """Names of the tables of a kind that come with chipload, sorted."""
    return tuple(sorted(_shipped_files(kind)))


def shipped_table(kind: str, name: str) -> Labelled:
    """The table of that name that comes with chipload.

    Raises
    ------
    InputError
        There is none; the message lists similar names and all known ones.
    """
    shipped = _shipped_files(kind)
    if name not in shipped:
        names = sorted(shipped)
        alike = [x for x in names if name.lower() in x.split("-")]
        near = alike or difflib.get_close_matches(name, names, 1, ALIKE.get(kind, 0.0))
        hint = f"the nearest {'are' if len(near) > 1 else 'is'} {', '.join(near)}" if near else "none is like it"
        raise InputError(f"{kind} {name}: not known: {hint} (known: {', '.join(names)}), or give a file")
    label = f"{kind} {name}"
    return label, parse_toml(label, shipped[name].read_bytes())


def nearest(name: str, known: list[str]) -> str:
    """The known name most similar to ``name``.

    >>> nearest("diametr", ["diameter", "flutes"])
    'diameter'
    """
    return difflib.get_close_matches(name, known, 1, 0.0)[0]


def _shipped_files(kind: str) -> dict[str, Traversable]:
    folder = resources.files("chipload") / "data" / f"{kind}s"
    return {x.name.removesuffix(".toml"): x for x in folder.iterdir() if x.name.endswith(".toml")}


def parse_toml(label: str, data: bytes) -> dict[str, Any]:
    """The table of a TOML text in UTF-8; ``label`` is its name in messages.

    Raises
    ------
    InputError
        It is not TOML, tables or lists are nested too deep, or an integer has more than 64 bits.
    """
    try:
        table = tomllib.loads(data.decode("utf-8"))
    except RecursionError:
        raise InputError(f"{label}: not a TOML file: lists or tables are nested too deep") from None
    except ValueError as err:
        raise InputError(f"{label}: not a TOML file: {str(err)[:200]}") from None
    require_sound(label, table)
    return table


def require_sound(label: str, table: dict[str, Any]) -> None:
    """Refuse values that no key can have: whole numbers of more than 64 bits, deep nesting.

    Raises
    ------
    InputError
        With the key and the limit.
    """
    waiting: list[tuple[str, Any, int]] = [("", table, 0)]
    while waiting:
        key, value, depth = waiting.pop()
        if depth > DEEPEST:
            raise InputError(f"{label}: {key[:60]}: nested deeper than {DEEPEST}")
        if isinstance(value, dict):
            waiting += [(f"{key}.{k}" if key else k, v, depth + 1) for k, v in value.items()]
        elif isinstance(value, list):
            waiting += [(f"{key}.{k}", v, depth + 1) for k, v in enumerate(value)]
        elif isinstance(value, int) and not -LARGEST <= value <= LARGEST:
            raise InputError(f"{label}: {key}: a number is too large: a whole number must be within {LARGEST}")
