"""A machine from the configuration of LinuxCNC: its `.ini` file and the values that it sets in HAL.

Notation: a joint is a motor and has a number; an axis is a coordinate and has a letter. Under trivial kinematics they
are the same. Otherwise the joints are the axes of the machine: `[JOINT_0]` is used, for `[AXIS_X]` limits a coordinate
of the tip.

Keys that are read: `[EMC] MACHINE`; `[TRAJ] LINEAR_UNITS`, `ANGULAR_UNITS`, `COORDINATES`, `MAX_LINEAR_VELOCITY`,
`MAX_ANGULAR_VELOCITY`, `MAX_LINEAR_ACCELERATION`, `MAX_ANGULAR_ACCELERATION`; `[KINS] KINEMATICS`; `MIN_LIMIT`,
`MAX_LIMIT`, `MAX_VELOCITY`, `MAX_ACCELERATION`, `WRAPPED_ROTARY` of `[AXIS_<letter>]` and `[JOINT_<number>]`;
`[EMCMOT] SERVO_PERIOD`, `[DISPLAY] MAX_FEED_OVERRIDE` and `[TRAJ] ARC_BLEND_*` of the trajectory planner;
`[SPINDLE_0] MIN_FORWARD_VELOCITY`, `MAX_FORWARD_VELOCITY`; `setp`, `sets` and `net` in `[HAL] HALCMD` and in the files
of `HALFILE` and `POSTGUI_HALFILE` in the folder of the `.ini`. A missing value is reported as a finding; an unsupported
value is refused. The geometry of each kinematics module follows its documentation, "5-Axis Kinematics".
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from chipload.errors import Finding, InputError
from chipload.machine.axis import LETTERS, Axis, Vector
from chipload.machine.chain import Chain
from chipload.machine.hal import Ini, hal_pins, read_sections
from chipload.machine.machine import Machine
from chipload.machine.trajectory import TrajectoryPlanner
from chipload.units import MM_PER, rad_s_from_rpm

_RAD_PER = {"deg": math.pi / 180.0, "degree": math.pi / 180.0, "rad": 1.0, "radian": 1.0, "grad": math.pi / 200.0}
_RAD_PER |= {"gon": math.pi / 200.0}
#: [mm] of each unit of length of a configuration
UNITS_MM = {"mm": 1.0, "metric": 1.0, "in": 25.4, "inch": 25.4, "imperial": 25.4, "cm": MM_PER["cm"]}
_OWN: dict[str, Vector] = {"X": (1.0, 0.0, 0.0), "Y": (0.0, 1.0, 0.0), "Z": (0.0, 0.0, 1.0)}
_OWN |= {turn: _OWN[axis] for turn, axis in zip("ABCUVW", "XYZXYZ", strict=True)}


@dataclass(frozen=True)
class _Module:
    """Order of a kinematics module's axes from the workpiece to the tool, its joints, and the pins of its geometry."""

    chain: str
    coordinates: str
    pins: tuple[str, ...]


_ROT = ("x-rot-point", "y-rot-point", "z-rot-point")
_MODULES = {
    "xyzac-trt-kins": _Module("CAXYZ", "XYZAC", (*_ROT, "y-offset", "z-offset")),
    "xyzbc-trt-kins": _Module("CBXYZ", "XYZBC", (*_ROT, "x-offset", "z-offset")),
    "xyzab_tdr_kins": _Module("ABXYZ", "XYZAB", (*_ROT, "x-offset", "z-offset")),
    "5axiskins": _Module("XYZCBW", "XYZBCW", ("pivot-length",)),
}
_PIVOT_LENGTH = 250.0  # default of 5axiskins for a pin that is not set, in units of the machine


def read_ini(path: str | Path) -> tuple[Machine, tuple[Finding, ...]]:
    """The machine of a LinuxCNC configuration, and a finding for each value that the configuration does not state.

    Codes of findings: ``ini-limit``, ``ini-velocity``, ``ini-acceleration``, ``ini-spindle``, ``ini-kinematics``
    (geometry that is assumed), ``ini-hal`` and ``ini-include`` (files not read).
    No file outside the folder of ``path`` is opened.

    Raises
    ------
    InputError
        The file cannot be read, a unit, a velocity or an acceleration is missing, a value is not a number, the
        kinematics are not trivkins, xyzac-trt-kins, xyzbc-trt-kins, xyzab_tdr_kins or 5axiskins, or X, Y or Z is
        missing.
    """
    ini, findings = read_sections(path)
    try:
        return _machine(ini, findings, Path(path)), tuple(findings)
    except InputError as err:
        text = str(err)
        raise InputError(text if text.startswith(ini.label) else f"{ini.label}: {text}") from None


