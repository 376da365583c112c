"""Tasks of tests of workers, which import them from here; some kill the process that executes them."""

from __future__ import annotations

import os
import signal
import time

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def killed_once(flag: str, value: int) -> int:
    """Kills its process the first time."""
    try:
        os.close(os.open(flag, os.O_CREAT | os.O_EXCL))
    except FileExistsError:
        return value * value
    os.kill(os.getpid(), signal.SIGKILL)
    return -1


def always_killed(value: int) -> int:
    """Kills its process every time."""
    os.kill(os.getpid(), signal.SIGKILL)
    return value


def shared_sum(shared: Floats, value: float) -> float:
    """The sum of what is shared and a value."""
    return float(shared.sum()) + value


def waits(_: int) -> None:
    """Does not end by itself."""
    time.sleep(600.0)


def process_of(_: int) -> int:
    """Number of the process."""
    return os.getpid()
