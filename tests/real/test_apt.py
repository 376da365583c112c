"""CL data of a CAM system, the Heidenhain programs that were made of it, and tables of five-axis points.

Notation: what stands in the files is found here by regular expressions, line by line: (line, x, y, z) of each GOTO, the
cycle that it falls into, the CIRCLE before it, the CSYS that holds. A, t are of CSYS, p = A' p_work + t.
"""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from chipload.machine.kinematics import forward
from chipload.machine.machine import machine_named
from chipload.program.apt.cutters import read_cutters
from chipload.program.apt.reader import read_apt_file
from chipload.program.motions import is_arc, starts
from chipload.program.program import LINE, RAPID
from chipload.program.to_axes import to_axes
from program.apt.cl_points import read_cl_points

DATA = Path(os.environ.get("CHIPLOAD_DATA", Path(__file__).parents[2].parent / "shared" / "data")) / "nc"
APT = DATA / "apt_dmu50" / "apt"
HUST = DATA / "five_axis_cl_hust"
pytestmark = pytest.mark.skipif(not APT.is_dir(), reason=f"no {APT}")

FILES = sorted(APT.glob("*.[ac][pl]t")) if APT.is_dir() else []
NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)"
GOTO = re.compile(rf"\s*GOTO/\s*({NUMBER}),({NUMBER}),({NUMBER})\s*")
CIRCLE = re.compile(rf"\s*CIRCLE/\s*({NUMBER}(?:,{NUMBER}){{5,6}})(?:,([A-Z]+))?\s*")
DEPTH = re.compile(rf"(?:FEDTO,|G98,)({NUMBER})")
UP = re.compile(rf"RTRCTO,({NUMBER})|,({NUMBER}) {NUMBER} DWELL")
#: what stands before the last ROTABL: work axes of the machine's X, Y, Z, and the tool's
TURNED = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])


@dataclass
class Point:
    line: int
    p: np.ndarray
    circle: np.ndarray | None
    depth: float | None
    up: float
    rapid: bool
    csys: tuple[np.ndarray, np.ndarray]


def points(path):
    """What the text says, by regular expressions."""
    out, circle, depth, up, rapid = [], None, None, 0.0, False
    csys = (np.eye(3), np.zeros(3))
    for line, text in enumerate(path.read_text().splitlines(), 1):
        if m := re.match(r"CSYS/(.*)", text):
            whole = np.array([float(x) for x in m[1].split(",")]).reshape(3, 4)
            csys = (whole[:, :3], whole[:, 3])
        elif m := CIRCLE.fullmatch(text):
            circle = np.array([float(x) for x in m[1].split(",")[:6]])
            if m[2] == "CLOCKWISE":
                circle[3:] *= -1.0
        elif re.match(r"CYCLE/ ?OFF", text):
            depth = None
        elif m := re.match(r"CYCLE/ ?D", text) and DEPTH.search(text):
            depth = float(m[1])
            up = float(next(x for x in UP.search(text).groups() if x))
        elif re.match("RAPID", text):
            rapid = True
        elif m := GOTO.fullmatch(text):
            out.append(Point(line, np.array([float(x) for x in m.groups()]), circle, depth, up, rapid, csys))
            circle, rapid = None, False
    return out


def frame(path):
    """Work from text, and the tool's axis: the .clt file has its table turned throughout."""
    return TURNED if path.suffix == ".clt" else np.eye(3)


