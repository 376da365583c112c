"""Shipped materials against the rows of the table they come from."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.cutting.force import forces_over_turn
from chipload.cutting.material import (
    Material,
    material_named,
    material_names,
    material_text,
    read_material,
    texts_beyond_range,
)
from chipload.engagement.tooth_engagement import engagement_of_arcs
from chipload.errors import InputError

GOOD = (
    'name = "mine"\nktc_mpa = 700\nkrc_mpa = 200.0\nkac_mpa = 50.0\nkte_n_mm = 10.0\nkre_n_mm = 8.0\nkae_n_mm = 1.0\n'
    'source = "own dynamometer"\n'
)

#: Ktc, Krc, Kac [MPa], Kte, Kre, Kae [N/mm] as printed in [Zhang2021] table 5
PRINTED = {
    "al6082-t6": ("189", (631.0, 99.0, 273.0, 13.0, 10.0, 2.8)),
    "al7075-t6": ("190", (767.01, 168.8, 222.0, 27.7, 26.6, 0.7)),
    "al7075-hss": ("156", (951.365, 262.597, 323.33, 11.115, 11.314, 1.105)),
    "al7075-carbide": ("47", (1319.41, 788.83, 48.75, 19.65, 26.77, 2.05)),
}


#: kc in MPa at chips of 0.02, 0.05 and 0.1 mm, of the printed kc1.1 and mc by hand
GROUPS = {
    "group-1-steel": (3070, 2533, 2189),
    "group-2-steel": (3547, 2899, 2489),
    "group-3-steel": (4283, 3438, 2911),
    "group-6-steel": (4539, 3643, 3085),
    "group-8-steel": (4411, 3540, 2998),
    "group-10-tool-steel": (6025, 4880, 4161),
    "group-13-stainless": (4264, 3517, 3041),
    "group-14-stainless": (4701, 3914, 3408),
    "group-15-grey-iron": (2515, 2094, 1823),
    "group-18-nodular-iron": (4037, 3123, 2572),
    "group-22-aluminium": (2127, 1692, 1423),
    "group-27-brass": (2013, 1572, 1303),
    "group-34-nickel": (8439, 6773, 5735),
    "group-37-titanium": (3184, 2555, 2164),
}


def test_every_shipped_material_says_how_sure_it_is():
    assert {n for n in material_names() if not n.startswith("group-") and "-from-" not in n} == set(PRINTED)
    assert set(GROUPS) <= set(material_names())
    for name in material_names():
        own = material_named(name)
        by_rule = own.tangential or "-from-" in name
        assert own.spread == 0.25 if not by_rule else own.spread in (0.3, 0.35)
        assert own.has_band
        assert own.tangential == name.startswith("group-")
        if own.tangential:
            assert own.chip == (0.05, 1.0)
            assert name.split("-")[1] in own.workpiece
            assert "VDI 3323" in own.source


@pytest.mark.parametrize("name", GROUPS)
def test_specific_cutting_force_of_a_group(name):
    own = material_named(name)
    mill = Cutter(10.0, 1, 0.0, 20.0, 30.0, 6e5)
    for h, kc in zip((0.02, 0.05, 0.1), GROUPS[name], strict=True):
        engagement = engagement_of_arcs([0.0], [math.pi], h, mill, 1.0)
        force, torque = forces_over_turn(engagement, mill, own, [math.pi / 2])
        assert torque[0, 0] / (5.0 * h) == pytest.approx(kc, abs=0.51 + 1e-6 * kc)
        assert np.linalg.norm(force[0, 0]) == pytest.approx(kc * h, rel=1e-3)


def test_a_spread_covers_the_second_copy_of_al7075_t6():
    own = material_named("al7075-t6")
    assert "796.1" in own.conditions
    for ours, other in ((own.Ktc, 796.1), (own.Kre, 30.8)):
        assert abs(other - ours) < own.spread * ours
    assert "doubtful" in material_named("al7075-carbide").conditions


def test_without_radial_and_axial_coefficients_only_the_tangential_force_is_known(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text('name = "mine"\nktc_mpa = 700\nkte_n_mm = 5.0\nsource = "spindle power"\n')
    own = read_material(path)
    assert own.tangential
    assert own.coefficients == (700.0, 0.0, 0.0, 5.0, 0.0, 0.0)
    assert not own.has_band
    path.write_text(GOOD)
    assert not read_material(path).tangential


@pytest.mark.parametrize("name", PRINTED)
def test_shipped_as_printed(name):
    row, numbers = PRINTED[name]
    material = material_named(name)
    assert material.name == name
    assert material.coefficients == numbers
    assert f"reference {row} " in material.source
    assert "10.1186/s10033-021-00536-9" in material.source
    assert material.conditions
    assert material.chip is None
    assert material.spread == 0.25


def test_reads_what_is_optional(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(
        'name = "mine"\nktc_mpa = 700\nkrc_mpa = 200.0\nkac_mpa = -5.0\nkte_n_mm = 10.0\nkre_n_mm = 8.0\n'
        'kae_n_mm = 0.0\nsource = "own dynamometer"\nchip_min_mm = 0.01\nchip_max_mm = 0.2\nspread = 0.07\n'
    )
    material = read_material(path)
    assert material.coefficients == (700.0, 200.0, -5.0, 10.0, 8.0, 0.0)
    assert material.chip == (0.01, 0.2)
    assert material.spread == 0.07
    assert material.conditions == ""


def test_reads_a_size_effect_a_cutter_and_ranges(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(
        'name = "mine"\nktc_mpa = 700\nkrc_mpa = 200.0\nkac_mpa = -5.0\nkte_n_mm = 0.0\nkre_n_mm = 0.0\n'
        'kae_n_mm = 0.0\nsource = "own dynamometer"\ncutter = "d 10, 4 teeth, 30 deg"\nexponent_t = 0.25\n'
        "exponent_r = 0.4\nspeed_min_m_min = 60\nspeed_max_m_min = 300.0\n"
    )
    material = read_material(path)
    assert material.exponents == (0.25, 0.4, 0.0)
    assert material.law == (700.0, 200.0, -5.0, 0.0, 0.0, 0.0, 0.25, 0.4, 0.0)
    assert material.cutter == "d 10, 4 teeth, 30 deg"
    assert material.speed == (1000.0, 5000.0)
    assert texts_beyond_range(material, 9.0, 1000.0) == ()
    assert texts_beyond_range(material, 9.0, 6000.0) == (
        "material mine: a speed of 360 m/min: its coefficients were measured from 60 to 300 m/min",
    )


def test_reads_a_covariance(tmp_path):
    rows = np.diag([900.0, 100.0, 25.0, 4.0, 1.0, 0.25]).tolist()
    rows[0][1] = rows[1][0] = 30.0
    path = tmp_path / "mine.toml"
    path.write_text(GOOD + f"covariance = {rows}\n")
    material = read_material(path)
    np.testing.assert_array_equal(material.variances, rows)
    assert hash(material) == hash(read_material(path))


def test_a_spread_is_a_covariance_with_correlated_errors():
    material = Material("mine", 700.0, 200.0, 50.0, 10.0, 8.0, 1.0, source="own", spread=0.1)
    found = np.array(material.variances)
    np.testing.assert_allclose(np.diagonal(found), [4900.0, 400.0, 25.0, 1.0, 0.64, 0.01])
    deviation = np.sqrt(np.diagonal(found))
    np.testing.assert_allclose((found / np.outer(deviation, deviation))[~np.eye(6, dtype=bool)], 0.5)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("exponent_t = 1.0", "material.exponent_t = 1: must be from 0 (no size effect) to below 1"),
        ("exponent_a = -0.2", "material.exponent_a = -0.2: must be from 0 (no size effect) to below 1"),
        (
            "speed_min_m_min = 60.0",
            "speed_max_m_min is missing: give both speed_min_m_min and speed_max_m_min or neither",
        ),
        (
            "speed_min_m_min = 60.0\nspeed_max_m_min = 30.0",
            "material.speed_max_m_min = 30: must be above speed_min_m_min = 60, which must be at least 0",
        ),
        ("cutter = 7", "cutter = 7: must be a text"),
        ("covariance = 3.0", "covariance: must be 6 rows of 6 numbers"),
        ("covariance = [[1.0]]", "material.covariance of shape (1, 1): must be 6 rows of 6 finite numbers"),
        (
            f"covariance = {np.diag([1.0, 1.0, 1.0, 1.0, 1.0, -1.0]).tolist()}",
            "material.covariance: must be symmetric and without negative variances",
        ),
        (
            f"covariance = {np.triu(np.ones((6, 6))).tolist()}",
            "material.covariance: must be symmetric and without negative variances",
        ),
        (
            f"spread = 0.1\ncovariance = {np.eye(6).tolist()}",
            "material.spread and material.covariance: give one of them: both state the same",
        ),
    ],
)
def test_refused(tmp_path, line, message):
    path = tmp_path / "mine.toml"
    path.write_text(GOOD + line + "\n")
    with pytest.raises(InputError) as err:
        read_material(path)
    assert str(err.value) == f"material {path}: {message}"


def test_a_material_that_is_written_is_read_as_it_was(tmp_path):
    """With the ranges of chips and speeds that its coefficients hold in."""
    text = (
        GOOD + "chip_min_mm = 0.02\nchip_max_mm = 0.3\nspeed_min_m_min = 60.0\nspeed_max_m_min = 240.0\nspread = 0.2\n"
    )
    (tmp_path / "a.toml").write_text(text)
    first = read_material(tmp_path / "a.toml")
    assert first.speed == pytest.approx((1000.0, 4000.0))
    (tmp_path / "b.toml").write_text(material_text(first))
    assert read_material(tmp_path / "b.toml") == first


def test_a_force_that_pulls_the_cutter_in_is_refused(tmp_path):
    text = (
        'name = "mine"\nktc_mpa = 700\nkrc_mpa = -200.0\nkac_mpa = 50.0\nkte_n_mm = 10.0\nkre_n_mm = 8.0\n'
        'kae_n_mm = 1.0\nsource = "measured"\n'
    )
    (tmp_path / "m.toml").write_text(text)
    with pytest.raises(InputError, match=r"material.krc_mpa = -200: must be from 0 to 20000 MPa"):
        read_material(tmp_path / "m.toml")
