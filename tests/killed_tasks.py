"""Tasks that kill the process that executes them; workers import them from here."""

from __future__ import annotations

import os
import signal


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
