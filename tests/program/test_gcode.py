from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from chipload.errors import InputError
from chipload.geometry.contour import Contour
from chipload.machine.machine import machine_named
from chipload.program.build import dwell, follow, plunge, rapid, rows
from chipload.program.gcode.writer import write_gcode
from chipload.program.motions import sweeps
from chipload.program.program import ARC_CCW, ARC_CW, LINE, RAPID, Program
from chipload.program.release import NOT_SIMULATED, Release

VMC, FANUC = machine_named("vmc"), machine_named("vmc-fanuc")
SPEED = 8000 * math.tau / 60


def pocket():
    c = Contour.from_bulges([[0, 0], [30, 0], [30, 20], [0, 20]], [0.0, 1.0, 0.0, 1.0], closed=True)
    return Program.join(
        [
            rapid([[0, 0, 5]], SPEED, 3, "link"),
            plunge([0, 0, -1], 100 / 60, SPEED, 3, "entry"),
            follow(c, -1.0, 10.0, SPEED, 3, "finish"),
            dwell([0, 0, -1], 0.5, SPEED, 3, "finish"),
            rapid([0, 0, 5], SPEED, 3, "link"),
        ]
    )


def test_linuxcnc_text():
    assert write_gcode(pocket(), VMC, title="a slot (30 x 20)", release=Release(""), comments=("stock: 6082",)) == (
        "(chipload: verified by independent simulation)\n(a slot [30 x 20])\n(stock: 6082)\n"
        "G17 G21 G90 G91.1 G94 G97 G40 G49 G80 G54\nG64 P0.005\n"
        "(link)\nT3 M6\nG43 H3\nS8000 M3\nG0 X0 Y0\nZ5\n"
        "(entry)\nG1 Z-1 F100\n"
        "(finish)\nX30 F600\nG3 X30 Y20 I0 J10\nG1 X0\nG3 X0 Y0 I0 J-10\nG4 P0.5\n"
        "(link)\nG0 Z5\nM5\nM2\n"
    )


def test_fanuc_text():
    assert write_gcode(pocket(), FANUC, title="a slot", release=NOT_SIMULATED, number=12, line_step=10) == (
        "%\nO0012 (NOT VERIFIED: NO SIMULATION HAS CHECKED THIS PROGRAM)\n(A SLOT)\n"
        "N10 G21\nN20 G17 G90 G94 G40 G49 G80\nN30 G54 G64\n"
        "(LINK)\nN50 T3 M6\nN60 S8000 M3\nN70 G0 X0. Y0.\nN80 G43 H3 Z5.\n"
        "(ENTRY)\nN100 G1 Z-1. F100.\n"
        "(FINISH)\nN120 X30. F600.\nN130 G3 X30. Y20. I0. J10.\nN140 G1 X0.\nN150 G3 X0. Y0. I0. J-10.\nN160 G4 P500\n"
        "(LINK)\nN180 G0 Z5.\nN190 M5\nN200 M30\n%\n"
    )


def arcs_of(text):
    """(k, 7) sense, start, end, I, J of each arc as the text says, modal words kept."""
    out, at, mode = [], {"X": 0.0, "Y": 0.0}, 0
    for line in text.splitlines():
        if line.startswith("(") or not re.match(r"(G[0-3]\b|[XYZ])", line):
            continue
        words = dict(re.findall(r"([GXYZIJF])(-?[0-9.]+)", line))
        mode = int(words.get("G", mode))
        to = {a: float(words.get(a, at[a])) for a in "XY"}
        if mode >= 2:
            out.append([2 * mode - 5, at["X"], at["Y"], to["X"], to["Y"], float(words["I"]), float(words["J"])])
        at = to
    return np.array(out).reshape(-1, 7)


