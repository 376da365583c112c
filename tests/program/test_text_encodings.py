"""Programs in the encodings in which shops save them: the same path, and the comment of the tool as it was typed."""

from __future__ import annotations

import codecs
import tomllib
from pathlib import Path

import pytest

from chipload.machine.machine import machine_named
from chipload.program.read import read_program
from command import call

GCODE = (
    "%\nO1\n(T1 Ø12 FRÄSER)\nG21 G90 G54\nT1 M6\nS3000 M3\nG0 X0. Y0. Z5.\nG1 Z-1. F200.\nX30. F600.\nG0 Z20.\nM30\n%\n"
)
HEIDENHAIN = (
    "0 BEGIN PGM A MM\n1 ; Fräser Ø12\n2 TOOL CALL 1 Z S3000 F200\n3 L X+0 Y+0 Z+5 R0 FMAX M3\n4 L Z-1 F200\n"
    "5 L X+30 F600\n6 L Z+20 FMAX M30\n7 END PGM A MM\n"
)
ENCODINGS = {
    "utf-8": b"",
    "utf-8-sig": b"",
    "utf-16-le": codecs.BOM_UTF16_LE,
    "utf-16-be": codecs.BOM_UTF16_BE,
    "latin-1": b"",
}


@pytest.mark.parametrize("encoding", ENCODINGS)
@pytest.mark.parametrize("name", ["a.nc", "a.h"])
def test_the_path_is_the_same(tmp_path: Path, encoding: str, name: str) -> None:
    text = HEIDENHAIN if name == "a.h" else GCODE
    (tmp_path / name).write_bytes(ENCODINGS[encoding] + text.encode(encoding))
    found = read_program(tmp_path / name, machine_named("vmc"))
    assert found.program.p_work[-3:].tolist() == [[0.0, 0.0, -1.0], [30.0, 0.0, -1.0], [30.0, 0.0, 20.0]]
    assert not [f for f in found.findings if f.code == "nc-not-read"]


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_a_comment_of_a_tool_is_read(tmp_path: Path, encoding: str) -> None:
    (tmp_path / "a.nc").write_bytes(ENCODINGS[encoding] + GCODE.encode(encoding))
    assert call("init", str(tmp_path / "a.nc"), str(tmp_path / "job"))[0] == 0
    cutter = tomllib.loads((tmp_path / "job" / "job.toml").read_text())["cutter"][0]
    assert cutter["diameter_mm"] == 12.0
    assert cutter["name"] == "Ø12 FRÄSER"