@pytest.mark.parametrize("path", FILES, ids=lambda p: p.name)
def test_every_record_is_a_row(path):
    program, findings = read_apt_file(path)
    said, R = points(path), frame(path)
    assert len(said) == len(re.findall(r"^\s*GOTO/", path.read_text(), re.MULTILINE)) > 3
    assert {f.code for f in findings} <= {"apt-unused", "apt-unknown", "apt-cutcom", "apt-coordinates", "apt-cutter"}
    assert ("apt-cutter" in {f.code for f in findings}) == (path.suffix == ".clt")  # it loads no tool
    np.testing.assert_allclose(program.axis, np.tile(R[:, 2], (len(program), 1)), atol=1e-9)
    atol = 1e-9
    arcs = 0
    for one in said:
        rows = np.flatnonzero(program.line == one.line)
        if one.depth is not None:
            h = (program.p_work[rows] - R @ one.p) @ R[:, 2]
            np.testing.assert_allclose(program.p_work[rows] - h[:, None] * R[:, 2], [R @ one.p] * len(rows), atol=atol)
            assert h.min() == pytest.approx(-one.depth, abs=atol)
            assert h[-1] == pytest.approx(one.up, abs=atol)
            assert (h[program.motion[rows] == LINE] < 0.0).all()
            continue
        assert len(rows) == 1
        np.testing.assert_allclose(program.p_work[rows[0]], R @ one.p, atol=atol)
        assert (program.motion[rows[0]] == RAPID) == one.rapid
        if one.circle is not None:
            arcs += 1
            sense = {2: -1.0, 3: 1.0}[int(program.motion[rows[0]])]
            np.testing.assert_allclose(sense * program.normal[rows[0]], R @ one.circle[3:], atol=1e-9)
            np.testing.assert_allclose(program.centre[rows[0]], R @ one.circle[:3], atol=atol)
    assert arcs == is_arc(program).sum() == len(re.findall(r"^\s*CIRCLE/", path.read_text(), re.MULTILINE))
    arc = is_arc(program)
    r = []
    for p in (starts(program), program.p_work):
        v = (p - program.centre)[arc]
        n = program.normal[arc]
        r.append(np.linalg.norm(v - (v * n).sum(axis=1)[:, None] * n, axis=1))
    np.testing.assert_allclose(*r, atol=1e-3)


@pytest.mark.parametrize("name", ["Guincho_Lbar1.apt", "Guincho_Lbar3.apt"])
def test_points_are_of_the_work_and_not_of_csys(name):
    """TRNTYP/WORLD: holes are in the stock as they stand; brought through their CSYS, either way, all lie beside it."""
    path = APT / name
    m = re.search(rf"Stock Size X({NUMBER})\s*Y({NUMBER})", path.read_text())
    size = np.array([float(x) for x in m.groups()])
    holes = [one for one in points(path) if one.depth is not None]
    assert len(holes) == 9
    for one in holes:
        A, t = one.csys
        brought = (A.T @ one.p + t, A @ (one.p - t))
        assert ((one.p[:2] > 0.0) & (one.p[:2] < size)).all()
        assert all(((b[:2] < 0.0) | (b[:2] > size)).any() for b in brought)


@pytest.mark.parametrize("path", [path for path in FILES if path.suffix == ".apt"], ids=lambda p: p.name)
def test_cutters(path):
    shapes, _ = read_cutters(path.read_text())
    said = re.findall(r"CUTTER/(.*)\s+LOAD/TOOL,(\d+)", path.read_text())
    assert {int(n) for _, n in said} == set(shapes) == set(read_apt_file(path)[0].tool.tolist())
    for numbers, n in reversed(said):
        first = next(x for x, m in said if m == n)
        if numbers == first:
            own = np.array([float(x) for x in numbers.split(",")]) * ([1.0] * 4 + [np.pi / 180.0] * 2 + [1.0])
            np.testing.assert_allclose(shapes[int(n)], own, atol=1e-12)


def test_csys_takes_the_instances_of_one_part_to_the_same_points():
    """Four pairs of holes, drilled in parts that lie turned in one sheet: p = A' p_work + t is the same for all."""
    holes = [one for one in points(APT / "manufacture3-top.apt") if one.depth is not None]
    groups: dict[tuple[float, ...], list[np.ndarray]] = {}
    for one in holes:
        A, t = one.csys
        groups.setdefault((*A.ravel(), *t), []).append(A.T @ one.p + t)
    own = [np.array(g) for g in groups.values()]
    assert len(own) == 4
    for group in own[1:]:
        away = np.linalg.norm(group[:, None] - own[0][None], axis=2).min(axis=1)
        assert away.max() < 0.02


PARTS = sorted((APT.parent / "heidenhain").glob("parts-*/*/11.h")) if APT.is_dir() else []


