"""Conversion of values (a name, a file or keys) into the tables of a job."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from chipload.errors import InputError
from chipload.progress import Progress

if TYPE_CHECKING:
    from chipload.cutter.table import CutterTable
    from chipload.jobs import FinishedJob

#: a table of the job file by its keys
Values: TypeAlias = Mapping[str, Any]
#: one table, or several
Tables: TypeAlias = Values | Sequence[Values]
#: a shipped name, a file (``Path``, or a text that ends in .toml or .ini), or keys of the table
Source: TypeAlias = str | Path | Values
#: one ``[[cutter]]`` or several
Cutters: TypeAlias = "CutterTable | Values | Sequence[CutterTable | Values]"

#: tables that a file alone may stand for; those that a shipped name may stand for too; those of which there are several
FILES, SOURCES = ("part", "program", "threshold"), ("machine", "material", "catalogue")
SEVERAL = ("operation", "surface", "surprise", "fixture", "measurement")


def run_tables(
    capability: str, folder: str | Path, progress: Progress, kinds: tuple[str, ...] = (), /, **given: Any
) -> FinishedJob:
    """Run the job of these tables; a table that is None is left out. Operations must be of one of ``kinds``."""
    from chipload import jobs

    tables = {key: _tables_of_value(key, value) for key, value in given.items() if value is not None}
    for k, op in enumerate(tables["operation"] if kinds else ()):
        if op.get("kind") not in kinds:
            known = f"{'one of ' if len(kinds) > 1 else ''}{', '.join(map(repr, kinds))}"
            raise InputError(f"operation.{k}.kind = {op.get('kind')!r}: must be {known}")
    return jobs.run_job(jobs.job_of(tables, folder, capability=capability), progress)


def _tables_of_value(key: str, given: Any) -> Any:
    """Return the table or tables that a value stands for under this key."""
    if key in FILES:
        return _file(key, given)
    if key in SOURCES:
        return _source(key, given)
    return tables_of(key, given) if key in SEVERAL else given


def tables_of(key: str, given: Tables) -> list[Values]:
    """Return one table or several as a list."""
    several = [given] if isinstance(given, Mapping) else list(given)
    for k, one in enumerate(several):
        if not isinstance(one, Mapping):
            raise InputError(f"{key}.{k} = {one!r}: must be a table of keys and values")
    return several


def cutters_of(given: Any) -> list[Any]:
    """Return one cutter or several as a list."""
    return list(given) if isinstance(given, (list, tuple)) else [given]


def _source(key: str, given: Source) -> Values:
    """Return the table that names a shipped entry or a file."""
    table = _file(key, given)
    if isinstance(given, Mapping) or is_file(given):
        return table
    return {"name": given}


def _file(key: str, given: Source) -> Values:
    """Return the table that names a file."""
    if isinstance(given, Mapping):
        return given
    if not isinstance(given, (str, Path)):
        raise InputError(f"{key}: {type(given).__name__}: give a name, a file, or the keys of its table")
    return {"file": str(given)}


def is_file(name: str | Path) -> bool:
    """Return whether a name is a file name: a path, or a text that ends in .toml or .ini."""
    return isinstance(name, Path) or Path(name).suffix.lower() in (".toml", ".ini")
