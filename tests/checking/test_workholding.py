"""Vises and clamps by their numbers. Oracle: corners by hand, volumes of boxes, and a collision of a known depth."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from chipload.checking.workholding import StrapClamp, Vise
from chipload.errors import InputError
from command import call
from slot_job import slot_text

LOW, HIGH = (0.0, 0.0, -20.0), (80.0, 50.0, 0.0)


def test_a_vise_that_closes_along_x_with_parallels() -> None:
    """The fixed jaw on the left; parallels fill the jaw below the stock, 40 - 6 mm."""
    vise = Vise((60.0, 40.0, 15.0), 6.0, "x", "x-", None, None, 8.0, 30.0)
    boxes = vise.boxes(LOW, HIGH)
    assert boxes["fixed jaw"] == ((-15.0, 0.0, -54.0), (0.0, 60.0, -14.0))
    assert boxes["moving jaw"] == ((80.0, 0.0, -54.0), (95.0, 60.0, -14.0))
    assert boxes["lower parallel"] == ((0.0, 0.0, -54.0), (8.0, 60.0, -20.0))
    assert boxes["upper parallel"] == ((72.0, 0.0, -54.0), (80.0, 60.0, -20.0))
    assert boxes["bed"][1][2] == -54.0


def test_steps_carry_the_stock() -> None:
    boxes = Vise((60.0, 40.0, 15.0), 6.0, step=(10.0, 3.0)).boxes(LOW, HIGH)
    assert boxes["lower step"] == ((10.0, 0.0, -30.0), (70.0, 3.0, -20.0))
    assert boxes["upper step"] == ((10.0, 47.0, -30.0), (70.0, 50.0, -20.0))


def test_a_strap_at_an_angle_with_its_bolt() -> None:
    """The volume of the strap does not change with its angle; the bolt stands in its middle."""
    clamp = StrapClamp((10.0, 20.0, 0.0), (60.0, 20.0, 12.0), math.radians(30.0), (10.0, 15.0))
    bodies = clamp.meshes()
    assert bodies["strap"].is_watertight
    assert bodies["strap"].volume == pytest.approx(60.0 * 20.0 * 12.0)
    middle = bodies["bolt"].bounds.mean(axis=0)
    assert middle == pytest.approx([10.0 + 30.0 * math.cos(math.radians(30.0)), 35.0, 19.5])


@pytest.mark.parametrize(
    ("vise", "message"),
    [
        (Vise((60.0, 40.0, 15.0), 6.0, opening=52.0), "opening_mm = 52: the stock has 50 mm between the jaws"),
        (Vise((60.0, 40.0, 15.0), 41.0), "grip_mm = 41: must be above 0 and below the height of the jaw, 40"),
        (Vise((60.0, 40.0, 15.0), 25.0), "grip_mm = 25: must be at most the height of the stock, 20"),
        (Vise((60.0, 40.0, 15.0), 6.0, "y", "x+"), "must be a side along y"),
        (Vise((60.0, 40.0, 15.0), 6.0, step=(4.0, 3.0), parallels=5.0), "leave one out"),
        (Vise((60.0, 40.0, 15.0), 6.0, step=(40.0, 3.0)), "height must be at most that of the jaw below the stock, 34"),
    ],
)
def test_what_contradicts_is_refused(vise: Vise, message: str) -> None:
    with pytest.raises(InputError, match=message):
        vise.boxes(LOW, HIGH)


#: a slot from X-8 to X28 through a block from 0 to 20, 2 mm deep from Z0
VISE = '[[fixture]]\nkind = "vise"\ncloses = "x"\njaw_mm = [40.0, 30.0, 20.0]\ngrip_mm = {}\n'


@pytest.mark.parametrize(("above", "verdict"), [(3.0, "clear"), (0.5, "hits")])
def test_a_cutter_in_the_jaws_exceeds(tmp_path: Path, above: float, verdict: str) -> None:
    """Jaws below the floor of the slot are clear; those above it are hit by as much as they stand out."""
    text = slot_text(3.0)
    low = float(text.split("low_mm = [")[1].split("]")[0].split(",")[2])
    (tmp_path / "slot.ngc").write_text("G21 G90 G94\nT1 M6\nS3000 M3\nG0 X-8 Y5 Z5\nG1 Z-2 F300\nX28\nG0 Z5\nM5\nM2\n")
    (tmp_path / "job.toml").write_text(text + VISE.format(-low - above))
    call("run", tmp_path / "job.toml", "--out", tmp_path / "r")
    summary = json.loads((tmp_path / "r" / "summary.json").read_text())
    hits = [f["text"] for t in summary["tracks"] for f in t["findings"] if f["code"] == "collision"]
    if verdict == "clear":
        assert not hits
    else:
        assert any("cutting part goes 1.5 mm into fixture 0, vise (fixed jaw)" in text for text in hits), hits
        assert any("(moving jaw)" in text for text in hits)


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ('[[fixture]]\nkind = "vise"\njaw_mm = [40.0, 30.0, 20.0]\n', "fixture.0.grip_mm is missing: a vise needs it"),
        ("[[fixture]]\nspacing_mm = 1.0\n", "fixture.0.file is missing: a file needs it"),
        (
            '[[fixture]]\nkind = "block"\nlow_mm = [0.0, 0.0, 0.0]\nhigh_mm = [1.0, 1.0, 1.0]\ngrip_mm = 2.0\n',
            'fixture.0.grip_mm: not used with kind = "block": leave it out',
        ),
        (
            '[[fixture]]\nkind = "block"\nlow_mm = [0.0, 0.0, 0.0]\nhigh_mm = [1.0, 0.0, 1.0]\n',
            "fixture.0: low_mm = [0.0, 0.0, 0.0]: must be below high_mm = [1.0, 0.0, 1.0] along each axis",
        ),
    ],
)
def test_keys_of_each_kind(tmp_path: Path, table: str, message: str) -> None:
    (tmp_path / "slot.ngc").write_text("G21 G90 G94\nT1 M6\nS3000 M3\nG0 X-8 Y5 Z5\nG1 Z-2 F300\nX28\nG0 Z5\nM2\n")
    (tmp_path / "job.toml").write_text(slot_text(3.0) + table)
    code, _, said = call("check", tmp_path / "job.toml")
    assert code == 2
    assert message in said
