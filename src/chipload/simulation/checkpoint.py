"""The checkpoint folder of a run: finished chunks and state, from which a stopped run continues.

Notation: a chunk is the columns of consecutive steps in one Parquet file. The state is all data that continue from one
step to the next, after the last step of the last chunk, in several files. ``last.json`` names the chunks and the state
that belong together and is replaced atomically: other files belong to a chunk that was not finished, and are written
again. Each pass beside the removal has one file (:mod:`chipload.simulation.kept_pass`).

The key is a hash of all inputs of the result. Data with another key belong to another run and are deleted. Data that
cannot be read are moved to a folder beside it and never deleted.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from chipload.arrow import arrow_array
from chipload.errors import InputError
from chipload.files import FRESH, cannot_write, sweep, write_whole
from chipload.lazy import pa, pq
from chipload.processes import lock_file

#: seconds of work between two states
EVERY_S = 10.0
KIND = "chipload unfinished simulation 1"
LAST, LOCK = "last.json", "lock"
#: files of passes over the steps begin so: they have keys of their own
PASS = "pass-"
#: columns that are kept in memory after they were read
KEPT = 6

Arrays = Mapping[str, NDArray[Any]]


@dataclass(frozen=True)
class StoredChunk:
    """A finished chunk: its file, its number of steps, the hash of the file."""

    file: str
    steps: int
    sha256: str


class _Damaged(Exception):
    """Error: a stored file differs from the one that was written; its message is the file name."""


class Stored(Mapping[str, NDArray[Any]]):
    """Columns in files: a column is read on first use; the last :data:`KEPT` stay in memory.

    A column that a piece lacks is 0 there.
    """

    def __init__(self, folder: Path, parts: Sequence[StoredChunk]) -> None:
        self.files = [(folder / part.file, part.steps) for part in parts]
        schemas = [pq.read_schema(file).names for file, _ in self.files]
        self.held = [frozenset(names) for names in schemas]
        self.names = tuple(dict.fromkeys(name for names in schemas for name in names))
        self._kept_files = dict[str, NDArray[Any]]()

    def __getitem__(self, name: str) -> NDArray[Any]:
        if name not in self.names:
            raise KeyError(name)
        found = self._kept_files.pop(name, None)
        if found is None:
            found = np.concatenate(
                [
                    _read(file, [name], count, stored_names)[name]
                    for (file, count), stored_names in zip(self.files, self.held, strict=True)
                ]
            )
            found.flags.writeable = False
        while len(self._kept_files) >= KEPT:
            del self._kept_files[next(iter(self._kept_files))]
        self._kept_files[name] = found
        return found

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __len__(self) -> int:
        return len(self.names)

    def chunks(self, names: Sequence[str] | None = None) -> Iterator[dict[str, NDArray[Any]]]:
        """Columns, chunk after chunk; None: all."""
        for (file, count), stored_names in zip(self.files, self.held, strict=True):
            yield _read(file, self.names if names is None else names, count, stored_names)


def in_rows(columns: Arrays, size: int, names: Sequence[str] | None = None) -> Iterator[dict[str, NDArray[Any]]]:
    """Columns, ``size`` rows at a time and the rest; ``names``: those that are asked for, None: all.

    >>> [some["x"].tolist() for some in in_rows({"x": np.arange(5)}, 2)]
    [[0, 1], [2, 3], [4]]
    """
    pending, count = list[dict[str, NDArray[Any]]](), 0
    whole = {} if isinstance(columns, Stored) else {name: columns[name] for name in names or columns}
    for piece in columns.chunks(names) if isinstance(columns, Stored) else (whole,):
        pending.append(piece)
        count += len(next(iter(piece.values())))
        if count >= size:
            whole = _one_below_the_other(pending)
            for at in range(0, count - size + 1, size):
                yield {k: v[at : at + size] for k, v in whole.items()}
            pending, count = [{k: v[count // size * size :].copy() for k, v in whole.items()}], count % size
    if count:
        yield _one_below_the_other(pending)


def _one_below_the_other(pieces: list[dict[str, NDArray[Any]]]) -> dict[str, NDArray[Any]]:
    """Join the columns of pieces, which are emptied: each column is there twice only while it is joined."""
    if len(pieces) == 1:
        return pieces[0]
    return {k: np.concatenate([p.pop(k) for p in pieces]) for k in list(pieces[0])}


class Checkpoint:
    """The checkpoint folder of a run, locked by that run; a context manager that unlocks it.

    What is in the folder stays when the context is left, unless :meth:`begin` was called and the input was then
    refused: :meth:`discard` removes it.

    Parameters
    ----------
    folder : it may be there or not; it is made when the first piece is written
    every_s : seconds of work between two states [s]; 0: one after every block
    fresh : throw away what was kept
    notice : is told from where the run goes on

    Raises
    ------
    InputError
        Another run holds the folder, or it holds something else.
    OutputError
        It cannot be written.
    """

    def __init__(
        self,
        folder: Path,
        every_s: float = EVERY_S,
        *,
        fresh: bool = False,
        notice: Callable[[str], None] = lambda text: None,
    ) -> None:
        if not 0.0 <= every_s < math.inf:
            raise InputError(f"{folder}: every_s = {every_s:g}: must be at least 0 s")
        self.folder, self.every_s, self.fresh, self.notice = folder, every_s, fresh, notice
        self.key, self.parts, self.number, self.safe = "", list[StoredChunk](), 0, 0
        self.passes = dict[str, int]()
        self._lock: int | None = None
        if folder.exists():
            require_ours(folder)
            self._hold()

    def __enter__(self) -> Checkpoint:
        return self

    def __exit__(self, _kind: object, error: object, _trace: object) -> None:
        if isinstance(error, InputError) and (self.key or (self.passes and not (self.folder / LAST).exists())):
            self.discard()
        self.close()

    def begin(self, key: str) -> dict[str, Path] | None:
        """Return the files of the state from which the run with this key continues; None if it begins from the start.

        ``safe`` is the number of steps that were kept.
        """
        self.key = key
        if self.folder.exists():
            state = None
            if not self.fresh and (self.folder / LAST).exists():
                try:
                    state = self._kept_files()
                except _Damaged as err:
                    self.set_aside(str(err))
                    return None
                except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
                    self.set_aside(LAST)
                    return None
            if state is not None:
                return state
            if any(_of_run(file) for file in self.folder.iterdir()):
                why = ", as requested" if self.fresh else ": the checkpoint belongs to another input"
                self.notice(f"starts from the beginning{why}")
            self._clear()
        return None

    def _kept_files(self) -> dict[str, Path] | None:
        """Files of the state; None: of another run."""
        last = json.loads((self.folder / LAST).read_bytes())
        if last["kind"] != KIND or last["key"] != self.key:
            return None
        parts = [StoredChunk(**part) for part in last["parts"]]
        state = {name: StoredChunk(**part) for name, part in last["state"].items()}
        for part in (*parts, *state.values()):
            file = self.folder / part.file
            if not file.exists() or _hash(file) != part.sha256:
                raise _Damaged(part.file)
        self.parts, self.number, self.safe = parts, len(parts), sum(part.steps for part in parts)
        return {name: self.folder / part.file for name, part in state.items()}

    def kept_pass(self, name: str) -> Path | None:
        """The file of a pass over the steps; None: nothing is kept of it."""
        file = self.folder / f"{PASS}{name}.npz"
        if self.fresh and name not in self.passes and self._lock is not None:
            file.unlink(missing_ok=True)
        return file if file.exists() else None

    def keep_pass(self, name: str, data: bytes, steps: int) -> None:
        """Write the results of a pass after a number of steps."""
        self._make()
        write_whole(self.folder / f"{PASS}{name}.npz", data)
        self.passes[name] = steps

    def what_is_kept(self) -> str:
        """Return a message on the state from which the run continues; empty if there is none.

        The folder says it: an interrupt may come between the file of a state and what this object knows of it.
        """
        if steps := self._steps_kept():
            return f"{steps} steps are kept"
        return f"{max(self.passes.values())} steps of a pass are kept" if self.passes else ""

    def _steps_kept(self) -> int:
        """Steps of the state of this run that is on disk."""
        if not self.key or not (self.folder / LAST).exists():
            return 0
        last = json.loads((self.folder / LAST).read_bytes())
        return sum(part["steps"] for part in last["parts"]) if last["key"] == self.key else 0

    def set_aside(self, what: str, only: Path | None = None) -> None:
        """Move what cannot be read to a folder next to this one, and start again; ``what`` is the file at fault,
        ``only`` the file of a pass that is set aside alone.
        """
        number = 1
        while (aside := self.folder.with_name(f"{self.folder.name}.damaged-{number}")).exists():
            number += 1
        try:
            aside.mkdir()
            for file in list(self.folder.iterdir()) if only is None else [only]:
                if only is not None or _of_run(file):
                    file.rename(aside / file.name)
        except OSError as err:
            raise cannot_write(aside, err) from None
        if only is None:
            self.parts, self.number, self.safe = [], 0, 0
        self.notice(f"starts from the beginning: {what} cannot be read: the checkpoint is moved to {aside}")

    def add(self, columns: Arrays) -> None:
        """Write a chunk; it is valid from the next :meth:`commit` on."""
        self._make()
        name = f"{self.number:06d}.parquet"
        table = pa.table({k: arrow_array(np.asarray(v)) for k, v in columns.items()})
        sink = pa.BufferOutputStream()
        pq.write_table(table, sink, compression="zstd", use_dictionary=False)
        self.parts.append(self._write(name, sink.getvalue().to_pybytes(), table.num_rows))
        self.number += 1

    def commit(self, state: Mapping[str, bytes]) -> None:
        """Make the chunks so far and their state (files by name) the valid ones."""
        self._make()
        made = {name: self._write(f"{name}-{self.number:06d}.npz", data, 0) for name, data in state.items()}
        parts = {"parts": [asdict(p) for p in self.parts], "state": {name: asdict(p) for name, p in made.items()}}
        write_whole(self.folder / LAST, (json.dumps({"kind": KIND, "key": self.key, **parts}) + "\n").encode())
        for old in set(self.folder.glob("*.npz")) - {self.folder / part.file for part in made.values()}:
            if _of_run(old):
                old.unlink()
        self.safe = sum(part.steps for part in self.parts)

    def again(self, why: str) -> None:
        """Delete the stored data, so that the run with this key begins from the start; ``why`` is reported."""
        self.notice(why)
        self.parts, self.number, self.safe = [], 0, 0
        if self._lock is not None:
            self._clear()

    def columns(self) -> Stored:
        """Return the columns of the chunks."""
        return Stored(self.folder, self.parts)

    def close(self) -> None:
        """Unlock the folder for other runs."""
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None

    def discard(self) -> None:
        """Remove the folder, if this run holds it."""
        if self._lock is not None and is_ours(self.folder):
            shutil.rmtree(self.folder, ignore_errors=True)
        self.safe = 0
        self.close()

    def _write(self, name: str, data: bytes, steps: int) -> StoredChunk:
        write_whole(self.folder / name, data)
        return StoredChunk(name, steps, hashlib.sha256(data).hexdigest())

    def _make(self) -> None:
        if self._lock is not None:
            return
        try:
            self.folder.mkdir(parents=True)
        except FileExistsError:
            raise InputError(f"{self.folder}: another run has started there: name another result") from None
        except OSError as err:
            raise cannot_write(self.folder, err) from None
        self._hold()

    def _hold(self) -> None:
        """Lock the folder for as long as this process lives."""
        try:
            self._lock = os.open(self.folder / LOCK, os.O_RDWR | os.O_CREAT, 0o644)
        except OSError as err:
            raise cannot_write(self.folder, err) from None
        try:
            lock_file(self._lock)
        except OSError:
            self.close()
            raise InputError(
                f"{self.folder}: another run uses this folder: wait for it or name another result"
            ) from None
        sweep(self.folder)

    def _clear(self) -> None:
        for file in self.folder.iterdir():
            if _of_run(file):
                file.unlink()


def _of_run(file: Path) -> bool:
    """Return whether a file of the folder belongs to the state of the removal, not to the lock or a pass."""
    return file.name != LOCK and not file.name.startswith(PASS)


def is_ours(folder: Path) -> bool:
    """Return whether a folder contains only files of a checkpoint."""
    try:
        return (
            not folder.is_symlink()
            and folder.is_dir()
            and all(
                p.name in (LAST, LOCK) or p.suffix in (".parquet", ".npz") or p.name.startswith(FRESH)
                for p in folder.iterdir()
            )
        )
    except OSError as err:
        raise cannot_write(folder, err) from None


def require_ours(folder: Path) -> None:
    """Refuse a folder with other files in it.

    Raises
    ------
    InputError
        It is something else.
    """
    try:
        there = folder.exists()
    except OSError as err:
        raise cannot_write(folder, err) from None
    if there and not is_ours(folder):
        raise InputError(
            f"{folder}: is needed for the checkpoint and holds other files: move it or name another result"
        )


def digest(*values: Any) -> str:
    """Return a hash of values: numbers, texts, arrays, geometries, dataclasses, and tuples, lists, mappings of them."""
    out = hashlib.sha256()
    for value in values:
        _feed(out, value)
    return out.hexdigest()


def _feed(out: Any, value: Any) -> None:
    if isinstance(value, np.ndarray) and value.dtype == object:
        _feed(out, ("shapes", *value.shape))
        for binary in shapely.to_wkb(value.ravel(), byte_order=1):
            _feed(out, binary)
    elif isinstance(value, np.ndarray):
        out.update(f"array {value.dtype} {value.shape}:".encode())
        out.update(np.ascontiguousarray(value).tobytes())
    elif is_dataclass(value) and not isinstance(value, type):
        out.update(type(value).__qualname__.encode())
        _feed(out, {f.name: getattr(value, f.name) for f in fields(value)})
    elif isinstance(value, Mapping):
        out.update(f"mapping {len(value)}:".encode())
        for key, item in value.items():
            _feed(out, key)
            _feed(out, item)
    elif isinstance(value, (tuple, list)):
        out.update(f"row {len(value)}:".encode())
        for item in value:
            _feed(out, item)
    elif isinstance(value, bytes):
        out.update(f"bytes {len(value)}:".encode())
        out.update(value)
    elif value is None or isinstance(value, (bool, int, float, str, np.generic)):
        text = repr(value)
        out.update(f"{type(value).__name__} {len(text)}:{text}".encode())
    else:
        raise TypeError(f"no hash of a {type(value).__name__}")


def _hash(file: Path) -> str:
    with file.open("rb") as data:
        return hashlib.file_digest(data, "sha256").hexdigest()


def _read(file: Path, names: Sequence[str], count: int, stored: frozenset[str]) -> dict[str, NDArray[Any]]:
    """Some columns of a file of ``count`` rows that holds the columns ``held``."""
    with pq.ParquetFile(file) as open_file:
        table = open_file.read(columns=[name for name in names if name in stored], use_threads=False)
    return {name: np.asarray(table.column(name).to_numpy()) if name in stored else np.zeros(count) for name in names}
