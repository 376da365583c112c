"""The note of a draft on a model that is a thin tube or cone about Z."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from chipload.jobs.drafts.drawing import thin_rings


def wall(radius: float, height: float, kind: str = "cylinder", x: float = 5.0) -> Any:
    """The whole face of a vertical cylinder or cone of greatest ``radius`` about (x, 0)."""
    low, high = np.array([x - radius, -radius, 0.0]), np.array([x + radius, radius, height])
    return SimpleNamespace(kind=kind, area=math.tau * radius * height, low=low, high=high)


@pytest.mark.parametrize("kind", ["cylinder", "cone"])
def test_a_thin_wall_is_named_with_its_sizes(kind: str) -> None:
    (text,) = thin_rings((wall(21.0, 60.0, kind), wall(19.0, 60.0, kind)))
    name = "tube" if kind == "cylinder" else "cone"
    assert (
        f"the model is a {name} of 20 mm mean radius{'' if name == 'tube' else ' at its wide end'} with a wall of about"
        " 2 mm" in text
    )
    assert f"chipload example {name}" in text


def test_other_round_parts_have_no_note() -> None:
    assert thin_rings((wall(21.0, 60.0), wall(10.0, 60.0))) == ()  # a thick bush
    assert thin_rings((wall(21.0, 60.0),)) == ()  # a bar
    assert thin_rings((wall(21.0, 60.0), wall(19.0, 60.0, x=9.0))) == ()  # not about one axis
    assert thin_rings((wall(21.0, 1.0), wall(19.0, 1.0))) == ()  # a washer
