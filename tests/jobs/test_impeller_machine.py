"""Programs of an impeller on the whole machine: by brute force over all rows and channels, and by changed texts."""

from __future__ import annotations

import math
import re
from dataclasses import fields, replace

import numpy as np
import pytest

import chipload
from chipload.checking.workpiece import Surroundings
from chipload.cutter.catalogue import CatalogueCutter
from chipload.errors import Severity
from chipload.jobs.impeller import programs, read_program
from chipload.jobs.impeller.machine_check import (
    around_part,
    every_channel,
    every_channel_findings,
    text_check,
)
from chipload.jobs.impeller.programs import program_files, table_text
from chipload.jobs.impeller.result import result_of
from chipload.machine.machine import machine_named
from chipload.machine.table import MachineTable
from chipload.program.gcode.writer import write_gcode
from chipload.program.program import LINE, RAPID
from chipload.program.read import times_of, times_on
from chipload.program.read_back import read_back
from chipload.program.release import NOT_SIMULATED
from chipload.result import Verdict, release_of
from impeller_job import impeller_job

MACHINE = machine_named("horizontal-b")
BLADES, CLEARANCE = 11, 0.5
#: cutting part of 40 mm, a shank, and a holder from 70 mm on
TOOL = CatalogueCutter(34.0, 2.0, 40.0, shank_diameter=20.0, reach=70.0, holder_diameter=63.0)
#: with a holder that goes lower than the cutter
WIDE = replace(TOOL, holder_diameter=120.0)
FILE = "program.ngc"


@pytest.fixture(scope="module")
def milled(tmp_path_factory):
    """The outcome of a small job: two programs, at 20 and 70 deg."""
    return chipload.run_job(impeller_job(tmp_path_factory.mktemp("impeller"))).outcome


@pytest.fixture(scope="module")
def written(milled):
    """The program at 70 deg, its text of one channel and that of all."""
    checked = milled.programs[1]
    one, every = (table_text(milled, checked, of, NOT_SIMULATED) for of in (None, checked.repeat))
    return checked, one, every


def plate(milled, top: float, clearance: float = CLEARANCE):
    """A table that ends at a height [mm]."""
    table = MachineTable((-160.0, -160.0, top - 20.0), (160.0, 160.0, top), 8.0)
    return around_part(Surroundings(machine_table=table), MACHINE, milled.impeller, clearance)


def depth_in_tool(points, tip, axis, low: float, high: float, radius: float) -> float:
    """How deep the deepest of some points lies in a cylinder of a tool, between two heights [mm]."""
    y = points - tip
    h = y @ axis
    d = np.linalg.norm(y - h[:, None] * axis, axis=1)
    return float(np.minimum(radius - d, np.minimum(h - low, high - h)).max())


def found_of(check, code: str) -> list[str]:
    return [f.text for f in check.findings if f.code == code]


def test_the_holder_goes_as_deep_into_the_table_as_points_of_its_rows_show(milled, written) -> None:
    """Cylinders of the tool at every row of every channel, against the points of the table: no cells, no steps."""
    checked, one, _ = written
    around = plate(milled, 8.0)
    check = text_check(one, FILE, MACHINE, WIDE, checked.setting.program, around)
    found = {text.split(" goes ")[0]: float(re.search(r"goes ([\d.]+) mm", text)[1]) for text in
             found_of(check, "collision")}  # fmt: skip
    whole = every_channel(checked.setting.program, BLADES)
    points = around.points["machine table"]
    deepest = max(
        depth_in_tool(points, p, a, 70.0, math.inf, 60.0) for p, a in zip(whole.p_work, whole.axis, strict=True)
    )
    assert found["shank or holder"] == pytest.approx(deepest, abs=0.05)
    assert all(f.severity is Severity.EXCEEDS and f.line > 0 for f in check.findings)


def test_a_holder_nearer_than_the_clearance_is_found_with_its_distance(milled, written) -> None:
    checked, one, _ = written
    p = checked.setting.program
    # the lower edge of the holder, by its rim
    up, aside = p.axis[:, 2], np.sqrt(1.0 - p.axis[:, 2] ** 2)
    rim = float((p.p_work[:, 2] + 70.0 * up - 60.0 * aside).min())
    tip = float((p.p_work[:, 2] + np.minimum(2.0 * up - 15.0 * aside - 2.0, 40.0 * up - 17.0 * aside)).min())
    assert tip > rim
    free, near = (text_check(one, FILE, MACHINE, WIDE, p, plate(milled, rim - gap)) for gap in (0.8, 0.3))
    assert not found_of(free, "collision")
    (text,) = found_of(near, "collision")
    assert text.startswith("shank or holder comes within")
    assert float(re.search(r"within ([\d.]+) mm", text)[1]) == pytest.approx(0.3, abs=0.05)


