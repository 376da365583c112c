"""Travel of the axes in the coordinates of the machine, where the work offset is stated, and spans where it is not.

The positions are sums of the numbers of the text and of the offset; `vmc` travels 800 x 500 x 500 mm about its zero.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from chipload.machine.machine import machine_named
from chipload.program.gcode.tools import read_tool_table
from chipload.program.read import ProgramReading, read_program
from chipload.program.setup import Setup

VMC = machine_named("vmc")
HEAD = "G21 G90 G17 G94\n{0}T1 M6\nG43 H1\nS3000 M3\n"
TABLE, _ = read_tool_table("T1 P1 Z50 D10")


def read(body: str, offsets: dict[str, list[float]] | None = None, table: bool = True, first: str = ""):
    return read_program(
        Path("a.ngc"), VMC, text=HEAD.format(first) + body + "\nM2\n", tools=TABLE if table else None,
        setup=Setup(work_offsets=offsets or {}),
    )  # fmt: skip


def limits(reading: ProgramReading) -> list[tuple[int, str]]:
    return [(f.line, f.text.split(":")[0]) for f in reading.violations if f.code == "machine-limit"]


MACHINE = " mm in the coordinates of the machine"


@pytest.mark.parametrize(
    ("x", "body", "expected"),
    [
        (380.0, "G0 X0 Y0 Z10\nG1 X20 F900", []),
        (380.0, "G0 X0 Y0 Z10\nG1 X20.001 F900", [(6, f"X = 400.001{MACHINE}")]),
        (-380.0, "G0 X0 Y0 Z10\nG1 X-70 F900\nX0", [(6, f"X = -450{MACHINE}")]),
        # 380 + 10 at both ends; the bulge reaches 10 mm farther
        (380.0, "G0 X10 Y-10 Z10\nG3 X10 Y10 I0 J10 F900", []),
        (381.0, "G0 X10 Y-10 Z10\nG3 X10 Y10 I0 J10 F900", [(6, f"X = 401{MACHINE}")]),
    ],
)
def test_a_stated_work_offset(x: float, body: str, expected: list[tuple[int, str]]) -> None:
    assert limits(read(body, {"G54": [x, 0.0, 0.0]})) == expected


def test_the_offset_of_g10_counts_as_stated() -> None:
    body = "G0 X-10 Y0 Z10\nG1 X70 F900"
    assert limits(read(body, first="G10 L2 P1 X380 Y0 Z0\n")) == [(7, f"X = 450{MACHINE}")]
    # and that of the second work offset, from zero of the first, 500 mm away
    two = f"{body}\nG0 G55 X0 Y0"
    assert limits(read(two, {"G54": [-100.0, 0.0, 0.0], "G55": [500.0, 0.0, 0.0]})) == [(7, f"X = 500{MACHINE}")]


def test_a_length_moves_z() -> None:
    """Z of the machine is that of the text, of the offset and of the tool: 10 + 195 + 50."""
    body, offsets = "G0 X0 Y0 Z10\nG1 Z-2 F900", {"G54": [0.0, 0.0, 195.0]}
    assert limits(read(body, offsets)) == [(5, f"Z = 255{MACHINE}")]
    unknown = read(body, offsets, table=False)
    assert limits(unknown) == []
    assert any("travel of Z: tool lengths not stated" in item for item in unknown.unchecked)


def test_without_an_offset_the_span_is_compared() -> None:
    inside = read("G0 X0 Y0 Z10\nG1 X800 F900")
    assert limits(inside) == []
    assert any("work offset not stated" in item for item in inside.unchecked)
    text = "X goes from -1 to 800 mm, 801 mm"
    assert limits(read("G0 X-1 Y0 Z10\nG1 X800 F900")) == [(6, text)]
    # the first rapid sends Y later: where Y stands until then is not known
    assert limits(read("G0 X0\nG0 Y9000\nG1 Y9100 Z0 F900")) == []
