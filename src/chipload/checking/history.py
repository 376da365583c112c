"""The result of a simulated program in Python: its columns, numbers and result files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from chipload.checking.outcome import ProgramResult
from chipload.checking.result import checked_result
from chipload.errors import InputError
from chipload.result import Result
from chipload.result.display import message_html, table_html
from chipload.stock.layers import LayeredStock


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class History(Result):
    """The result of a simulated program with its history, which has a row for each step.

    Parameters
    ----------
    program : the program, its machine and the results of the simulation
    """

    program: ProgramResult

    @classmethod
    def of(cls, program: ProgramResult) -> History:
        """Return the history of a program that was simulated and stays as it is."""
        result = checked_result(program)
        return cls(**{f.name: getattr(result, f.name) for f in fields(result)}, program=program)

    def __len__(self) -> int:
        return len(self.columns["line"])

    def __repr__(self) -> str:
        return f"History({self.program.name} on {self.program.machine.name}, {len(self)} steps: {self.verdict})"

    def __getitem__(self, column: str) -> NDArray[Any]:
        """Return the values (n,) of a column, as ``history["force_n"]``."""
        if column not in self.columns:
            raise InputError(f"history: no column {column!r}: it has {', '.join(self.columns)}")
        return self.columns[column]

    @cached_property
    def columns(self) -> Mapping[str, NDArray[Any]]:
        """Columns (n,) of history.parquet by name, see :data:`chipload.result.COLUMNS`."""
        return self.in_use[0].columns

    @property
    def stock(self) -> LayeredStock:
        """The stock after the program."""
        if self.program.simulated is None:
            raise InputError(f"{self.program.name}: was only read, not simulated: it has no stock")
        return self.program.simulated.stock

    @property
    def energy_balance(self) -> Mapping[int, float]:
        """Work over the specific energy of the removed volume, less 1, by tool number."""
        return {} if self.program.simulated is None else self.program.simulated.removal.energy_balance

    @property
    def resolution_error(self) -> Mapping[str, float]:
        """Relative resolution error of the greatest value of each column."""
        return {} if self.program.simulated is None else self.program.simulated.removal.resolution_error

    @property
    def numbers(self) -> Mapping[str, Any]:
        """Numbers of the operation as in summary.json: ``force_n``, ``torque_nm``, ``removed_mm3``, ``collisions``."""
        return self.operations[0]

    def save(self, out: str | Path) -> Path:
        """Write the result folder of ``chipload run``: report, summary, history, scene, stock."""
        from chipload.checking.figures import program_presentation
        from chipload.report.folder import write_result

        return write_result(self, program_presentation(self.program, self, {}), out)

    def _repr_html_(self) -> str:
        """HTML for notebooks."""
        numbers = table_html(("program", self.program.name), _rows(self.numbers))
        return message_html(self.verdict, self.message) + numbers


def _rows(numbers: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return the names and values that a notebook shows."""
    shown = (
        ("time [s]", numbers["time_s"]),
        ("in air [s]", numbers["air_cut_s"]),
        ("removed [mm\u00b3]", numbers["removed_mm3"]),
        ("greatest force [N]", numbers["force_n"]["max"]),
        ("greatest torque [N m]", numbers["torque_nm"]["max"]),
        ("greatest power [W]", numbers["power_w"]["max"]),
        ("greatest chip thickness [mm]", numbers["chip_max_mm"]["max"]),
        ("greatest deflection [\u00b5m]", numbers["deflection_um"]["max"]),
        ("form error [\u00b5m]", numbers["form_error_um"]["max"]),
        ("deepest gouge [mm]", numbers["gouge_mm"]["max"]),
        ("highest excess [mm]", numbers["excess_mm"]["max"]),
    )
    out = [(name, f"{value:.4g}") for name, value in shown if value is not None]
    return [*out, ("steps", str(numbers["steps"])), ("collisions", str(len(numbers["collisions"])))]