def blocks(path):
    """(n, 2) X Y of the L and C blocks, those that repeat their place left out."""
    now, out = [0.0, 0.0], []
    for line in path.read_text(errors="replace").splitlines():
        if not re.match(r"\d+ (L|C) ", line) or "M91" in line:
            continue
        words = re.findall(rf"\b([XY])\s*({NUMBER})", line)
        for letter, value in words:
            now["XY".index(letter)] = float(value)
        if words and (not out or out[-1] != now):
            out.append(list(now))
    return np.array(out)


@pytest.mark.parametrize("path", PARTS, ids=lambda p: p.parent.name)
def test_heidenhain_program_of_the_same_part_goes_the_same_way(path):
    """Its post-processor wrote three decimals; helical blocks (CP) give no point and are left out on both sides."""
    program, _ = read_apt_file(APT / f"{path.parent.name}.apt")
    theirs = blocks(path)
    rise = np.abs(np.diff(program.p_work[:, 2], prepend=program.p_work[:1, 2])) > 0.0
    ours = program.p_work[~(is_arc(program) & rise), :2]
    ours = ours[np.append(True, np.abs(np.diff(ours, axis=0)).max(axis=1) > 5e-4)]
    k = 0
    for p in theirs:
        while k < len(ours) and np.abs(ours[k] - p).max() > 1.1e-3:
            k += 1
        assert k < len(ours), p
    assert len(theirs) > 0.9 * len(ours)


@pytest.mark.parametrize("path", FILES, ids=lambda p: p.name)
def test_axes_of_the_machine_put_the_tool_where_the_text_says(path):
    machine, length = machine_named("dmu50"), 120.0
    program, _ = read_apt_file(path)
    commands, _ = to_axes(program, machine, tool_lengths=dict.fromkeys(program.tool.tolist(), length))
    tip, axis = forward(machine, commands.machine(), length)
    R, last = frame(path), {line: k for k, line in enumerate(commands.line.tolist())}
    for one in points(path):
        end = R @ (one.p if one.depth is None else one.p + one.up * np.array([0.0, 0.0, 1.0]))
        np.testing.assert_allclose(tip[last[one.line]], end, atol=1e-6)
        np.testing.assert_allclose(axis[last[one.line]], R[:, 2], atol=1e-6)


@pytest.mark.parametrize("name", ["pathdata2.txt", "tool path data3.txt"])
def test_goto_without_a_header(name):
    path = HUST / name
    program, findings = read_apt_file(path, feed=10.0)
    said = np.array([[float(x) for x in re.findall(NUMBER, line)] for line in path.read_text().split()])
    np.testing.assert_allclose(program.p_work, said[:, :3], atol=1e-12)
    np.testing.assert_allclose(
        program.axis, said[:, 3:] / np.linalg.norm(said[:, 3:], axis=1, keepdims=True), atol=1e-12
    )
    assert {f.code for f in findings} <= {"apt-units", "apt-start", "apt-end", "apt-axis"}


@pytest.mark.parametrize("name", ["Open pocket curve.txt", "tool path data.txt"])
def test_columns(name):
    path = HUST / name
    program, _ = read_cl_points(path.read_text(), feed=10.0, spindle=100.0, tool=2)
    said = np.loadtxt(path)
    np.testing.assert_allclose(program.p_work, said[:, :3], atol=1e-12)
    np.testing.assert_allclose(np.cross(program.axis, said[:, 3:]), 0.0, atol=1e-9)
    assert ((program.axis * said[:, 3:]).sum(axis=1) > 0.9).all()
    if (program.axis[:, 2] < 0.0).any():
        return  # the table of this machine turns no point of the work over to the spindle from below
    commands, _ = to_axes(program, machine_named("dmu50"), tool_lengths={2: 80.0})
    tip, axis = forward(machine_named("dmu50"), commands.machine(), 80.0)
    last = np.append(np.flatnonzero(np.diff(commands.line)), len(tip) - 1)
    np.testing.assert_allclose(tip[last], said[:, :3], atol=1e-6)
    np.testing.assert_allclose(axis[last], program.axis, atol=1e-8)
