"""What a simulation gives back in Python: columns, pictures, numbers, and the files of a result."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.report.columns import USUAL, columns_figure
from chipload.report.folder import write_result
from chipload.report.reading import Read, summary_bytes, verdict
from chipload.report.simulated import Simulated, history
from chipload.simulation.chips import stacked
from chipload.stock.layers import LayeredStock

if TYPE_CHECKING:
    import pandas

#: colours of the verdicts
COLOURS = {"holds": "#0b6b4f", "unproven": "#8a6100", "fails": "#b3261e"}


@dataclass(frozen=True, eq=False)
class History:
    """A program that was run through a stock, a row a step.

    Parameters
    ----------
    read : the program, its machine and what the simulation found
    """

    read: Read

    def __len__(self) -> int:
        return len(self.columns["line"])

    def __repr__(self) -> str:
        return f"History({self.read.name} on {self.read.machine.name}, {len(self)} steps: {self.verdict})"

    def __getitem__(self, column: str) -> NDArray[Any]:
        """(n,) values of a column, as ``history["force_n"]``."""
        if column not in self.columns:
            raise InputError(f"history: no column {column!r}: it has {', '.join(self.columns)}")
        return self.columns[column]

    @cached_property
    def columns(self) -> Mapping[str, NDArray[Any]]:
        """(n,) arrays by name, those of history.parquet: see :func:`chipload.simulation.chips.remove`."""
        return stacked(list(history(self._simulated)))

    @property
    def stock(self) -> LayeredStock:
        """What is left."""
        return self._simulated.stock

    @property
    def verdict(self) -> str:
        """`holds`, `unproven` or `fails`: the program on its machine, and every limit."""
        return "fails" if self.read.reading.broken else self._simulated.verdict

    @property
    def says(self) -> str:
        """The verdict in a sentence."""
        return verdict(self.read)[1]

    def summary(self) -> dict[str, Any]:
        """The operation in numbers, as in summary.json: ``force_n``, ``torque_nm``, ``limits``, ``collisions`` ..."""
        whole = json.loads(summary_bytes(self.read))
        operation: dict[str, Any] = whole["operations"][0]
        return {**operation, "verdict": self.verdict, "holds": self.verdict == "holds", "says": self.says}

    def plot(self, *columns: str, x: Literal["t_s", "s_mm"] = "t_s") -> go.Figure:
        """Columns one below the other against time or path, with their limits; none named: the loads.

        Raises
        ------
        InputError
            A column is not known.
        """
        return columns_figure(self.columns, self._simulated.limits, columns or USUAL, x)

    def to_pandas(self) -> pandas.DataFrame:
        """The columns as a table of pandas, which is to be installed: ``pip install chipload[notebook]``."""
        try:
            import pandas
        except ImportError:
            raise InputError("to_pandas: pandas is not installed: pip install 'chipload[notebook]'") from None
        return pandas.DataFrame({name: np.array(values) for name, values in self.columns.items()})

    def save(self, out: str | Path) -> Path:
        """Write the folder that ``chipload run`` writes: report, summary, history, scene, stock."""
        return write_result(self.read, out)

    def _repr_html_(self) -> str:
        """What a notebook shows."""
        said = self.summary()
        rows = "".join(
            f"<tr><td>{escape(name)}</td><td style='text-align:right'>{escape(value)}</td></tr>"
            for name, value in _rows(said)
        )
        colour = COLOURS[self.verdict]
        says = self.says.removeprefix("Unproven: ").removeprefix("Does not hold: ")
        return (
            f"<div style='border-left:5px solid {colour};padding:4px 12px'><b style='color:{colour}'>{self.verdict}"
            f"</b>: {escape(says)}</div><table>{rows}</table>"
        )

    @property
    def _simulated(self) -> Simulated:
        assert self.read.simulated is not None
        return self.read.simulated


def _rows(said: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Names and values that a notebook shows."""
    numbers = (
        ("time [s]", said["time_s"]),
        ("in air [s]", said["air_cut_s"]),
        ("removed [mm\u00b3]", said["removed_mm3"]),
        ("greatest force [N]", said["force_n"]["max"]),
        ("greatest torque [N m]", said["torque_nm"]["max"]),
        ("greatest power [W]", said["power_w"]["max"]),
        ("thickest chip [mm]", said["chip_mm"]["max"]),
        ("tool and work part by [\u00b5m]", said["deflection_um"]["max"]),
        ("form error [\u00b5m]", said["form_error_um"]["max"]),
        ("deepest gouge [mm]", said["gouge_mm"]["max"]),
        ("highest excess [mm]", said["excess_mm"]["max"]),
    )
    out = [(name, f"{value:.4g}") for name, value in numbers if value is not None]
    return [*out, ("steps", str(said["steps"])), ("collisions", str(len(said["collisions"])))]