def _machine(ini: Ini, findings: list[Finding], path: Path) -> Machine:
    mm = _unit(ini, "LINEAR_UNITS", UNITS_MM)
    words = (ini.value("KINS", "KINEMATICS") or "").split()
    if not words:
        raise InputError(f"{ini.label}: [KINS] KINEMATICS is missing: must be given")
    name = words[0]
    parameters = dict(word.split("=", 1) for word in words[1:] if "=" in word)
    module = _MODULES.get(name)
    if module is None and name != "trivkins":
        raise InputError(f"{ini.label}: KINEMATICS = {name}: must be trivkins, {', '.join(_MODULES)}")
    default = module.coordinates if module else ini.value("TRAJ", "COORDINATES") or ""
    joints = "".join(parameters.get("coordinates", default).upper().split())
    letters = "".join(dict.fromkeys(joints))
    order = module.chain if module else "".join(sorted(letters, key=lambda c: (c not in "ABC", LETTERS.find(c))))
    for letter in order:
        if letter not in LETTERS or letter not in letters:
            raise InputError(
                f"{ini.label}: coordinates {joints}: {letter}: must be letters of {LETTERS}, all of {order}"
            )
    rad = _unit(ini, "ANGULAR_UNITS", _RAD_PER) if set(letters) & set("ABC") else 1.0
    pivots, directions, nose = _geometry(ini, name, module, order, mm, findings)
    axes = []
    for letter in order:
        joint, unit = joints.index(letter), rad if letter in "ABC" else mm
        low, high = _limits(ini, letter, joint, module is None, unit, findings)
        axes.append(
            Axis(
                letter=letter,
                head=letter not in "ABC" or (name == "5axiskins"),
                direction=directions.get(letter, _OWN[letter]),
                pivot=pivots.get(letter, (0.0, 0.0, 0.0)),
                low=low,
                high=high,
                rate=_rate_limit(ini, letter, joint, "VELOCITY", findings) * unit,
                acceleration=_rate_limit(ini, letter, joint, "ACCELERATION", findings) * unit,
            )
        )
    rapid = _number(ini, "TRAJ", "MAX_LINEAR_VELOCITY") or _number(ini, "TRAJ", "MAX_VELOCITY")
    if not any(not axis.rotary for axis in axes):
        raise InputError(f"{ini.label}: coordinates {joints or 'none'}: no linear axis: X, Y and Z are needed")
    if rapid is None:
        rapid = max(axis.rate for axis in axes if not axis.rotary) / mm
        findings.append(
            Finding("ini-velocity", 0, f"[TRAJ] MAX_LINEAR_VELOCITY is missing: {rapid:g} of the fastest axis is taken")
        )
    most, least = (_number(ini, "SPINDLE_0", f"{key}_FORWARD_VELOCITY") for key in ("MAX", "MIN"))
    if most is None:
        findings.append(
            Finding("ini-spindle", 0, "[SPINDLE_0] MAX_FORWARD_VELOCITY is missing: spindle speeds have no upper limit")
        )
    return Machine(
        name=ini.value("EMC", "MACHINE") or path.stem,
        chain=Chain(tuple(axes), nose=nose),
        rapid=rapid * mm,
        feed_max=rapid * mm,
        spindle_min=rad_s_from_rpm(least or 0.0),
        spindle_max=math.inf if most is None else rad_s_from_rpm(most),
        corner_tolerance=0.0,
        dialect="linuxcnc",
        decimals=6,
        note=f"Read from the configuration {path.name}.",
        planner=_planner(ini),
    )


def _planner(ini: Ini) -> TrajectoryPlanner:
    """Settings of the trajectory planner; a missing setting has the default of LinuxCNC."""
    default = TrajectoryPlanner()
    period = _number(ini, "EMCMOT", "SERVO_PERIOD")
    depth = _number(ini, "TRAJ", "ARC_BLEND_OPTIMIZATION_DEPTH")
    numbers = {
        "gap_cycles": _number(ini, "TRAJ", "ARC_BLEND_GAP_CYCLES"),
        "ramp_frequency": _number(ini, "TRAJ", "ARC_BLEND_RAMP_FREQ"),
        "kink_ratio": _number(ini, "TRAJ", "ARC_BLEND_KINK_RATIO"),
        "override": _number(ini, "DISPLAY", "MAX_FEED_OVERRIDE"),
    }
    values = {key: value for key, value in numbers.items() if value is not None}
    values["override"] = max(values.get("override", 1.0), 1.0)
    return TrajectoryPlanner(
        cycle=default.cycle if period is None else 1e-9 * period,
        blend_arcs=_number(ini, "TRAJ", "ARC_BLEND_ENABLE") != 0.0,
        lookahead=default.lookahead if depth is None else int(depth),
        **values,
    )


