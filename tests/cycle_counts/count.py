#!/usr/bin/python3
"""Run programs one after another and count the servo cycles of each: the [DISPLAY] of a LinuxCNC without a screen.

Runs under LinuxCNC's own Python. `programs.txt` lists the programs; `counts.json` gets name, cycles and error of each.
A cycle counts while `motion.in-position` is false: dwells and tool changes do not count. The integrator runs in the
servo thread, so that the count does not depend on how busy the computer is.
"""

from __future__ import annotations

import json
import subprocess
import time
from pathlib import Path
from typing import Any

ORIGIN = ("G21 G90 G40 G49 G92.1", "G10 L2 P1 R0 {}", "G54", "G64", "G53 G0 {}")


def count() -> float:
    """Seconds of servo cycles in which the axes moved."""
    return float(subprocess.run(["halcmd", "getp", "integ.0.out"], check=True, capture_output=True).stdout)


def still(cnc: Any, status: Any, seconds: float) -> bool:
    """Whether interpreter and axes come to rest."""
    end, calm = time.time() + seconds, 0
    while time.time() < end:
        try:
            status.poll()
        except cnc.error:  # it is being written
            time.sleep(0.02)
            continue
        calm = calm + 1 if status.interp_state == cnc.INTERP_IDLE and status.inpos else 0
        if calm > 15:
            return True
        time.sleep(0.02)
    return False


def main() -> None:
    """Home, then run every program from the zero of the machine."""
    # modules of LinuxCNC's own Python
    import hal  # type: ignore[import-not-found]
    import linuxcnc as cnc  # type: ignore[import-not-found]

    hal.component("count").ready()
    command, status, errors = cnc.command(), cnc.stat(), cnc.error_channel()
    for state in (cnc.STATE_ESTOP_RESET, cnc.STATE_ON):
        command.state(state)
        command.wait_complete()
    status.poll()
    for joint in range(status.joints):
        command.home(joint)
    time.sleep(1.0)
    status.poll()
    zero = " ".join(letter + "0" for k, letter in enumerate("XYZABCUVW") if status.axis_mask >> k & 1)
    results = []
    for line in Path("programs.txt").read_text().split():
        name, seconds = line.rsplit(":", 1)
        command.mode(cnc.MODE_MDI)
        command.wait_complete()
        for text in ORIGIN:
            command.mdi(text.format(zero))
            time.sleep(0.1)
            still(cnc, status, 30.0)
        while errors.poll():
            pass
        command.mode(cnc.MODE_AUTO)
        command.wait_complete()
        command.program_open(name)
        before = count()
        command.auto(cnc.AUTO_RUN, 0)
        time.sleep(0.3)
        done = still(cnc, status, float(seconds))
        if not done:
            command.abort()
            command.wait_complete()
        time.sleep(0.1)
        found = errors.poll()
        error = (found[1] if found else "") if done else "not at its end in time"
        results.append({"name": name, "cycles": round((count() - before) * 1000.0), "error": error})
        Path("counts.json").write_text(json.dumps(results))


if __name__ == "__main__":
    main()
