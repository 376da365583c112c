"""New feeds of programs: closed forms of a slot, what still exceeds, and that what is said to hold does."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from chipload.errors import InputError
from chipload.jobs import FinishedJob, load_job, run_job
from chipload.program.gcode.reader import read_gcode
from chipload.report.page import page_bytes
from chipload.result import Verdict, error_of
from mill import made_up_job, made_up_material

MATERIAL = made_up_material(1200.0, 500.0, 300.0, 14.0, 11.0, 2.0)
JOB = made_up_job(
    2,
    2.0,
    """[operation.feeds]
slowest_percent = 10.0
fastest_percent = 900.0
change_least_percent = 0.0
divide = false
[limits]
""",
)
HEAD = "G21 G90 G94 G17\nT1 M6\nS3000 M3\n"
SLOT = HEAD + "G0 X-8 Y0 Z5\nG0 Z-3\nG1 X34 F600 (slot)\nG0 Z5\nM2\n"


#: closed forms give nominal loads; the budget at 95 % has tests of its own
NOMINAL = "checks.confidence=0.5"


def done(folder: Path, text: str, limits: str, changes: tuple[str, ...] = (NOMINAL,), job: str = JOB) -> FinishedJob:
    (folder / "m.toml").write_text(MATERIAL)
    (folder / "a.ngc").write_bytes(text.encode())
    (folder / "job.toml").write_text(job + limits)
    return run_job(load_job(folder / "job.toml", list(changes)))


def feed_of(text: str, line: int) -> float:
    """The feed of a line: its own word or the last one above it."""
    return float(re.findall(r"F([\d.]+)", "\n".join(text.split("\n")[:line]))[-1])


#: limits at which a slot has a feed of some hundred mm/min
LIMITS = {"force_n": 620.0, "force_axial_n": 120.0, "torque_nm": 2.5, "power_w": 400.0, "chip_max_mm": 0.13}


def slot_feed(name: str, load: float) -> float:
    """The feed [mm/min] at which a slot of 3 mm with two straight teeth has a load.

    [Altintas2012] ch. 2: a tooth straight ahead has h = f_z, all other rotations less; the mean torque as there, but of
    chips between trochoids: the integral of h over the front is 2 f_z + pi f_z^2 / (4 R), and a tooth touches over
    pi + f_z / R. Every slice against these paths (tests/engagement/tooth_paths.py) gives the same within 1e-4.
    """
    a, teeth, rpm, omega, R = 3.0, 2, 3000.0, 3000.0 * math.tau / 60.0, 5.0
    cut, edge = np.array([1200.0, 500.0, 300.0]), np.array([14.0, 11.0, 2.0])
    roots = np.roots([(cut**2).sum(), 2.0 * (cut * edge).sum(), (edge**2).sum() - (load / a) ** 2])
    turned = load * 1000.0 / omega * math.tau / (teeth * a * R)
    mean = np.roots([cut[0] * math.pi / (4.0 * R), 2.0 * cut[0] + edge[0] / R, math.pi * edge[0] - turned])
    tooth = {
        "force_n": float(roots.real.max()),
        "force_axial_n": (load / a - edge[2]) / cut[2],
        "torque_nm": (load * 1000.0 / (R * a) - edge[0]) / cut[0],
        "power_w": float(mean.real.max()),
        "chip_max_mm": load,
    }
    return tooth[name] * teeth * rpm


def aimed(read: FinishedJob, name: str) -> float:
    """The feed [mm/min] of the slot that leaves room for the resolution error of the load, as it is documented."""
    error = error_of(name, read.outcome.feeds.before.resolution_error)
    assert (0.005 if name == "power_w" else 0.007) <= error < 0.03
    return slot_feed(name, LIMITS[name] / (1.0 + 2.0 * error))


@pytest.mark.parametrize("name", ["force_n", "force_axial_n", "torque_nm", "power_w", "chip_max_mm"])
def test_a_slot_gets_the_feed_of_the_closed_form(tmp_path: Path, name: str) -> None:
    limit = LIMITS[name]
    read = done(tmp_path, SLOT, f"{name} = {limit}\n")
    feed = aimed(read, name)
    assert 100.0 < feed < 3000.0
    assert read.outcome.feeds is not None
    assert feed_of(read.outcome.feeds.text, 6) == pytest.approx(feed, rel=1.2e-3)
    assert feed_of(read.outcome.feeds.text, 6) <= feed
    assert read.outcome.feeds.by == (name,)
    assert read.result.verdict is Verdict.HOLDS
    assert read.outcome.feeds.text == SLOT.replace("F600", f"F{feed_of(read.outcome.feeds.text, 6):g}")


def test_a_limit_that_is_used_fully_still_holds_within_the_resolution_error(tmp_path: Path) -> None:
    """The new loads are within their limit whatever their own resolution error; without room for it they are not."""
    read = done(tmp_path, SLOT, "".join(f"{k} = {v}\n" for k, v in LIMITS.items()))
    (check,) = (c for c in read.result.limits if c.name == read.outcome.feeds.by[0])
    assert check.state is Verdict.HOLDS
    assert check.resolution_error >= 0.005
    assert 0.97 * check.limit < check.worst * (1.0 + check.resolution_error) <= check.limit
    # the feed of the closed form for the whole limit is within it, but not within the resolution error
    full = slot_feed(check.name, 0.999 * check.limit)
    plain = JOB[: JOB.index("[operation.feeds]")] + "[limits]\n"
    used = done(tmp_path, SLOT.replace("F600", f"F{full:.3f}"), f"{check.name} = {check.limit}\n", job=plain)
    assert used.result.limits[0].state is Verdict.UNPROVEN
    assert used.result.limits[0].worst < check.limit


def test_the_least_of_two_limits_holds_a_line(tmp_path: Path) -> None:
    read = done(tmp_path, SLOT, "".join(f"{k} = {v}\n" for k, v in LIMITS.items()))
    feeds = {name: aimed(read, name) for name in LIMITS}
    least = min(feeds, key=feeds.__getitem__)
    assert read.outcome.feeds.by == (least,)
    assert feed_of(read.outcome.feeds.text, 6) == pytest.approx(feeds[least], rel=1.2e-3)


@pytest.mark.parametrize(
    ("text", "per"),
    [
        (SLOT.replace("G21", "G20").replace("X-8", "X-0.314961").replace("X34 F600", "X1.338583 F23.6")
         .replace("Z-3", "Z-0.11811"), 25.4),
        (SLOT.replace("G94", "G93").replace("F600", "F14."), 42.0),
        (SLOT.replace("G94", "G95").replace("F600", "F0.2"), 3000.0),
    ],
    ids=["inch", "inverse time", "per turn"],
)  # fmt: skip
def test_feeds_are_changed_in_the_unit_of_the_text(tmp_path: Path, text: str, per: float) -> None:
    read = done(tmp_path, text, f"force_n = {LIMITS['force_n']}\n")
    feed = aimed(read, "force_n")
    assert feed_of(read.outcome.feeds.text, 6) == pytest.approx(feed / per, rel=1.3e-3)
    assert re.sub(r" F[\d.]+", "", read.outcome.feeds.text) == re.sub(r" F[\d.]+", "", text)
    assert read.result.verdict is Verdict.HOLDS


def test_the_words_of_a_sinumerik_are_changed_too(tmp_path: Path) -> None:
    text = "; a slot\nG71 G90 G94 G17\nT1 M6\nS3000 M3\nG0 X-8 Y0 Z5\nG0 Z-3\nG1 X34 F=600 ; F9\nG0 Z5\nM30\n"
    (tmp_path / "a.mpf").write_text(text)
    job = JOB.replace("a.ngc", "a.mpf")
    read = done(tmp_path, SLOT, f"force_n = {LIMITS['force_n']}\n", job=job)
    feed = aimed(read, "force_n")
    word = re.search(r"F=([\d.]+) ; F9", read.outcome.feeds.text)
    assert float(word[1]) == pytest.approx(feed, rel=1.2e-3)
    assert read.outcome.feeds.text == text.replace("600", word[1])
    bad = done(tmp_path, SLOT, "force_n = 50.0\n", job=job)
    first, rest = bad.presentation.files(bad.result)["0-feeds.mpf"].decode().split("\n", 1)
    assert first.startswith("; a slot ; NOT VERIFIED: Exceeds: force ")
    assert rest == bad.outcome.feeds.text.split("\n", 1)[1]


def test_no_feed_is_asked_that_a_short_line_does_not_reach(tmp_path: Path) -> None:
    """From rest to rest over s at the acceleration a the machine reaches sqrt(a s), here of 3000 mm/s^2."""
    text = HEAD + "G0 X60 Y60 Z5\nG1 X60.03 F300\nG0 Y50\nG1 X68 F300\nG0 X70\nM2\n"
    read = done(tmp_path, text, "force_n = 620.0\n", ("operation.0.feeds.air_mm_min=6000",))
    assert feed_of(read.outcome.feeds.text, 5) == pytest.approx(60.0 * math.sqrt(3000.0 * 0.03), rel=1e-3)
    assert feed_of(read.outcome.feeds.text, 7) == 6000.0
    assert read.outcome.feeds.by == ("machine", "air")
    # the long one: up and down takes v / a, the rest is at 100 mm/s
    before, after = read.outcome.feeds.seconds_before, float(read.outcome.seconds.sum())
    long = (7.97 / 5.0 + 5.0 / 3000.0) - (7.97 / 100.0 + 100.0 / 3000.0)
    short = (0.03 / 5.0 + 5.0 / 3000.0) - 2.0 * math.sqrt(0.03 / 3000.0)
    assert before - after == pytest.approx(long + short, rel=1e-3)


WAYS = (
    HEAD
    + """G0 X-8 Y-12 Z5
