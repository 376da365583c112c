"""What a simulation will need, before it is run.

Measured on programs of 10,000 to 100,000 motions (docs/design/streaming.md): the libraries and an ordinary stock take
350 MB, a motion that is read 1.6 kB, the columns of a step 0.5 kB while they are joined.
"""

from __future__ import annotations

#: [bytes] of the libraries and the stock, of a motion, of a step
BASE, MOTION, STEP = 350e6, 1.6e3, 0.5e3


def estimate(steps: int, motions: int) -> str:
    """Steps and memory of a simulation, in a sentence.

    >>> estimate(200_000, 100_000)
    'estimate: 200000 steps, 610 MB of memory'
    """
    return f"estimate: {steps} steps, {(BASE + MOTION * motions + STEP * steps) / 1e6:.0f} MB of memory"
