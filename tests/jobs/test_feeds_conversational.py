"""New feeds of conversational programs: closed form of a slot, the rest of the text, blocks that keep their feed."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from chipload.errors import InputError
from chipload.jobs import FinishedJob, load_job, run_job
from chipload.program.heidenhain import with_feeds
from chipload.result import Verdict, error_of
from jobs.test_feeds import JOB, MATERIAL, NOMINAL, slot_feed

SLOT = """0 BEGIN PGM SLOT MM
1 TOOL CALL 1 Z S3000 F600 ; D 10
2 L X-8 Y+0 Z+5 R0 FMAX M3
3 L Z-3 FMAX
4 L X+34 R0 M8 ; slot at the feed of TOOL CALL
5 L Z+5 FMAX M5
6 END PGM SLOT MM
"""
#: a pass in air, a slot, a corner that is rounded, a hole by a cycle
MORE = SLOT.replace(
    "5 L Z+5 FMAX M5\n",
    """5 L Y+20 F300
6 RND R2
7 L X+50
8 L Z+5 FMAX
9 CYCL DEF 200 DRILLING ~
Q200=+2 ;CLEARANCE ~
Q201=-3 ;DEPTH ~
Q206=+150 ;FEED ~
Q202=+3 ;PECK ~
Q210=+0 ~
Q203=+0 ;SURFACE ~
Q204=+5 ~
Q211=+0
10 L X+17 Y-18 FMAX M99
11 L Z+5 FMAX M5
""",
).replace("6 END", "12 END")


def done(folder: Path, text: str, limits: str) -> FinishedJob:
    (folder / "m.toml").write_text(MATERIAL)
    (folder / "a.h").write_text(text)
    (folder / "job.toml").write_text(JOB.replace("a.ngc", "a.h").replace("divide = false\n", "") + limits)
    return run_job(load_job(folder / "job.toml", [NOMINAL]))


def without_feeds(text: str) -> str:
    return re.sub(r" F[\d.]+", "", text)


def test_a_slot_gets_the_feed_of_the_closed_form(tmp_path: Path) -> None:
    """Its word stands before M8; that of TOOL CALL stays."""
    read = done(tmp_path, SLOT, "force_n = 620.0\n")
    feeds = read.outcome.feeds
    error = error_of("force_n", feeds.before.resolution_error)
    written = float(re.search(r"4 L X\+34 R0 F([\d.]+) M8 ; slot", feeds.text)[1])
    assert written == pytest.approx(slot_feed("force_n", 620.0 / (1.0 + 2.0 * error)), rel=1.2e-3)
    assert read.result.verdict is Verdict.HOLDS
    assert feeds.text == SLOT.replace("R0 M8", f"R0 F{written:g} M8")
    assert dict(feeds.not_divided) == {}


def test_cycles_and_roundings_keep_their_feed(tmp_path: Path) -> None:
    read = done(tmp_path, MORE, "force_n = 620.0\n")
    feeds = read.outcome.feeds
    assert without_feeds(feeds.text) == without_feeds(MORE)
    program = feeds.text.split("\n")
    changed = [k + 1 for k, (a, b) in enumerate(zip(program, MORE.split("\n"), strict=True)) if a != b]
    # the slot; the feed of the pass behind it and of the blocks beside the rounding, 300, stands as it was
    assert changed == [5]
    by = dict(zip(feeds.line.tolist(), feeds.by, strict=True))
    assert by[6] == by[8] == by[19] == "programmed"
    assert by[5] == "force_n"


def test_a_program_that_does_not_hold_says_so_behind_its_head(tmp_path: Path) -> None:
    read = done(tmp_path, SLOT, "force_n = 50.0\n")
    assert read.result.verdict is Verdict.EXCEEDS
    lines = read.presentation.files(read.result)["0-feeds.h"].decode().split("\n")
    assert lines[0] == "0 BEGIN PGM SLOT MM"
    assert "; NOT VERIFIED" in lines[1]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("L X+1 FQ10\n", "line 1: FQ10: a feed that is no number cannot be changed: write it"),
        ("L X+1 F AUTO\n", "line 1: F AUTO: a feed that is no number cannot be changed: write it"),
        ("L X+1 F100\nCALL LBL 1 REP 2\n", "line 2: CALL LBL: feeds are changed only in a program without jumps"),
        ("M128 F1000\nL X+1 F100\n", "line 1: M128 F: is no feed of a cut: write M128 in a block of its own"),
        ("L X+1 F100\nM136\nL X+2\n", "line 3: moves at a feed that was stated in another unit: state it again here"),
    ],
)
def test_what_cannot_be_changed_is_refused(text: str, message: str) -> None:
    with pytest.raises(InputError, match=re.escape(message)):
        with_feeds(text, {1: 0.9, 3: 0.5} if "M136" in text else {})


def test_feeds_for_each_turn_and_roundings_of_their_own() -> None:
    text = "L X+1 FU0.2\nL Y+1 M99\nL X+2\nRND R1 F50\nL Y+9 F0.3 M8"
    assert with_feeds(text, {1: 0.5, 2: 2.0, 3: 2.0, 5: 0.5}) == (
        "L X+1 FU0.1\nL Y+1 FU0.4 M99\nL X+2\nRND R1 F50\nL Y+9 F0.15 M8"
    )
