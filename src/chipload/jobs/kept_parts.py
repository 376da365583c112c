"""Finished parts of a run in its checkpoint, so that a stopped run continues after the last one.

Notation: a part is a value of arrays, numbers, texts, tuples, lists, dicts and of some kinds of records; its key states
which part it is and what it depends on. A part is written as a JSON tree with its arrays and comes back bit for bit;
a part that is made is given on as it would come back, so that a run that was stopped has the bytes of one that was not.
"""

from __future__ import annotations

import io
import json
import struct
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.progress import Progress, silent
from chipload.simulation.checkpoint import Checkpoint, digest
from chipload.workers import Team

if TYPE_CHECKING:
    from chipload.planning.impeller.kept import PlanTask

T = TypeVar("T")
#: kinds of records
Kinds = tuple[type, ...]

#: of the time of a run that writing takes at most
_SHARE = 0.05
_SIZE = struct.Struct("<q")


class KeptRecords:
    """Parts of a run by their keys.

    Parameters
    ----------
    checkpoint : where they are kept; None: nowhere
    key : of all that the run depends on
    records : kinds of records that a part may be made of besides arrays and plain values
    team : makes announced parts in parallel; None: each is made on request
    """

    def __init__(self, checkpoint: Checkpoint | None, key: str, records: Kinds, team: Team | None = None) -> None:
        self.checkpoint, self.records, self.team = checkpoint, records, team
        self._parts: dict[str, bytes] = {}
        self._new: dict[str, bytes] = {}
        self._since, self._cost = time.monotonic(), 0.0
        if checkpoint is None or checkpoint.begin(key) is None:
            return
        columns = checkpoint.columns()
        try:
            self._parts = dict(zip(columns["part"].tolist(), columns["data"].tolist(), strict=True))
        except KeyError as err:
            checkpoint.set_aside(str(err))
            return
        checkpoint.notice(f"continues after step {checkpoint.safe} of its parts, kept in {checkpoint.folder}")

    def __call__(self, key: tuple[object, ...], make: Callable[[], T]) -> T:
        """The part of this key, kept or made."""
        name = digest(*key)
        if name in self._parts:
            try:
                return read_part(self._parts[name], self.records)  # type: ignore[no-any-return]
            except (InputError, ValueError, KeyError, TypeError):
                # what cannot be read is made again
                del self._parts[name]
        data = part_bytes(make(), self.records)
        self._parts[name] = self._new[name] = data
        self.write()
        return read_part(data, self.records)  # type: ignore[no-any-return]

    def share(self, value: object) -> None:
        """Give the team what the functions of parts have as their first argument from now on."""
        if self.team is not None:
            self.team.share(value)

    def ahead(self, parts: Sequence[PlanTask], progress: Progress = silent) -> None:
        """Make the parts that are not kept side by side, where there is a team; a single one is made on request."""
        if self.team is None:
            return
        open_yet = {name: part for part in parts if (name := digest(*part.key)) not in self._parts}
        if len(open_yet) < 2:
            return
        names = [*open_yet]
        tasks = [(part.make, self.records, part.arguments) for part in open_yet.values()]
        for number, (k, data) in enumerate(self.team.completed_shared(_part_as_bytes, tasks), 1):
            self._parts[names[k]] = self._new[names[k]] = data
            self.write()
            progress(number / len(names), f"{number} of {len(names)} parts")

    def write(self, at_once: bool = False) -> None:
        """Write what is new, if it is time to, or ``at_once``."""
        kept = self.checkpoint
        if kept is None or not self._new:
            return
        begin = time.monotonic()
        due = begin - self._since >= max(kept.every_s, self._cost / _SHARE)
        if not (due or at_once or kept.every_s == 0.0):
            return
        columns = {"part": [*self._new], "data": [*self._new.values()]}
        kept.add({name: np.array(values, dtype=object) for name, values in columns.items()})
        kept.commit({})
        self._new = {}
        self._since = time.monotonic()
        self._cost = self._since - begin


def _part_as_bytes(shared: Any, make: Callable[..., Any], records: Kinds, arguments: tuple[Any, ...]) -> bytes:
    """A part as bytes; this is what a worker executes."""
    return part_bytes(make(shared, *arguments), records)


def part_bytes(value: object, records: Kinds = ()) -> bytes:
    """A part as bytes: the length of its tree, the tree, its arrays one after the other."""
    arrays: list[NDArray[Any]] = []
    tree = json.dumps(_tree(value, arrays, records)).encode()
    sink = io.BytesIO()
    sink.write(_SIZE.pack(len(tree)))
    sink.write(tree)
    for array in arrays:
        np.save(sink, np.ascontiguousarray(array), allow_pickle=False)
    return sink.getvalue()


def read_part(data: bytes, records: Kinds = ()) -> Any:
    """What :func:`part_bytes` wrote.

    >>> read_part(part_bytes((1, 2.5, "text", None, {"key": [True]})))
    (1, 2.5, 'text', None, {'key': [True]})
    """
    source = io.BytesIO(data)
    (size,) = _SIZE.unpack(source.read(_SIZE.size))
    tree = json.loads(source.read(size))
    arrays: list[NDArray[Any]] = []
    while source.tell() < len(data):
        arrays.append(np.load(source, allow_pickle=False))
    return _value(tree, arrays, {kind.__name__: kind for kind in records})


def _tree(value: object, arrays: list[NDArray[Any]], records: Kinds) -> Any:
    if value is None or (isinstance(value, (bool, int, float, str)) and not isinstance(value, np.generic)):
        return value
    if isinstance(value, np.ndarray):
        arrays.append(value)
        return {"array": len(arrays) - 1}
    if isinstance(value, np.generic):
        return _tree(value.item(), arrays, records)
    if isinstance(value, (tuple, list)) and type(value) in (tuple, list):
        return {type(value).__name__: [_tree(x, arrays, records) for x in value]}
    if isinstance(value, dict):
        return {"dict": [[_tree(k, arrays, records), _tree(x, arrays, records)] for k, x in value.items()]}
    if type(value) in records:
        kind = type(value)
        own = [_tree(getattr(value, f.name), arrays, records) for f in fields(kind) if f.init]  # type: ignore[arg-type]
        return {"record": kind.__name__, "of": own}
    raise TypeError(f"a part of a run holds a {type(value).__name__}, which is not kept")


def _value(tree: Any, arrays: list[NDArray[Any]], kinds: Mapping[str, Any]) -> Any:
    if not isinstance(tree, dict):
        return tree
    if "array" in tree:
        return arrays[tree["array"]]
    if "dict" in tree:
        return {_value(k, arrays, kinds): _value(x, arrays, kinds) for k, x in tree["dict"]}
    if "record" in tree:
        kind: Any = kinds[tree["record"]]
        names = [f.name for f in fields(kind) if f.init]
        return kind(**dict(zip(names, (_value(x, arrays, kinds) for x in tree["of"]), strict=True)))
    kind = tuple if "tuple" in tree else list
    return kind(_value(x, arrays, kinds) for x in tree[kind.__name__])
