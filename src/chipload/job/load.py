"""A job: one TOML file that names part, stock, machine, material and cutters, what to do, and the limits.

Every key carries its unit in its name; inside chipload the planner gets mm, mm/s and rad/s. A refused job gives one
line: the file, the dotted key, the value, the limit and what to do.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from chipload.errors import InputError
from chipload.job.impeller import ImpellerJob, ImpellerJobTable, impeller_job
from chipload.job.messages import first_error
from chipload.job.override import override
from chipload.job.planned import Job, planned_job
from chipload.job.program import ProgramJob, program_job
from chipload.job.shell import ShellJob, shell_job
from chipload.job.shell_tables import ShellJobTable
from chipload.job.tables import JobTable, ProgramJobTable, Table
from chipload.job.wall import WallJob, WallJobTable, wall_job

#: a job of any kind
AnyJob = Job | ProgramJob | ImpellerJob | ShellJob | WallJob

#: kinds of jobs: the table that only they have, the table of the whole file, and what makes the job of it
KINDS: Mapping[str, tuple[type[Table], Callable[[Path, Any, Sequence[str]], AnyJob]]] = {
    "shell": (ShellJobTable, shell_job),
    "program": (ProgramJobTable, program_job),
    "impeller": (ImpellerJobTable, impeller_job),
    "wall": (WallJobTable, wall_job),
    "part": (JobTable, planned_job),
}


def load_job(path: str | Path, overrides: Sequence[str] = ()) -> AnyJob:
    """Read a job file and apply ``key.path=value`` overrides; its kind is that of the first table of :data:`KINDS`.

    Raises
    ------
    InputError
        The file cannot be read, a key is unknown or missing, a value is out of range: one line that names it.
    """
    path = Path(path).absolute()
    label = path.name
    try:
        raw = tomllib.loads(path.read_bytes().decode("utf-8"))
    except OSError as err:
        raise InputError(f"{path}: cannot be read: {err.strerror}") from None
    except (ValueError, RecursionError) as err:
        raise InputError(f"{label}: not a TOML file: {err}") from None
    root, made = KINDS[next((key for key in KINDS if key in raw), "part")]
    for text in overrides:
        override(raw, text, root)
    try:
        return made(path, root.model_validate(raw), tuple(overrides))
    except ValidationError as err:
        raise InputError(f"{label}: {first_error(err, root)}") from None
    except InputError as err:
        raise InputError(f"{label}: {err}") from None
    except OverflowError:
        raise InputError(f"{label}: a number is too large: write it below 1e300") from None
