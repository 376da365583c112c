"""Which cutter would reach what none of a catalogue reaches: against a slot's width in closed form."""

import numpy as np
import pytest

from chipload.cutter.catalogue import Catalogue, CatalogueCutter
from chipload.planning.impeller.answer import largest_cutters
from chipload.planning.impeller.scene import Scene
from chipload.planning.impeller.unreached import with_fits


def slot(width):
    """Two walls x = 0 and x = width, the axis of the pallet along them."""
    y, z = (x.ravel() for x in np.meshgrid(np.linspace(-40, 40, 81), np.linspace(-40, 40, 81), indexing="ij"))
    wall = np.stack([np.full(len(y), width), y, z], axis=-1)
    contact, normal = np.array([[0.0, 0.0, 0.0], [0.0, 1.0, 1.0]]), np.tile([1.0, 0.0, 0.0], (2, 1))
    return Scene(contact, normal, np.zeros((2, 3, 3)), np.zeros(2, dtype=int), wall, np.ones(len(y), dtype=int), 1.0)


@pytest.mark.parametrize("width", [3.0, 6.1, 9.0])
def test_what_would_fit_a_slot(width):
    scene = slot(width)
    sizes = Catalogue("large", (CatalogueCutter(12.0, 1.0), CatalogueCutter(14.0, 2.0)))
    answer = largest_cutters(scene, sizes, [0.0], 0.0)
    assert len(answer.unreachable) == 2
    found = with_fits(scene, answer)
    for missed in found:
        # a corner radius of 2 is no cutter of the catalogue below D 4; of both the larger one is named
        assert missed.fits == pytest.approx(width, abs=2e-3)
    # the search of the catalogue itself ends at its smallest cutter and may name less
    assert all(not a.fits > b.fits + 1e-9 for a, b in zip(answer.unreachable, found, strict=True))
