"""Jobs whose program compensates for the cutter's radius: what states the diameter, and what contradicts it."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from chipload.cli import app
from mill import block_job, simulation

#: along a side of the block: G41 keeps the cutter's centre a radius away from Y = 0
PATH = """G21 G90 G17 G94
{head}
T1 M6
S3000 M3
G0 X-20 Y-20 Z5
G0 Z-2
G41 D1
G1 X-20 Y2 F600
G1 X60
G40
G0 Z5
M2
"""
JOB = block_job("side.ngc", "[0.0, -20.0, -5.0]", "[40.0, 20.0, 0.0]", simulation("force_n = 5000.0\n"), "{keys}\n")
#: the centre goes along Y = 7, the cutter of 10 mm from Y = 2 to Y = 12, 2 mm deep, over 40 mm
REMOVED = 40.0 * 10.0 * 2.0


def run(folder: Path, *, head: str = "", keys: str = "", table: str | None = None, length: str = ""):
    (folder / "side.ngc").write_text(PATH.format(head=head).replace("G0 X-20 Y-20 Z5", f"{length}G0 X-20 Y-20 Z5"))
    if table is not None:
        (folder / "tool.tbl").write_text(table)
        keys += '\ntools = "tool.tbl"'
    (folder / "job.toml").write_text(JOB.format(keys=keys))
    done = CliRunner().invoke(app, ["run", str(folder / "job.toml"), "--out", str(folder / "r")])
    summary = folder / "r" / "summary.json"
    return done.exit_code, done.stdout, done.stderr, json.loads(summary.read_text()) if summary.is_file() else None


def test_g41_without_a_table_takes_the_diameter_of_the_jobs_cutter(tmp_path: Path) -> None:
    code, _, err, summary = run(tmp_path)
    assert (code, err) == (0, "")
    assert summary["operations"][0]["removed_mm3"] == pytest.approx(REMOVED, rel=1e-3)
    assert [f["text"] for f in summary["findings"] if f["code"] == "nc-diameter-of-cutter"] == [
        "G41 D1: the 10 mm of cutter 1 are taken"
    ]


def test_a_table_without_the_diameter_leaves_the_result_unproven_and_says_so_first(tmp_path: Path) -> None:
    code, out, _, summary = run(tmp_path, table="T1 P1 Z50\n")
    assert code == 3
    assert out.startswith(
        "Unproven: line 7: G41 D1: the tool table states no D for tool 1, so "
        "the controller compensates by 0: the 10 mm of cutter 1 are taken: write D10 in the table"
    )
    op = summary["operations"][0]
    assert (summary["verdict"], {x["state"] for x in summary["limits"]}) == ("unproven", {"holds"})
    assert op["removed_mm3"] == pytest.approx(REMOVED, rel=1e-3)
    first = next(f for f in summary["findings"] if f["severity"] == "unproven")
    assert first["line"] == 7
    assert first["text"].startswith("G41 D1: the tool table states no D")


def test_a_table_that_contradicts_the_cutter_is_refused(tmp_path: Path) -> None:
    code, _, err, _ = run(tmp_path, table="T1 P1 D6 Z50\n")
    assert code == 2
    assert (
        "side.ngc: the tool table states 6 mm for tool 1, the [[cutter]] has 10 mm: must agree within 0.05 mm: correct "
        "D of T1 in the tool table or diameter_mm of the [[cutter]] with number = 1" in err
    )


def test_a_worn_cutter_is_noted_and_its_diameter_is_compensated_for(tmp_path: Path) -> None:
    code, _, _, summary = run(tmp_path, table="T1 P1 D9.96 Z50\n", length="G43 H1 ")
    assert code == 0
    assert "tool-diameter" in [f["code"] for f in summary["findings"]]
    # the centre goes 0.02 mm nearer to the contour than that of the cutter that is simulated
    assert summary["operations"][0]["removed_mm3"] == pytest.approx(REMOVED, rel=1e-3)


def test_the_length_of_the_table_without_g43_leaves_the_result_unproven(tmp_path: Path) -> None:
    code, out, _, summary = run(tmp_path, table="T1 P1 D10 Z50\n")
    assert code == 3
    assert out.startswith("Unproven: line 6: tool 1 moves without its length, Z50 of the tool table (active is Z0)")
    assert [f["code"] for f in summary["findings"] if f["severity"] == "unproven"] == ["nc-length-missing"]


def test_a_comment_that_contradicts_the_cutter_is_refused_unless_comments_do_not_count(tmp_path: Path) -> None:
    comment = "(T1 D=6. CR=0. - ZMIN=-2. - flat end mill)"
    code, _, err, _ = run(tmp_path, head=comment)
    assert code == 2
    assert "side.ngc: line 2: the comment (T1 D=6. CR=0. - ZMIN=-2. - FLAT END MILL) states 6 mm for tool 1" in err
    assert "or set program.tool_comments = false" in err
    assert run(tmp_path, head=comment, keys="tool_comments = false")[0] == 0


def test_a_block_that_is_not_read_leaves_the_result_unproven(tmp_path: Path) -> None:
    code, out, _, summary = run(tmp_path, head="G187 P2")
    assert code == 3
    assert out.startswith("Unproven: line 2: G187: is not read")
    assert [f["severity"] for f in summary["findings"] if f["line"] == 2] == ["unproven"]
