"""Surfaces of an impeller: areas by closed forms, floors between their walls."""

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import dblquad

from chipload import examples
from chipload.errors import InputError
from chipload.jobs import load_job
from chipload.jobs.impeller.part import read_part
from chipload.planning.impeller.parametric import ImpellerShape, impeller_of
from chipload.planning.impeller.surfaces import ContactSampling, hub_range, surface_of

HOW = ContactSampling((0.1, 0.9), (0.2, 0.95), (60, 40), 4.0, 2.0)


@pytest.fixture(scope="module")
def hecc():
    return read_part(load_job(Path(examples.__file__).parent / "hecc" / "job.toml").job).impeller


def test_the_area_of_a_side():
    impeller = impeller_of(ImpellerShape())
    patch = impeller.blade.plus

    def element(v, u):
        return float(np.linalg.norm(np.cross(patch.at(u, v, 1, 0), patch.at(u, v, 0, 1))))

    exact, _ = dblquad(element, 0.1, 0.9, 0.2, 0.95, epsabs=1e-4, epsrel=1e-6)
    found = surface_of(impeller, "blade", "plus", HOW)
    assert found.area.sum() == pytest.approx(exact, rel=2e-4)
    assert found.shape == (60, 40)


def test_the_area_of_a_floor():
    shape = ImpellerShape()
    found = surface_of(
        impeller_of(shape), "blade", "floor", ContactSampling((0.0, 1.0), (0.0, 1.0), (200, 80), 4.0, 2.0)
    )
    # a quarter of an ellipse turned about z, less the feet of the blades, t wide round the axis
    phi = np.linspace(0.0, 0.5 * math.pi, 20001)
    a, b = shape.outer_radius - shape.hub_radius, shape.height
    r = shape.outer_radius - a * np.cos(phi)
    width = 2.0 * math.pi * r / shape.blades - shape.thickness
    exact = np.trapezoid(width * np.hypot(a * np.sin(phi), b * np.cos(phi)), phi)
    assert found.area.sum() == pytest.approx(exact, rel=2e-4)
    r = np.hypot(found.scene.contact[:, 0], found.scene.contact[:, 1]).reshape(found.shape)
    assert found.up.reshape(found.shape)[:, -1] == pytest.approx(
        2.0 * math.pi * r[:, 0] / shape.blades - shape.thickness, rel=1e-3
    )


@pytest.mark.parametrize("body", [0, 1])
def test_a_floor_lies_between_its_walls(hecc, body):
    low, high = hub_range(hecc, 0.0)
    # not at the edges themselves, where both sides of a blade meet
    s = low + (high - low) * np.linspace(0.02, 0.98, 30)
    theta = hecc.across(body, s, np.linspace(0.0, 1.0, 9))
    width = theta[:, -1] - theta[:, 0]
    # two channels a pitch: each about half of it less the blades, where the splitter is and ahead of it
    assert (width > 0.25 * hecc.pitch).all()
    assert (width < 0.75 * hecc.pitch).all()
    both = width + np.diff(hecc.across(1 - body, s, [0.0, 1.0]), axis=1)[:, 0]
    assert (both < hecc.pitch).all()
    assert (both > 0.6 * hecc.pitch).all()
    # counted the other way round the channel is the same
    back = hecc.across(body + 1, s, [0.0, 1.0], -1)
    assert np.abs(np.exp(1j * back[:, ::-1]) - np.exp(1j * theta[:, [0, -1]])).max() < 1e-12


def test_check_points_of_the_floor_leave_no_gap(hecc):
    scene = surface_of(hecc, "blade", "plus", ContactSampling((0.1, 0.9), (0.2, 0.9), (4, 4), 6.0, 2.0)).scene
    floor = scene.check[scene.check_surface == 2]
    low, high = hub_range(hecc, 0.0)
    own, far = hecc.across(0, np.linspace(low, high, 12), [0.02, 0.98]).T
    for share in np.linspace(0.0, 1.0, 7):
        at = hecc.hub.at(np.linspace(low, high, 12), own + share * (far - own))
        gap = np.linalg.norm(at[:, None] - floor[None], axis=2).min(axis=1)
        assert gap.max() < 6.0 / math.sqrt(2.0) + 0.5


def test_what_does_not_exist_is_refused(hecc):
    with pytest.raises(InputError, match="surface blade shroud: must be blade or splitter and plus, minus, floor"):
        surface_of(hecc, "blade", "shroud", HOW)
    with pytest.raises(InputError, match="no splitter: leave it out"):
        surface_of(impeller_of(ImpellerShape()), "splitter", "plus", HOW)
