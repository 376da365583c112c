"""Parameters that mirror the state of a controller: #5420, #5400, #<_metric> and their like.

Notation: coordinates are in the units that are active, tools in units of the machine, angles in degrees.

Reference: LinuxCNC 2.9, "Predefined Named Parameters" and "Numbered Parameters".
"""

from __future__ import annotations

import math

from chipload.program.gcode.controller import Controller
from chipload.program.gcode.state import AXES, LINEAR, ZERO
from chipload.program.gcode.tools import Tool


def mirror(c: Controller) -> None:
    """Let the parameters of a controller be read from its state."""
    live, state = c.parameters.live, c.state

    def coordinate(k: int) -> float:
        return state.at[k] / (state.scale if k in LINEAR else 1.0)

    def absolute(k: int) -> float:
        return c.machine_position()[k] / (state.scale if k in LINEAR else 1.0)

    def loaded_tool() -> Tool:
        return (c.tools or {}).get(state.tool, Tool(state.tool))

    def length(k: int) -> float:
        value = loaded_tool().offset[k]
        return value / c.machine_scale if k in LINEAR else math.degrees(value)

    for k, axis in enumerate(AXES):
        live[5420 + k] = lambda k=k: coordinate(k)  # type: ignore[misc]
        live[f"_{axis}"] = live[5420 + k]
        live[f"_abs_{axis}"] = lambda k=k: absolute(k)  # type: ignore[misc]
        live[5401 + k] = lambda k=k: length(k)  # type: ignore[misc]
    live[5220] = lambda: float(state.datum.number)
    live[5400] = lambda: float(state.tool)
    live[5410] = lambda: loaded_tool().diameter / c.machine_scale
    live[5411] = lambda: math.degrees(loaded_tool().front)
    live[5412] = lambda: math.degrees(loaded_tool().back)
    live[5413] = lambda: float(loaded_tool().orientation)
    flags = {
        "_metric": lambda: state.scale == 1.0,
        "_imperial": lambda: state.scale != 1.0,
        "_absolute": lambda: state.absolute,
        "_incremental": lambda: not state.absolute,
        "_inverse_time": lambda: state.feed_mode == 930,
        "_units_per_minute": lambda: state.feed_mode == 940,
        "_units_per_rev": lambda: state.feed_mode == 950,
        "_tool_offset": lambda: state.datum.length != ZERO,
        "_retract_r_plane": lambda: not state.old_level,
        "_retract_old_z": lambda: state.old_level,
        "_spindle_rpm_mode": lambda: not state.surface,
        "_spindle_css_mode": lambda: state.surface,
        "_ijk_absolute_mode": lambda: state.absolute_centre,
        "_lathe_diameter_mode": lambda: state.diameter,
        "_lathe_radius_mode": lambda: not state.diameter,
        "_spindle_on": lambda: state.sense != 0,
        "_spindle_cw": lambda: state.sense == 1,
        "_mist": lambda: state.mist,
        "_flood": lambda: state.flood,
        "_speed_override": lambda: True,
        "_feed_override": lambda: True,
        "_adaptive_feed": lambda: False,
        "_feed_hold": lambda: True,
        "_task": lambda: False,
        "_vmajor": lambda: 2.9,
        "_vminor": lambda: 0,
        "_line": lambda: c.line,
        "_motion_mode": lambda: state.motion,
        "_plane": lambda: state.plane,
        "_ccomp": lambda: state.compensation,
        "_coord_system": lambda: 530 + 10 * state.datum.number if state.datum.number < 7 else 584 + state.datum.number,
        "_feed": lambda: state.feed / state.scale,
        "_rpm": lambda: state.speed,
        "_current_tool": lambda: state.tool,
        "_current_pocket": lambda: loaded_tool().pocket,
        "_selected_tool": lambda: state.selected,
        "_selected_pocket": lambda: (c.tools or {}).get(state.selected, Tool(0)).pocket,
        "_value": lambda: c.returned[0],
        "_value_returned": lambda: c.returned[1],
        "_call_level": lambda: c.level,
        "_remap_level": lambda: 0,
    }
    for name, flag in flags.items():
        live[name] = lambda flag=flag: float(flag())  # type: ignore[misc]