G0 Z-3
G1 X-6 F400 ; air
X20 (slot)
Y12
G3 X14 Y18 I-6 J0
G1 X6 Y18
X6.02
G0 Z5
G0 X60 Y60
G1 X70 F300
M2
"""
)


def test_each_line_is_held_by_what_the_job_and_the_machine_say(tmp_path: Path) -> None:
    more = ("operation.0.feeds.air_mm_min=4000", "operation.0.feeds.fastest_mm_min=900", NOMINAL)
    read = done(tmp_path, WAYS, "force_n = 620.0\n", more)
    held = dict(zip(read.outcome.feeds.line.tolist(), read.outcome.feeds.by, strict=True))
    # 0.02 mm from full feed to rest: sqrt(2 a s) is asked, no more
    assert held == {6: "air", 7: "force_n", 8: "force_n", 9: "force_n", 10: "force_n", 11: "machine", 14: "air"}
    assert feed_of(read.outcome.feeds.text, 6) == feed_of(read.outcome.feeds.text, 14) == 4000.0
    assert max(feed_of(read.outcome.feeds.text, k) for k in (7, 8, 9, 10)) <= 900.0
    assert feed_of(read.outcome.feeds.text, 11) <= 900.0
    kept = done(tmp_path, WAYS, "force_n = 620.0\n")
    assert feed_of(kept.outcome.feeds.text, 14) == 300.0
    assert dict(zip(kept.outcome.feeds.line.tolist(), kept.outcome.feeds.by, strict=True))[14] == "programmed"


def test_what_no_feed_can_hold_is_listed_and_said_in_the_first_line(tmp_path: Path) -> None:
    read = done(tmp_path, WAYS.replace("\n", "\r\n"), "force_n = 50.0\n")
    assert read.result.verdict is Verdict.EXCEEDS
    assert read.result.message.startswith("Exceeds: force ")
    feeds = read.result.operations[0]["feeds"]
    listed = {x["line"]: x for x in feeds["still_exceeding"]}
    assert feeds["still_exceeding_count"] == len(listed) >= 2
    for row in listed.values():
        assert row["slowest"]
        assert row["factor"] == pytest.approx(0.1)
        assert row["allowed"] == 50.0 < row["worst"] < row["before"]
    text = read.presentation.files(read.result)["0-feeds.ngc"].decode()
    first, rest = text.split("\r\n", 1)
    assert re.fullmatch(r"G21 G90 G94 G17 \(NOT VERIFIED: [ -~]+\)", first)
    assert rest == read.outcome.feeds.text.split("\r\n", 1)[1]
    page = page_bytes(read.result, read.presentation).decode()
    assert "Lines that still exceed a limit" in page
    assert read.result.message.split(";")[0] in page


def test_lines_that_would_rub_are_listed(tmp_path: Path) -> None:
    """The least feed per tooth is a floor under limits, and what the fastest feed keeps below it is said."""
    least = ("operation.0.feeds.tooth_feed_least_mm=0.05", NOMINAL)
    slow = done(tmp_path, SLOT, "force_n = 50.0\n", least)
    assert feed_of(slow.outcome.feeds.text, 6) == pytest.approx(0.05 * 2 * 3000, rel=1.2e-3)
    assert slow.outcome.feeds.rubs == ()
    rubs = done(
        tmp_path, SLOT.replace("F600", "F60"), "force_n = 620.0\n", (*least, "operation.0.feeds.fastest_percent=200")
    )
    assert rubs.outcome.feeds.rubs == ((6, pytest.approx(0.02)),)
    assert rubs.result.verdict is Verdict.EXCEEDS
    first = "Exceeds: line 6: feed per tooth 0.02 mm is less than 0.05 mm. Critical limit: force 132 of 620 N, "
    assert rubs.result.message.startswith(first)


def test_a_limit_is_used_up(tmp_path: Path) -> None:
    """A third simulation: the load that each line leaves is what its resolution error may take, and 1 % of feed more
    takes it.
    """
    read = done(tmp_path, WAYS, "force_n = 620.0\n")
    held = [k for k, by in zip(read.outcome.feeds.line.tolist(), read.outcome.feeds.by, strict=True) if by == "force_n"]
    assert len(held) >= 3
    lines = read.outcome.feeds.text.split("\n")
    for k in held:
        bare = re.sub(r" F[\d.]+", "", lines[k - 1]).split(" (")[0]
        lines[k - 1] = f"{bare} F{1.01 * feed_of(read.outcome.feeds.text, k):.3f}"
    for k in set(read.outcome.feeds.line.tolist()) - set(held):
        lines[k - 1] = (
            f"{re.sub(r' F[0-9.]+', '', lines[k - 1]).split(' ;')[0]} F{feed_of(read.outcome.feeds.text, k):g}"
        )
    plain = JOB[: JOB.index("[operation.feeds]")] + "[limits]\n"
    more = done(tmp_path, "\n".join(lines), "force_n = 620.0\n", job=plain).outcome.simulated.removal.columns
    room = 620.0 / (1.0 + 2.0 * read.outcome.feeds.before.resolution_error["force_n"])
    assert sorted(set(more["line"][more["force_n"] > room].tolist())) == held
    assert read.outcome.simulated.removal.columns["force_n"].max() <= room


def test_the_table_of_feeds_alone_tells_the_kind_of_job(tmp_path: Path) -> None:
    """In the file or by ``--set``; the keys of both kinds are else the same."""
    plain = JOB[: JOB.index("[operation.feeds]")] + "[limits]\nforce_n = 620.0\n"
    (tmp_path / "job.toml").write_text(plain)
    assert load_job(tmp_path / "job.toml").capability.name == "program"
    asked = ["operation.0.feeds.slowest_percent=50", "operation.0.feeds.fastest_percent=200"]
    assert load_job(tmp_path / "job.toml", asked).capability.name == "feeds"
    (tmp_path / "job.toml").write_text(JOB + "force_n = 620.0\n")
    assert load_job(tmp_path / "job.toml", ["operation.0.step_mm=3"]).capability.name == "feeds"
    with pytest.raises(InputError, match="find speeds first, then feeds for the new program"):
        load_job(tmp_path / "job.toml", ["operation.0.speeds.least_rpm=5000"])
    (tmp_path / "job.toml").write_text(plain.replace("force_n = 620.0", ""))
    with pytest.raises(InputError, match="no load limit is stated"):
        load_job(tmp_path / "job.toml", asked)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("#1 = 600\n" + SLOT.replace("F600", "F#1"), "line 7: F#1: a feed that is calculated cannot be changed"),
        (
            HEAD + "o1 repeat [2]\nG1 X3 F60\no1 endrepeat\nM2\n",
            "line 4: o1 repeat: feeds are changed only in a program",
        ),
        (SLOT.replace("\n", "\r"), "a.ngc: a line ends with CR alone"),
    ],
)
def test_texts_whose_feeds_cannot_be_changed(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(InputError, match=re.escape(said)):
        done(tmp_path, text, "force_n = 620.0\n")


def test_cl_data_are_to_be_converted_first(tmp_path: Path) -> None:
    text = "PARTNO/x\nUNITS/MM\nLOADTL/1\nSPINDL/3000,CLW\nRAPID\nGOTO/-8,0,5\nFEDRAT/600\nGOTO/34,0,-3\nFINI\n"
    (tmp_path / "a.cls").write_text(text)
    said = "operation.0.feeds: a.cls is apt: feeds are changed in NC texts of LinuxCNC, Fanuc or Sinumerik: convert"
    with pytest.raises(InputError, match=re.escape(said)):
        done(tmp_path, SLOT, "force_n = 620.0\n", job=JOB.replace("a.ngc", "a.cls"))


def test_the_thickest_chip_of_a_ramp_is_not_that_of_its_greatest_force(tmp_path: Path) -> None:
    """The cutter rises out of the block: its chip is thickest before its force is greatest (found by random ways)."""
    text = HEAD + "G0 X-9 Y0\nG0 Z-2\nF500\nG1 X-2.40 Y-7.97 Z0.94\nG0 Z9\nM2\n"
    job = JOB.replace("helix_deg = 0.0\n", "helix_deg = 30.0\nrunout_mm = 0.01\nrunout_deg = 20.0\n")
    read = done(tmp_path, text, "chip_max_mm = 0.026\n", job=job)
    before, after = read.outcome.feeds.before.columns, read.outcome.simulated.removal.columns
    assert before["chip_max_mm"].max() > 0.08
    # all of the limit is used but the room for the stated error of the chip
    room = 1.0 + 2.0 * read.outcome.feeds.before.resolution_error["chip_max_mm"]
    assert room < 1.15
    assert 0.026 / room < after["chip_max_mm"].max() <= 0.026


def test_the_chip_of_another_instant_grows_no_more_than_the_feed(tmp_path: Path) -> None:
    """The instant of the greatest force is not that of the thickest chip, and runout adds to each what the feed does
    not change: a line that may go 2.85 times as fast keeps the limit (found by random ways).
    """
    ways = "F500\nG1 X-0.00 Y-19.20 Z-3.39 F1972\nG1 X0.00 Y-10.00 Z-0.14 F1737\nG1 X0.05 Y-13.92 Z-0.00\nG0 Z9\nM2\n"
    job = JOB.replace("helix_deg = 0.0\n", "helix_deg = 30.0\nrunout_mm = 0.01\nrunout_deg = 20.0\n")
    read = done(tmp_path, HEAD + "G0 X-9 Y0\nG0 Z-2\n" + ways, "chip_max_mm = 0.178\n", job=job)
    feeds, after = read.outcome.feeds, read.outcome.simulated.removal.columns
    before = feeds.before.columns
    (k,) = np.flatnonzero(feeds.line == 9)
    was, now = (x["chip_max_mm"][x["line"] == 9].max() for x in (before, after))
    # the chip is taken to grow as the feed, up to the limit less the room for its error
    room = 1.0 + 2.0 * feeds.before.resolution_error["chip_max_mm"]
    assert room < 1.25
    assert feeds.factor[k] == pytest.approx(0.178 / (room * was), rel=2e-3)
    assert 1.2 * was < now <= feeds.factor[k] * was


def test_a_chip_that_runout_makes_does_not_shrink_with_the_feed(tmp_path: Path) -> None:
    """The thickest chip of a line is not at the instant of its greatest force, and runout makes a part of it that stays
    where the line is cut more slowly (found by random ways).
    """
    ways = (
        "F500\nG1 X0.00 Y7.77 Z-2.70\nG1 X-2.17 Y15.36 Z-0.80\nG1 X0.00 Y22.40 Z-3.79 F285\n"
        "G1 X-2.20 Y2.12 Z-1.11 F748\nG1 X-13.02 Y-4.71 Z-2.66\nG1 X-12.97 Y-10.04 Z-0.80\n"
        "G1 X0.00 Y-20.30 Z0.75\nG0 Z9\nM2\n"
    )
    job = JOB.replace("helix_deg = 0.0\n", "helix_deg = 30.0\nrunout_mm = 0.01\nrunout_deg = 20.0\n")
    read = done(tmp_path, HEAD + "G0 X-9 Y0\nG0 Z-2\n" + ways, "force_n = 213\nchip_max_mm = 0.020\n", job=job)
    feeds, after = read.outcome.feeds, read.outcome.simulated.removal.columns
    (k,) = np.flatnonzero(feeds.line == 9)
    thickest = after["chip_max_mm"][after["line"] == 9].max()
    assert thickest > 0.0
    assert thickest <= 0.020 or feeds.by[k] == "slowest"


@settings(max_examples=6, deadline=None, phases=[Phase.generate])
@given(st.data())
def test_what_is_said_to_hold_holds(tmp_path_factory, data) -> None:
    """Random ways through a block, random cutters with runout: the second simulation never exceeds a limit on a line
    that the feeds were said to hold, and the text moves as it did.
    """
    folder = tmp_path_factory.mktemp("ways")
    rows, number = [], st.floats(-14.0, 34.0)
    for _ in range(data.draw(st.integers(3, 7))):
        word = data.draw(st.sampled_from(["", f" F{data.draw(st.integers(100, 2000))}"]))
        rows.append(
            f"G1 X{data.draw(number):.2f} Y{data.draw(number) - 10:.2f} Z{data.draw(st.floats(-4.0, 1.0)):.2f}{word}"
        )
    text = HEAD + "G0 X-9 Y0\nG0 Z-2\nF500\n" + "\n".join(rows) + "\nG0 Z9\nM2\n"
    cutter = f"corner_radius_mm = {data.draw(st.sampled_from([0.0, 1.0, 5.0]))}\nrunout_mm = 0.01\nrunout_deg = 20.0\n"
    job = JOB.replace("helix_deg = 0.0\n", f"helix_deg = 30.0\n{cutter}").replace(
        "tolerance_mm = 0.002", "tolerance_mm = 0.01"
    )
    limits = f"force_n = {data.draw(st.integers(60, 600))}\nchip_max_mm = {data.draw(st.floats(0.02, 0.2)):.3f}\n"
    read = done(folder, text, limits, job=job)
    held, c = read.outcome.feeds, read.outcome.simulated.removal.columns
    loose = held.line[np.array([by == "slowest" for by in held.by])]
    for name, column in (("force_n", "force_n"), ("chip_max_mm", "chip_max_mm")):
        over = c[column] > read.outcome.simulated.limits[name]
        assert set(c["line"][over].tolist()) <= set(loose.tolist()), name
    one, two = (read_gcode(x)[0] for x in (text, held.text))
    np.testing.assert_array_equal(one.position, two.position)
    assert re.sub(r" F[\d.]+", "", held.text) == re.sub(r" F[\d.]+", "", text)
    np.testing.assert_allclose(held.before.columns["chip_max_mm"] > 0.0, c["chip_max_mm"] > 0.0)


@pytest.mark.parametrize("name", ["force_n", "force_axial_n", "torque_nm", "power_w", "chip_max_mm"])
def test_feeds_at_a_confidence_hold_at_it_and_use_it(tmp_path: Path, name: str) -> None:
    """Planned and checked with one budget: the value at 95 % is within the limit, and short of it by the room for the
    resolution error alone.
    """
    limit = LIMITS[name] * (1.0 if name == "chip_max_mm" else 2.0)
    read = done(tmp_path, SLOT, f"{name} = {limit}\n[checks]\ncutter_strength = false\n", ())
    (check,) = (c for c in read.result.limits if c.name == name)
    assert check.state is Verdict.HOLDS, check.text
    assert read.outcome.feeds.by == (name,)
    assert 0.95 * limit < check.value_at_confidence <= limit
    assert read.result.headline.startswith("Holds at 95 %: ")
    assert feed_of(read.outcome.feeds.text, 6) < 0.9 * slot_feed(name, limit)
