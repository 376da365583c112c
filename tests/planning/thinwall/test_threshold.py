"""Thresholds by finite elements against plate theory, and from experiments."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chipload.errors import InputError
from chipload.planning.thinwall.threshold import Experiments, calibrated, from_deflections, of_state, scatter
from chipload.structure.grid import from_map
from chipload.structure.places import normals_of, on_side
from chipload.structure.removal import cut, start
from chipload.structure.solid import SolidWorkpiece
from chipload.structure.unit_loads import watch

E, NU = 114000.0, 0.3


def wall(width: float, thickness: float, columns: int) -> SolidWorkpiece:
    """Clamped along y = 0, 60 mm high; rows denser towards the clamp."""
    v = 60.0 * np.linspace(0.0, 1.0, 13) ** 2
    grid = from_map(np.linspace(0.0, width, columns + 1).tolist(), v.tolist(), [0.0, thickness], lambda p: p)
    return SolidWorkpiece(grid, E, NU, 4.43e-9, grid.side("j-"), rule=8)


def borne(solid: SolidWorkpiece, u, v, removed: float = 0.0):
    state = start(solid, limit=10**6)
    if removed:
        state = cut(state, np.arange(len(solid.grid.elements)), (0.0, 1.0 - removed))
    places = on_side(solid.grid, "k-", u, v)
    return of_state(state, watch(state, places, normals_of(solid.grid, places, "k-")), 0.05)


def test_map_of_a_cantilever_plate():
    """Square plate: 0.3615 and 0.4911 a^2 / D at the middle and the corner of the free edge: the corner bears 3/4; of a
    plate twice as wide 0.2114 and 0.4195: half."""
    t = 0.3
    D = E * t**3 / (12.0 * (1.0 - NU**2))
    for width, middle, corner in ((1.0, 0.3615, 0.4911), (2.0, 0.2114, 0.4195)):
        found = borne(wall(60.0 * width, t, 20), [0.5, 0.0], [1.0, 1.0])
        assert found.source == "modelled"
        assert_allclose(found.force, 0.05 * D / (60.0**2 * np.array([middle, corner])), rtol=0.01)


def endless_strip(y0: float) -> float:
    """w D / (P a^2) under a force at the height y0 of an endless strip, clamped at y = 0, free at y = 1: for each wave
    number k along it (A + B y) cosh(k y) + (C + D y) sinh(k y) below the force and above it, by eight conditions."""

    def row(k: float, y: float) -> list[np.ndarray]:
        """The four functions and their first three derivatives."""
        c, s = math.cosh(k * y), math.sinh(k * y)
        f = [np.array([c, y * c, s, y * s])]
        f.append(np.array([k * s, c + k * y * s, k * c, s + k * y * c]))
        f.append(np.array([k**2 * c, 2 * k * s + k**2 * y * c, k**2 * s, 2 * k * c + k**2 * y * s]))
        f.append(np.array([k**3 * s, 3 * k**2 * c + k**3 * y * s, k**3 * c, 3 * k**2 * s + k**3 * y * c]))
        return f

    def transform(k: float) -> float:
        foot, here, top = row(k, 0.0), row(k, y0), row(k, 1.0)
        M, load = np.zeros((8, 8)), np.zeros(8)
        M[0, :4], M[1, :4] = foot[0], foot[1]
        for i in range(4):
            M[2 + i, :4], M[2 + i, 4:] = -here[i], here[i]
        load[5] = 1.0
        M[6, 4:] = top[2] - NU * k**2 * top[0]
        M[7, 4:] = top[3] - (2.0 - NU) * k**2 * top[1]
        scale = np.abs(M).max(axis=0)
        return float(here[0] @ (np.linalg.solve(M / scale, load) / scale)[:4])

    node, weight = np.polynomial.legendre.leggauss(60)
    k = 6.0 * (node + 1.0)
    tail = 0.5 * 12.0 * transform(12.0)  # as k^-3
    return float(6.0 * weight @ [transform(float(v)) for v in k] + tail) / math.pi


def test_half_height_of_a_wide_wall():
    """Middle of the edge and of the span below it, by a transform along the wall."""
    assert endless_strip(1.0) == pytest.approx(0.16651, abs=5e-5)
    t = 0.3
    D = E * t**3 / (12.0 * (1.0 - NU**2))
    found = borne(wall(360.0, t, 60), [0.5, 0.5], [1.0, 8.0 / 12.0]).force
    exact = [endless_strip(1.0), endless_strip((8.0 / 12.0) ** 2)]
    assert_allclose(found, 0.05 * D / (60.0**2 * np.array(exact)), rtol=0.02)


def test_corner_against_half_height():
    """Of a wall twice as wide as high the corner bears half of the middle of the edge, and a fourteenth of the
    middle of its span at half height."""
    edge, half, corner = borne(wall(120.0, 0.3, 24), [0.5, 0.5, 0.0], [1.0, math.sqrt(72.0 / 144.0), 1.0]).force
    assert corner / edge == pytest.approx(0.2114 / 0.4195, rel=0.01)
    assert half / corner == pytest.approx(14.0, rel=0.02)


def test_removal_softens():
    """A wall that lost 40 % of its thickness bears 0.6^3 of what it bore."""
    whole, thinner = (borne(wall(60.0, 0.3, 6), [0.5, 0.0], [1.0, 1.0], x).force for x in (0.0, 0.4))
    assert_allclose(thinner, 0.6**3 * whole, rtol=2e-3)


def test_calibrated_plane():
    """Log-linear forces come back at any place between; the scatter of the repeats is the reserve."""
    rng = np.random.default_rng(3)
    place = np.vstack([[[0, 0], [1, 0], [0, 1], [1, 1]], rng.uniform(0.1, 0.9, (5, 2))])
    force = np.exp(3.0 - 1.2 * place[:, 0] - 2.0 * place[:, 1])
    made = Experiments(np.vstack([place, place]), np.concatenate([force * 1.02, force / 1.02]))
    s = math.sqrt(2.0) * math.log(1.02)
    assert scatter(made)[0] == pytest.approx(s, rel=1e-9)
    at = rng.uniform(0.0, 1.0, (50, 2))
    found = calibrated(made, at, 2.0)
    assert_allclose(found.force, np.exp(3.0 - 1.2 * at[:, 0] - 2.0 * at[:, 1] - 2.0 * s), rtol=1e-9)
    assert found.source == "calibrated"
    assert found.text.startswith("calibrated: 18 experiments at 9 places, scatter 2.8 %")
    assert not found.outside.any()


def test_scatter_without_repeats():
    """One place in the middle of a square, e times what its corners bear: predicted one too low."""
    made = Experiments([[0, 0], [2, 0], [0, 2], [2, 2], [1, 1]], [1.0, 1.0, 1.0, 1.0, math.e])
    assert scatter(made)[0] == pytest.approx(1.0)


def test_outside_takes_the_least():
    made = Experiments([[0, 0], [0, 0], [1, 0], [0, 1]], [50.0, 50.0, 20.0, 30.0])
    found = calibrated(made, [[5.0, 5.0], [0.0, 0.5]], 3.0)
    assert found.outside.tolist() == [True, False]
    assert_allclose(found.force, [20.0, math.sqrt(50.0 * 30.0)])


@pytest.mark.parametrize(
    ("place", "force", "text"),
    [
        ([[0, 0]], [5.0], r"experiments: 1 places: must be at least 3"),
        ([[0, 0], [1, 0], [0, 1]], [5.0, 0.0, 1.0], r"row 1: normal_force_n = 0: must be above 0"),
        ([[0, 0], [1, 0], [0, 1]], [5.0, 1.0], r"places \(3, 2\), forces \(2,\)"),
        ([[0, 0], [1, 1], [2, 2]], [5.0, 1.0, 2.0], "all places lie on a line"),
        ([[0, 0], [1, 0], [0, 1]], [5.0, 1.0, 2.0], "the scatter is unknown; repeat one"),
    ],
)
def test_refused(place, force, text):
    with pytest.raises(InputError, match=text):
        calibrated(Experiments(place, force), [[0.2, 0.2]], 2.0)


def test_refused_deflection():
    with pytest.raises(InputError, match=r"row 2: deflection_mm = 0: must be above 0"):
        from_deflections([[0, 0], [1, 0], [0, 1]], [1, 1, 1], [0.1, 0.1, 0.0], 0.05)
