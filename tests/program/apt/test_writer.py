from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.errors import InputError
from chipload.geometry.contour import Contour
from chipload.program.apt.writer import write_apt
from chipload.program.build import dwell, follow, helix, plunge, rapid
from chipload.program.program import Program
from chipload.program.release import NOT_SIMULATED, Release

MILL = Cutter(10.0, 4, 0.5, 22.0, 35.0, 6e5, corner_radius=1.0)


def numbers(line):
    return [float(x) for x in line.partition("/")[2].split(",")]


def test_text():
    c = Contour.from_bulges([[0, 0], [30, 0], [30, 20]], [0.0, -1.0])
    program = Program.join(
        [
            rapid([[0, 0, 5]], 100 * math.pi, 3, "link"),
            plunge([0, 0, -1], 2.0, 100 * math.pi, 3, "entry"),
            follow(c, -1.0, 10.0, 100 * math.pi, 3, "finish"),
            dwell([30, 20, -1], 0.5, 0.0, 3, "finish"),
        ]
    )
    assert write_apt(program, {3: MILL}, title="slot ü$", release=NOT_SIMULATED) == (
        "PARTNO/slot ?S\nPPRINT/CHIPLOAD: NOT VERIFIED: no simulation has checked this program\n"
        "UNITS/MM\nCUTTER/10,1,4,1,0,0,22\nLOADTL/3\n"
        "SPINDL/3000,RPM,CLW\nPPRINT/link\nRAPID\nGOTO/0,0,5\nPPRINT/entry\nFEDRAT/120,MMPM\nGOTO/0,0,-1\n"
        "PPRINT/finish\nFEDRAT/600,MMPM\nGOTO/30,0,-1\nCIRCLE/30,10,-1,0,0,-1\nGOTO/30,20,-1\n"
        "SPINDL/OFF\nDELAY/0.5\nSPINDL/OFF\nFINI\n"
    )


def test_full_turn_is_two_records():
    circle = Contour.circle((1.0, 2.0), 5.0)
    whole = follow(circle, 0.0, 10.0, 100.0, 3, "x")
    one = Program(
        **{
            **{f: getattr(whole, f)[-1:] for f in whole.__dataclass_fields__ if f != "labels"},
            "labels": whole.labels,
        }
    )
    for part in (whole, one):
        text = write_apt(
            Program.join([rapid([6, 2, 0], 100.0, 3, "x"), part]), {3: MILL}, title="t", release=Release("")
        ).splitlines()
        k = text.index("CIRCLE/1,2,0,0,0,1")
        assert text[k : k + 4] == ["CIRCLE/1,2,0,0,0,1", "GOTO/-4,2,0", "CIRCLE/1,2,0,0,0,1", "GOTO/6,2,0"]


def test_helix_is_chords_within_tolerance():
    entry = helix((8.0, 0.0), (3.0, 0.0), (0.0, -2.0), 2.0, 4.0, 100.0, 3, "entry", level=False)
    program = Program.join([rapid([8, 0, 0], 100.0, 3, "link"), entry])
    text = write_apt(program, {3: MILL}, title="t", release=Release(""), chord_mm=0.01)
    p = np.array([numbers(x) for x in text.splitlines() if x.startswith("GOTO")])
    middle = 0.5 * (p[1:] + p[:-1])
    off = 5.0 - np.hypot(middle[:, 0] - 3.0, middle[:, 1])
    assert 0.005 < off.max() <= 0.01 + 1e-6
    a = np.unwrap(np.arctan2(p[:, 1], p[:, 0] - 3.0))
    np.testing.assert_allclose(p[:, 2], -2.0 * a / math.tau, atol=2e-6)


def test_tilted_axis_and_missing_cutter():
    part = rapid([[1, 2, 3], [4, 5, 6]], 0.0, 3, "x")
    tilted = replace(part, axis=np.array([[0, 0, 1], [0.6, 0, 0.8]]))
    text = write_apt(tilted, {3: MILL}, title="t", release=Release("")).splitlines()
    assert "MULTAX/ON" in text
    assert [x for x in text if x.startswith("GOTO")] == ["GOTO/1,2,3,0,0,1", "GOTO/4,5,6,0.6,0,0.8"]
    with pytest.raises(InputError) as err:
        write_apt(part, {1: MILL}, title="t", release=Release(""))
    assert str(err.value) == "program row 0: tool 3 has no cutter: give its [[cutter]]"
