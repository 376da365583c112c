"""The modes of every tool of a job.

A mode without damping or stiffness is left out and its tool or workpiece is named: stability is then unproven.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydantic import ValidationError

from chipload.cutter.cutter import Cutter
from chipload.errors import InputError
from chipload.files import read_regular
from chipload.jobs.messages import table_errors
from chipload.jobs.simulation.dynamics_tables import DynamicsTable, ModesFileTable, ModeTable
from chipload.jobs.simulation.tables import WorkpieceTable
from chipload.stability.modes import Modes
from chipload.stability.probability import ModeSpread
from chipload.stability.process_damping import ProcessDamping
from chipload.tables import parsed

#: N/mm in 1 N/um, t in 1 kg
PER_UM, PER_KG = 1000.0, 1e-3
#: largest file of modes [bytes]
LARGEST_FILE = 1_000_000
DIRECTIONS = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


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


def dynamics_of(
    table: DynamicsTable, folder: Path, cutters: Mapping[int, Cutter], workpiece: WorkpieceTable | None = None
) -> Dynamics:
    """Return the modes of every tool, and the damping of the modes of the workpiece.

    Raises
    ------
    InputError
        No mode is stated, one states stiffness and mass, names a tool that is not there, or its values cannot be.
    """
    listed = [*table.mode, *(read_modes(folder / table.file) if table.file is not None else ())]
    density = None if workpiece is None else workpiece.density_kg_m3
    if not listed and density is None:
        raise InputError("dynamics: has no mode: state [[dynamics.mode]], or a file of chipload tap")
    unknown: list[str] = []
    known: list[tuple[int, ModeTable, float]] = []
    for k, mode in enumerate(listed, 1):
        where = f"dynamics.mode {k}"
        if mode.tool is not None and mode.tool not in cutters:
            raise InputError(f"{where}: tool = {mode.tool}: no [[cutter]] has this number")
        if mode.stiffness_n_um is not None and mode.mass_kg is not None:
            raise InputError(f"{where}: stiffness_n_um and mass_kg: state one of them")
        stiffness = math.nan
        if mode.stiffness_n_um is not None:
            stiffness = PER_UM * mode.stiffness_n_um
        elif mode.mass_kg is not None:
            stiffness = PER_KG * mode.mass_kg * (math.tau * mode.frequency_hz) ** 2
        else:
            unknown.append(f"stiffness of mode {k}")
        if mode.damping_ratio is None:
            unknown.append(f"damping of mode {k}")
        if mode.damping_ratio is not None and not math.isnan(stiffness):
            known.append((k, mode, stiffness))
    modes, number = {}, {}
    for tool in sorted(cutters):
        own = [x for x in known if x[1].tool in (None, tool)]
        if not any(m.of == "cutter" and m.tool in (None, tool) for m in listed):
            unknown.append(f"modes of tool {tool}")
        if own:
            modes[tool] = _modes(own)
            number[tool] = tuple(k for k, _, _ in own)
    damping = None
    if workpiece is not None:
        damping = workpiece.damping_ratio
        if density is None and not any(m.of == "workpiece" for m in listed):
            unknown.append("density of the workpiece")
        if density is not None and damping is None:
            unknown.append("damping of the workpiece")
    names = {k: f"{m.of} {m.frequency_hz:g} Hz" for k, m in enumerate(listed, 1)}
    return Dynamics(modes, number, names, tuple(dict.fromkeys(unknown)), _spread(table), damping, _process(table))


def _process(table: DynamicsTable) -> ProcessDamping | None:
    """Return the damping by worn edges, if it is stated."""
    stated = table.process_damping
    return None if stated is None else ProcessDamping(stated.indentation_n_mm3, stated.wear_land_mm, stated.friction)


def _spread(table: DynamicsTable) -> ModeSpread | None:
    """Return the spreads of the modes, which are stated all or not at all."""
    names = ("frequency_percent", "damping_percent", "stiffness_percent")
    stated = [0.01 * value for name in names if (value := getattr(table, name)) is not None]
    if stated and len(stated) < len(names):
        raise InputError(f"dynamics: state all of {', '.join(names)}, or none")
    return ModeSpread(*stated) if stated else None


def read_modes(path: Path) -> tuple[ModeTable, ...]:
    """Read the modes of a file.

    Raises
    ------
    InputError
        It cannot be read or is no table of modes.
    """
    raw = parsed(path.name, read_regular(path, path.name, LARGEST_FILE))
    for mode in raw.get("mode", ()) if isinstance(raw.get("mode"), list) else ():
        if isinstance(mode, dict):
            for key in ("residual_percent", "coherence"):
                mode.pop(key, None)
    try:
        return ModesFileTable.model_validate(raw).mode
    except ValidationError as err:
        texts = table_errors(err, ModesFileTable)
        raise InputError(f"{path.name}: {next(iter(texts))}") from None


def _modes(some: Iterable[tuple[int, ModeTable, float]]) -> Modes:
    """Return modes with directions in x, y and z if one moves along z, else in x and y."""
    rows = list(some)
    stated = [DIRECTIONS[m.direction] if isinstance(m.direction, str) else m.direction for _, m, _ in rows]
    direction = np.array([(*d, 0.0)[:3] for d in stated])
    return Modes(
        frequency=[m.frequency_hz for _, m, _ in rows],  # type: ignore[arg-type]
        damping=[m.damping_ratio for _, m, _ in rows],  # type: ignore[arg-type]
        stiffness=[k for _, _, k in rows],  # type: ignore[arg-type]
        direction=direction if direction[:, 2].any() else direction[:, :2],
    )