def _geometry(
    ini: Ini, name: str, module: _Module | None, order: str, mm: float, findings: list[Finding]
) -> tuple[dict[str, Vector], dict[str, Vector], Vector]:
    """Pivots and directions of the rotary axes by letter, and the nose."""
    origin: Vector = (0.0, 0.0, 0.0)
    if module is None:
        for letter in order:
            if letter in "ABC":
                axis = "XYZ"["ABC".index(letter)]
                text = f"{letter}: trivkins do not state its position: taken as a table about {axis} through the origin"
                findings.append(Finding("ini-kinematics", 0, text))
        return {}, {}, origin
    pins = hal_pins(ini, findings)
    values = {}
    for pin in module.pins:
        value = pins.get(f"{name}.{pin}")
        if value is None:
            value = _PIVOT_LENGTH if pin == "pivot-length" else 0.0
            findings.append(Finding("ini-kinematics", 0, f"{name}.{pin} is not set to a number: {value:g} is taken"))
        values[pin] = value * mm
    if name == "5axiskins":
        pivot = (0.0, 0.0, values["pivot-length"])
        return {"B": pivot, "C": pivot}, {"B": (0.0, -1.0, 0.0), "W": (0.0, 0.0, -1.0)}, origin
    x, y, z = (values[pin] for pin in _ROT)
    offset_pivot = (x + values.get("x-offset", 0.0), y + values.get("y-offset", 0.0), z + values["z-offset"])
    if name == "xyzab_tdr_kins":
        return {"A": offset_pivot, "B": (x, y, z)}, {}, origin
    tilt = order[1]
    sign = 1.0 if pins.get(f"{name}.conventional-directions") else -1.0
    directions = {
        letter: (sign * _OWN[letter][0], sign * _OWN[letter][1], sign * _OWN[letter][2]) for letter in order[:2]
    }
    return {"C": (x, y, z), tilt: offset_pivot}, directions, origin


def _unit(ini: Ini, key: str, known: dict[str, float]) -> float:
    value = ini.value("TRAJ", key)
    if value is None or value.lower() not in known:
        shown = "is missing" if value is None else f"= {value}"
        raise InputError(f"{ini.label}: [TRAJ] {key} {shown}: must be one of {', '.join(known)}")
    return known[value.lower()]


def _number(ini: Ini, section: str, key: str) -> float | None:
    """A number of the file; None: the key is missing."""
    text = ini.value(section, key)
    if text is None:
        return None
    try:
        value = float(text.split("#")[0].split(";")[0])
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f"{ini.label}: [{section}] {key} = {text}: must be a finite number")
    return value


def _limits(ini: Ini, letter: str, joint: int, same: bool, unit: float, findings: list[Finding]) -> tuple[float, float]:
    """Limits [mm or rad] of a machine axis: those of its joint; narrower of joint and axis in trivkins."""
    if (ini.value(f"AXIS_{letter}", "WRAPPED_ROTARY") or ini.value(f"JOINT_{joint}", "WRAPPED_ROTARY") or "0") != "0":
        return -math.inf, math.inf
    both = (f"JOINT_{joint}", f"AXIS_{letter}")
    limits = []
    for key, narrower in (("MIN_LIMIT", max), ("MAX_LIMIT", min)):
        values = [value for section in both if (value := _number(ini, section, key)) is not None]
        if not values:
            findings.append(Finding("ini-limit", 0, f"{letter}: {key} is missing: no limit on that side"))
            limits.append(math.inf if narrower is min else -math.inf)
        else:
            limits.append((narrower(values) if same or letter in "ABC" else values[0]) * unit)
    return limits[0], limits[1]


def _rate_limit(ini: Ini, letter: str, joint: int, what: str, findings: list[Finding]) -> float:
    """Greatest velocity or acceleration [units of the machine] of an axis: the lesser of axis and joint."""
    sections = (f"JOINT_{joint}", f"AXIS_{letter}")
    values = [value for section in sections if (value := _number(ini, section, f"MAX_{what}")) is not None]
    if not values:
        key = f"MAX_{'ANGULAR' if letter in 'ABC' else 'LINEAR'}_{what}"
        value = _number(ini, "TRAJ", key)
        if value is None:
            raise InputError(f"{ini.label}: [AXIS_{letter}] MAX_{what} is missing: must be given")
        findings.append(Finding(f"ini-{what.lower()}", 0, f"{letter}: MAX_{what} is missing: [TRAJ] {key} is taken"))
        values = [value]
    return min(values)
