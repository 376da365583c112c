"""Feeds of divided lines: time beside the optimum and force by an oracle of its own, and what is not divided."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from chipload.jobs import FinishedJob, load_job, run_job
from chipload.result import Verdict
from mill import made_up_job, made_up_material
from slot_programs import (
    COEFFICIENTS,
    JOB,
    LIMIT_N,
    MACHINE,
    allowed_feeds,
    forces,
    lines_in,
    places_of,
    program,
    total_time,
    written_feeds,
)

#: a program of two passes
TEXT, LINES = program(0, 2)


def done(folder: Path, text: str, job: str, changes: tuple[str, ...] = ()) -> FinishedJob:
    (folder / "m.toml").write_text(made_up_material(*COEFFICIENTS))
    (folder / "machine.toml").write_text(MACHINE)
    (folder / "a.ngc").write_bytes(text.encode())
    (folder / "job.toml").write_text(job)
    return run_job(load_job(folder / "job.toml", list(changes)))


@pytest.fixture(scope="module")
def passes(tmp_path_factory) -> FinishedJob:
    return done(tmp_path_factory.mktemp("passes"), TEXT, JOB)


def test_the_time_is_near_the_optimum_and_the_force_within_its_limit(passes: FinishedJob) -> None:
    """Every place of the path at its own allowed feed, with the acceleration of the machine, bounds any division."""
    feeds, places = passes.outcome.feeds, places_of(LINES, 0.5)
    best = total_time(places, allowed_feeds(places))
    feed = written_feeds(feeds.text, places, lines_in(LINES, feeds.segments))
    assert 1.0 < total_time(places, feed) / best < 1.08
    assert 0.95 * LIMIT_N < forces(places, feed).max() <= LIMIT_N
    # the least feed of each line instead
    one = feed.copy()
    for k in range(len(LINES)):
        one[places.line == k] = feed[places.line == k].min()
    assert total_time(places, one) > 1.2 * best


def test_the_result_says_what_was_divided(passes: FinishedJob) -> None:
    feeds = passes.outcome.feeds
    segments, lines = sum(map(len, feeds.segments.values())), len(feeds.segments)
    assert passes.result.verdict is Verdict.HOLDS, passes.result.message
    assert lines >= 5
    assert f"Divided: {segments} segments in {lines} lines." in passes.result.message
    numbers = passes.result.operations[0]["feeds"]
    assert (numbers["segments"], numbers["lines_divided"], numbers["not_divided"]) == (segments, lines, {})
    assert len(feeds.text.split("\n")) == len(TEXT.split("\n")) + segments - lines


def test_the_rest_of_the_text_stays(passes: FinishedJob) -> None:
    """Lines that are not divided, and the ends of those that are, word by word but F."""
    feeds, rows = passes.outcome.feeds, passes.outcome.feeds.text.split("\n")
    bare, more = [re.sub(r" ?F[\d.]+", "", x) for x in rows], 0
    for number, line in enumerate(TEXT.split("\n"), 1):
        own = feeds.segments.get(number)
        old = re.sub(r" ?F[\d.]+", "", line)
        if own is None:
            assert bare[number + more - 1] == old
            continue
        assert (own.start, own.stop) == (number + more, number + more + len(own))
        assert bare[own.stop - 2].split(" I")[0] == re.sub(r"G\d ", "", old).split(" I")[0]
        assert re.findall(r"[G]\d+", bare[own.start - 1]) == re.findall(r"[G]\d+", old)
        more += len(own) - 1


SLOT_JOB = made_up_job(
    2,
    1.0,
    """[operation.feeds]
slowest_percent = 5.0
fastest_percent = 900.0
change_least_percent = 0.0
[limits]
force_n = 300.0
[checks]
confidence = 0.5
cutter_strength = false
""",
)
HEAD = "G21 G90 G94 G17\nT1 M6\nS3000 M3\n"
SLOT = HEAD + "G0 X-8 Y0 Z5\nG0 Z-3\nN10 G1 X48 F300 (slot)\nG0 Z5\nM2\n"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (SLOT.replace("N10", "N10 G61.1"), "Not divided: 1 line that changes load (exact stop 1)."),
        (SLOT.replace("G94", "G93").replace("F300", "F5"), "(inverse time feed 1)"),
        (SLOT.replace("X48", "X[40+8]"), "(other words 1)"),
        (SLOT, "Divided: "),
    ],
)
def test_lines_that_cannot_be_divided_keep_one_feed_and_are_counted(tmp_path: Path, text: str, said: str) -> None:
    read = done(tmp_path, text, SLOT_JOB)
    assert said in read.result.note
    if not said.startswith("Div"):
        assert read.outcome.feeds.segments == {}
        assert len(read.outcome.feeds.text.split("\n")) == len(text.split("\n"))


def test_a_line_in_turned_coordinates_is_divided_only_as_its_words_say(tmp_path: Path) -> None:
    """G68 turns the slot of a Fanuc by 90 degrees: the words of its line are no path of the machine's axes."""
    job = SLOT_JOB.replace('"vmc"', '"vmc-fanuc"').replace("a.ngc", "a.nc")
    text = (
        SLOT.replace("G0 X-8 Y0 Z5", "G0 Z5\nG68 X0. Y0. R90.\nG0 X-28. Y-20.")
        .replace("X48", "X28.")
        .replace("Z-3", "Z-3.")
    )
    (tmp_path / "a.nc").write_text(text)
    read = done(tmp_path, text, job)
    feeds = read.outcome.feeds
    assert feeds.segments or feeds.not_divided
    assert "X28." in feeds.text


def test_division_can_be_switched_off(tmp_path: Path) -> None:
    read = done(tmp_path, SLOT, SLOT_JOB, ("operation.0.feeds.divide=false",))
    assert read.outcome.feeds.segments == {}
    assert "ivided" not in read.result.note
    assert len(read.outcome.feeds.text.split("\n")) == len(SLOT.split("\n"))


PLUNGE = HEAD + "G0 X20 Y0 Z5\nG1 Z-5 F900 (plunge)\nG1 X34 (slot)\nG0 Z5\nM2\n"


@pytest.mark.parametrize("name", ["force_n", "force_axial_n"])
def test_a_plunge_is_as_fast_as_its_axial_force_allows(tmp_path: Path, name: str) -> None:
    """Bottom edges to the axis: the teeth push up with (Krc f_z + Kre) R each, and nothing across.

    Ahead of the material and in it the line has segments of their own.
    """
    job = SLOT_JOB.replace("force_n = 300.0", f"{name} = 400.0").replace(
        "overhang_mm = 30.0", "overhang_mm = 30.0\ncentre_cutting = true"
    )
    read = done(tmp_path, PLUNGE, job)
    feeds = read.outcome.feeds
    assert 5 in feeds.segments
    error = feeds.before.resolution_error["force_n"]
    most = 400.0 / (1.0 + 2.0 * error)
    krc, kre = COEFFICIENTS[1], COEFFICIENTS[4]
    wanted = (most / (2.0 * 5.0) - kre) / krc * 2.0 * 3000.0
    column = read.outcome.simulated.removal.columns
    plunge = (column["ramp_deg"] > 89.0) & (column["force_n"] > 0.0)
    assert column["feed_mm_min"][plunge].max() == pytest.approx(wanted, rel=0.02)
