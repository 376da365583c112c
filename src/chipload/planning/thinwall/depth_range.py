"""The range of depths of stock in which a pose of a cutter has a tooth engagement."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.errors import InputError

Floats = NDArray[np.float64]


class DepthLimited(Protocol):
    """A pose with a greatest depth of stock.

    Attributes
    ----------
    deepest : greatest depth [mm]
    deepest_is : text for messages: the meaning of ``deepest``
    """

    @property
    def deepest(self) -> float:
        """Greatest depth [mm]."""

    @property
    def deepest_is(self) -> str:
        """Text for messages: the meaning of ``deepest``."""


def depths_in_range(pose: DepthLimited, depths: ArrayLike, remedy: str = "") -> Floats:
    """Depths of stock as an array, each of them checked.

    Parameters
    ----------
    depths : (n,) float or a number [mm]
    remedy : end of the message

    Returns
    -------
    (n,) float [mm], above 0, at most ``pose.deepest`` but for rounding

    Raises
    ------
    InputError
        A depth is out of its range, or no number.
    """
    d = np.atleast_1d(np.asarray(depths, dtype=np.float64))
    wrong = np.flatnonzero(~((d > 0.0) & (d <= pose.deepest * (1.0 + 1e-12))))
    if len(wrong):
        raise InputError(
            f"depth_mm = {d[wrong[0]]:g}: must be above 0 and at most {pose.deepest:.6g}, {pose.deepest_is}"
            + (f": {remedy}" if remedy else "")
        )
    return d
