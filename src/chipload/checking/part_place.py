"""Check that the finished part lies in its stock and is of its size."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chipload.errors import Finding, Severity
from chipload.number_text import number_text

Floats = NDArray[np.float64]

#: a part may stand out of its stock by this share of its longest side, the error of facets and of a zero
OUT = 1e-3
#: a part that fills less of the box of its stock is of another unit: an inch over a millimetre is 1 / 16387
LEAST_SHARE = 1e-3


def find_misplaced_part(bounds: Floats, volume: float, low: Floats, high: Floats) -> tuple[Finding, ...]:
    """Return a finding where a part stands out of the box of its stock, or is far too small for it.

    Parameters
    ----------
    bounds : (2, 3) low and high corner of the part [mm]
    volume : of the part [mm^3]
    low, high : (3,) corners of the stock [mm]

    Examples
    --------
    >>> low, high = np.zeros(3), np.full(3, 10.0)
    >>> find_misplaced_part(np.array([[0.0, 0.0, 0.0], [10.0, 10.0, 5.0]]), 500.0, low, high)
    ()
    >>> find_misplaced_part(np.array([[0.0, 0.0, 5.0], [10.0, 10.0, 12.0]]), 700.0, low, high)[0].text
    'the part stands out of its stock by Z 2 mm: check part.file, its unit and its zero, and the stock'
    """
    out = np.maximum(np.maximum(low - bounds[0], bounds[1] - high), 0.0)
    if (out > OUT * float(np.ptp(bounds, axis=0).max())).any():
        by = ", ".join(f"{axis} {value:.3g} mm" for axis, value in zip("XYZ", out.tolist(), strict=True) if value > 0.0)
        text = f"the part stands out of its stock by {by}: check part.file, its unit and its zero, and the stock"
        return (Finding("part-misplaced", 0, text, Severity.UNPROVEN),)
    share = abs(volume) / float(np.prod(high - low))
    if share < LEAST_SHARE:
        size = " x ".join(f"{v:.3g}" for v in np.ptp(bounds, axis=0).tolist())
        text = f"the part, {size} mm, fills {number_text(100.0 * share, 2)} % of its stock: check part.units"
        return (Finding("part-misplaced", 0, text, Severity.UNPROVEN),)
    return ()
