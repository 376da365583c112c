"""The same parts as each control would have them: one path, one time, whatever the words.

Each part is posted by hand for Fanuc, Haas, Sinumerik and Heidenhain. Oracle: they are one part, so that cuts, and with
them what is left of the stock, and times are equal.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.errors import Severity
from chipload.machine.machine import machine_named
from chipload.program.program import ARC_CCW, ARC_CW, LINE
from chipload.program.read import line_times, read_program
from chipload.program.setup import Setup, StatedControl

VMC = machine_named("vmc")
ISO = "%\nO0001\nG21 G90 G17 G94 G40 G49 G80 G54\nT1 M6\nS2000 M3\nG0 X0. Y0.\nG43 H1 Z20.\n"
SI = "G71 G90 G17 G94 G40 G54\nT1 M6\nD1\nS2000 M3\nG0 X0 Y0\nG0 Z20\n"
HH = "BEGIN PGM A MM\nTOOL CALL 1 Z S2000\nM3\nL X+0 Y+0 R0 FMAX\nL Z+20 R0 FMAX\n"
#: part: text of each control, without head and end
PARTS = {
    "line and arc": {
        "fanuc": "G0 Z2.\nG1 Z-2. F100.\nX30. F400.\nG3 X40. Y10. I0. J10.\nG2 X50. Y20. R10.\nG0 Z20.",
        "sinumerik": "G0 Z2\nG1 Z-2 F100\nX30 F400\nG3 X40 Y10 I0 J10\nG2 X50 Y20 CR=10\nG0 Z20",
        "heidenhain": "L Z+2 FMAX\nL Z-2 F100\nL X+30 F400\nCC X+30 Y+10\nC X+40 Y+10 DR+\nCR X+50 Y+20 R+10 DR-\n"
        "L Z+20 FMAX",
    },
    "helix": {
        "fanuc": "G0 X10. Z0.\nG3 X10. Y0. Z-1. I-10. J0. F300.\nG3 X10. Y0. Z-2. I-10. J0.\nG0 Z20.",
        "sinumerik": "G0 X10 Z0\nG3 X10 Y0 Z-1 I-10 J0 F300\nG3 X10 Y0 Z-2 I-10 J0\nG0 Z20",
        "heidenhain": "L X+10 Z+0 FMAX\nCC X+0 Y+0\nCP IPA+360 IZ-1 DR+ F300\nCP IPA+360 IZ-1 DR+\nL Z+20 FMAX",
    },
    "drilled row": {
        "fanuc": "G98 G81 X10. Y0. Z-8. R2. F150.\nX20.\nX30.\nG80\nG0 Z20.",
        "haas": "G98 G81 Z-8. R2. F150. L0\nX10. Y0.\nX20.\nX30.\nG80\nG0 Z20.",
        "sinumerik": "F150\nMCALL CYCLE81(20,0,2,-8)\nX10\nX20\nX30\nMCALL\nG0 Z20",
        "heidenhain": "CYCL DEF 200 Q200=2 Q201=-8 Q206=150 Q202=8 Q210=0 Q203=0 Q204=20 Q211=0\nL X+10 FMAX M99\n"
        "L X+20 FMAX M99\nL X+30 FMAX M99\nL Z+20 FMAX",
    },
    "counterbore with a dwell": {
        "fanuc": "G98 G82 X10. Y0. Z-3. R2. P1500 F150.\nG80\nG0 Z20.",
        "haas": "G98 G82 X10. Y0. Z-3. R2. P1.5 F150.\nG80\nG0 Z20.",
        "sinumerik": "F150\nX10\nCYCLE82(20,0,2,-3,,1.5)\nG0 Z20",
        "heidenhain": "CYCL DEF 200 Q200=2 Q201=-3 Q206=150 Q202=3 Q210=0 Q203=0 Q204=20 Q211=1.5\nL X+10 FMAX M99\n"
        "L Z+20 FMAX",
    },
    "bore that is fed out": {
        "fanuc": "G98 G85 X10. Y0. Z-12. R2. F80.\nG80\nG0 Z20.",
        "sinumerik": "F80\nX10\nCYCLE85(20,0,2,-12,,0,80,80)\nG0 Z20",
        "heidenhain": "CYCL DEF 201 Q200=2 Q201=-12 Q206=80 Q211=0 Q208=80 Q203=0 Q204=20\n"
        "L X+10 FMAX M99\nL Z+20 FMAX",
    },
    "dwell": {
        "fanuc": "G0 Z2.\nG1 Z-1. F100.\nG4 P2500\nG0 Z20.",
        "haas": "G0 Z2.\nG1 Z-1. F100.\nG4 P2.5\nG0 Z20.",
        "sinumerik": "G0 Z2\nG1 Z-1 F100\nG4 F2.5\nG0 Z20",
        "heidenhain": "L Z+2 FMAX\nL Z-1 F100\nCYCL DEF 9.0 DWELL\nCYCL DEF 9.1 DWELL 2.5\nL Z+20 FMAX",
    },
    "inside of a frame": {
        "fanuc": "#13001=3.\nG0 X20. Y10. Z2.\nG1 Z-1. F100.\nG41 D1 X20. Y0. F400.\nX40.\nY30.\nX0.\nY0.\nX20.\n"
        "G40 Y10.\nG0 Z20.",
        "haas": "#2401=6.\nG0 X20. Y10. Z2.\nG1 Z-1. F100.\nG41 D1 X20. Y0. F400.\nX40.\nY30.\nX0.\nY0.\nX20.\n"
        "G40 Y10.\nG0 Z20.",
        "sinumerik": "G0 X20 Y10 Z2\nG1 Z-1 F100\nG41 X20 Y0 F400\nX40\nY30\nX0\nY0\nX20\nG40 Y10\nG0 Z20",
        "heidenhain": "L X+20 Y+10 FMAX\nL Z+2 FMAX\nL Z-1 F100\nL X+20 Y+0 RL F400\nL X+40\nL Y+30\nL X+0\nL Y+0\n"
        "L X+20\nL Y+10 R0\nL Z+20 FMAX",
    },
    "repeated by a subprogram": {
        "fanuc": "G0 Z2.\nG1 Z-1. F100.\nM98 P20007\nG0 Z20.\nM30\nO0007\nG91 G1 X10. F200.\nY5.\nG90\nM99",
        "haas": "G0 Z2.\nG1 Z-1. F100.\nM98 P7 L2\nG0 Z20.\nM30\nO0007\nG91 G1 X10. F200.\nY5.\nG90\nM99",
        "sinumerik": "G0 Z2\nG1 Z-1 F100\nR1=0\nWHILE R1<2\nG91 G1 X10 F200\nY5\nG90\nR1=R1+1\nENDWHILE\nG0 Z20",
        "heidenhain": "L Z+2 FMAX\nL Z-1 F100\nLBL 1\nL IX+10 F200\nL IY+5\nCALL LBL 1 REP 1\nL Z+20 FMAX",
    },
    "turned coordinates": {
        "fanuc": "G0 Z2.\nG1 Z-1. F100.\nG68 X0. Y0. R30.\nG1 X20. Y0. F200.\nY10.\nG69\nG0 Z20.",
        "sinumerik": "G0 Z2\nG1 Z-1 F100\nROT Z30\nG1 X20 Y0 F200\nY10\nROT\nG0 Z20",
        "heidenhain": "L Z+2 FMAX\nL Z-1 F100\nCYCL DEF 10.0 ROTATION\nCYCL DEF 10.1 ROT+30\nL X+20 Y+0 F200\nL Y+10\n"
        "CYCL DEF 10.0 ROTATION\nCYCL DEF 10.1 ROT+0\nL Z+20 FMAX",
    },
    "mirrored coordinates": {
        "fanuc": "G0 Z2.\nG1 Z-1. F100.\nG51.1 X0.\nG1 X20. F200.\nG3 X30. Y10. I0. J10.\nG50.1 X0.\nG0 Z20.",
        "haas": "G0 Z2.\nG1 Z-1. F100.\nG101 X0.\nG1 X20. F200.\nG3 X30. Y10. I0. J10.\nG100 X0.\nG0 Z20.",
        "sinumerik": "G0 Z2\nG1 Z-1 F100\nMIRROR X0\nG1 X20 F200\nG3 X30 Y10 CR=10\nMIRROR\nG0 Z20",
        "heidenhain": "L Z+2 FMAX\nL Z-1 F100\nCYCL DEF 8.0 MIRROR IMAGE\nCYCL DEF 8.1 X\nL X+20 F200\n"
        "CR X+30 Y+10 R+10 DR+\nCYCL DEF 8.0 MIRROR IMAGE\nCYCL DEF 8.1\nL Z+20 FMAX",
    },
    "scaled coordinates": {
        "fanuc": "G0 Z2.\nG51 X0. Y0. Z0. P1.5\nG1 Z-1. F200.\nX20.\nG3 X30. Y10. R10.\nG50\nG0 Z20.",
        "sinumerik": "G0 Z2\nSCALE X1.5 Y1.5 Z1.5\nG1 Z-1 F200\nX20\nG3 X30 Y10 CR=10\nSCALE\nG0 Z20",
        "heidenhain": "L Z+2 FMAX\nCYCL DEF 11.0 SCALING\nCYCL DEF 11.1 SCL 1.5\nL Z-1 F200\nL X+20\n"
        "CR X+30 Y+10 R+10 DR+\nCYCL DEF 11.0 SCALING\nCYCL DEF 11.1 SCL 1\nL Z+20 FMAX",
    },
    "rounded and chamfered corners": {
        "fanuc": "G0 Z2.\nG1 Z-1. F100.\nX30. F400. ,R5.\nY20. ,C4.\nX0.\nG0 Z20.",
        "sinumerik": "G0 Z2\nG1 Z-1 F100\nX30 F400 RND=5\nY20 CHR=4\nX0\nG0 Z20",
        "heidenhain": "L Z+2 FMAX\nL Z-1 F100\nL X+30 F400\nRND R5\nL Y+20\nCHF 4\nL X+0\nL Z+20 FMAX",
    },
    "shifted zero": {
        "fanuc": "G0 Z2.\nG52 X10. Y5.\nG1 X0. Y0. Z-1. F200.\nX20.\nG52 X0. Y0.\nG0 Z20.",
        "sinumerik": "G0 Z2\nTRANS X10 Y5\nG1 X0 Y0 Z-1 F200\nX20\nTRANS\nG0 Z20",
        "heidenhain": "L Z+2 FMAX\nCYCL DEF 7.0 DATUM SHIFT\nCYCL DEF 7.1 X+10\nCYCL DEF 7.2 Y+5\n"
        "L X+0 Y+0 Z-1 F200\nL X+20\nCYCL DEF 7.0 DATUM SHIFT\nCYCL DEF 7.1 X+0\nCYCL DEF 7.2 Y+0\nL Z+20 FMAX",
    },
}  # fmt: skip


def text_of(part, control):
    body = PARTS[part].get(control, PARTS[part]["fanuc"])
    if control == "sinumerik":
        return f"{SI}{body}\nM30\n"
    if control == "heidenhain":
        return f"{HH}{body}\nM30\nEND PGM A MM\n"
    return f"{ISO}{body}\n" if "M30" in body else f"{ISO}{body}\nM30\n%\n"


def read(tmp_path: Path, part, control):
    path = tmp_path / f"part{'.h' if control == 'heidenhain' else '.nc'}"
    path.write_text(text_of(part, control))
    setup = Setup(
        cutters={1: Cutter(6.0, 2, 0.5, 20.0, 30.0, 5.8e5)}, control=StatedControl(control, compensation="control")
    )
    return read_program(path, VMC, setup=setup)


def cuts(reading):
    """(n, 3) path of the cuts: chords of arcs are left to their ends, centres and turns."""
    p = reading.program
    rows = np.isin(p.motion, (LINE, ARC_CW, ARC_CCW))
    begin = np.vstack([p.p_work[:1], p.p_work[:-1]])
    found = np.column_stack([begin, p.p_work, p.centre[:, :2], p.feed])[rows]
    return found[np.linalg.norm(found[:, 3:6] - found[:, :3], axis=1) + np.abs(found[:, 6:8]).sum(axis=1) > 0.0]


def removed(program):
    """Volume [mm3] that a flat cutter of 6 mm takes below Z0: brute force on a grid, rapids too."""
    ground = np.zeros((280, 280))
    x = y = 0.5 * (np.arange(280) - 100.5)
    for k, start in enumerate(program.p_work[:-1], 1):
        for p in _places(program, k, start):
            if p[2] < 0.0:
                under = (x[:, None] - p[0]) ** 2 + (y[None, :] - p[1]) ** 2 <= 9.0
                ground[under] = np.minimum(ground[under], p[2])
    return -0.25 * float(ground.sum())


def _places(program, k, start):
    """Points along row k of a program, 0.5 mm apart."""
    end, centre = program.p_work[k], program.centre[k]
    if program.motion[k] not in (ARC_CW, ARC_CCW):
        t = np.linspace(0.0, 1.0, max(int(np.linalg.norm(end - start) / 0.5), 1) + 1)
        return start + t[:, None] * (end - start)
    sense = 1.0 if program.motion[k] == ARC_CCW else -1.0
    a, b = (np.arctan2(*(p - centre)[1::-1]) for p in (start, end))
    sweep = sense * ((sense * (b - a) - 1e-9) % (2.0 * np.pi) + 1e-9 + 2.0 * np.pi * program.turns[k])
    r = np.hypot(*(start - centre)[:2])
    t = np.linspace(0.0, 1.0, int(r * abs(sweep) / 0.5) + 2)
    angle = a + t * sweep
    z = start[2] + t * (end[2] - start[2])
    return np.column_stack([centre[0] + r * np.cos(angle), centre[1] + r * np.sin(angle), z])


@pytest.mark.parametrize("part", PARTS)
def test_one_part(tmp_path: Path, part):
    readings = {control: read(tmp_path, part, control) for control in ("fanuc", "haas", "sinumerik", "heidenhain")}
    for control, reading in readings.items():
        left_out = [f for f in reading.findings if f.severity >= Severity.UNPROVEN]
        assert left_out == [], control
    expected = cuts(readings["fanuc"])
    volume = removed(readings["fanuc"].program)
    assert volume > 5.0
    times = {control: line_times(reading, VMC)[1].sum() for control, reading in readings.items()}
    for control, reading in readings.items():
        np.testing.assert_allclose(cuts(reading), expected, atol=1e-6, err_msg=control)
        assert times[control] == pytest.approx(times["fanuc"], rel=0.01), control
        assert removed(reading.program) == pytest.approx(volume, rel=1e-3), control
