"""`chipload init` of a drawing: which contours are milled, by which cutter, what is a flaw and what is refused."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import ezdxf

from chipload.jobs import check_job, load_job
from command import call


def drawn(path: Path, points: list[tuple[float, float]]) -> None:
    """A closed polygon that names no unit."""
    drawing = ezdxf.new("R2000")
    drawing.header["$INSUNITS"] = 0
    drawing.modelspace().add_lwpolyline(points, close=True)
    drawing.saveas(path)


def square(path: Path) -> None:
    """A closed square of 40 mm that names no unit."""
    drawn(path, [(0.0, 0.0), (40.0, 0.0), (40.0, 40.0), (0.0, 40.0)])


def test_a_drawing_is_a_pocket(tmp_path: Path) -> None:
    """Of a square of 40 mm an opening by diameter D leaves out (4 - pi) D^2 / 4: 3 % of the area is D = 14.95 mm."""
    square(tmp_path / "square.dxf")
    code, said, _ = call("init", tmp_path / "square.dxf", tmp_path / "job")
    assert code == 0
    assert "1600 mm2" in said
    job = tomllib.loads((tmp_path / "job" / "job.toml").read_text())
    assert (job["operation"][0]["kind"], job["cutter"][0]["diameter_mm"]) == ("pocket", 12.0)
    assert job["part"]["units_if_unstated"] == "mm"
    lines, _ = check_job(load_job(tmp_path / "job" / "job.toml"))
    assert "operation 0: pocket, cutter 1 of 12 mm, 1600 mm2" in lines


def test_a_channel_is_wider_than_the_cutter(tmp_path: Path) -> None:
    """Two squares of 40 mm, joined by a channel of 9 mm: 8 mm would fit, 6 mm is the largest with 1.3 of it."""
    lower = [(0.0, 0.0), (40.0, 0.0), (40.0, 15.5), (60.0, 15.5), (60.0, 0.0), (100.0, 0.0)]
    drawn(tmp_path / "joined.dxf", [*lower, *((x, 40.0 - y) for x, y in reversed(lower))])
    assert call("init", tmp_path / "joined.dxf", tmp_path / "job")[0] == 0
    job = tomllib.loads((tmp_path / "job" / "job.toml").read_text())
    assert job["cutter"][0]["diameter_mm"] == 6.0


def drafted(path: Path, folder: Path) -> dict:
    """The job that a drawing proposes, which `check` does not refuse."""
    code, _, said = call("init", path, folder)
    assert code == 0, said
    assert call("check", folder / "job.toml")[0] == 3  # its guesses are not confirmed
    return tomllib.loads((folder / "job.toml").read_text())


def test_lines_that_close_nothing_are_left_out_of_a_pocket(tmp_path: Path) -> None:
    """A centre line beside a square on one layer."""
    path = tmp_path / "line.dxf"
    drawn(path, [(0.0, 0.0), (40.0, 0.0), (40.0, 40.0), (0.0, 40.0)])
    doc = ezdxf.readfile(path)
    doc.modelspace().add_line((-5.0, 20.0), (45.0, 20.0))
    doc.saveas(path)
    job = drafted(path, tmp_path / "job")
    assert (job["part"]["open_chains"], job["operation"][0]["kind"]) == ("dropped", "pocket")


def test_a_small_gap_of_an_outline_is_closed(tmp_path: Path) -> None:
    """Ends up to 0.5 mm apart are joined; a side that is missing is none: its contour is finished from outside."""
    for gap, join in ((0.05, 0.05), (0.03, 0.05), (0.3, 0.5)):
        path = tmp_path / f"gap{gap}.dxf"
        doc = ezdxf.new()
        doc.modelspace().add_lwpolyline([(0, 0), (40, 0), (40, 40), (0, 40), (0, gap)])
        doc.saveas(path)
        job = drafted(path, tmp_path / f"job{gap}")
        assert (job["part"]["join_mm"], job["operation"][0]["kind"]) == (join, "pocket")
    path = tmp_path / "open.dxf"
    doc = ezdxf.new()
    doc.modelspace().add_lwpolyline([(0, 0), (40, 0), (40, 40), (0, 40)])
    doc.saveas(path)
    operation = drafted(path, tmp_path / "open")["operation"][0]
    # drawn counter-clockwise: its outside is on the right, where every corner is rounded by the cutter
    assert (operation["kind"], operation["side"]) == ("contour", "right")


def test_a_drawing_beyond_the_travel_is_moved_to_its_middle(tmp_path: Path) -> None:
    """The machine travels 800 by 500 mm about its origin."""
    path = tmp_path / "far.dxf"
    drawn(path, [(1000.0, 700.0), (1040.0, 700.0), (1040.0, 720.0), (1000.0, 720.0)])
    assert drafted(path, tmp_path / "job")["part"]["origin_mm"] == [1020.0, 710.0]
    drawn(path, [(0.0, 0.0), (400.0, 0.0), (400.0, 600.0), (0.0, 600.0)])
    code, _, said = call("init", path, tmp_path / "wide")
    assert (code, said) == (
        2,
        "chipload: the drawing is 600 mm wide in Y, machine vmc travels 500 mm: name a larger one (--on of init, "
        "--machine of simulate), or check the unit\n",
    )


def test_a_unit_that_makes_a_drawing_wider_than_the_travel(tmp_path: Path) -> None:
    """40 m by the header, as ezdxf writes it unless told otherwise: 40 mm are proposed."""
    path = tmp_path / "metres.dxf"
    doc = ezdxf.new()
    doc.modelspace().add_lwpolyline([(0, 0), (40, 0), (40, 40), (0, 40)], close=True)
    doc.saveas(path)
    assert drafted(path, tmp_path / "job")["part"]["units"] == "mm"
    text = (tmp_path / "job" / "job.toml").read_text()
    assert "by the unit that it states, m, it is 40000 by 40000 mm" in text


def test_a_pocket_that_no_cutter_enters(tmp_path: Path) -> None:
    path = tmp_path / "tiny.dxf"
    drawn(path, [(0.0, 0.0), (0.4, 0.0), (0.4, 0.3), (0.0, 0.3)])
    code, _, said = call("init", path, tmp_path / "job")
    assert code == 2
    assert "the contours enclose 0.12 mm2, too narrow for a cutter of 0.5 mm: if the drawing is in another" in said


def test_channels_that_no_cutter_has_room_in_are_cut_in_circles(tmp_path: Path) -> None:
    """A slot of 0.6 mm: 0.5 mm is the least cutter, which has 0.1 mm of room and cuts 0.3 diameters deep."""
    path = tmp_path / "slot.dxf"
    drawn(path, [(0.0, 0.0), (20.0, 0.0), (20.0, 0.6), (0.0, 0.6)])
    assert call("init", path, tmp_path / "job")[0] == 0
    job = tomllib.loads((tmp_path / "job" / "job.toml").read_text())
    (operation,) = job["operation"]
    assert (operation["strategies"], operation["use"]) == (["trochoidal"], "trochoidal")
    assert (job["cutter"][0]["diameter_mm"], operation["axial_depth_mm"]) == (0.5, 0.15)


def test_notes_say_what_a_small_cutter_really_turns(tmp_path: Path) -> None:
    """2 mm at 15000 rpm, the greatest of vmc: pi 2 15 = 94.2 m/min; 3 mm of flutes and 2 mm more stick out."""
    path = tmp_path / "slot.dxf"
    doc = ezdxf.new(units=4)
    doc.modelspace().add_lwpolyline([(0, 0), (20, 0), (20, 2.8), (0, 2.8)], close=True)
    doc.saveas(path)
    assert call("init", path, tmp_path / "job")[0] == 0
    said = (tmp_path / "job" / "job.toml").read_text()
    assert "diameter_mm = 2.0" in said
    assert re.search(r"speed_rpm = 15000\.0 +# guess: 94\.2 m/min, as far as the spindle of vmc turns", said)
    assert re.search(r"overhang_mm = 5\.0 +# guess: no file states it; flutes and one diameter", said)
