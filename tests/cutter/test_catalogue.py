"""Catalogues of cutters."""

import pytest

from chipload.cutter.catalogue import Catalogue, CatalogueCutter, catalogue_named, read_catalogue
from chipload.errors import InputError


def test_the_grid_of_the_source():
    found = catalogue_named("wu2019")
    assert [c.diameter for c in found.family(2.0)] == list(range(10, 81, 2))
    assert [c.diameter for c in found.family(1.5)] == [14.0]


def test_read(tmp_path):
    path = tmp_path / "own.toml"
    path.write_text(
        'name = "own"\ncutter = [{diameter_mm = 12.0, corner_radius_mm = 1.0, cutting_length_mm = 20.0, '
        "neck_diameter_mm = 11.0, neck_length_mm = 45.0, reach_mm = 60.0, holder_diameter_mm = 40.0}]\n"
    )
    (one,) = read_catalogue(path).cutters
    assert one.rho == 5.0
    # cutting part, neck and shank with 0.5 mm round them, holder
    assert one.stages(0.5).tolist() == [[0.0, 6.0], [19.0, 6.0], [44.0, 6.5], [59.0, 20.5]]


@pytest.mark.parametrize(
    ("row", "text"),
    [
        ("diameter_mm = 10.0", "cutter 1: corner_radius_mm is missing"),
        ("diameter_mm = 10.0, corner_radius_mm = 6.0", r"corner_radius_mm = 6: must be from 0 to diameter_mm / 2 = 5"),
        (
            "diameter_mm = 10.0, corner_radius_mm = 1.0, reach = 3.0",
            "reach: unknown key: the nearest known one is reach_mm",
        ),
        ("diameter_mm = 'x', corner_radius_mm = 1.0", "diameter_mm = 'x': must be a finite number"),
        (
            "diameter_mm = 10.0, corner_radius_mm = 1.0, reach_mm = 30.0",
            "holder_diameter_mm missing: give it with reach_mm",
        ),
        (
            "diameter_mm = 10.0, corner_radius_mm = 1.0, cutting_length_mm = 20.0, reach_mm = 15.0, "
            "holder_diameter_mm = 30.0",
            "reach_mm = 15: must be at least cutting_length_mm = 20",
        ),
    ],
)
def test_refused(tmp_path, row, text):
    path = tmp_path / "bad.toml"
    path.write_text(f'name = "bad"\ncutter = [{{{row}}}]\n')
    with pytest.raises(InputError, match=text):
        read_catalogue(path)


def test_refused_catalogues():
    with pytest.raises(InputError, match="no cutter"):
        Catalogue("none", ())
    with pytest.raises(InputError, match="D 10 r 1 appears twice"):
        Catalogue("twice", (CatalogueCutter(10.0, 1.0), CatalogueCutter(10.0, 1.0)))
    with pytest.raises(InputError, match="catalogue other: not known: the nearest is wu2019"):
        catalogue_named("other")
