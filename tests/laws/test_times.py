"""The parts of the time of a program add up to it: in the cut, in air, rapids, dwell, and what remains."""

from __future__ import annotations

import json

import pytest

from chipload.jobs import load_job, run_job
from chipload.result.load import load_result
from slot_job import slot_job

#: the slot with a dwell of 0.5 s in air and one of 0.25 s behind the cut, and two tool calls
DWELLS = (
    "G21 G90 G94\nT1 M6\nS3000 M3\nG0 X-8 Y5 Z5\nG4 P0.5\nG1 Z-2 F300\nX8\nG4 P0.25\nG0 Z5\nG0 X-8\nM5\nT1 M6\nM2\n"
)


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    folder = tmp_path_factory.mktemp("times")
    job = slot_job(folder / "job")
    (folder / "job" / "slot.ngc").write_text(DWELLS)
    done = run_job(load_job(job, ["operation.0.step_mm=1"]))
    done.save(folder / "result")
    return done.result, folder / "result"


def test_the_parts_add_up_to_the_time_of_the_program(saved):
    track = saved[0].tracks[0]
    own = track.times
    assert own.whole == pytest.approx(track.time_s, rel=1e-12)
    assert min(own.cut, own.air, own.rapid) > 0.0
    # the dwells are stated
    assert own.dwell == pytest.approx(0.75, abs=1e-12)
    # of 16 mm along X at 5 mm/s the cut begins when the rim of 3 mm comes to the block at X 0, within a step of 1 mm
    assert own.cut == pytest.approx(11.0 / 5.0, abs=1.0 / 5.0 + 0.1)
    # 7 mm down at 5 mm/s and what is left of the way along X are in air, with the accelerations of the machine
    assert own.air == pytest.approx((7.0 + 5.0) / 5.0, abs=1.0 / 5.0 + 0.2)


def test_summary_operation_and_page_state_the_same_parts(saved):
    result, folder = saved
    summary = json.loads((folder / "summary.json").read_bytes())
    parts, (op,) = summary["tracks"][0]["times"], summary["operations"]
    assert sum(parts.values()) == pytest.approx(summary["tracks"][0]["time_s"], rel=1e-12)
    names = {"cutting_s": "cut_s", "air_cut_s": "air_s", "rapid_s": "rapid_s", "dwell_s": "dwell_s"}
    for own, name in names.items():
        assert op[own] == pytest.approx(parts[name], abs=1e-9), name
    assert load_result(folder).tracks[0].times.whole == pytest.approx(result.tracks[0].time_s, rel=1e-12)
    page = (folder / "report.html").read_text()
    assert "<th class=n>dwell</th>" in page
    assert "<td class=n>0.75</td>" in page
