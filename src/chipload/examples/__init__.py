"""Jobs that come with chipload, to be copied out and run."""

from __future__ import annotations

import shutil
from importlib import resources
from pathlib import Path

from chipload.errors import InputError
from chipload.tables import nearest


def example_titles() -> dict[str, str]:
    """Every example with the heading of its README."""
    folders = sorted((f for f in resources.files(__name__).iterdir() if f.joinpath("job.toml").is_file()), key=str)
    return {f.name: f.joinpath("README.md").read_text("utf-8").splitlines()[0].lstrip("# ") for f in folders}


def check_name(name: str) -> None:
    """Refuse a name that no example has.

    Raises
    ------
    InputError
        There is no such example.
    """
    known = list(example_titles())
    if name not in known:
        near = nearest(name, known)
        raise InputError(f"example {name}: not known; did you mean {near}? (known: {', '.join(known)})")


def copy_example(name: str, folder: str | Path) -> Path:
    """Copy an example into a new or empty folder and return that folder.

    Raises
    ------
    InputError
        There is no such example, the folder holds something, or it cannot be written.
    """
    check_name(name)
    target = Path(folder)
    try:
        if target.exists() and (not target.is_dir() or any(target.iterdir())):
            raise InputError(f"{folder}: is not empty: name a folder that is new or empty")
        with resources.as_file(resources.files(__name__) / name) as source:
            shutil.copytree(source, target, dirs_exist_ok=True, ignore=shutil.ignore_patterns("__pycache__"))
    except OSError as err:
        raise InputError(f"{folder}: cannot be written: {err.strerror or err}") from None
    return target
