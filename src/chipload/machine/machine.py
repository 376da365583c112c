"""A machine: travel, speed and acceleration of its axes, torque and power of its spindle, dialect of its controller.

It is read from TOML with the unit in every key; a missing number is an error, never a guess. Its axes form a
:class:`~chipload.machine.chain.Chain`; :mod:`chipload.machine.axis` states the sign of an axis.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.errors import InputError
from chipload.machine.chain import Chain
from chipload.machine.schema import Row, chain_from_table, check_table, vector
from chipload.machine.table import MachineTable
from chipload.machine.trajectory import TrajectoryPlanner
from chipload.tables import read_table, shipped_names, shipped_table
from chipload.units import mm_s_from_mm_min, rad_s_from_rpm, rpm_from_rad_s

AXES = ("x", "y", "z")
DIALECTS = ("linuxcnc", "fanuc")


@dataclass(frozen=True)
class Machine:
    """A mill.

    Parameters
    ----------
    name : name by which a job refers to it
    chain : its axes from the workpiece to the tool
    rapid : greatest speed along the path in G0 [mm/s], > 0
    feed_max : greatest speed along the path in G1, G2, G3 [mm/s], > 0
    spindle_min, spindle_max : [rad/s], 0 <= spindle_min <= spindle_max, spindle_max > 0; inf: not known
    corner_tolerance : greatest deviation of the path at a corner [mm], 0 to 1; 0: an exact stop at every corner
    dialect : of the programs that are written for it, `linuxcnc` or `fanuc`
    decimals : number of decimals of a position in a program [mm], 3 to 6
    power_w : power of the spindle [W]; None: not known
    torque : torque of the spindle [N mm]; None: not known
    torque_curve : (speed [rad/s], torque [N mm]) of the spindle at rising speeds that cover its range, linear between
        them; empty: not known
    note : source of its numbers, and which of them are assumed
    jerk : greatest jerk along the path [mm/s^3], > 0; None: not known. Feed schedules and the cycle time respect it
    jerk_low : what the jerk is at least where it is not known [mm/s^3], > 0; with it the cycle time has an upper end
    block_time : least time that the control takes for a block [s], > 0; None: it is never slower than the motion
    planner : settings of LinuxCNC's trajectory planner; None: another controller, judged by its corner tolerance
    table : the block under the workpiece; None: not known
    tcp_words : blocks that begin and end tool centre point control, ``{tool}`` for the tool's number; None: it has none
    counter_clockwise : whether the spindle also turns counter-clockwise (M4)
    control : as which control it reads programs that do not show theirs, a key of
        :data:`chipload.program.control.CONTROLS`; empty: that of its dialect

    Raises
    ------
    InputError
        A number is out of range; the message names it, its value and its limit.
    """

    name: str
    chain: Chain
    rapid: float
    feed_max: float
    spindle_min: float
    spindle_max: float
    corner_tolerance: float
    dialect: str
    decimals: int
    power_w: float | None = None
    torque: float | None = None
    note: str = ""
    tcp_words: tuple[str, str] | None = None
    torque_curve: tuple[tuple[float, float], ...] = ()
    planner: TrajectoryPlanner | None = None
    jerk: float | None = None
    jerk_low: float | None = None
    block_time: float | None = None
    table: MachineTable | None = None
    counter_clockwise: bool = True
    control: str = ""

    def __post_init__(self) -> None:
        def require(ok: bool, key: str, value: object, limit: str) -> None:
            if not ok:
                shown = f"{value:g}" if isinstance(value, float) else repr(value)
                raise InputError(f"machine.{key} = {shown}: {limit}")

        require(0.0 < self.rapid < math.inf, "rapid_mm_min", self.rapid * 60.0, "must be above 0")
        require(0.0 < self.feed_max < math.inf, "feed_max_mm_min", self.feed_max * 60.0, "must be above 0")
        per_rpm = 60.0 / math.tau
        require(self.spindle_max > 0.0, "spindle.max_rpm", self.spindle_max * per_rpm, "must be above 0")
        require(
            0.0 <= self.spindle_min <= self.spindle_max,
            "spindle.min_rpm",
            self.spindle_min * per_rpm,
            f"must be from 0 to max_rpm = {self.spindle_max * per_rpm:g}",
        )
        require(
            0.0 <= self.corner_tolerance <= 1.0, "corner_tolerance_mm", self.corner_tolerance, "must be from 0 to 1 mm"
        )
        require(self.dialect in DIALECTS, "dialect", self.dialect, "must be linuxcnc or fanuc")
        require(3 <= self.decimals <= 6, "decimals", self.decimals, "must be from 3 to 6")
        for key, value, factor in (("power_w", self.power_w, 1.0), ("torque_nm", self.torque, 1e-3)):
            require(
                value is None or 0.0 < value < math.inf, f"spindle.{key}", (value or 0.0) * factor, "must be above 0"
            )

        for key, value in (("jerk_mm_s3", self.jerk), ("jerk_low_mm_s3", self.jerk_low)):
            require(value is None or 0.0 < value < math.inf, key, value, "must be above 0")
        both = self.jerk is not None and self.jerk_low is not None
        require(not both, "jerk_low_mm_s3", self.jerk_low, "must be left out where jerk_mm_s3 is stated")
        if self.block_time is not None:
            shown = 1e3 * self.block_time
            require(0.0 < self.block_time <= 1.0, "block_time_ms", shown, "must be above 0, at most 1000 ms")
            text = "must be left out with [trajectory_planner]: its cycle_ms limits short segments"
            require(self.planner is None, "block_time_ms", shown, text)
        self._check_curve()

    def _check_curve(self) -> None:
        """Refuse a torque curve whose speeds do not rise or do not cover the range, or with a torque of 0 or less."""
        if not self.torque_curve:
            return
        speed, torque = np.array(self.torque_curve).T
        rpm, nm = rpm_from_rad_s(1.0) * speed, torque / 1000.0
        key = "machine.spindle.torque_curve"
        falls = np.flatnonzero(~(np.diff(speed) > 0.0))
        if len(falls):
            raise InputError(f"{key}: {rpm[falls[0] + 1]:g} rpm after {rpm[falls[0]]:g}: speeds must rise")
        if not (nm > 0.0).all() or not np.isfinite(nm).all():
            raise InputError(f"{key}: a torque must be above 0 and finite")
        low, high = rpm_from_rad_s(self.spindle_min), rpm_from_rad_s(self.spindle_max)
        if not (speed[0] <= self.spindle_min * (1.0 + 1e-12) and speed[-1] >= self.spindle_max * (1.0 - 1e-12)):
            raise InputError(
                f"{key}: from {rpm[0]:g} to {rpm[-1]:g} rpm: must hold min_rpm = {low:g} to max_rpm = {high:g}"
            )

    def torque_at(self, speed: ArrayLike) -> NDArray[np.float64]:
        """Torque [N mm] of the spindle at speeds [rad/s], limited by its greatest torque and its curve; inf: not known.

        >>> machine_named("vmc").torque_at([100.0, 1000.0]).tolist()
        [70000.0, 70000.0]
        """
        w = np.abs(np.asarray(speed, dtype=np.float64))
        out = np.full(w.shape, math.inf if self.torque is None else self.torque)
        if self.torque_curve:
            out = np.minimum(out, np.interp(w, *np.array(self.torque_curve).T))
        return out

    @property
    def limits(self) -> tuple[tuple[float, float], tuple[float, float], tuple[float, float]]:
        """((low, high) [mm],) of X, Y, Z, in the coordinates of the machine."""
        x, y, z = (self.chain.axis(letter) for letter in "XYZ")
        return (x.low, x.high), (y.low, y.high), (z.low, z.high)

    @property
    def acceleration(self) -> tuple[float, float, float]:
        """Accelerations of X, Y and Z [mm/s^2]."""
        x, y, z = (self.chain.axis(letter).acceleration for letter in "XYZ")
        return x, y, z

    @property
    def acceleration_xy(self) -> float:
        """Acceleration that every direction in the XY plane can have [mm/s^2]: the lesser of X and Y."""
        return min(self.acceleration[0], self.acceleration[1])


def _from_table(label: str, table: Row) -> Machine:
    """A machine from the values of its file; ``label`` names it in messages."""
    top = check_table(label, table, "")
    spindle = check_table(label, top["spindle"], "spindle")
    try:
        rapid = mm_s_from_mm_min(top["rapid_mm_min"])
        return Machine(
            name=top["name"],
            chain=chain_from_table(label, top, spindle, rapid if rapid > 0.0 else math.inf),
            rapid=rapid,
            feed_max=mm_s_from_mm_min(top["feed_max_mm_min"]),
            spindle_min=rad_s_from_rpm(spindle["min_rpm"]),
            spindle_max=rad_s_from_rpm(spindle["max_rpm"]),
            corner_tolerance=float(top["corner_tolerance_mm"]),
            dialect=top["dialect"],
            decimals=top["decimals"],
            power_w=float(spindle["power_w"]) if "power_w" in spindle else None,
            torque=float(spindle["torque_nm"]) * 1e3 if "torque_nm" in spindle else None,
            note=top.get("note", ""),
            torque_curve=tuple((rad_s_from_rpm(n), 1e3 * t) for n, t in spindle.get("torque_curve", ())),
            tcp_words=_tcp_words(top),
            planner=_planner(label, top),
            jerk=_optional(top, "jerk_mm_s3"),
            jerk_low=_optional(top, "jerk_low_mm_s3"),
            block_time=_optional(top, "block_time_ms", 1e-3),
            table=_machine_table(label, top),
            counter_clockwise=bool(spindle.get("counter_clockwise", True)),
            control=top.get("control", ""),
        )
    except InputError as err:
        text = str(err)
        raise InputError(text if text.startswith(label) else f"{label}: {text}") from None


def _optional(top: Row, key: str, factor: float = 1.0) -> float | None:
    """A number of the file times ``factor``; None: it is not stated."""
    return factor * float(top[key]) if key in top else None


def _planner(label: str, top: Row) -> TrajectoryPlanner | None:
    """The settings of `[trajectory_planner]`; a missing setting has the default of LinuxCNC."""
    if "trajectory_planner" not in top:
        return None
    given = check_table(label, top["trajectory_planner"], "trajectory_planner")
    names = ("blend_arcs", "lookahead", "gap_cycles", "kink_ratio")
    values = {name: given[name] for name in names if name in given}
    if "ramp_frequency_hz" in given:
        values["ramp_frequency"] = float(given["ramp_frequency_hz"])
    if "override_max" in given:
        values["override"] = float(given["override_max"])
    return TrajectoryPlanner(cycle=1e-3 * given["cycle_ms"], **values)


def _machine_table(label: str, top: Row) -> MachineTable | None:
    """The block of `[table]`."""
    if "table" not in top:
        return None
    given = check_table(label, top["table"], "table")
    spacing = {"spacing": float(given["spacing_mm"])} if "spacing_mm" in given else {}
    return MachineTable(vector(given["low_mm"]), vector(given["high_mm"]), **spacing)


def _tcp_words(top: Row) -> tuple[str, str] | None:
    if "tcp_on" not in top and "tcp_off" not in top:
        return None
    words = str(top.get("tcp_on", "")), str(top.get("tcp_off", ""))
    for key, word in zip(("tcp_on", "tcp_off"), words, strict=True):
        if not re.fullmatch(r"[A-Z0-9.{}a-z ]+", word):
            raise InputError(f"machine.{key} = {word!r}: must be words of the controller, as G43.4 H{{tool}} and G49")
    return words


def read_machine(path: str | Path) -> Machine:
    """Read a machine from a TOML file, or from LinuxCNC's `.ini` (:func:`chipload.machine.ini.read_ini`).

    Keys: ``name``, ``dialect``, ``decimals``, ``rapid_mm_min``, ``feed_max_mm_min``, ``corner_tolerance_mm``,
    optional ``control`` (as which it reads programs that do not show theirs), ``note``, ``jerk_mm_s3`` (along the
    path), ``jerk_low_mm_s3`` (what it is at least, where it is not known), ``block_time_ms`` (least time of the
    control for a block; not with a trajectory planner), ``tcp_on`` and ``tcp_off`` (words that begin and end tool
    centre point control), and ``chain``, the letters of the axes from the workpiece to the tool (XYZ if left out).

    In ``[axis.x]`` and the tables of the other linear axes: ``min_mm``, ``max_mm``, ``acceleration_mm_s2``, optional
    ``rate_mm_min`` (else the rapid rate), ``direction`` (else the letter's own), ``side`` (`table` or `head`, else
    head), ``indexed``, ``step_mm``. In ``[axis.a]``, b, c: ``side``, ``direction``, ``pivot_mm``, ``min_deg`` and
    ``max_deg`` or ``endless = true``, ``rate_deg_min``, ``acceleration_deg_s2``, optional ``indexed``, ``step_deg``.

    In ``[trajectory_planner]``, for a machine under LinuxCNC: ``cycle_ms`` (period of the servo thread), optional
    ``blend_arcs``, ``lookahead``, ``gap_cycles``, ``ramp_frequency_hz``, ``kink_ratio``, ``override_max``. Without the
    table, ``corner_tolerance_mm`` sets the speed at corners.

    In ``[spindle]``: ``min_rpm``, ``max_rpm``, optional ``power_w``, ``torque_nm``, ``torque_curve`` (pairs of rpm and
    N m), ``direction`` (from the tip to the spindle; else +Z), ``counter_clockwise`` (whether it has M4, else
    true), and ``nose_mm`` or ``gauge_mm``, the distance of the
    nose from the pivot of the head's last rotary axis. In ``[work]``, which may be left out: ``zero_mm``,
    ``x_axis``, ``z_axis``.

    In ``[table]``, which may be left out: ``low_mm`` and ``high_mm``, corners of the block under the workpiece in
    work coordinates, optional ``spacing_mm``. A job that simulates a program compares its tools with that block,
    unless it states a ``[machine_table]`` of its own.

    Raises
    ------
    InputError
        The file cannot be read, a key is unknown or missing, a value is out of range.
    """
    if Path(path).suffix.lower() == ".ini":
        from chipload.machine.ini import read_ini

        return read_ini(path)[0]
    return _from_table(*read_table("machine", path))


def machine_names() -> tuple[str, ...]:
    """Names of the machines that come with chipload, sorted.

    >>> {"vmc", "vmc-fanuc"} <= set(machine_names())
    True
    """
    return shipped_names("machine")


def machine_named(name: str) -> Machine:
    """The shipped machine of that name.

    Raises
    ------
    InputError
        No shipped machine has that name; the message gives the nearest one.

    Examples
    --------
    >>> machine_named("vmc").acceleration_xy
    3000.0
    """
    return _from_table(*shipped_table("machine", name))
