"""Functions that read a machine, a material or a program."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from chipload.api.job_tables import is_file
from chipload.progress import Progress, silent

if TYPE_CHECKING:
    from chipload.cutting.material import Material
    from chipload.machine.machine import Machine
    from chipload.program.read import ProgramReading
    from chipload.program.setup import Setup


def read_machine(name: str | Path) -> Machine:
    """Read a machine by its shipped name, or from a TOML file or a LinuxCNC configuration (.ini).

    Raises
    ------
    InputError
        There is none of this name, or the file cannot be read.

    Examples
    --------
    >>> read_machine("vmc").name
    'vmc'
    """
    if Path(name).suffix.lower() == ".ini":
        from chipload.machine.ini import read_ini

        return read_ini(name)[0]
    from chipload.machine import machine

    return machine.read_machine(name) if is_file(name) else machine.machine_named(str(name))


def read_material(name: str | Path) -> Material:
    """Read force coefficients by the name of a shipped material, or from a TOML file.

    Raises
    ------
    InputError
        There is none of this name, or the file cannot be read.

    Examples
    --------
    >>> read_material("al7075-t6").name
    'al7075-t6'
    """
    from chipload.cutting import material

    return material.read_material(name) if is_file(name) else material.material_named(str(name))


def read_program(
    path: str | Path,
    machine: Machine | str | Path,
    *,
    dialect: str | None = None,
    tools: str | Path | None = None,
    feed_mm_min: float | None = None,
    tolerance_mm: float = 0.001,
    setup: Setup | None = None,
    progress: Progress = silent,
) -> ProgramReading:
    r"""Read NC text or CL data as the controller of a machine interprets it.

    Parameters
    ----------
    path : .ngc, .nc, .h, .apt, .cls and so on
    machine : a value, a shipped name or a file
    dialect : linuxcnc, fanuc, sinumerik, heidenhain or apt; None: by the ending of the file and by the machine
    tools : LinuxCNC tool table
    feed_mm_min : feed of cuts before the program states one
    tolerance_mm : how far the tip may leave its path where a move with rotary axes is cut up
    setup : values that the controller holds, work offsets and cutters

    Returns
    -------
    ProgramReading
        ``program`` is the :class:`chipload.Program`; ``findings`` are the reader's,
        ``violations`` what the machine cannot do.

    Raises
    ------
    InputError
        The program cannot be read, or the machine has not the axes that it moves.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     file = Path(folder) / "line.ngc"
    ...     _ = file.write_text("G21 G90\nG0 X0 Y0 Z5\nG0 X10\nM30\n", encoding="ascii", newline="")
    ...     reading = read_program(file, "vmc")
    >>> reading.program.p_work[-1].tolist()
    [10.0, 0.0, 5.0]
    """
    from chipload.program import read
    from chipload.units import mm_s_from_mm_min

    return read.read_program(
        path,
        read_machine(machine) if isinstance(machine, (str, Path)) else machine,
        dialect=dialect,
        tools=None if tools is None else read.read_tools(tools),
        feed=None if feed_mm_min is None else mm_s_from_mm_min(feed_mm_min),
        tolerance=tolerance_mm,
        setup=setup,
        progress=progress,
    )
