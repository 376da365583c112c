"""What every kind of job names: a shipped thing or a file of one's own, and cutters by number."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel, ValidationError

from chipload.cutter.cutter import Cutter
from chipload.cutter.table import CutterTable
from chipload.errors import InputError
from chipload.files import near_name
from chipload.jobs.messages import Errors
from chipload.jobs.tables import SourceTable
from chipload.tables import shipped_table
from chipload.units import rpm_from_rad_s


def source(key: str, table: SourceTable, folder: Path) -> str | Path:
    """The shipped name or the file, whichever is stated.

    Raises
    ------
    InputError
        Neither is, or both are.
    """
    if (table.name is None) == (table.file is None):
        raise InputError(_one_source(key, table.name is not None))
    return table.name if table.name is not None else folder / str(table.file)


def _one_source(key: str, both: bool) -> str:
    return f"{key}: {'both are' if both else 'none is'} stated: state either {key}.name or {key}.file"


def sources_of(table: Any, folder: Path, *keys: str) -> dict[str, str | Path]:
    """The shipped name or the file of several tables of a job.

    Raises
    ------
    InputError
        As :func:`source`, a line for each.
    """
    errors, out = Errors(), dict[str, str | Path]()
    for key in keys:
        with errors.collect():
            out[key] = source(key, getattr(table, key), folder)
    errors.refuse()
    return out


def sources_and_cutters(
    table: Any, folder: Path, errors: Errors, *keys: str
) -> tuple[dict[str, str | Path], dict[int, Cutter]]:
    """The sources of several tables of a job, and its cutters by number; what is wrong is put among ``errors``."""
    sources: dict[str, str | Path] = {}
    tools: dict[int, Cutter] = {}
    with errors.collect():
        sources = sources_of(table, folder, *keys)
    with errors.collect():
        tools = cutters(table.cutter, folder)
    errors.texts += [
        f"cutter {n}: body_mm: for a program that is simulated: leave it out, and state its numbers"
        for n, cutter in tools.items()
        if cutter.body
    ]
    errors.texts += speed_errors(table.model_dump(), tools, number=next(iter(tools)) if len(tools) == 1 else None)
    return sources, tools


def speed_errors(values: Any, cutters: Mapping[int, Cutter], key: str = "", number: int | None = None) -> list[str]:
    """Spindle speeds (``speed_rpm``, ``most_rpm``) of the tables of a job that are above ``max_rpm`` of their cutter.

    Parameters
    ----------
    values : of the job, or of a table of it
    key : of that table
    number : of the cutter that a table outside of it names
    """
    if isinstance(values, (list, tuple)):
        return [text for k, one in enumerate(values) for text in speed_errors(one, cutters, f"{key}.{k}", number)]
    if not isinstance(values, Mapping):
        return []
    own = values.get("cutter")
    number = own if isinstance(own, int) else number
    out, per = list[str](), rpm_from_rad_s(1.0)
    for name, value in values.items():
        place = f"{key}.{name}" if key else name
        cutter = None if number is None else cutters.get(number)
        most = None if cutter is None else cutter.max_speed
        if (
            name in ("speed_rpm", "most_rpm")
            and most is not None
            and value is not None
            and value > per * most * (1.0 + 1e-9)
        ):
            out.append(f"{place} = {value:g}: must be at most max_rpm = {per * most:g} of cutter {number}")
        out += speed_errors(value, cutters, place, number)
    return out


def entries_of(values: Mapping[str, Any], key: str) -> Iterator[tuple[int, Mapping[str, Any]]]:
    """The tables of a list in a file, with their number; what is no table is left out."""
    found = values.get(key)
    for k, entry in enumerate(found if isinstance(found, (list, tuple)) else ()):
        if isinstance(entry, Mapping):
            yield k, entry


def cutters(entries: Sequence[CutterTable], folder: Path) -> dict[int, Cutter]:
    """The cutters of a job by number.

    Raises
    ------
    InputError
        Two have one number, or one cannot be used: a line for each.
    """
    out: dict[int, Cutter] = {}
    errors = Errors()
    for k, entry in enumerate(entries):
        try:
            cutter = entry.cutter(folder)
        except InputError as err:
            errors.texts += [str(text).replace("cutter", f"cutter.{k}", 1) for text in err.args]
            continue
        if cutter.number in out:
            errors.add(f"cutter.{k}.number = {cutter.number}: is taken by another cutter: give each its own")
        out[cutter.number] = cutter
    errors.refuse()
    return out


def unknown_cutter(key: str, number: int, known: Mapping[int, Cutter]) -> Iterator[str]:
    """What is wrong with the number of a cutter: that none has it; nothing where no cutter could be read."""
    if known and number not in known:
        numbers = ", ".join(str(n) for n in sorted(known))
        yield f"{key} = {number}: no [[cutter]] has this number: state one of {numbers}"


def cutter_errors(raw: Mapping[str, Any], folder: Path) -> list[str]:
    """What is wrong with those cutters of a file whose values are right one by one."""
    entries = raw.get("cutter")
    found = []
    for k, entry in enumerate(entries if isinstance(entries, list) else []):
        try:
            CutterTable.model_validate(entry).cutter(folder)
        except ValidationError:
            continue
        except InputError as err:
            found += [str(text).replace("cutter", f"cutter.{k}", 1) for text in err.args]
    return found


def source_errors(raw: Mapping[str, Any], root: type[BaseModel]) -> list[str]:
    """Tables of a file that name neither a shipped thing nor a file, or both."""
    found = []
    for key, field in root.model_fields.items():
        table = raw.get(key)
        if SourceTable in (field.annotation, *get_args(field.annotation)) and isinstance(table, dict):
            stated = [name for name in ("name", "file") if name in table]
            if len(stated) != 1:
                found.append(_one_source(key, bool(stated)))
    return found


def named_errors(values: Mapping[str, Any], folder: Path) -> list[str]:
    """What is wrong with the names and the files that the tables of a job state: shipped things that are not known,
    files that are not there.

    Parameters
    ----------
    values : of a job file, or of its tables
    folder : that file names are relative to
    """
    errors = Errors()
    for kind in ("machine", "material", "catalogue"):
        table = values.get(kind)
        name = table.get("name") if isinstance(table, Mapping) and table.get("file") is None else None
        if isinstance(name, str):
            with errors.collect():
                shipped_table(kind, name)
    for key, file in _files_of(values):
        if not (folder / file).exists():
            near = near_name(folder / file)
            meant = f": did you mean {near}?" if near else f": is not in {folder.name or folder}"
            errors.add(f"{key} = {file}: no such file{meant}")
    return errors.texts


def _files_of(values: Any, key: str = "") -> Iterator[tuple[str, str]]:
    """The keys `file` of tables within one another, with their values."""
    if isinstance(values, (list, tuple)):
        for k, one in enumerate(values):
            yield from _files_of(one, f"{key}.{k}")
    elif isinstance(values, Mapping):
        for name, one in values.items():
            place = f"{key}.{name}" if key else str(name)
            if name == "file" and isinstance(one, str) and one:
                yield place, one
            else:
                yield from _files_of(one, place)


class Limited:
    """A job whose table has limits."""

    table: Any

    @property
    def limits(self) -> dict[str, float]:
        """The limits that are stated, by name."""
        return dict(self.table.limits.stated)

    @property
    def unchecked(self) -> tuple[str, ...]:
        """Names of the limits that are not stated, so that nothing holds the job against them."""
        return tuple(self.table.limits.unstated)
