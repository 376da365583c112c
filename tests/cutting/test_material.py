"""Shipped materials against the rows of the table they come from."""

from __future__ import annotations

import numpy as np
import pytest

from chipload.cutting.material import Material, beyond, material_named, material_names, read_material
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


@pytest.mark.parametrize("name", material_names())
def test_shipped_as_printed(name):
    row, numbers = PRINTED[name]
    material = material_named(name)
    assert material.name == name
    assert material.coefficients == numbers
    assert f"reference {row} " in material.source
    assert "10.1186/s10033-021-00536-9" in material.source
    assert material.conditions
    assert material.chip is None
    assert material.spread is None


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
    assert beyond(material, 9.0, 1000.0) == ()
    assert beyond(material, 9.0, 6000.0) == (
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


def test_a_spread_is_a_diagonal_covariance():
    material = Material("mine", 700.0, 200.0, 50.0, 10.0, 8.0, 1.0, source="own", spread=0.1)
    np.testing.assert_allclose(material.variances, np.diag([4900.0, 400.0, 25.0, 1.0, 0.64, 0.01]))


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
            "material.spread and material.covariance: give one of them, they say the same thing",
        ),
    ],
)
def test_refused(tmp_path, line, message):
    path = tmp_path / "mine.toml"
    path.write_text(GOOD + line + "\n")
    with pytest.raises(InputError) as err:
        read_material(path)
    assert str(err.value) == f"material {path}: {message}"
