"""Messages state numbers as a person writes them: no format of a message can give 2.4e+03 mm/min or 1.2e+06 points."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from chipload.number_text import number_text

SOURCE = Path(__file__).parents[1] / "src" / "chipload"
#: units of quantities that are often above 1000
LARGE = (
    r"(?:mm/min|rpm|points|steps|mm2|mm3|columns|cells|motions|rows|s|min|µm|N m|N/mm|N|MPa/N|MPa|%|Hz|m/min|times)"
    r"(?![\w/])"
)
FORMAT = re.compile(r"\{[^{}]*:\.[1-4]g\} " + LARGE)


def test_large_quantities_are_not_written_with_an_exponent() -> None:
    wrong = [
        f"{path.relative_to(SOURCE)}: {found[0]}"
        for path in sorted(SOURCE.rglob("*.py"))
        for line in path.read_text().splitlines()
        if "hovertemplate" not in line
        for found in [FORMAT.search(line)]
        if found
    ]
    assert not wrong, "write {number_text(value)} of chipload.number_text"


@pytest.mark.parametrize("digits", [2, 3, 4])
def test_numbers_up_to_a_million_read_back(digits: int) -> None:
    """What is written is a plain decimal number within half a unit of its last digit, of the units place at most."""
    for value in (0.00123456, 0.999999, 1.0, 9.9996, 2399.6, 2400.4, 12345.678, 99999.6, 1234567.0):
        for signed in (value, -value):
            text = number_text(signed, digits)
            assert re.fullmatch(r"-?\d+(\.\d+)?", text), text
            assert abs(float(text) - signed) <= max(0.5 * 10.0 ** (1 - digits) * value, 0.0) or (
                value >= 10.0 ** (digits - 1) and abs(float(text) - signed) <= 0.5
            )
