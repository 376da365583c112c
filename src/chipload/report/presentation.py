"""The presentation of a capability's result: its part of the report, its scene and its files."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import IO

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.lazy import trimesh
from chipload.result import Result
from chipload.simulation.engagement_samples import EngagementSamples

#: content of a file, or what writes it bit by bit
Content = bytes | Callable[[IO[bytes]], None]


@dataclass(frozen=True, eq=False)
class Blank:
    """The blank with which a track begins, and its cutters.

    Parameters
    ----------
    mesh : closed, of its stock [mm]; None: it is not known, the cutters are shown alone
    cutters : by tool number
    shapes : kind and profile (m, 2) [mm] of the parts of cutters that have more than :class:`Cutter` knows, as a neck
    before : tracks that have cut the same stock before this one, in their order
    wider : how many times as wide as usual the cells are that the stock is shown with
    """

    mesh: trimesh.Trimesh | None
    cutters: Mapping[int, Cutter]
    shapes: Mapping[int, Sequence[tuple[str, NDArray[np.float64]]]] = field(default_factory=dict)
    before: tuple[str, ...] = ()
    wider: float = 1.0


@dataclass(frozen=True, eq=False)
class Presentation:
    """Contents of a result folder besides the common files.

    Parameters
    ----------
    sections : puts figures into a mapping by name and returns HTML between the limits and the findings of the report
    scene : scene.glb
    files : makes the programs and other files by name; a program states the verdict of the result that it is given
    blanks : of tracks by their names, from which the stock is shown at every row
    samples : tooth engagement and loads over a revolution of some steps, of tracks by their names
    """

    sections: Callable[[dict[str, go.Figure]], list[str]]
    scene: Callable[[], bytes]
    files: Callable[[Result], Mapping[str, Content]] = field(default=lambda result: {})
    blanks: Callable[[], Mapping[str, Blank]] = field(default=dict)
    samples: Callable[[], Mapping[str, EngagementSamples]] = field(default=dict)
