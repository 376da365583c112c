#!/usr/bin/python3
"""Drive a LinuxCNC without a screen: wait for the controller's beat, run one program, write down what the machine does.

Runs as the [DISPLAY] of tube.ini, so in the Python of LinuxCNC's own modules. It reads `$PROGRAM`, waits for the beat,
and writes `machine.csv`: time [s, monotonic], X, Y, Z [mm], velocity [mm/s], override in effect. It ends with the
program, after `$SECONDS` of it, or when the file `end` appears; LinuxCNC goes down with it.
"""

import os
import signal
import sys
import time
from pathlib import Path

PERIOD_S = 0.02
BEAT_S = 60.0


def main() -> int:
    """Run the program once."""
    # modules of LinuxCNC's own Python
    import hal  # type: ignore[import-not-found]
    import linuxcnc  # type: ignore[import-not-found]

    component = hal.component("drive")
    component.ready()
    command, status = linuxcnc.command(), linuxcnc.stat()
    for state in (linuxcnc.STATE_ESTOP_RESET, linuxcnc.STATE_ON):
        command.state(state)
        command.wait_complete()
    for joint in range(3):
        command.home(joint)
    time.sleep(0.5)
    Path("up").touch()
    start = time.monotonic()
    while not hal.get_value("watch.out"):
        if time.monotonic() - start > BEAT_S or Path("end").exists():
            return 1
        time.sleep(PERIOD_S)
    command.mode(linuxcnc.MODE_AUTO)
    command.wait_complete()
    command.program_open(os.environ["PROGRAM"])
    command.auto(linuxcnc.AUTO_RUN, 0)
    start, last = time.monotonic(), float(os.environ["SECONDS"])
    with Path("machine.csv").open("w") as log:
        log.write("t_s,x_mm,y_mm,z_mm,velocity_mm_s,override\n")
        while (now := time.monotonic()) - start < last and not Path("end").exists():
            row = [now, *(hal.get_value(f"joint.{j}.motor-pos-fb") for j in range(3))]
            row += [hal.get_value("motion.current-vel"), hal.get_value("motion.adaptive-feed")]
            log.write(",".join(f"{x:.6f}" for x in row) + "\n")
            log.flush()
            status.poll()
            if status.interp_state == linuxcnc.INTERP_IDLE and now - start > 1.0:
                break
            time.sleep(PERIOD_S)
    command.abort()
    return 0


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    sys.exit(main())