@pytest.mark.parametrize(("machine", "unit"), [(VMC, 1e-6), (FANUC, 1e-4)])
def test_rounded_arcs_stay_arcs(machine, unit):
    """Radii at both ends agree to 1.5 units; the written sweep is the meant one, no arc became a turn."""
    rng = np.random.default_rng(3)
    n = 4000
    r = 10.0 ** rng.uniform(-2.5, 3, n)
    a = rng.uniform(0, math.tau, n)
    sweep = math.tau * rng.uniform(0, 1, n) ** 6 * rng.choice([-1, 1], n) + 1e-8
    sweep[::97] = np.sign(sweep[::97]) * math.tau
    c = rng.uniform(-50, 50, (n, 2))
    p0 = c + r[:, None] * np.column_stack([np.cos(a), np.sin(a)])
    p1 = c + r[:, None] * np.column_stack([np.cos(a + sweep), np.sin(a + sweep)])
    p1[::97] = p0[::97]
    points = np.column_stack([np.stack([p0, p1], axis=1).reshape(-1, 2), np.zeros(2 * n)])
    motion = np.column_stack([np.full(n, RAPID), np.where(sweep > 0, ARC_CCW, ARC_CW)]).ravel()
    program = rows(motion, points, np.repeat(c, 2, axis=0), np.where(motion == RAPID, 0, 5.0), 100.0, 1, "cut")
    text = write_gcode(program, machine, title="t", release=NOT_SIMULATED)
    assert "-0 " not in text + " "
    arcs = arcs_of(text)
    assert len(arcs) > 2000
    sense, start, end, ij = arcs[:, 0], arcs[:, 1:3], arcs[:, 3:5], arcs[:, 5:7]
    mismatch = np.abs(np.hypot(*ij.T) - np.hypot(*(start + ij - end).T))
    assert mismatch.max() <= 1.5 * unit
    # each arc of the text against the arc of the program with the nearest start and end
    meant = program.p_work[1::2, :2]
    turn = sweeps(program)[1::2]
    v0, v1 = -ij, end - start - ij
    written = (sense * np.arctan2(v0[:, 0] * v1[:, 1] - v0[:, 1] * v1[:, 0], (v0 * v1).sum(axis=1))) % math.tau
    written[np.hypot(*(end - start).T) == 0.0] = math.tau
    for k in range(len(arcs)):
        near = np.hypot(*(meant - end[k]).T) + np.hypot(*(program.p_work[0::2, :2] - start[k]).T)
        j = int(np.argmin(near))
        assert near[j] <= 4.0 * unit
        assert np.sign(turn[j]) == sense[k]
        assert r[j] * abs(abs(turn[j]) - written[k]) <= 10.0 * unit + 1e-2 * r[j]


def test_same_program_same_bytes():
    assert write_gcode(pocket(), VMC, title="t", release=Release("")) == write_gcode(
        pocket(), VMC, title="t", release=Release("")
    )


def test_exact_stop_and_no_negative_zero():
    p = rows([RAPID, LINE], [[-1e-9, -0.0, -1e-12], [1, -1e-8, -1e-7]], (0, 0), [0, 5.0], 100.0, 1, "cut")
    text = write_gcode(p, replace(VMC, corner_tolerance=0.0), title="t", release=NOT_SIMULATED)
    assert "\nG61\n" in text
    assert "-0" not in text
    assert "\nG1 X1 F300\n" in text


@pytest.mark.parametrize(
    ("program", "message"),
    [
        (
            plunge([0, 0, 1], 5.0, 100.0, 4, "cut"),
            "program row 0: tool 4 begins with a cutting motion: begin with a rapid",
        ),
        (
            rows([RAPID, LINE], [[0, 0, 0], [1, 0, 0]], (0, 0), [0, 1e-9], 100.0, 1, "cut"),
            "program row 1: feed 6e-08 mm/min rounds to 0: raise it",
        ),
        (
            replace(rapid([0, 0, 0], 0.0, 1, "x"), axis=np.array([[0.6, 0.0, 0.8]])),
            "program row 0: the axis is tilted: vmc is written with three axes",
        ),
    ],
)
def test_refused(program, message):
    with pytest.raises(InputError) as err:
        write_gcode(program, VMC, title="t", release=NOT_SIMULATED)
    assert str(err.value) == message


def test_number_is_refused():
    with pytest.raises(InputError, match=r"^program number = 10000: must be from 1 to 9999$"):
        write_gcode(pocket(), FANUC, title="t", release=NOT_SIMULATED, number=10000)
