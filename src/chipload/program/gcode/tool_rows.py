"""Tool offsets of a controller by kind and number: what G10 and variables set, else what the tool table states.

Notation: a kind is ``length``, ``radius`` or ``diameter``, or one of them with `` wear``. Variables stand in rows,
of which the first 200 are read: which row holds which kind is in the profile of the control. Values are in mm here.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from chipload.program.gcode.state import LINEAR, nine

if TYPE_CHECKING:
    from chipload.program.gcode.controller import Controller

#: variables of origins: the first, the last, and the number of the work offset of the first
ORIGINS = ((5221, 5340, 1), (7001, 7999, 10), (14001, 15999, 10))
#: from the origin of a work offset to that of the next, and axes of one
STRIDE, AXES = 20, 6
#: offsets in a row of variables
ROW = 200
WEAR = " wear"


class ToolRows:
    """Tool offsets of one controller."""

    def __init__(self, controller: Controller):
        self.c = controller
        #: value [mm] by kind and number, that the program has set
        self.stated: dict[tuple[str, int], float] = {}
        #: called with the number of the active work offset whose origin the program has moved
        self.moved: Callable[[int], None] | None = None
        if controller.control.macros.tool_variables or controller.control.macros.system_variables:
            controller.parameters.row, controller.parameters.keep = self.read, self.keep
            for variable, value in controller.parameters.numbered.items():
                if (place := self._place(variable)) is not None:
                    self.stated[place] = value * controller.machine_scale

    def _place(self, variable: int) -> tuple[str, int] | None:
        rows = self.c.control.macros.tool_variables
        return next(((kind, variable - first + 1) for first, kind in rows.items() if 0 <= variable - first < ROW), None)

    def _origin(self, variable: int) -> tuple[int, int] | None:
        """Work offset and axis whose origin is in a variable: G54 to G59, and G54.1 P (G154 P) of a Fanuc or a Haas."""
        if not self.c.control.macros.system_variables:
            return None
        for first, last, base in ORIGINS:
            number, axis = divmod(variable - first, STRIDE)
            if first <= variable <= last and axis < AXES:
                return base + number, axis
        return None

    def _set_origin(self, number: int, axis: int, value: float) -> None:
        """Put the origin of a work offset elsewhere along an axis [units of the text, deg]."""
        c = self.c
        if number > 9:
            c.set_origin(number, {axis: value})
        else:
            at = list(c.stored(5201 + STRIDE * number))
            at[axis] = value * (c.state.scale if axis in LINEAR else 1.0)
            c.store(5201 + STRIDE * number, nine(at))
            c.stated_offsets.add(number)
        if c.state.datum.number == number and self.moved is not None:
            self.moved(number)

    def read(self, variable: int) -> float | None:
        """Value of a variable [units of the text]; None where it is no tool offset or nothing states it."""
        if (axis := self._origin(variable)) is not None and axis[0] > 9:
            at = self.c.origins.get(axis[0], None)
            return None if at is None else at[0][axis[1]] / (self.c.state.scale if axis[1] in LINEAR else 1.0)
        place = self._place(variable)
        value = None if place is None else self.value(*place)
        return None if value is None else value / self.c.state.scale

    def keep(self, variable: int, value: float) -> bool:
        """Set the offset of a variable [units of the text]; whether it is one."""
        if (axis := self._origin(variable)) is not None:
            self._set_origin(*axis, value)
            return True
        place = self._place(variable)
        if place is not None:
            self.set(*place, value * self.c.state.scale)
        return place is not None

    def set(self, kind: str, number: int, value: float) -> None:
        """Set an offset [mm]."""
        self.stated[kind, number] = value
        self.c.stated_tool_offset(kind, number)

    def value(self, kind: str, number: int) -> float | None:
        """Offset [mm] of a number; None where neither the program nor the tool table states it."""
        if (kind, number) in self.stated:
            return self.stated[kind, number]
        tool = (self.c.tools or {}).get(number)
        if tool is None:
            return None
        if kind.endswith(WEAR):
            return 0.0
        return tool.offset[2] if kind == "length" else tool.diameter * (1.0 if kind == "diameter" else 0.5)

    def radius(self, number: int) -> float | None:
        """Geometry [mm] that the program has set for compensation; None where it has set none."""
        if ("radius", number) in self.stated:
            return self.stated["radius", number]
        diameter = self.stated.get(("diameter", number))
        return None if diameter is None else 0.5 * diameter

    def wear(self, number: int) -> float:
        """Wear of the radius [mm] that the program has set."""
        return self.stated.get((f"radius{WEAR}", number), 0.0) + 0.5 * self.stated.get((f"diameter{WEAR}", number), 0.0)

    def length(self, number: int, stated: float) -> float:
        """Length [mm] with its wear; ``stated`` by the tool table."""
        return self.stated.get(("length", number), stated) + self.stated.get((f"length{WEAR}", number), 0.0)
