"""Estimate of the steps, memory and processor time of a simulation before it runs.

Measured on programs of 10,000 to 100,000 motions (docs/design/streaming.md): the libraries and an ordinary stock take
350 MB, a motion that is read 1.6 kB, the columns of a step 0.5 kB while they are joined.

The processor time of a step by layers depends on how many layers and chips it meets: 1.6 ms on a relief in thick
layers, 3 ms in five axes (docs/design/real_programs.md), 17 ms where a drill of 3 mm meets 160 layers in each step. By
moves of an upright axis a step of a finishing program takes 0.1 ms, one with chips 0.6 to 2.1 ms with a flat end mill,
0.9 to 5.2 ms with a ball nose or a drill and 14 ms with an engraver, whose taper is divided into many sections
(docs/real_programs.md); where the axis leans 0.7 to 2.8 ms with 24 slices of a corner, and twice that with the 48 of a
job (docs/design/engines.md). The estimate names the range, up to about twice what was measured.
"""

from __future__ import annotations

from chipload.cutter.cutter import Cutter

#: [bytes] of the libraries and the stock, of a motion, of a step
BASE, MOTION, STEP = 350e6, 1.6e3, 0.5e3
#: processor time of a step [s], least and greatest that was measured
QUICK, SLOW = 1.6e-3, 17e-3
#: of the start and the report [s]: a result with few steps, and one whose loops are read for the first time
START = (4.0, 12.0)
#: processor time of a step by moves [s] where the axis leans, and least of an upright axis
LEANING, UPRIGHT = (0.6e-3, 8e-3), 0.1e-3
#: greatest of an upright axis: a flat end mill, one with a corner radius or a point, a tapered one
FLAT, ROUND, TAPERED = 4e-3, 10e-3, 28e-3


def estimate(
    steps: int,
    motions: int,
    quick: float = QUICK,
    slow: float = SLOW,
    coarse: bool = True,
    more: tuple[float, float] = (0.0, 0.0),
) -> str:
    """Return steps, memory and time of a simulation as a sentence; ``quick`` and ``slow`` are times of a step [s].

    With ``coarse``, a long estimate ends with how to get a first result. ``more`` is the least and greatest time [s] of
    what is calculated besides the steps.

    >>> estimate(200_000, 100_000)
    'estimate: 200000 steps, 610 MB of memory, 5 to 57 min; for a first result: run --coarse'
    >>> estimate(40_000, 0, 0.4e-3, 8e-3)
    'estimate: 40000 steps, 370 MB of memory, 20 s to 6 min; for a first result: run --coarse'
    >>> estimate(28, 8)
    'estimate: 28 steps, 350 MB of memory, 4 to 12 s'
    """
    low, high = START[0] + more[0] + quick * steps, START[1] + more[1] + slow * steps
    unit, name = (60.0, "min") if high > 300.0 else (1.0, "s")
    least = f"{low / unit:.0f}" if low >= unit else f"{low:.0f} s"
    hint = "; for a first result: run --coarse" if coarse and high > 300.0 else ""
    memory = (BASE + MOTION * motions + STEP * steps) / 1e6
    return f"estimate: {steps} steps, {memory:.0f} MB of memory, {least} to {high / unit:.0f} {name}{hint}"


def slowest_step(cutter: Cutter) -> float:
    """Return the greatest processor time [s] of a step by moves with an upright cutter.

    >>> slowest_step(Cutter(10.0, 4, 0.5, 20.0, 35.0, 5.8e5)) == FLAT
    True
    """
    if cutter.taper > 0.0 or cutter.barrel_radius is not None or cutter.shape:
        return TAPERED
    return ROUND if cutter.corner_radius > 0.0 or cutter.bottom > 0.0 else FLAT
