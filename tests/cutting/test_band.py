"""Bands of the force against coefficients drawn at random."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.cutting.band import band_over_turn, mean_band, peak_band
from chipload.cutting.force import forces_over_turn, in_work, mean_forces
from chipload.cutting.material import Material, material_named
from chipload.engagement.tooth_engagement import engagement_of_arcs
from chipload.engagement.tooth_surfaces import chips_of_teeth
from chipload.errors import InputError

MILL = Cutter(10.0, 3, math.radians(30.0), 25.0, 35.0, 6e5)
BITES = engagement_of_arcs([0.3, 2.4], [2.0, math.pi], [0.05, 0.08], MILL, 6.0)
THETA = np.array([0.8, 1.7])
FRAME = np.linalg.qr(np.random.default_rng(3).normal(size=(2, 3, 3)))[0]


def fitted(exponents=(0.0, 0.0, 0.0)):
    """Coefficients whose errors hang together."""
    rng = np.random.default_rng(8)
    root = rng.normal(size=(6, 6)) * np.array([40.0, 20.0, 15.0, 1.0, 0.8, 0.3])[:, None]
    return Material(
        "fit", 900.0, 300.0, 100.0, 20.0, 15.0, 1.0, source="made up", covariance=root @ root.T, exponents=exponents
    )


@pytest.mark.parametrize(
    "material", [fitted(), fitted((0.2, 0.3, 0.1)), replace(material_named("al7075-t6"), spread=0.08)]
)
def test_against_coefficients_drawn_at_random(material):
    if material.covariance is None:
        deviation = 0.08 * np.array(material.coefficients)
        c = np.outer(deviation, deviation) * (0.5 + 0.5 * np.eye(6))
    else:
        c = np.array(material.covariance)
    draws = np.random.default_rng(5).multivariate_normal(material.coefficients, c, 6000)
    mean, turn = [], []
    for k in draws:
        names = dict(zip(("Ktc", "Krc", "Kac", "Kte", "Kre", "Kae"), k, strict=True))
        one = replace(material, **{**names, "Kte": max(names["Kte"], 0.0)})
        force, torque = mean_forces(BITES, MILL, one)
        mean.append(np.column_stack([in_work(force, FRAME), torque]))
        force, torque = forces_over_turn(BITES, MILL, one, THETA)
        turn.append(np.concatenate([in_work(force, FRAME), torque[..., None]], axis=-1))
    force, torque = mean_band(BITES, MILL, material, FRAME)
    np.testing.assert_allclose(np.column_stack([force, torque]), np.std(mean, axis=0), rtol=0.04)
    force, torque = band_over_turn(BITES, MILL, material, THETA, FRAME)
    np.testing.assert_allclose(np.concatenate([force, torque[..., None]], -1), np.std(turn, axis=0), rtol=0.04)


def test_errors_that_hang_together_add_up():
    """All six coefficients wrong by the same factor: the load is, too; each by itself errs less."""
    al = material_named("al7075-t6")
    k = np.array(al.coefficients)
    together = replace(al, spread=None, covariance=0.01 * np.outer(k, k))
    mean, torque = mean_forces(BITES, MILL, al)
    band, torque_band = mean_band(BITES, MILL, together)
    np.testing.assert_allclose(band, 0.1 * np.abs(mean), rtol=1e-9)
    np.testing.assert_allclose(torque_band, 0.1 * torque, rtol=1e-9)
    alone, torque_alone = mean_band(BITES, MILL, replace(al, spread=0.1))
    assert (torque_alone < torque_band).all()
    assert alone.shape == (2, 3)


def test_the_band_of_a_rotation_without_load_is_nothing():
    force, torque = band_over_turn(
        BITES, replace(MILL, flutes=1), replace(material_named("al7075-t6"), spread=0.1), [5.5]
    )
    np.testing.assert_array_equal(force[0], 0.0)
    assert torque[0, 0] == 0.0


def test_refuses_a_material_that_does_not_say():
    with pytest.raises(InputError) as err:
        mean_band(BITES, MILL, replace(material_named("al7075-t6"), spread=None))
    assert str(err.value) == (
        "material al7075-t6: neither spread nor covariance is known, so the uncertainty of its coefficients is "
        "unknown: give spread, or fit them"
    )


@pytest.mark.parametrize("runout", [(0.0, 0.0), (0.008, 0.7)])
def test_the_band_of_the_greatest_force_is_that_of_materials_drawn_at_random(runout):
    """2000 materials, coefficients wrong by 2 %, correlation 0.5: the scatter of |F| and of the torque at the peak."""
    mill = replace(MILL, runout=runout)
    engagement = chips_of_teeth(BITES, mill)
    al = replace(material_named("al7075-t6"), spread=0.02)
    theta = np.linspace(0.0, math.tau, 181)
    force, torque = forces_over_turn(engagement, mill, al, theta)
    at = theta[np.linalg.norm(force, axis=2).argmax(axis=1)], theta[torque.argmax(axis=1)]
    found = peak_band(engagement, mill, al, *at)
    rng = np.random.default_rng(7)
    sizes, torques = [], []
    for z in rng.standard_normal((2000, 7)):
        factors = 1.0 + 0.02 * math.sqrt(0.5) * (z[:1] + z[1:])
        ktc, krc, kac, kte, kre, kae = factors * al.coefficients
        drawn = replace(al, Ktc=ktc, Krc=krc, Kac=kac, Kte=kte, Kre=kre, Kae=kae)
        f, m = (forces_over_turn(engagement, mill, drawn, np.array(x)) for x in at)
        k = range(len(engagement))
        sizes.append(np.linalg.norm(f[0][k, k], axis=1))
        torques.append(m[1][k, k])
    np.testing.assert_allclose(found[0], np.std(sizes, axis=0), rtol=0.06)
    np.testing.assert_allclose(found[1], np.std(torques, axis=0), rtol=0.06)


def test_coefficients_that_err_together_scale_the_greatest_force():
    al = material_named("al7075-t6")
    k = np.array(al.coefficients)
    together = replace(al, spread=None, covariance=0.0625 * np.outer(k, k))
    force, torque = forces_over_turn(BITES, MILL, al, [0.9, 0.9])
    found = peak_band(BITES, MILL, together, [0.9] * len(BITES), [0.9] * len(BITES))
    np.testing.assert_allclose(found[0], 0.25 * np.linalg.norm(force[:, 0], axis=1), rtol=1e-9)
    np.testing.assert_allclose(found[1], 0.25 * torque[:, 0], rtol=1e-9)
