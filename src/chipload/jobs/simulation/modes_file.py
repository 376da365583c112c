"""The file of modes that ``[dynamics]`` names, as ``chipload tap`` writes it."""

from __future__ import annotations

from pathlib import Path

from pydantic import ValidationError

from chipload.errors import InputError
from chipload.files import read_regular
from chipload.jobs.messages import table_errors
from chipload.jobs.simulation.dynamics_tables import ModesFileTable, ModeTable
from chipload.tables import parse_toml

#: largest file of modes [bytes]
LARGEST_FILE = 1_000_000


def read_modes(path: Path) -> tuple[ModeTable, ...]:
    """Read the modes of a file.

    Raises
    ------
    InputError
        It cannot be read or is no table of modes.
    """
    raw = parse_toml(path.name, read_regular(path, path.name, LARGEST_FILE))
    for mode in raw.get("mode", ()) if isinstance(raw.get("mode"), list) else ():
        if isinstance(mode, dict):
            for key in ("residual_percent", "coherence"):
                mode.pop(key, None)
    try:
        return ModesFileTable.model_validate(raw).mode
    except ValidationError as err:
        texts = table_errors(err, ModesFileTable)
        raise InputError(f"{path.name}: {next(iter(texts))}") from None
