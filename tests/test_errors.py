import math

import pytest

from chipload.errors import Finding, InputError, Severity, group_findings, worst_severity


def test_a_finding_is_a_note_without_place_and_row_unless_stated():
    finding = Finding("nc-x", 3, "three positional arguments")
    assert (finding.severity, finding.place, finding.row) == (Severity.NOTE, None, None)
    assert str(finding) == "line 3: three positional arguments (nc-x)"


def test_severities_are_ordered_from_note_to_exceeds():
    assert Severity.NOTE < Severity.UNPROVEN < Severity.EXCEEDS
    found = [Finding("a", 0, "a", Severity.EXCEEDS), Finding("b", 0, "b"), Finding("c", 0, "c", Severity.UNPROVEN)]
    assert worst_severity(found) is Severity.EXCEEDS
    assert worst_severity(found[1:]) is Severity.UNPROVEN
    assert worst_severity([]) is Severity.NOTE


@pytest.mark.parametrize(
    ("place", "row", "message"),
    [
        ((0.0, math.nan, 1.0), None, "place = (0.0, nan, 1.0): must be three finite numbers"),
        ((0.0, 1.0), None, "place = (0.0, 1.0): must be three finite numbers"),
        (None, -1, "row = -1: must be at least 0"),
    ],
)
def test_a_wrong_place_or_row_is_refused(place, row, message):
    with pytest.raises(InputError) as caught:
        Finding("nc-x", 0, "text", Severity.NOTE, place, row)
    assert message in str(caught.value)


def test_what_is_found_in_many_lines_is_told_once_with_its_lines():
    coolant = [Finding("nc-coolant", n, "M8: left out") for n in (9, 30, 41, 52, 52, 63)]
    other = [Finding("nc-coolant", 10, "M9: left out"), Finding("nc-coolant", 9, "M8: left out", Severity.UNPROVEN)]
    found = group_findings([*coolant, *other])
    assert [text for _, text in found] == [
        "lines 9, 30, 41 and 2 more: M8: left out (nc-coolant)",
        "line 10: M9: left out (nc-coolant)",
        "line 9: M8: left out (nc-coolant)",
    ]
    assert [first for first, _ in found] == [coolant[0], *other]
    assert group_findings([Finding("a", 1, "x"), Finding("a", 2, "x")])[0][1] == "lines 1, 2: x (a)"
    assert group_findings([Finding("a", 0, "x"), Finding("a", 0, "x")])[0][1] == "x (a)"
