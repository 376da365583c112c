"""How deep the check looks: less than a blade is thick, by the thickness of a wedge in closed form."""

import pytest

from chipload.errors import InputError
from chipload.geometry.blade_thickness import thickness
from chipload.geometry.bspline import patch_through
from chipload.geometry.sections import Blade
from chipload.jobs.impeller.ray_depth import MOST, ray_depth


class Wedge:
    """60 mm long, 30 mm high; from 2 mm at one end to ``thin`` at the other."""

    def __init__(self, thin):
        def side(sign):
            grid = [[[x, sign * 0.5 * t, z] for z in (0.0, 30.0)] for x, t in ((0.0, 2.0), (60.0, thin))]
            return patch_through(grid, [0, 1], [0, 1])

        self.bodies = (Blade(side(1.0), side(-1.0)),)


@pytest.mark.parametrize("thin", [0.3, 0.55, 1.5])
def test_thickness_of_a_wedge(thin):
    """At the distance x from the thick end it is 2 + (thin - 2) x / 60 thick; the nearest point is across it."""
    wedge = Wedge(thin)
    assert thickness(wedge.bodies[0], 0.0) == pytest.approx(thin, rel=0.02)
    assert thickness(wedge.bodies[0], 0.2) == pytest.approx(2.0 + 0.8 * (thin - 2.0), rel=0.02)


def test_thickness_between_the_points_that_are_tried():
    """Two planes 0.2 mm apart, so high that points of a side are farther from each other than that."""
    wedge = Wedge(0.2)
    wedge.bodies = (Blade(*(patch_through([[[x, y, z] for z in (0.0, 400.0)] for x in (0.0, 30.0)], [0, 1], [0, 1])
                            for y in (0.1, -0.1))),)  # fmt: skip
    assert thickness(wedge.bodies[0], 0.013) == pytest.approx(0.2, rel=1e-6)


def test_a_ray_ends_before_the_cutter_on_the_other_side():
    assert ray_depth(Wedge(1.5), 0.0, 0.05) == MOST
    depth = ray_depth(Wedge(0.55), 0.0, 0.1)
    assert 0.12 <= depth <= 0.55 - 0.1
    assert depth == pytest.approx(0.4, abs=0.01)


def test_a_gouge_that_cannot_be_told_is_refused():
    with pytest.raises(InputError, match=r"gouge_mm = 0.15: the metal is 0.3 mm thick .*: must be at most 0.11 mm"):
        ray_depth(Wedge(0.3), 0.0, 0.15)
    # and what it says is right
    assert ray_depth(Wedge(0.3), 0.0, 0.11) > 0.11
