"""Processes and locks of files: calls that only Linux, macOS or Windows have, with their counterparts."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
from typing import Any

if sys.platform == "win32":
    import msvcrt
else:
    import fcntl


def cores() -> int:
    """Return the number of cores that this process may use, where the system states it, else that of the computer.

    >>> cores() >= 1
    True
    """
    if sys.platform == "linux":
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def own_group() -> dict[str, Any]:
    """Return arguments of ``Popen`` for a process that Ctrl-C does not reach and that stops with all it started."""
    if sys.platform == "win32":
        return {"creationflags": subprocess.CREATE_NEW_PROCESS_GROUP}
    return {"start_new_session": True}


def stop_group(pid: int, *, kill: bool = False) -> None:
    """Ask a process of :func:`own_group` and all that it started to stop, or kill them; nothing if it has ended.

    Windows has Ctrl-Break in place of SIGTERM, and ``taskkill`` in place of SIGKILL to a group.
    """
    if sys.platform == "win32":
        if kill:
            subprocess.run(["taskkill", "/F", "/T", "/PID", str(pid)], check=False, capture_output=True)
        else:
            with contextlib.suppress(OSError):
                os.kill(pid, signal.CTRL_BREAK_EVENT)
    else:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(pid, signal.SIGKILL if kill else signal.SIGTERM)


def lock_file(handle: int) -> None:
    """Lock an open file for as long as it is open; Windows locks its first byte, the others the whole file.

    Raises
    ------
    OSError
        Another process has locked it, or the file system has no locks.
    """
    if sys.platform == "win32":
        msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
    else:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
