"""The envelope against all pairs."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from chipload.errors import InputError
from chipload.planning.thinwall.envelope import lower_envelope


@settings(deadline=None, max_examples=60)
@given(st.integers(0, 2**31), st.integers(1, 400), st.sampled_from([0.0, 0.01, 0.1, 1.0, 30.0]))
def test_against_all_pairs(seed, n, slope):
    rng = np.random.default_rng(seed)
    p = rng.uniform(-20.0, 20.0, (n, 3)) * rng.choice([0.0, 1.0], 3)
    d = rng.uniform(0.0, 2.0, n)
    apart = np.linalg.norm(p[:, None] - p[None], axis=2)
    assert_allclose(lower_envelope(p, d, slope), (d[None] + slope * apart).min(axis=1), rtol=0.0, atol=1e-12)


def test_grid():
    """A cone around one low place, and never above what was given."""
    x, y = np.meshgrid(np.linspace(0, 100, 101), np.linspace(0, 60, 61), indexing="ij")
    d = np.full(x.shape, 1.0)
    d[30, 20] = 0.2
    out = lower_envelope(np.stack([x, y], axis=-1), d, 0.05)
    assert_allclose(out, np.minimum(1.0, 0.2 + 0.05 * np.hypot(x - 30, y - 20)), atol=1e-12)


def test_refused():
    with pytest.raises(InputError, match="slope = -1: must be finite and at least 0"):
        lower_envelope([[0.0, 0.0]], [1.0], -1.0)
    with pytest.raises(InputError, match="a depth a point"):
        lower_envelope([[0.0, 0.0]], [1.0, 2.0], 1.0)
