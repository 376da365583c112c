"""Steps of the controller a second, and the loop with its plant against real time, on one thread.

    python benchmarks/control.py [steps]

The fuzzy forms alone, the whole step with its rules, and the closed loop on a path of 280 mm with steps of depth, with
a control period of 10 ms, 1 ms of simulation and the model's look-ahead; each three times, the best counts.
"""

import sys
import time
from dataclasses import replace

import numpy as np
from numba import njit

from chipload.control import _fuzzy, _override
from chipload.control.fuzzy import standard
from chipload.control.override import Override, begin, sets_of
from chipload.control.plant import Loop, TorqueProfile, run
from chipload.control.spindle_model import Spindle

LIMIT = 2000.0
RULES = Override(
    kind="mamdani", torque_ref=0.93 * LIMIT, overload=2.0 * LIMIT, torque_most=18e3, light=80.0, floor=0.05, cap=1.0,
    start=0.3, air_override=0.4, lost_override=0.2, lost_s=1.0,
)  # fmt: skip
SPINDLE = Spindle(628.0, 5.0, 300.0, (2.0, 0.004), 0.5, 5.0, 60.0, 0.01, 0.02, 0.05)


@njit(nogil=True)
def answers(error, change, output, rules, kind, x, y, strength):
    total = 0.0
    for k in range(len(x)):
        if kind == 0:
            total += _fuzzy.mamdani(error, change, output, rules, False, x[k], y[k], strength)
        elif kind == 1:
            total += _fuzzy.product_sum(error, change, output, rules, x[k], y[k])
        else:
            total += min(max(x[k] + y[k], -1.0), 1.0)
    return total


@njit(nogil=True)
def steps(rules, sets, state, torque):
    o = 0.3
    for k in range(len(torque)):
        seen = _override.Observation(torque[k] * o, 0.01, True, o, 0.0, -1.0, False)
        o, _ = _override.step(rules, sets, state, seen)
    return o


def best(call):
    """Shortest of three times, after one that compiles [s]."""
    call()
    times = []
    for _ in range(3):
        begun = time.perf_counter()
        result = call()
        times.append(time.perf_counter() - begun)
    return min(times), result


def main() -> None:
    n = int(sys.argv[1]) if len(sys.argv) > 1 else 2_000_000
    table = standard()
    rng = np.random.default_rng(0)
    x, y = rng.uniform(-1, 1, (2, n))
    strength = np.empty(len(table.output))
    arrays = (table.error, table.change, table.output, table.rules)
    for kind, name in enumerate(("Mamdani", "product, sum", "clip(e + d)")):
        seconds, _ = best(lambda kind=kind: answers(*arrays, kind, x, y, strength))
        print(f"{name:28s}{n / seconds:14.0f} answers/s")
    torque = 2500.0 + rng.normal(0.0, 50.0, n)
    for kind in ("mamdani", "product-sum", "pi"):
        rules = replace(RULES, kind=kind).numbers
        seconds, _ = best(lambda rules=rules: steps(rules, sets_of(table), begin(RULES), torque))
        print(f"step, {kind:22s}{n / seconds:14.0f} steps/s")
    s = np.arange(0.0, 280.1, 0.25)
    depth = 1900.0 + 1000.0 * np.sign(np.sin(s / 20.0)) + 1000.0 * (s > 80.0) * (s < 110.0)
    path = TorqueProfile(s, np.full(len(s), 20.0), 0.15 * depth, 0.85 * depth)
    loop = Loop(acceleration=500.0, latency=0.1)
    for kind, model in (("pi", None), ("mamdani", None), ("mamdani", path), ("product-sum", path)):
        config = replace(RULES, kind=kind)
        seconds, found = best(lambda config=config, model=model: run(path, model, config, table, SPINDLE, loop, LIMIT))
        ahead = " with feed-forward" if model else ""
        print(f"loop, {kind + ahead:30s}{found.time / seconds:12.0f} x real time, {found.time:.1f} s of cutting")


if __name__ == "__main__":
    main()