def test_what_lies_below_the_part_is_not_known_without_a_table(milled, written) -> None:
    """The lowest point of the holder, by its rim."""
    checked, one, _ = written
    p = checked.setting.program
    wide = replace(TOOL, holder_diameter=140.0)
    bare = around_part(Surroundings(), MACHINE, milled.impeller, CLEARANCE)
    assert bare.bottom == 0.0
    assert not found_of(text_check(one, FILE, MACHINE, TOOL, p, bare), "below-stock")
    check = text_check(one, FILE, MACHINE, wide, p, bare)
    (text,) = found_of(check, "below-stock")
    rim = (p.p_work[:, 2] + 70.0 * p.axis[:, 2] - 70.0 * np.sqrt(1.0 - p.axis[:, 2] ** 2)).min()
    assert float(re.search(r"goes ([\d.]+) mm below", text)[1]) == pytest.approx(-rim, abs=0.01)
    assert check.doubts == (text,)
    # with a table below the part it is compared instead
    assert not text_check(one, FILE, MACHINE, wide, p, plate(milled, rim - 1.0)).findings


def test_a_text_that_is_not_the_plan_is_not_released(milled, written) -> None:
    checked, one, every = written
    p, around = checked.setting.program, plate(milled, -90.0)
    assert not text_check(one, FILE, MACHINE, TOOL, p, around).findings
    k, line = next((k, x) for k, x in list(enumerate(one.splitlines()))[20:] if " Y" in x)
    moved = re.sub(r"Y(-?[\d.]+)", lambda m: f"Y{float(m[1]) + 0.1:.6f}", line)
    check = text_check(one.replace(line, moved, 1), FILE, MACHINE, TOOL, p, around)
    assert [f.code for f in check.findings] == ["text-differs"]
    assert check.findings[0].line >= k + 1
    backwards = text_check(one.replace(" M3", " M4"), FILE, MACHINE, TOOL, p, around)
    assert {f.code for f in backwards.findings} >= {"spindle-reversed"}
    assert [f.code for f in text_check("G0 X1 Q", FILE, MACHINE, TOOL, p, around).findings] == ["text-unread"]
    repeat = checked.repeat
    assert not every_channel_findings(one, every, FILE, MACHINE, TOOL, repeat)
    for old, new in (("/ 11]", "/ 12]"), ("repeat [11]", "repeat [10]"), (line, moved)):
        assert old in every
        (f,) = every_channel_findings(one, every.replace(old, new, 1), FILE, MACHINE, TOOL, repeat)
        assert f.code == "text-differs"


def without_a_pass(text: str) -> str:
    """The longest feed motion is left out: the one that goes farthest in Y."""
    lines = text.splitlines()
    feeds = [k for k, line in enumerate(lines) if re.match(r"(G1 )?X[^Z]* Y", line) and not line.startswith("G0")]
    return "\n".join(lines[: feeds[2]] + lines[feeds[2] + 1 :]) + "\n"


def deeper(text: str) -> str:
    """Every height of the text 0.5 mm lower, from the first approach on."""
    return re.sub(r"Z(-?[\d.]+)", lambda m: f"Z{float(m[1]) - 0.5:.6f}", text)


CHANGES = {
    "feed doubled": lambda text: re.sub(r"F([\d.]+)", lambda m: f"F{2.0 * float(m[1]):.6g}", text),
    "spindle reversed": lambda text: text.replace(" M3", " M4"),
    "line deleted": without_a_pass,
    "wrong tool": lambda text: re.sub(r"T(\d+) M6", "T9 M6", text),
    "lower": deeper,
    "no end": lambda text: text.replace("\nM2\n", "\n"),
}


@pytest.mark.parametrize("change", CHANGES)
def test_a_changed_text_exceeds_and_is_not_released(milled, written, change, monkeypatch) -> None:
    """By the reader where the writer is wrong, and by its blocks where it is changed after it was simulated."""
    checked, one, _ = written
    p, around = checked.setting.program, plate(milled, -90.0)
    changed = CHANGES[change](one)
    assert changed != one
    assert text_check(changed, FILE, MACHINE, TOOL, p, around).fails
    held = result_of(milled)
    name = next(
        file for track in held.in_use for file in track.programs if file.endswith(".ngc") and "-all" not in file
    )
    assert program_files(milled, held)[name].startswith(b"(chipload: verified")
    own = programs.write_gcode
    monkeypatch.setattr(programs, "write_gcode", lambda *a, **k: CHANGES[change](own(*a, **k)))
    assert program_files(milled, held)[name].startswith(b"(NOT VERIFIED: its text is not the one")


