"""The table of columns: each name once, its unit that of the name's ending."""

from __future__ import annotations

import math

import pytest

from chipload.result import COLUMNS, Column, column_of, error_of
from chipload.result.columns import BOUNDED, _by_name, unit_of

#: units by the ending of a name, written here a second time on purpose
ENDINGS = {
    "_mm_min": "mm/min", "_mm3": "mm\u00b3", "_mm": "mm", "_um": "\u00b5m", "_deg": "deg", "_s": "s", "_n": "N",
    "_nm": "N m", "_w": "W", "_j": "J", "_mpa": "MPa", "_rpm": "1/min", "_percent": "%", "_hz": "Hz",
}  # fmt: skip


def expected_unit(name: str) -> str:
    """Unit by the longest ending that fits."""
    fits = sorted((e for e in ENDINGS if name.endswith(e)), key=len)
    return ENDINGS[fits[-1]] if fits else ""


@pytest.mark.parametrize("name", sorted(COLUMNS))
def test_the_unit_fits_the_ending_of_the_name(name):
    column = COLUMNS[name]
    assert column.name == name
    assert column.unit == expected_unit(name) == unit_of(name)
    assert column.label
    assert column.meaning


def test_no_two_columns_have_one_label_and_unit():
    shared = {}
    for c in COLUMNS.values():
        shared.setdefault(c.title, []).append(c.name)
    assert [names for names in shared.values() if len(names) > 1] == []


def test_every_column_declares_where_its_error_comes_from():
    """Exact and why, or like other columns, which end at columns whose error a calculation states; never both."""
    for column in COLUMNS.values():
        source = column.error
        assert not (source.exact and source.like), column.name
        assert set(source.like) <= set(COLUMNS), column.name
        stated = dict.fromkeys(source.like, 0.02)
        expected = 0.0 if source.exact else 0.02 if source.like else math.inf
        assert error_of(column.name, stated) == expected, column.name
        assert error_of(column.name, {}) == (0.0 if source.exact else math.inf), column.name
        assert error_of(column.name, {column.name: 0.3}) == 0.3, column.name


@pytest.mark.parametrize("name", ["feed_mm_min", "spindle_rpm", "line", "x_mm", "s_mm", "override", "unreached_points"])
def test_what_is_commanded_or_counted_is_exact(name):
    assert COLUMNS[name].error.exact


@pytest.mark.parametrize(
    "name", ["force_n", "torque_nm", "chip_max_mm", "engagement_deg", "gouge_mm", "form_error_um", "stress_mpa", "t_s"]
)
def test_what_a_calculation_finds_is_not_exact(name):
    assert not COLUMNS[name].error.exact


def test_a_name_that_stands_twice_is_refused():
    with pytest.raises(ValueError, match="column a_mm: appears twice"):
        _by_name([Column("a_mm", "mm", "a", "a"), Column("a_mm", "mm", "b", "b")])


def test_limits_of_another_name_bound_a_column_of_the_same_unit():
    for limit, (name, label) in BOUNDED.items():
        column = column_of(limit)
        assert (column.name, column.label, column.unit) == (name, label, expected_unit(limit))
