"""Work offsets that LinuxCNC has saved in the parameter file named in the `.ini` of a machine.

Each line holds the number and value of a parameter; lengths are in the unit of the machine. G54 to G59.3 begin at 5221,
20 parameters apart: X Y Z A B C U V W, then the rotation about Z.
Reference: LinuxCNC 2.9, "Parameters", numbered parameters.
"""

from __future__ import annotations

import math
from pathlib import Path

from chipload.errors import InputError
from chipload.files import is_file, read_regular
from chipload.machine.hal import read_sections
from chipload.machine.ini import UNITS_MM

#: first parameter of G54, parameters per work offset, axis values of a work offset, number of work offsets
FIRST, STRIDE, NUMBERS, COUNT = 5221, 20, 9, 9
#: largest parameter file [bytes]
LARGEST_FILE = 1_000_000


def saved_offsets(path: Path) -> dict[str, list[float]]:
    """Origin of each work offset in the machine, X Y Z A B C U V W [mm, deg] by its code; empty if there is no file.

    A work offset with a rotation of the coordinates is omitted.

    Raises
    ------
    InputError
        A file cannot be read, or the unit of the machine is missing.
    """
    ini, _ = read_sections(path)
    name = ini.value("RS274NGC", "PARAMETER_FILE")
    file = path.parent / name if name else None
    if file is None or not is_file(file):
        return {}
    mm = UNITS_MM.get((ini.value("TRAJ", "LINEAR_UNITS") or "").lower())
    if mm is None:
        raise InputError(f"{ini.label}: [TRAJ] LINEAR_UNITS is missing: must be one of {', '.join(UNITS_MM)}")
    values: dict[int, float] = {}
    for line in read_regular(file, file.name, LARGEST_FILE).decode("utf-8", "replace").splitlines():
        words = line.split()
        if len(words) >= 2 and words[0].isdigit():
            try:
                values[int(words[0])] = float(words[1])
            except ValueError:
                raise InputError(f"{file.name}: parameter {words[0]} = {words[1][:20]}: must be a number") from None
    out: dict[str, list[float]] = {}
    for k in range(COUNT):
        first = FIRST + STRIDE * k
        nine = [values.get(first + i, 0.0) * (1.0 if 3 <= i < 6 else mm) for i in range(NUMBERS)]
        if first in values and values.get(first + NUMBERS, 0.0) == 0.0 and all(map(math.isfinite, nine)):
            out[f"G{54 + k}" if k < 6 else f"G59.{k - 5}"] = nine
    return out
