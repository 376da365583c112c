"""Templates of the files that a job names: material, machine, catalogue, controller, fixture; each is read back."""

from __future__ import annotations

from importlib import resources
from pathlib import Path

from chipload.errors import InputError
from chipload.files import cannot_write, write_whole

#: kinds of templates and their files
TEMPLATES = {
    "material": "material.toml", "machine": "machine.toml", "catalogue": "catalogue.toml",
    "controller": "controller.toml", "fixture": "fixture.stl",
}  # fmt: skip
#: corners of the block of the fixture [mm]: a vice jaw next to a workpiece at x = 0
JAW = ((-30.0, -50.0, -40.0), (-1.0, 50.0, -5.0))


def write_template(kind: str, folder: Path) -> Path:
    """Write a template into a folder and return the file.

    Raises
    ------
    InputError
        The file is there already.
    OutputError
        It cannot be written.
    """
    path = folder / TEMPLATES[kind]
    if path.exists():
        raise InputError(f"{path}: already exists and is not overwritten: name another folder")
    if kind == "fixture":
        data = block_stl(*JAW).encode()
    else:
        data = resources.files("chipload").joinpath("data", "templates", TEMPLATES[kind]).read_bytes()
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as err:
        raise cannot_write(folder, err) from None
    write_whole(path, data)
    return path


def block_stl(low: tuple[float, float, float], high: tuple[float, float, float]) -> str:
    """A block as an STL text: twelve triangles, seen counter-clockwise from outside [mm].

    >>> block_stl((0, 0, 0), (1, 1, 1)).count("vertex")
    36
    """
    corners = [tuple((low, high)[(k >> i) & 1][i] for i in range(3)) for k in range(8)]
    sides = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))
    lines = ["solid fixture"]
    for a, b, c, d in sides:
        for triangle in ((a, b, c), (a, c, d)):
            points = "\n".join("      vertex {:g} {:g} {:g}".format(*corners[k]) for k in triangle)
            lines.append(f"  facet normal 0 0 0\n    outer loop\n{points}\n    endloop\n  endfacet")
    return "\n".join([*lines, "endsolid fixture", ""])
