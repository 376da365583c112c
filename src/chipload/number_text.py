"""Numbers as a person writes them: three significant digits, no exponents in the usual range."""

from __future__ import annotations

import math
from collections.abc import Iterable

#: sizes that are written without an exponent
LEAST, MOST = 1e-4, 1e7


def number_text(value: float, digits: int = 3) -> str:
    """Return a number with so many significant digits; whole digits before the point all stay.

    >>> [number_text(v) for v in (0.0, 392.04, 0.8107, 11000.0, 4218.4, 0.0061, 99.999, -0.00001, 1.5e9, 2e-17)]
    ['0', '392', '0.811', '11000', '4218', '0.0061', '100', '-1e-5', '1.5e9', '2e-17']
    """
    if not math.isfinite(value):
        return str(value)
    size = abs(value)
    if size == 0.0:
        return "0"
    if not LEAST <= size < MOST:
        whole, _, exponent = f"{value:.{digits - 1}e}".partition("e")
        return f"{whole.rstrip('0').rstrip('.')}e{int(exponent)}"
    rounded = float(f"{value:.{digits - 1}e}") if size < 10.0**digits else float(f"{value:.0f}")
    decimals = max(digits - 1 - math.floor(math.log10(abs(rounded))), 0)
    text = f"{rounded:.{decimals}f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def worst_text(value: float, limit: float) -> str:
    """Return a value with three significant digits, or with as many as show on which side of its limit it lies.

    >>> [worst_text(v, 500.0) for v in (412.34, 499.96, 500.0, 500.04)], worst_text(12.97, 12.98)
    (['412', '499.96', '500', '500.04'], '12.97')
    """
    texts = (number_text(value, digits) for digits in range(3, 10))
    known = (x for x in texts if (float(x) > limit) == (value > limit) and (float(x) < limit) == (value < limit))
    return next(known, number_text(value))


def place_text(place: Iterable[float]) -> str:
    """Return coordinates in mm to 0.01 mm.

    >>> place_text((5.7e-17, 2.25, -33.33333))
    '0, 2.25, -33.33'
    """
    return ", ".join(f"{round(x, 2) + 0.0:.6g}" for x in place)


def percent_text(share: float) -> str:
    """Return a share in percent with three significant digits.

    >>> percent_text(0.17634), percent_text(1.0), percent_text(0.0004), percent_text(12.3456)
    ('17.6 %', '100 %', '0.04 %', '1235 %')
    """
    return f"{number_text(100.0 * share, 3)} %"