def test_what_is_simulated_is_what_was_read(milled, written, tmp_path, monkeypatch) -> None:
    """A writer that goes 0.5 mm too low gouges by as much; the job of such texts exceeds, and none is released."""
    own = read_program.write_gcode
    for module in (read_program, programs):
        monkeypatch.setattr(module, "write_gcode", lambda *a, **k: deeper(own(*a, **k)))
    found = chipload.run_job(impeller_job(tmp_path))
    assert found.result.verdict is Verdict.EXCEEDS
    assert max(p.gouge.found for p in found.outcome.programs) > max(p.gouge.found for p in milled.programs) + 0.1
    assert not any(
        text.startswith(b"(chipload: verified") for file, text in program_files(found.outcome, found.result).items()
        if file.endswith((".ngc", ".apt"))
    )  # fmt: skip


def test_the_history_is_that_of_the_text(milled, written) -> None:
    """Lines, places and time of each row, by the file as it is read from its first line to its end."""
    checked, one, _ = written
    track = next(t for t in result_of(milled).tracks if t.time_s == checked.seconds)
    reading = read_back(one, FILE, MACHINE, {2: TOOL.assembled(2, 100.0)})
    seconds = times_of(reading, MACHINE)
    columns = track.columns
    assert columns["t_s"][-1] == pytest.approx(seconds.sum(), rel=1e-12)
    assert track.time_s == pytest.approx(seconds.sum(), rel=1e-12)
    assert columns["line"][-1] == reading.program.line[-1]
    assert one.splitlines()[columns["line"][-1] - 1].startswith(("G0", "Z", "X", "Y"))
    n = len(columns["line"])
    np.testing.assert_array_equal(columns["line"], reading.program.line[-n:])
    for k, x in enumerate("xyz"):
        np.testing.assert_allclose(columns[f"{x}_mm"], reading.program.p_work[-n:, k], atol=1e-9)
    assert {"finish", "link"} <= set(columns["pass"].tolist())
    # what is in tracks takes as long as it does in the plan
    plan = times_on(checked.setting.program, MACHINE)
    cut = np.array([x == "finish" for x in checked.setting.program.labels])[checked.setting.program.label]
    assert checked.cutting == pytest.approx(plan[cut].sum(), rel=2e-3)


def test_a_row_that_only_begins_a_feed_is_no_difference(milled, written) -> None:
    """A row at the end of a rapid, fed and without a motion, has no words in the text."""
    checked, _, _ = written
    p = checked.setting.program
    k = int(np.flatnonzero(p.motion == RAPID)[1])
    rows = np.insert(np.arange(len(p)), k + 1, k)
    fed = replace(p, **{f.name: getattr(p, f.name)[rows] for f in fields(p) if f.name != "labels"})
    motion, feed = fed.motion.copy(), fed.feed.copy()
    motion[k + 1], feed[k + 1] = LINE, 20.0
    fed = replace(fed, motion=motion, feed=feed)
    text = write_gcode(fed, MACHINE, title="fed", release=NOT_SIMULATED)
    assert not text_check(text, FILE, MACHINE, TOOL, fed, plate(milled, -90.0)).findings


