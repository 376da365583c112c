"""Where the numbers come from: hashes of the inputs and versions; no time of day, no place on this computer."""

from __future__ import annotations

import contextlib
import hashlib
import platform
from collections.abc import Mapping, Sequence
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from chipload.cutting.material import Material
from chipload.files import hash_of
from chipload.machine.machine import Machine
from chipload.result import Provenance

#: libraries whose version may change a number
LIBRARIES = ("chipload", "numpy", "scipy", "numba", "shapely", "embreex", "ezdxf", "cadquery-ocp-novtk")


def hashes(files: Mapping[str, Path]) -> dict[str, str]:
    """Name and hash of each file."""
    return {name: f"{path.name} sha256 {hash_of(path)}" for name, path in files.items()}


def versions() -> dict[str, str]:
    """Versions of the libraries that are installed, and of Python."""
    found = {}
    for name in LIBRARIES:
        with contextlib.suppress(PackageNotFoundError):
            found[name] = version(name)
    return found | {"python": platform.python_version()}


@cache
def sources() -> str:
    """Hash of the sources of chipload: what was begun with others is not gone on with. Read once in a process."""
    out = hashlib.sha256()
    folder = Path(__file__).parents[1]
    for file in sorted(folder.rglob("*.py")):
        out.update(f"{file.relative_to(folder).as_posix()} ".encode() + file.read_bytes())
    return out.hexdigest()


def provenance_of(
    files: Mapping[str, Path], overrides: Sequence[str], machine: Machine, materials: Sequence[Material] = ()
) -> Provenance:
    """Where the numbers of a run come from.

    Parameters
    ----------
    files : what was read, by what it is
    overrides : keys of the job that were overridden
    """
    named = f"{machine.name}: {machine.note}" if machine.note else machine.name
    sources = {m.name: f"{m.workpiece}; {m.source}; {m.conditions}" for m in materials}
    return Provenance(hashes(files), tuple(overrides), named, sources, versions())


def title_of(path: Path) -> str:
    """What a job is called: its folder where the file is `job.toml`."""
    return path.parent.name if path.stem == "job" else path.stem
