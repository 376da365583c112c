"""Shipped materials against the rows of the table they come from."""

from __future__ import annotations

import pytest

from chipload.cutting.material import material_named, material_names, read_material

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
