"""What every kind of job names: a shipped thing or a file of one's own, and cutters by number."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from chipload.cutter.cutter import Cutter
from chipload.cutter.table import CutterTable
from chipload.errors import InputError
from chipload.job.tables import SourceTable


def source(key: str, table: SourceTable, folder: Path) -> str | Path:
    """The shipped name or the file, whichever is stated.

    Raises
    ------
    InputError
        Neither is, or both are.
    """
    if (table.name is None) == (table.file is None):
        said = "none is" if table.name is None else "both are"
        raise InputError(f"{key}: {said} stated: state either {key}.name or {key}.file")
    return table.name if table.name is not None else folder / str(table.file)


def cutters(entries: Sequence[CutterTable], folder: Path) -> dict[int, Cutter]:
    """The cutters of a job by number.

    Raises
    ------
    InputError
        Two have one number, or one cannot be used.
    """
    out: dict[int, Cutter] = {}
    for k, entry in enumerate(entries):
        try:
            cutter = entry.cutter(folder)
        except InputError as err:
            raise InputError(str(err).replace("cutter", f"cutter.{k}", 1)) from None
        if cutter.number in out:
            raise InputError(f"cutter.{k}.number = {cutter.number}: is taken by another cutter: give each its own")
        out[cutter.number] = cutter
    return out


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
