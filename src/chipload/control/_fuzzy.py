"""The output of the fuzzy controller, compiled.

Oracle: the sampled form in :mod:`chipload.control.fuzzy`.
"""

from __future__ import annotations

from numba import njit


@njit(cache=True, nogil=True)
def place(centres, x):
    """Index of the set to the left of x, at most the last but one, and the memberships of that set and of the next."""
    last = len(centres) - 1
    if x <= centres[0]:
        return 0, 1.0, 0.0
    if x >= centres[last]:
        return last - 1, 0.0, 1.0
    i = 0
    while x >= centres[i + 1]:
        i += 1
    width = centres[i + 1] - centres[i]
    # both from their own side: the answer stays odd to the last bits
    return i, (centres[i + 1] - x) / width, (x - centres[i]) / width


@njit(cache=True, nogil=True)
def _falling_side(a, x):
    """Area and moment about 1/2 of min(a, 1 - y) over y from 0 to x."""
    p = min(x, 1.0 - a)
    area = a * p
    moment = 0.5 * a * p * (p - 1.0)
    if x > p:
        # primitives of 1 - y and of (1 - y)(y - 1/2)
        area += (x - p) * (1.0 - 0.5 * (x + p))
        moment += (x - p) * (-0.5 + 0.75 * (x + p) - (x * x + x * p + p * p) / 3.0)
    return area, moment


@njit(cache=True, nogil=True)
def _area_between_clips(a, b):
    """Area and moment about the middle of max(min(a, 1 - y), min(b, y)) over y from 0 to 1."""
    if b <= a and b <= 0.5:
        left, right = 1.0 - b, b
    elif a <= 0.5:
        left, right = a, 1.0 - a
    else:
        left, right = 0.5, 0.5
    a0, m0 = _falling_side(a, left)
    a1, m1 = _falling_side(b, right)
    return a0 + a1, m0 - m1


@njit(cache=True, nogil=True)
def mamdani(error, change, output, rules, whole_ends, e, d, strength):
    """Centroid of the cut sets; ``strength`` (outputs,) is scratch. See :func:`chipload.control.fuzzy.mamdani`."""
    i, x0, x1 = place(error, e)
    j, y0, y1 = place(change, d)
    strength[:] = 0.0
    for p in range(2):
        a = x1 if p else x0
        for q in range(2):
            w = min(a, y1 if q else y0)
            k = rules[i + p, j + q]
            strength[k] = max(strength[k], w)
    area, moment = 0.0, 0.0
    last = len(output) - 1
    for k in range(last):
        if strength[k] > 0.0 or strength[k + 1] > 0.0:
            width = output[k + 1] - output[k]
            a, m = _area_between_clips(strength[k], strength[k + 1])
            area += width * a
            moment += width * (0.5 * (output[k] + output[k + 1]) * a + width * m)
    if whole_ends:
        width = output[1] - output[0]
        a, m = _area_between_clips(0.0, strength[0])
        area += width * a
        moment += width * ((output[0] - 0.5 * width) * a + width * m)
        width = output[last] - output[last - 1]
        a, m = _area_between_clips(strength[last], 0.0)
        area += width * a
        moment += width * ((output[last] + 0.5 * width) * a + width * m)
    return moment / area


@njit(cache=True, nogil=True)
def product_sum(error, change, output, rules, e, d):
    """Output centres interpolated over the rules; see :func:`chipload.control.fuzzy.product_sum`."""
    i, x0, x1 = place(error, e)
    j, y0, y1 = place(change, d)
    low = y0 * output[rules[i, j]] + y1 * output[rules[i, j + 1]]
    high = y0 * output[rules[i + 1, j]] + y1 * output[rules[i + 1, j + 1]]
    return x0 * low + x1 * high
