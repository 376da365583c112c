"""CL data of NX: TLDATA, MSYS in each operation, END-OF-PATH instead of FINI; lengths worked out by hand."""

from __future__ import annotations

import math

import pytest

from chipload.errors import InputError, Severity
from chipload.program.apt.cutters import read_cutters
from chipload.program.apt.reader import read_apt
from chipload.program.motions import lengths

MSYS = "MSYS/0.0000,0.0000,0.0000,1.0000000,0.0000000,0.0000000,0.0000000,1.0000000,0.0000000"
PATH = """TOOL PATH/CAVITY_MILL,TOOL,EM{tool}
TLDATA/MILL,{diameter},1.0000,75.0000,0.0000,0.0000
{msys}
$$ centerline data
PAINT/PATH
LOAD/TOOL,{tool}
SPINDL/RPM,6000,CLW
RAPID
GOTO/-20.0000,0.0000,3.0000,0.0000000,0.0000000,1.0000000
FEDRAT/MMPM,250.0000
GOTO/-20.0000,0.0000,-2.0000
FEDRAT/900.0000
GOTO/40.0000,0.0000,-2.0000
CIRCLE/40.0000,10.0000,-2.0000,0.0000000,0.0000000,1.0000000,10.0000,0.0600,0.5000,12.0000,1.0000
GOTO/50.0000,10.0000,-2.0000
RAPID
GOTO/50.0000,10.0000,3.0000
PAINT/TOOL,NOMORE
END-OF-PATH
"""
FIRST = PATH.format(tool=3, diameter="12.0000", msys=MSYS)
SECOND = PATH.format(tool=4, diameter="8.0000", msys=MSYS)
OWN = 5.0 + 60.0 + 5.0 * math.pi + 5.0


def unproven(text: str) -> list[str]:
    return [f.code for f in read_apt(text, units="mm")[1] if f.severity is Severity.UNPROVEN]


def test_two_operations_are_read_whole() -> None:
    program, _ = read_apt(FIRST + SECOND)
    assert unproven(FIRST + SECOND) == []
    assert sorted(set(program.tool.tolist())) == [3, 4]
    assert float(lengths(program).sum()) == pytest.approx(2.0 * OWN + math.hypot(70.0, 10.0))


def test_a_text_that_ends_within_an_operation_may_have_been_cut_off() -> None:
    assert unproven(FIRST.removesuffix("END-OF-PATH\n")) == ["apt-end"]
    assert unproven(FIRST + SECOND[: SECOND.index("CIRCLE")]) == ["apt-end"]
    assert unproven(FIRST + "$$ end of file\n") == []


def test_the_cutters_are_those_of_tldata() -> None:
    shapes, _ = read_cutters(FIRST + SECOND)
    assert {n: s[:2] for n, s in shapes.items()} == {3: (12.0, 1.0), 4: (8.0, 1.0)}
    tapered = FIRST.replace("75.0000,0.0000,0.0000", "75.0000,3.0000,0.0000")
    assert read_cutters(tapered)[0] == {}


def test_coordinates_that_change_between_operations_are_refused() -> None:
    other = SECOND.replace("MSYS/0.0000", "MSYS/10.0000")
    with pytest.raises(InputError, match="changes the coordinates"):
        read_apt(FIRST + other)


@pytest.mark.parametrize("record", ["ROTATE/TABLE,BAXIS,ANGLE,30", "PATTERN/X", "CALSUB/X", "MODE/INCR", "SPLINE/1"])
def test_records_that_move_and_are_not_read_are_unproven(record: str) -> None:
    assert unproven(FIRST.replace("FEDRAT/900", f"{record}\nFEDRAT/900")) == ["apt-left-out"]
