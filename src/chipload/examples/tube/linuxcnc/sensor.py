#!/usr/bin/python3
"""The pins of a spindle's sensor in HAL, for the Python of LinuxCNC's own modules.

Each line of the input is a current [A], a speed [rev/s] and a power [W], put on the pins `sensor.current`,
`sensor.speed` and `sensor.power`, `nan` too; the answer is the time [s, monotonic], X, Y, Z [mm] and the velocity
[mm/s] of the machine, and the line of the program.
"""

import sys
import time

NAMES = ("current", "speed", "power")


def main() -> int:
    """Exchange lines until the input ends."""
    # a module of LinuxCNC's own Python
    import hal  # type: ignore[import-not-found]

    component = hal.component("sensor")
    for name in NAMES:
        component.newpin(name, hal.HAL_FLOAT, hal.HAL_OUT)
    component.ready()
    for line in sys.stdin:
        for name, word in zip(NAMES, line.split(), strict=True):
            component[name] = float(word)
        try:
            row = [time.monotonic(), *(hal.get_value(f"joint.{j}.motor-pos-fb") for j in range(3))]
            print(*row, hal.get_value("motion.current-vel"), hal.get_value("motion.program-line"), flush=True)
        except RuntimeError:
            # the machine has left HAL
            break
    component.exit()
    return 0


if __name__ == "__main__":
    sys.exit(main())
