"""engagement.npz: tooth engagement and loads over a revolution of some steps of each track, written and read again."""

from __future__ import annotations

import io
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.arrays import read_arrays
from chipload.result import Result
from chipload.simulation.engagement_samples import EngagementSamples, samples_from

#: the file
ENGAGEMENT = "engagement.npz"


def engagement_bytes(result: Result, samples: Mapping[str, EngagementSamples]) -> bytes:
    """The file: the samples of each track by its number."""
    sink = io.BytesIO()
    arrays: dict[str, NDArray[Any]] = {}
    for k, track in enumerate(result.tracks):
        if track.name in samples:
            arrays |= {f"{k}-{name}": values for name, values in samples[track.name].arrays().items()}
    np.savez_compressed(sink, **arrays)  # type: ignore[arg-type]
    return sink.getvalue()


def read_engagement(path: Path, track: int) -> EngagementSamples | None:
    """The samples of a track; None: the file has none.

    Raises
    ------
    InputError
        It cannot be read.
    """
    stored = read_arrays(path, wanted=re.compile(rf"{track}-[a-z]+").fullmatch)
    own = {name.partition("-")[2]: values for name, values in stored.items()}
    return samples_from(own) if own else None
