"""A folder of jobs that run in the order of the numbers of their names, later ones from the results of earlier ones."""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import Path

from chipload.errors import InputError

#: folder of the results of the jobs, in that of the jobs
RESULTS = "result"
_NUMBERED = re.compile(r"(\d+)-.+\.toml")


def jobs_in(folder: Path) -> list[Path]:
    """The jobs of a folder, as ``1-pockets.toml``, by their numbers.

    Raises
    ------
    InputError
        It has none, or two with one number.
    """
    found = {path: int(m[1]) for path in sorted(folder.glob("*.toml")) if (m := _NUMBERED.fullmatch(path.name))}
    if not found:
        own = "; it has a job.toml: name that" if (folder / "job.toml").exists() else ""
        raise InputError(f"{folder}: has no numbered jobs, as 1-pockets.toml{own}: name a job file")
    out = sorted(found, key=lambda path: found[path])
    for a, b in pairwise(out):
        if found[a] == found[b]:
            raise InputError(f"{folder}: {a.name} and {b.name} have one number: which runs first? rename one of them")
    return out


def results_of(folder: Path, out: Path) -> Path:
    """The folder of the results of a folder of jobs, where its jobs look for them.

    Raises
    ------
    InputError
        Another one is named.
    """
    if out.absolute().resolve() != (folder / RESULTS).absolute().resolve():
        raise InputError(f"--out {out}: the jobs of {folder} read earlier results there: use --out {folder / RESULTS}")
    return out
