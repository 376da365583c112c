"""Guesses in a job file that its user must confirm: tables with ``confirm = true``.

Notation: a draft of a job (:mod:`chipload.jobs.drafts`) marks a table that holds guesses by ``confirm = true`` and each
guessed key by a comment ``# guess: reason`` behind its value. A table whose ``confirm`` is false or gone is confirmed.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection
from typing import Any

from chipload.errors import InputError

#: what begins the comment of a guessed value
MARK = "# guess: "
_HEADER = re.compile(r"\s*(\[\[?)\s*([A-Za-z0-9_.\-]+)\s*\]\]?\s*(?:#.*)?$")
_GUESS = re.compile(rf"\s*([A-Za-z0-9_\-]+)\s*=\s*(.*?)\s*{MARK}(.*?)\s*$")


def take_confirm(raw: dict[str, Any]) -> tuple[str, ...]:
    """Remove every ``confirm`` of the tables of a file, in place; dotted names of the tables where it is true.

    Raises
    ------
    InputError
        A ``confirm`` is neither true nor false.

    >>> take_confirm({"machine": {"name": "vmc", "confirm": True}, "cutter": [{"confirm": False}, {"confirm": True}]})
    ('machine', 'cutter.1')
    """
    out: list[str] = []

    def visit(value: Any, name: str) -> None:
        if isinstance(value, dict):
            confirm = value.pop("confirm", False) if name else False
            if not isinstance(confirm, bool):
                raise InputError(f"{name}.confirm = {str(confirm)[:40]!r}: must be true or false")
            if confirm:
                out.append(name)
        if isinstance(value, (dict, list)):
            entries = value.items() if isinstance(value, dict) else enumerate(value)
            for key, inner in entries:
                visit(inner, f"{name}.{key}" if name else str(key))

    visit(raw, "")
    return tuple(out)


def guesses_of(tables: Collection[str], text: str, stated: Collection[str] = ()) -> tuple[str, ...]:
    r"""A line for each guess in the tables that are not confirmed.

    Parameters
    ----------
    tables : dotted names, of :func:`take_confirm`
    text : the job file
    stated : keys that an option states, which are then no longer guesses

    >>> guesses_of(["cutter.0"], "[[cutter]]\nconfirm = true\nflutes = 3  # guess: no file states them\nnumber = 1")
    ('cutter.0.flutes = 3: no file states them (line 3)',)
    >>> guesses_of(["operation.0.paths"], "[[operation]]\n[operation.paths]\ngouge_mm = 0.1  # guess: usual")
    ('operation.0.paths.gouge_mm = 0.1: usual (line 3)',)
    """
    found: list[str] = []
    counted: Counter[str] = Counter()
    table = ""
    seen: set[str] = set()
    for number, line in enumerate(text.splitlines(), 1):
        if header := _HEADER.match(line):
            table = header[2]
            if header[1] == "[[":
                table = f"{header[2]}.{counted[header[2]]}"
                counted[header[2]] += 1
            elif (above := header[2].partition("."))[0] in counted:
                # a table within the last one of a list
                table = f"{above[0]}.{counted[above[0]] - 1}.{above[2]}"
        elif table in tables and (guess := _GUESS.match(line)):
            seen.add(table)
            if f"{table}.{guess[1]}" not in stated:
                found.append(f"{table}.{guess[1]} = {guess[2]}: {guess[3]} (line {number})")
    return (*found, *(f"{name}: confirm = true: the table is not confirmed" for name in tables if name not in seen))
