"""The HAL pins of the component: a separate program for the Python interpreter that has LinuxCNC's modules.

It uses the standard library and `hal` only, and is passive: each line on its input is one exchange, and when its input
ends, it leaves HAL. The first line is JSON: {"name": component, "pins": [[name, type, direction], ...], "signals":
{pin: signal}, "sources": {in pin: pin or signal in HAL whose value is taken instead}}, types `float`, `bit`, `s32`,
directions `in`, `out`; signals are made where there are none. Each later line holds the values of the out pins in their
order; the answer is the time [s] and the values of the in pins. A value that is no number is not set: the line is
answered with `error`, and the beat that it carried does not arrive.
"""

from __future__ import annotations

import json
import math
import signal
import sys
import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any


def serve(component: Any, out_pins: list[str], readers: Sequence[Callable[[], Any]]) -> None:
    """Exchange lines until the input ends; ``readers`` give the values of the in pins."""
    for line in sys.stdin:
        words = line.split()
        try:
            values = [float(x) for x in words]
        except ValueError:
            values = []
        if len(values) != len(out_pins) or not all(map(math.isfinite, values)):
            print("error", flush=True)
            continue
        for name, value in zip(out_pins, values, strict=True):
            kind = type(component[name])
            component[name] = kind(value)
        print(time.monotonic(), *(float(read()) for read in readers), flush=True)


def main() -> None:
    """Make the component, connect it, serve."""
    import hal  # type: ignore[import-not-found]  # of the system, see docs/design/linuxcnc.md

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    request = json.loads(sys.stdin.readline())
    types = {"float": hal.HAL_FLOAT, "bit": hal.HAL_BIT, "s32": hal.HAL_S32}
    directions = {"in": hal.HAL_IN, "out": hal.HAL_OUT}
    component = hal.component(request["name"])
    try:
        for name, kind, direction in request["pins"]:
            component.newpin(name, types[kind], directions[direction])
        component.ready()
        there = {x["NAME"] for x in hal.get_info_signals()}
        for name, sig in request["signals"].items():
            if sig not in there:
                kind = next(k for n, k, _ in request["pins"] if n == name)
                hal.new_sig(sig, types[kind])
            hal.connect(f"{request['name']}.{name}", sig)
        pins, sources = request["pins"], request["sources"]
        readers = [
            partial(hal.get_value, sources[name]) if name in sources else partial(component.__getitem__, name)
            for name, _, direction in pins
            if direction == "in"
        ]
        for read in readers:
            read()
        print("ready", flush=True)
        serve(component, [name for name, _, direction in pins if direction == "out"], readers)
    except BrokenPipeError:
        pass
    finally:
        component.exit()


if __name__ == "__main__":
    main()
