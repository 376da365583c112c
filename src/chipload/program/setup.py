"""State of a controller before a program begins: parameters, work offsets, the cutters of its tools.

Notation: a parameter is named as the text names it: ``#5221``, ``#<depth>`` or ``_hal[x]`` (RS-274), ``R10``
(Sinumerik), ``Q10`` (Heidenhain). A work offset is named by the code that selects it: ``G54`` to ``G59.3``,
``G54.1 P7`` (Fanuc), ``G505`` (Sinumerik). Its origin is the place of its zero in the machine's coordinates, X Y Z A B
C U V W [mm, deg]; only differences count where the machine has no rotary axes.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from chipload.cutter.cutter import Cutter
from chipload.errors import InputError
from chipload.program.control import ControlSettings, control_named, is_cl_data

#: number from which tools that have only a name count
FIRST_NAMED = 9001

Nine = tuple[float, ...]


@dataclass(frozen=True)
class StatedControl:
    """What a job states about the control of its program; None: not stated.

    Parameters
    ----------
    name : of a profile
    unit : of lengths before the text says G20 or G21: ``mm`` or ``inch``
    tools_unit : of the tool table
    compensation : what an offset for G41 holds: ``control`` (the cutter's radius), ``wear``, ``off`` (G41 is left out)
    settings : of the control
    """

    name: str | None = None
    unit: str | None = None
    tools_unit: str | None = None
    compensation: str | None = None
    settings: ControlSettings = field(default_factory=ControlSettings)

    def __post_init__(self) -> None:
        """Refuse a value that is not one of the known ones."""
        units, kinds = ("mm", "inch"), ("control", "wear", "off")
        for key, known in (("unit", units), ("tools_unit", units), ("compensation", kinds)):
            value = getattr(self, key)
            if value is not None and value not in known:
                raise InputError(f"program.{key} = {value!r}: must be one of {', '.join(known)}")


@dataclass(frozen=True, eq=False)
class Setup:
    """State of a controller when a program begins.

    Parameters
    ----------
    parameters : value by name
    work_offsets : 3 to 9 numbers [mm, deg] by code
    placed_in : code of the work offset in whose coordinates the workpiece is; None: the first that the program uses
    cutters : of the tools, by number
    control : what is stated about the control and the units
    """

    parameters: Mapping[str, float] = field(default_factory=dict)
    work_offsets: Mapping[str, Sequence[float]] = field(default_factory=dict)
    cutters: Mapping[int, Cutter] = field(default_factory=dict)
    placed_in: str | None = None
    control: StatedControl = field(default_factory=StatedControl)

    def values(self, dialect: str) -> dict[int | str, float]:
        """Value of each parameter by number, or by name in lower case without spaces.

        Raises
        ------
        InputError
            The dialect has no parameter of that name.

        >>> Setup({"#100": 2.5, "#<depth>": 1.0}).values("linuxcnc"), Setup({"Q10": 3.0}).values("heidenhain")
        ({100: 2.5, 'depth': 1.0}, {10: 3.0})
        """
        out: dict[int | str, float] = {}
        lines = None if is_cl_data(dialect) else control_named(dialect).lines
        for name, value in self.parameters.items():
            plain = "".join(name.split()).lower()
            found = None if lines is None else re.fullmatch(lines.parameter, plain)
            if found is None:
                shown = "no parameters" if lines is None else lines.parameter_example
                raise InputError(f"program.parameters: {name!r}: must be as {dialect} names them: {shown}")
            if not math.isfinite(value):
                raise InputError(f"program.parameters: {name} = {value:g}: must be a finite number")
            own = next(group for group in found.groups() if group)
            out[int(own) if own.isdigit() else own] = float(value)
        return out

    def origins(self, dialect: str) -> dict[int, tuple[Nine, float]]:
        """(9,) [mm, deg] and rotation [deg] of each work offset by its number, 1 for G54.

        Raises
        ------
        InputError
            The dialect has no work offset of that name, or its numbers are not 3 to 9.

        >>> Setup(work_offsets={"G55": [10.0, 0.0, -5.0]}).origins("linuxcnc")
        {2: ((10.0, 0.0, -5.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), 0.0)}
        """
        out: dict[int, tuple[Nine, float]] = {}
        for name, given in self.work_offsets.items():
            number = offset_number(name, dialect)
            origin = tuple(float(x) for x in given)
            if not 3 <= len(origin) <= 9 or not all(math.isfinite(x) for x in origin):
                raise InputError(
                    f"program.work_offsets: {name} = {list(given)}: must be 3 to 9 numbers, X Y Z A B C U V W in mm "
                    "and degrees"
                )
            out[number] = (origin + (0.0,) * (9 - len(origin)), 0.0)
        return out

    def placed(self, dialect: str) -> int | None:
        """Number of the work offset of ``placed_in``."""
        return None if self.placed_in is None else offset_number(self.placed_in, dialect, "placed_in")

    def diameters(self) -> dict[int, float]:
        """Diameter [mm] of each cutter by its tool."""
        return {number: cutter.diameter for number, cutter in self.cutters.items()}


def offset_name(number: int, dialect: str) -> str:
    """The code that selects a work offset, 1 for G54.

    >>> offset_name(2, "fanuc"), offset_name(16, "fanuc"), offset_name(9, "linuxcnc"), offset_name(5, "sinumerik")
    ('G55', 'G54.1 P7', 'G59.3', 'G505')
    """
    codes = (f"G{53 + number}", f"G59.{number - 6}", f"G54.1 P{number - 9}", f"G{500 + number}")
    for code in codes:
        try:
            if offset_number(code, dialect) == number:
                return code
        except InputError:
            continue
    return codes[0]


def offset_number(name: str, dialect: str, key: str = "work_offsets") -> int:
    """Number of a work offset that a code selects; ``key`` of the job for messages.

    >>> offset_number("G59.3", "linuxcnc"), offset_number("G54.1 P7", "fanuc"), offset_number("G505", "sinumerik")
    (9, 16, 5)
    """
    plain = " ".join(name.split()).upper()
    rules = None if is_cl_data(dialect) else control_named(dialect).offsets
    if rules is not None:
        for pattern, base in zip(rules.work_codes, rules.work_bases, strict=True):
            if (found := re.fullmatch(pattern, plain)) is not None:
                return int(found[1]) + base
    text = (
        f"must be {rules.work_names}" if rules is not None and rules.work_names else f"{dialect} has none: leave it out"
    )
    raise InputError(f"program.{key}: {name!r}: {text}")
