"""``--set key.path=value``: values on the command line that take the place of those in the job file."""

from __future__ import annotations

import re
import tomllib
from typing import Any

from chipload.errors import InputError
from chipload.jobs.messages import REMOVED, RENAMED, keys_at, nearest_key
from chipload.jobs.tables import Table


def override(raw: dict[str, Any], text: str, root: type[Table]) -> None:
    """Apply one ``key.path=value`` to the table of the file, in place; ``root`` states which keys it may have."""
    path, equals, value = text.partition("=")
    keys = [k.strip() for k in path.split(".")]
    if not equals or not all(keys):
        raise InputError(f"--set {text}: must be key.path=value, as cutter.0.diameter_mm=12")
    if keys[0] in RENAMED:
        raise InputError(f"--set {text}: {keys[0]}: renamed: write {'.'.join((RENAMED[keys[0]], *keys[1:]))}")
    here: Any = raw
    holder: Any
    slot: Any
    for depth, key in enumerate(keys):
        last = depth == len(keys) - 1
        name = ".".join(keys[: depth + 1])
        if isinstance(here, list):
            at = ".".join(keys[:depth])
            if not (key.isdecimal() and int(key) < len(here)):
                raise InputError(
                    f"--set {text}: {name}: {at} has {len(here)} "
                    f"{'entry' if len(here) == 1 else 'entries'}: count from 0 to {len(here) - 1}"
                )
            here, holder, slot = here[int(key)], here, int(key)
        elif isinstance(here, dict):
            known = keys_at([int(k) if k.isdecimal() else k for k in keys[:depth]], root)
            # a table of free keys, as program.parameters, has no known ones
            if known and key not in here and key not in known:
                if keys[0] == "operation" and key in REMOVED:
                    raise InputError(f"--set {text}: {name}: {REMOVED[key]}")
                raise InputError(f"--set {text}: {name}: unknown key; did you mean {nearest_key(key, known)}?")
            if not last:
                here, holder, slot = here.setdefault(key, {}), here, key
            else:
                holder, slot = here, key
        else:
            raise InputError(f"--set {text}: {'.'.join(keys[:depth])} is a value, not a table: it has no key {key}")
        if last:
            holder[slot] = _value(value)
            # a source is one or the other: stating the one takes the place of the other
            if name in ("machine.file", "machine.name", "material.file", "material.name"):
                holder.pop("name" if key == "file" else "file", None)


def _value(text: str) -> Any:
    """A TOML value, or the text itself where it is none.

    A number may be written without a digit before or after its point, which TOML itself does not allow.

    >>> _value("12"), _value(".5"), _value("nan") != _value("nan"), _value("part.dxf"), _value('["a", "b"]')
    (12, 0.5, True, 'part.dxf', ['a', 'b'])
    """
    text = text.strip()
    if re.fullmatch(r"[+-]?(\.\d+|\d+\.)([eE][+-]?\d+)?", text):
        return float(text)
    try:
        table = tomllib.loads(f"value = {text}")
    except (ValueError, RecursionError):
        return text
    return table["value"] if len(table) == 1 else text
