"""A program in which one block is wrong: that block is a finding, and all other motions are read."""

from pathlib import Path

import pytest

from chipload.errors import InputError, Severity
from chipload.machine.machine import machine_named
from chipload.program.read import read_program

SINUMERIK = (
    'G17 G54 G71 G90 G94\nT="MILL_10"\nM6\nS3000 M3 F300\nG0 X0 Y0 Z10\nG1 Z-1\nX10\n',
    "\nG1 X20 Y0 Z-1\nX30\nG0 Z10\nM30\n",
)
HEIDENHAIN = (
    "BEGIN PGM A MM\nTOOL CALL 1 Z S3000 F300\nM3\nL X+0 Y+0 R0 FMAX\nL Z+10 FMAX\nL Z-1 F300\nL X+10\n",
    "\nL X+20 Y+0 Z-1 R0 F300\nL X+30\nL Z+10 FMAX\nL M30\nEND PGM A MM\n",
)


@pytest.mark.parametrize(
    ("name", "text", "block", "why"),
    [
        ("part.mpf", SINUMERIK, "WHILE R1<5", "ENDWHILE is missing"),
        ("part.mpf", SINUMERIK, "ENDWHILE", "ENDWHILE has no WHILE before it"),
        ("part.mpf", SINUMERIK, "FOR R1=1 TO 3", "ENDFOR is missing"),
        ("part.mpf", SINUMERIK, "LOOP", "ENDLOOP is missing"),
        ("part.mpf", SINUMERIK, "UNTIL R1==1", "UNTIL has no REPEAT before it"),
        ("part.mpf", SINUMERIK, "ELSE", "ELSE has no IF before it"),
        ("part.mpf", SINUMERIK, "IF R1==1\nELSE", "ENDIF is missing"),
        ("part.h", HEIDENHAIN, "FN 4: Q1 = 5 DIV 0", "division by 0"),
        ("part.h", HEIDENHAIN, "FN 9: IF +Q1 EQU +1 GOTO LBL 77", "Q1 is read before it is set"),
        ("part.h", HEIDENHAIN, "FN 99", "FN must be written FN number"),
    ],
)
def test_the_rest_is_read(tmp_path: Path, name, text, block, why):
    path = tmp_path / name
    path.write_text(block.join(text))
    reading = read_program(path, machine_named("vmc"))
    gaps = [f for f in reading.findings if f.severity is Severity.UNPROVEN]
    assert {f.line for f in gaps} == set(range(8, 9 + block.count("\n")))
    assert why in gaps[0].text
    assert sorted(set(reading.program.p_work[:, 0].tolist())) == [0.0, 10.0, 20.0, 30.0]
    with pytest.raises(InputError, match="line 8"):
        read_program(path, machine_named("vmc"), strict=True)
