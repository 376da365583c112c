"""The fit of coefficients: forces of straight teeth in closed form, made here, give back what made them."""

from __future__ import annotations

import math

import numpy as np
import pytest

import chipload
from api.mechanics.steady_cuts import engagement, mill
from chipload.errors import InputError

WANT = (1000.0, 300.0, 200.0, 10.0, 5.0, 2.0)
RPM, RATE = 3000.0, 180_000.0


def cut(fz, teeth=3, turns=2):
    """A slot at a feed so small that h = f sin(phi); straight teeth, ap 2."""
    Ktc, Krc, Kac, Kte, Kre, Kae = WANT
    theta = np.arange(int(turns * RATE * 60.0 / RPM)) * math.tau * RPM / 60.0 / RATE + 0.003
    force = np.zeros((len(theta), 3))
    for j in range(teeth):
        phi = (theta - math.tau * j / teeth) % math.tau
        ft, fr, fa = ((k * fz * np.sin(phi) + e) * 2.0 for k, e in ((Ktc, Kte), (Krc, Kre), (Kac, Kae)))
        each = [-ft * np.cos(phi) - fr * np.sin(phi), ft * np.sin(phi) - fr * np.cos(phi), -fa]
        force += np.where((phi < math.pi)[:, None], np.transpose(each), 0.0)
    return chipload.measured_cut(
        f"fz {fz}", force, rate_hz=RATE, feed_mm_min=fz * teeth * RPM, speed_rpm=RPM,
        engagement=engagement(flutes=teeth),
    )  # fmt: skip


def test_mean_forces_give_the_coefficients_back():
    found = chipload.fit([cut(fz) for fz in (0.005, 0.01, 0.02)], mill(flutes=3))
    assert found.coefficients.values == pytest.approx(WANT, rel=1e-2)
    assert (found.coefficients.interval[:, 0] <= found.coefficients.values).all()


def test_one_cut_gives_them_by_every_sample():
    found = chipload.fit([cut(0.02)], mill(flutes=3), method="instantaneous", band_hz=900.0, runout=False)
    assert found.coefficients.values[[0, 1, 3, 4]] == pytest.approx(np.array(WANT)[[0, 1, 3, 4]], rel=3e-2)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"cuts": []}, "fit: no cut to fit: name at least one measurement with use = fit"),
        ({"cuts": [3.0]}, "cuts[0]: float: give what measured_cut returns"),
        ({"method": "median"}, "method = 'median': must be average or instantaneous"),
        ({"band_hz": 100.0}, "band_hz: only the method instantaneous uses it: leave it out"),
        ({"method": "instantaneous"}, "band_hz: missing or not above 0: the method instantaneous requires it"),
        (
            {"method": "instantaneous", "band_hz": 900.0, "ringing_hz": [1.0]},
            "ringing_hz: 1 values: must be three, None where the dynamometer is rigid",
        ),
    ],
)
def test_what_cannot_be_fitted_is_refused(values, message):
    with pytest.raises(InputError) as err:
        chipload.fit(**{"cuts": [cut(0.02)], "cutter": mill(flutes=3), **values})
    assert str(err.value) == message
