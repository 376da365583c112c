"""The modes of every tool of a job.

A mode without damping or stiffness is left out and its tool or workpiece is named: stability is then unproven.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from chipload.checking.clamped import Workpiece
from chipload.cutter.cutter import Cutter
from chipload.errors import InputError
from chipload.ranges import choice_field, number_field, require_ranges
from chipload.stability.modes import Modes
from chipload.stability.probability import ModeSpread
from chipload.stability.process_damping import ProcessDamping

#: N/mm in 1 N/um, t in 1 kg
PER_UM, PER_KG = 1000.0, 1e-3
#: directions of modes that differ by less are one, relative
LEAST_ACROSS = 1e-3
DIRECTIONS = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


@dataclass(frozen=True, kw_only=True)
class Mode:
    """A mode of vibration at the tip of the cutter, or of the workpiece where it is cut.

    Parameters
    ----------
    frequency_hz : natural frequency
    direction : in machine coordinates: ``x``, ``y``, ``z``, (x, y) or (x, y, z)
    damping_ratio : None: not known; stability is then unproven
    stiffness_n_um, mass_kg : modal stiffness, or modal mass instead of it
    tool : tool number; None: every tool
    of : vibrating body; ``cutter`` includes holder and spindle
    """

    frequency_hz: float = number_field(above=0.0)
    direction: Literal["x", "y", "z"] | tuple[float, float] | tuple[float, float, float]
    damping_ratio: float | None = number_field(None, above=0.0, below=1.0)
    stiffness_n_um: float | None = number_field(None, above=0.0)
    mass_kg: float | None = number_field(None, above=0.0)
    tool: int | None = number_field(None, least=1, most=1000, whole=True)
    of: Literal["cutter", "workpiece"] = choice_field("cutter", "cutter", "workpiece")

    def __post_init__(self) -> None:
        """Refuse values out of range."""
        require_ranges(self, "dynamics.mode.")


@dataclass(frozen=True, kw_only=True)
class Vibration:
    """Modes of vibration of cutter and workpiece. They give each step a stability margin.

    Parameters
    ----------
    modes : of cutters and workpiece
    frequency_percent, damping_percent, stiffness_percent : standard deviations of the modes, all or none; with them
        each step has a probability of stability
    process_damping : damping by worn edges; None: left out
    """

    modes: tuple[Mode, ...] = ()
    frequency_percent: float | None = number_field(None, least=0.0, below=100.0)
    damping_percent: float | None = number_field(None, least=0.0, below=100.0)
    stiffness_percent: float | None = number_field(None, least=0.0, below=100.0)
    process_damping: ProcessDamping | None = None

    def __post_init__(self) -> None:
        """Refuse values out of range."""
        require_ranges(self, "dynamics.")


@dataclass(frozen=True, eq=False)
class Dynamics:
    """Modes of the tools of a job.

    Parameters
    ----------
    modes : by tool number; a tool without known modes is left out
    number : of each mode of a tool, from 1 as the job and its file list them
    name : of each mode by this number
    unknown : what is not stated and would be needed
    spread : of the modes; None: not stated
    workpiece_damping : of the modes that [workpiece] gives; None: it gives none
    process : damping by worn edges; None: left out
    """

    modes: Mapping[int, Modes]
    number: Mapping[int, tuple[int, ...]]
    name: Mapping[int, str]
    unknown: tuple[str, ...]
    spread: ModeSpread | None = None
    workpiece_damping: float | None = None
    process: ProcessDamping | None = None

    @property
    def first_followed(self) -> int:
        """Number of the first workpiece mode that is followed through the removal."""
        return max(self.name, default=0) + 1


def dynamics_of(vibration: Vibration, cutters: Mapping[int, Cutter], workpiece: Workpiece | None = None) -> Dynamics:
    """Return the modes of every tool, and the damping of the modes of the workpiece.

    Raises
    ------
    InputError
        No mode is stated, one states stiffness and mass, names a tool that is not there, or its values cannot be.
    """
    listed = vibration.modes
    density = None if workpiece is None else workpiece.density_kg_m3
    if not listed and density is None:
        raise InputError("dynamics: has no mode: state [[dynamics.mode]], or a file of chipload tap")
    unknown: list[str] = []
    known: list[tuple[int, Mode, float]] = []
    for k, mode in enumerate(listed, 1):
        where = f"dynamics.mode {k}"
        if mode.tool is not None and mode.tool not in cutters:
            raise InputError(f"{where}: tool = {mode.tool}: no [[cutter]] has this number")
        stiffness = modal_stiffness(mode, where)
        if math.isnan(stiffness):
            unknown.append(f"stiffness of mode {k}")
        if mode.damping_ratio is None:
            unknown.append(f"damping of mode {k}")
        if mode.damping_ratio is not None and not math.isnan(stiffness):
            known.append((k, mode, stiffness))
    modes, number = {}, {}
    for tool in sorted(cutters):
        own = [x for x in known if x[1].tool in (None, tool)]
        across = [m for m in listed if m.of == "cutter" and m.tool in (None, tool)]
        if not across:
            unknown.append(f"modes of tool {tool}")
        elif along := _missing_direction(across):
            unknown.append(f"modes of tool {tool} along {along}")
        if own:
            modes[tool] = modes_with_stiffness(own)
            number[tool] = tuple(k for k, _, _ in own)
    damping = None
    if workpiece is not None:
        damping = workpiece.damping_ratio
        if density is None and not any(m.of == "workpiece" for m in listed):
            unknown.append("density of the workpiece")
        if density is not None and damping is None:
            unknown.append("damping of the workpiece")
    names = {k: f"{m.of} {m.frequency_hz:g} Hz" for k, m in enumerate(listed, 1)}
    spread, lacking = _spread(vibration), tuple(dict.fromkeys(unknown))
    return Dynamics(modes, number, names, lacking, spread, damping, vibration.process_damping)


def _spread(vibration: Vibration) -> ModeSpread | None:
    """Return the spreads of the modes, which are stated all or not at all."""
    names = ("frequency_percent", "damping_percent", "stiffness_percent")
    stated = [0.01 * value for name in names if (value := getattr(vibration, name)) is not None]
    if stated and len(stated) < len(names):
        raise InputError(f"dynamics: state all of {', '.join(names)}, or none")
    return ModeSpread(*stated) if stated else None


def _missing_direction(modes: Iterable[Mode]) -> str:
    """Return the direction across the axis that no mode moves in; empty: they move in all.

    A cutter that is taken as rigid in a direction has a margin there that nobody measured.
    """
    flat = np.array([_direction(m)[:2] for m in modes])
    _, size, along = np.linalg.svd(flat)
    if len(size) > 1 and size[1] > LEAST_ACROSS * size[0]:
        return ""
    if size[0] <= LEAST_ACROSS:
        return "x and y"
    a, b = np.abs(along[1]).tolist()
    return "x" if b <= LEAST_ACROSS else "y" if a <= LEAST_ACROSS else f"[{along[1][0]:.3g}, {along[1][1]:.3g}]"


def _direction(mode: Mode) -> tuple[float, ...]:
    """Return the direction of a mode in x, y and z."""
    stated = DIRECTIONS[mode.direction] if isinstance(mode.direction, str) else mode.direction
    return (*stated, 0.0)[:3]


def modal_stiffness(mode: Mode, where: str) -> float:
    """Return the stiffness [N/mm] that a mode states, or that follows from its mass, k = m w^2; NaN: neither is stated.

    Parameters
    ----------
    where : name of the mode in messages

    Raises
    ------
    InputError
        Both are stated.
    """
    if mode.stiffness_n_um is not None and mode.mass_kg is not None:
        raise InputError(f"{where}: stiffness_n_um and mass_kg: state one of them")
    if mode.stiffness_n_um is not None:
        return PER_UM * mode.stiffness_n_um
    if mode.mass_kg is not None:
        return PER_KG * mode.mass_kg * (math.tau * mode.frequency_hz) ** 2
    return math.nan


def modes_with_stiffness(some: Iterable[tuple[int, Mode, float]]) -> Modes:
    """Return modes, each with its number and stiffness [N/mm]; directions in x, y and z if one moves along z, else in x
    and y.
    """
    rows = list(some)
    direction = np.array([_direction(m) for _, m, _ in rows])
    return Modes(
        frequency=[m.frequency_hz for _, m, _ in rows],  # type: ignore[arg-type]
        damping=[m.damping_ratio for _, m, _ in rows],  # type: ignore[arg-type]
        stiffness=[k for _, _, k in rows],  # type: ignore[arg-type]
        direction=direction if direction[:, 2].any() else direction[:, :2],
    )
