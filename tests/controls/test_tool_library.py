"""A whole tool library of Fusion assigned by number. Oracle: the library, in mm by 25.4."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import pytest
from typer.testing import CliRunner

from chipload.cli import app
from chipload.cutter.fusion import read_fusion_library
from chipload.errors import InputError


def tool(number, kind, **geometry):
    own = {} if number is None else {"post-process": {"number": number}}
    return {"type": kind, "unit": "inches", "BMC": "carbide", "description": kind, "geometry": geometry, **own}


LIBRARY = [
    tool(3, "flat end mill", DC=0.5, LCF=1.0, LB=1.5, NOF=3, SFDM=0.5),
    tool(7, "drill", DC=0.25, LCF=2.0, LB=2.5, NOF=2, SFDM=0.25, SIG=118),
    tool(8, "face mill", DC=2.0, LCF=0.35, LB=1.5, NOF=5, SFDM=1.0, RE=0.03),
    tool(9, "boring bar", DC=1.0),
    tool(4, "tap right hand", DC=0.25, LCF=1.0, LB=1.5, NOF=3, SFDM=0.25, TP=0.05),
    tool(None, "drill", DC=0.1, SIG=118),
    tool(5, "drill", DC=0.1, SIG=118),
    tool(5, "drill", DC=0.2, SIG=118),
]
TEXT = "%\nO1\nG20 G90 G17 G94 G54\nT{0} M6\nS3000 M3\nG0 X0. Y0.\nG43 H{0} Z1.\nG1 Z-.1 F9.\nX1.\nG0 Z1.\nM30\n%\n"


@pytest.fixture
def library(tmp_path: Path) -> Path:
    path = tmp_path / "shop.json"
    path.write_text(json.dumps({"data": LIBRARY, "version": 2}))
    return path


def test_tools_by_number(library):
    found = read_fusion_library(library)
    assert sorted(found) == [3, 4, 7, 8]
    assert found[8]["flute_length_mm"] == pytest.approx(0.35 * 25.4)


@pytest.mark.parametrize(("number", "diameter"), [(3, 12.7), (7, 6.35), (8, 50.8)])
def test_a_draft_takes_its_tools_from_the_library(tmp_path: Path, library, number, diameter):
    (tmp_path / "part.nc").write_text(TEXT.format(number))
    done = CliRunner().invoke(app, ["init", str(tmp_path / "part.nc"), str(tmp_path / "job"), "--tools", str(library)])
    assert done.exit_code == 0, done.output
    cutter = tomllib.loads((tmp_path / "job" / "job.toml").read_text())["cutter"][0]
    assert (cutter["number"], cutter["diameter_mm"]) == (number, pytest.approx(diameter))
    assert cutter["modulus_gpa"] == 580.0


def test_a_library_without_numbers_is_refused(tmp_path: Path):
    path = tmp_path / "none.json"
    path.write_text(json.dumps({"data": [LIBRARY[5]]}))
    with pytest.raises(InputError, match="no tool has a post-process number of its own"):
        read_fusion_library(path)


def test_a_tap_is_its_core_and_its_comment_states_the_thread(tmp_path: Path, library):
    text = TEXT.format(4).replace("G20", "(T4 D=0.25 CR=0. - RIGHT HAND TAP)\nG20")
    (tmp_path / "part.nc").write_text(text.replace("G1 Z-.1 F9.\nX1.\n", "G84 Z-.5 R.1 F150.\nG80\n"))
    done = CliRunner().invoke(app, ["init", str(tmp_path / "part.nc"), str(tmp_path / "job"), "--tools", str(library)])
    assert done.exit_code == 0, done.output
    cutter = tomllib.loads((tmp_path / "job" / "job.toml").read_text())["cutter"][0]
    assert cutter["thread_pitch_mm"] == pytest.approx(1.27)
    assert cutter["diameter_mm"] < 6.35