def test_the_way_between_channels_is_that_of_the_pallet(written) -> None:
    """From the end of a channel to the next the pallet turns while the linear axes go straight; nothing jumps."""
    program = written[0].setting.program
    whole = every_channel(program, BLADES)
    # turned back by the pallet it is a straight line, as the linear axes go
    own = slice(len(program) - 1, len(whole) // BLADES + 1)
    between, angle = whole.p_work[own], np.unwrap(np.arctan2(whole.axis[:, 1], whole.axis[:, 0]))[own]
    x, y, c, s = between[:, 0], between[:, 1], np.cos(angle), np.sin(angle)
    still = np.column_stack([c * x + s * y, c * y - s * x, between[:, 2]])
    share = np.linspace(0.0, 1.0, len(still))[:, None]
    assert still == pytest.approx((1.0 - share) * still[0] + share * still[-1], abs=1e-9)
    ends = program.p_work[[-1, 0]]
    turn = math.tau / BLADES
    c, s = math.cos(turn), math.sin(turn)
    assert between[0] == pytest.approx(ends[0])
    assert between[-1] == pytest.approx(np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ ends[1])
    turns = np.degrees(np.arccos(np.clip((whole.axis[1:] * whole.axis[:-1]).sum(axis=1), -1.0, 1.0)))
    assert turns[len(program) - 1 : len(whole) // BLADES].max() <= 3.01


def positions(text: str, letter: str) -> list[float]:
    """Where an axis is sent by a text."""
    lines = (x for x in text.splitlines() if not x.startswith(("(", "#", "G52")))
    return [float(v) for line in lines for v in re.findall(rf"{letter}(-?[\d.]+)", line)]


def test_each_axis_stays_within_its_travel_or_exceeds(milled, written) -> None:
    """By the words of the text: the part's zero is that of the machine's file."""
    checked, one, _ = written
    p, around = checked.setting.program, plate(milled, -90.0)
    x, z = positions(one, "X"), positions(one, "Z")
    assert text_check(one, FILE, MACHINE, TOOL, p, around).lengths == pytest.approx((70.0, 500.0 - max(z)), abs=1e-6)

    def on(letter: str, low: float, high: float, cutter: CatalogueCutter = TOOL):
        axes = tuple(replace(a, low=low, high=high) if a.letter == letter else a for a in MACHINE.chain.axes)
        short = replace(MACHINE, chain=replace(MACHINE.chain, axes=axes))
        return text_check(one, FILE, short, cutter, p, around)

    assert not on("X", min(x) - 0.001, max(x) + 0.001).findings
    (text,) = found_of(on("X", min(x) - 0.001, max(x) - 0.5), "machine-limit")
    assert f"X = {max(x):g} mm" in text
    # the tool is at least as long as its reach, and as long as it is stated to be
    assert not on("Z", -200.0, max(z) + 70.1).findings
    (text,) = found_of(on("Z", -200.0, max(z) + 69.9), "machine-limit")
    assert f"Z = {max(z) + 70.0:g} mm" in text
    assert on("Z", -200.0, max(z) + 100.1, replace(TOOL, length=100.0)) == on(
        "Z", -200.0, 999.0, replace(TOOL, length=100.0)
    )
    assert found_of(on("Z", -200.0, max(z) + 99.9, replace(TOOL, length=100.0)), "machine-limit")


def test_a_cutter_is_not_turned_faster_than_it_may_be(milled, written) -> None:
    checked, one, _ = written
    p, around = checked.setting.program, plate(milled, -90.0)
    speeds = [float(v) for v in re.findall(r"S([\d.]+)", one)]
    slow, quick = (replace(TOOL, max_speed=max(speeds) * k * math.tau / 60.0) for k in (0.99, 1.01))
    (text,) = found_of(text_check(one, FILE, MACHINE, slow, p, around), "cutter-speed")
    assert f"turns at {max(speeds):g} rpm" in text
    assert not text_check(one, FILE, MACHINE, quick, p, around).findings


def test_no_program_is_released_unless_the_whole_job_holds(milled) -> None:
    held = result_of(milled)
    files = [file for track in held.in_use for file in track.programs]
    assert files
    assert all(release_of(held, file).verified for file in files)
    checked = milled.checked
    doubt = text_check("G0 X1 Q", FILE, MACHINE, TOOL, milled.programs[0].setting.program, plate(milled, 0.0))
    spoilt = tuple(replace(w, programs=(replace(w.programs[0], machine_check=doubt), *w.programs[1:])) for w in checked)
    result = result_of(replace(milled, checked=spoilt))
    assert not any(release_of(result, file).verified for track in result.tracks for file in track.programs)


def test_what_is_not_stated_is_listed(milled) -> None:
    listed = result_of(replace(milled, stated=replace(milled.stated, around=()))).unchecked
    for item in ("fixtures: none", "pallet and machine table: none", "holders of D 34 r 2", "length_mm of D 34 r 2"):
        assert any(item in text for text in listed), item
    assert [c.text for c in result_of(milled).tracks[0].limits] == [
        "all contact points reached", "all contact points certified",
    ]  # fmt: skip


def test_what_no_program_mills_is_listed_with_its_share(milled) -> None:
    """By triangles of the side, whose areas are added where their middle lies in the range of the job."""
    (text,) = (x for x in result_of(milled).unchecked if x.startswith("not milled: "))
    parts = text.removeprefix("not milled: ").split("; ")
    assert parts[-2:] == ["blade floor", "leading and trailing edges and tips of all blades"]
    for part, side in zip(parts[:2], ("plus", "minus"), strict=True):
        stated, rest = part.split(" % of blade ")
        assert rest == f"{side}, beyond 0.3 to 0.34 along and 0.5 to 0.56 up"
        t, w = np.linspace(0.0, 1.0, 101), np.linspace(0.0, 1.0, 51)
        grid = getattr(milled.impeller.blade, side).at(*(x.ravel() for x in np.meshgrid(t, w, indexing="ij")))
        p = grid.reshape(101, 51, 3)
        a, b, c, d = p[:-1, :-1], p[1:, :-1], p[1:, 1:], p[:-1, 1:]
        cell = 0.5 * sum(np.linalg.norm(np.cross(y - x, z - x), axis=2) for x, y, z in ((a, b, c), (a, c, d)))
        left = 100.0 * (1.0 - cell[30:34, 25:28].sum() / cell.sum())
        assert float(stated) == pytest.approx(left, abs=0.06)
