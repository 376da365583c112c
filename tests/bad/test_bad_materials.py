"""Materials that must be refused, each with its exact message."""

from __future__ import annotations

import pytest

from chipload.cutting.material import material_named, material_names, need_directions, read_material
from chipload.errors import InputError

GOOD = {
    "name": '"mine"',
    "ktc_mpa": "700.0",
    "krc_mpa": "200.0",
    "kac_mpa": "50.0",
    "kte_n_mm": "10.0",
    "kre_n_mm": "8.0",
    "kae_n_mm": "1.0",
    "source": '"own dynamometer"',
}
NO_SOURCE = (
    "material.source is missing: a coefficient without a source is refused; state where it was published or measured"
)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"source": None}, NO_SOURCE),
        ({"source": '" "'}, NO_SOURCE),
        ({"kac_mpa": None}, "kac_mpa is missing: must be given, coefficients are never invented"),
        ({"name": None}, "name is missing: must be given, coefficients are never invented"),
        ({"ktc_mp": "700.0"}, "unknown key ktc_mp: the nearest known one is ktc_mpa"),
        ({"ktc_n_mm2": "700.0"}, "unknown key ktc_n_mm2: the nearest known one is kte_n_mm"),
        ({"sorce": '"x"'}, "unknown key sorce: the nearest known one is source"),
        ({"ktc_mpa": "7e8"}, "material.ktc_mpa = 7e+08: must be from 10 to 20000 MPa"),
        ({"ktc_mpa": "0.7"}, "material.ktc_mpa = 0.7: must be from 10 to 20000 MPa"),
        ({"ktc_mpa": "nan"}, "material.ktc_mpa = nan: must be from 10 to 20000 MPa"),
        ({"kte_n_mm": "-1.0"}, "material.kte_n_mm = -1: must be from 0 to 1000 N/mm"),
        ({"kre_n_mm": "inf"}, "material.kre_n_mm = inf: must be from -1000 to 1000 N/mm"),
        ({"ktc_mpa": '"700"'}, "ktc_mpa = '700': must be a number"),
        ({"ktc_mpa": "true"}, "ktc_mpa = True: must be a number"),
        ({"source": "7"}, "source = 7: must be a text"),
        ({"chip_min_mm": "0.1"}, "chip_max_mm is missing: give both chip_min_mm and chip_max_mm or neither"),
        (
            {"chip_min_mm": "0.1", "chip_max_mm": "0.05"},
            "material.chip_max_mm = 0.05: must be above chip_min_mm = 0.1, which must be at least 0",
        ),
        ({"spread": "7.0"}, "material.spread = 7: must be from 0 to below 1 (0.1 is 10 %)"),
    ],
)
def test_refused(tmp_path, change, message):
    path = tmp_path / "mine.toml"
    rows = {**GOOD, **change}
    path.write_text("".join(f"{key} = {value}\n" for key, value in rows.items() if value is not None))
    with pytest.raises(InputError) as err:
        read_material(path)
    assert str(err.value) == f"material {path}: {message}"


def test_rubbish(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_bytes(b"\xff\x00\x13")
    with pytest.raises(InputError, match=r"mine\.toml: not a TOML file: "):
        read_material(path)
    with pytest.raises(InputError) as err:
        read_material(tmp_path / "none.toml")
    assert str(err.value) == f"material {tmp_path / 'none.toml'}: cannot be read: No such file or directory"


def test_unknown_name():
    with pytest.raises(InputError) as err:
        material_named("al7057-t6")
    assert str(err.value) == (
        "material al7057-t6: not known: the nearest is al7075-t6 "
        f"(known: {', '.join(material_names())}), or give a file"
    )


@pytest.mark.parametrize("name", ["steel", "Steel", "ti6al4v", "1045", "inconel", "brass", "titanium"])
def test_another_metal_is_no_slip_of_the_pen(name):
    with pytest.raises(InputError) as err:
        material_named(name)
    hint = str(err.value).split(" (known: ")[0]
    assert "al6082" not in hint
    assert "al7075" not in hint
    assert "aluminium" not in hint


def test_a_part_of_the_name_is_enough():
    with pytest.raises(InputError) as err:
        material_named("steel")
    assert str(err.value).startswith(
        "material steel: not known: the nearest are group-1-steel, group-10-tool-steel, group-2"
    )


def test_what_has_no_direction_says_so():
    need_directions(material_named("al7075-t6"), "a thin wall")
    with pytest.raises(InputError) as err:
        need_directions(material_named("group-2-steel"), "a thin wall")
    assert str(err.value) == (
        "material group-2-steel: only its tangential force is known, a thin wall needs the radial and axial "
        "coefficients too: give a material with all six, or fit them (chipload fit)"
    )
