"""The result folder: what is in it, and that each file says what the outcome says."""

from __future__ import annotations

import io
import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
import trimesh

from chipload.geometry.contour import Contour
from chipload.planning.result import Event
from chipload.report.folder import write_result
from chipload.report.history import history_bytes
from chipload.report.outcome import Outcome, verdict
from chipload.report.page import page_bytes
from chipload.report.programs import program_files
from chipload.report.scene import scene_bytes
from chipload.report.shape import pieces, slab, thinned
from chipload.report.summary import summary_bytes

Maker = Callable[..., Outcome]


def test_the_verdict_stands_on_the_strategy_in_use(outcome: Maker) -> None:
    assert verdict(outcome("backward")) == (
        True,
        "Every stated limit holds and the simulation agrees (contour, backward: engagement 12.68 of 13 deg, "
        "force 50.71 of 200 N).",
    )
    assert verdict(outcome("plain")) == (
        False,
        "Does not hold: operation 0 (contour, plain): engagement 18.74 deg exceeds 13 deg at (5.000, 7.957).",
    )


@pytest.mark.parametrize("status", ["failed", "unproven"])
def test_what_is_not_proved_does_not_hold(outcome: Maker, status: str) -> None:
    assert verdict(outcome("backward", status)) == (
        False,
        f"Does not hold: operation 0 (contour, backward): simulation: {status}: 1800 rows compared.",
    )


def test_what_was_not_simulated_does_not_hold(outcome: Maker) -> None:
    made = outcome()
    bare = replace(made, operations=(replace(made.operations[0], proofs={}),))
    assert verdict(bare)[1].endswith("the program was not checked by the simulation.")


def test_what_the_machine_cannot_do_does_not_hold(outcome: Maker) -> None:
    made = outcome()
    far = replace(made.operations[0], beyond={"backward": ("row 1: X = 401 mm",), "plain": ()})
    assert verdict(replace(made, operations=(far,))) == (
        False,
        "Does not hold: operation 0 (contour, backward): row 1: X = 401 mm.",
    )


def test_summary_says_the_verdict_first_and_every_strategy(outcome: Maker) -> None:
    told = json.loads(summary_bytes(outcome("plain")))
    assert list(told)[:2] == ["holds", "says"]
    assert told["holds"] is False
    strategies = told["operations"][0]["strategies"]
    assert list(strategies) == ["plain", "backward", "feed"]
    plain = strategies["plain"]
    assert plain["engagement_deg"]["max"] == pytest.approx(18.738)
    assert plain["limits"][0] == {
        "name": "engagement_deg",
        "limit": 13.0,
        "worst": pytest.approx(18.738),
        "at_mm": pytest.approx([5.0, 7.957], abs=1e-3),
        "holds": False,
    }
    assert plain["events"][0]["code"] == "lead-none"
    assert plain["verification"]["status"] == "proved"
    assert plain["fails"] == ["engagement 18.74 deg exceeds 13 deg at (5.000, 7.957)"]
    assert told["unchecked"] == ["torque_nm"]


def test_a_number_that_is_none_is_a_fault(outcome: Maker) -> None:
    made = outcome()
    op = made.operations[0]
    bad = replace(op.result.strategies["feed"], summary={"time_s": float("nan")})
    op = replace(op, result=replace(op.result, strategies={**op.result.strategies, "feed": bad}))
    with pytest.raises(ValueError, match="not JSON compliant"):
        summary_bytes(replace(made, operations=(op,)))


def test_history_has_a_row_a_step(outcome: Maker) -> None:
    table = pq.read_table(io.BytesIO(history_bytes(outcome())))
    assert table.num_rows == 3 * 1800
    need = "operation strategy pass x_mm y_mm z_mm engagement_deg feed_mm_min force_x_n force_y_n torque_nm error_um"
    assert set(need.split()) <= set(table.column_names)
    assert table.column_names[:3] == ["operation", "strategy", "pass"]
    rows = table.to_pydict()
    assert sorted(set(rows["strategy"])) == ["backward", "feed", "plain"]
    plain = [a for a, n, p in zip(rows["engagement_deg"], rows["strategy"], rows["pass"], strict=True)
             if (n, p) == ("plain", "finish")]  # fmt: skip
    assert max(plain) == pytest.approx(18.738)


def test_history_of_operations_with_other_columns_has_nulls(outcome: Maker) -> None:
    made = outcome()
    op = made.operations[0]
    plain = op.result.strategies["plain"]
    wide = replace(plain, history={**plain.history, "arcs": np.ones(1800, dtype=np.int64)})
    op = replace(op, result=replace(op.result, strategies={**op.result.strategies, "plain": wide}))
    table = pq.read_table(io.BytesIO(history_bytes(replace(made, operations=(op,)))))
    assert table["arcs"].null_count == 2 * 1800


def test_the_same_outcome_gives_the_same_bytes(outcome: Maker) -> None:
    for make in (summary_bytes, history_bytes, page_bytes, scene_bytes):
        assert make(outcome()) == make(outcome()), make.__name__
    assert program_files(outcome()) == program_files(outcome())


def test_the_page_loads_nothing_from_elsewhere(outcome: Maker) -> None:
    html = page_bytes(outcome()).decode()
    # what a page loads stands in its own elements and styles; the library's text is data to it
    own = re.sub(r"<script>.*?</script>", "", html, flags=re.S)
    assert "http" not in own.replace("application/json", "")
    assert not re.search(r"\b(src|href)\s*=|@import|url\(", own)
    assert html.count("<script") == 3


def test_the_page_says_the_verdict_before_all_else(outcome: Maker) -> None:
    html = page_bytes(outcome("plain")).decode()
    body = html[html.index("<main>") :]
    order = ["Does not hold", "What does not hold", "Strategies side by side", "Limits", "Along the finish pass",
             "From above", "In space", "Findings", "What was not checked", "Where the numbers come from"]  # fmt: skip
    places = [body.index(x) for x in order]
    assert places == sorted(places)
    assert "torque: the job states no limit" in body
    assert "operation.0.x: a finding" in body


def test_a_pass_that_never_cut_is_still_shown(outcome: Maker) -> None:
    made = outcome()
    op = made.operations[0]
    air = {n: replace(s, history={k: v if v.dtype == object else 0.0 * v for k, v in s.history.items()})
           for n, s in op.result.strategies.items()}  # fmt: skip
    made = replace(made, operations=(replace(op, result=replace(op.result, strategies=air)),))
    assert b"Along the finish pass" in page_bytes(made)
    assert scene_bytes(made)


def test_names_from_outside_cannot_become_markup(outcome: Maker) -> None:
    evil = "</script><script>alert(1)</script>"
    made = outcome()
    op = made.operations[0]
    event = Event("x", 1.0, 1.0, evil)
    strategies = {n: replace(s, events=(event,)) for n, s in op.result.strategies.items()}
    op = replace(op, result=replace(op.result, strategies=strategies))
    html = page_bytes(replace(made, title=evil, findings=(evil,), operations=(op,))).decode()
    assert evil not in html


def test_a_long_history_stays_small_and_keeps_its_extremes(outcome: Maker) -> None:
    html = page_bytes(outcome(rows=60_000))
    assert len(html) < 12e6


def test_thinning_keeps_the_extremes_of_every_stretch() -> None:
    rng = np.random.default_rng(1)
    values = rng.normal(size=50_000)
    values[31_234], values[17] = 40.0, -40.0
    keep = thinned(values, 2000)
    assert len(keep) <= 2002
    assert {31_234, 17, 0, 49_999} <= set(keep.tolist())
    assert (np.diff(keep) > 0).all()


def test_a_prism_of_a_region_with_an_island_has_its_volume() -> None:
    square = Contour.polyline([[0, 0], [10, 0], [10, 10], [0, 10]], closed=True)
    hole = Contour.polyline([[4, 4], [6, 4], [6, 6], [4, 6]], closed=True)
    vertices, faces = slab([square, hole], -3.0, 0.0)
    mesh = trimesh.Trimesh(vertices, faces)
    assert abs(mesh.volume) == pytest.approx((100.0 - 4.0) * 3.0)
    assert mesh.is_watertight


def test_pieces_begin_where_the_rows_jump() -> None:
    x = np.array([0.0, 1.0, 2.0, 50.0, 51.0, 52.0])
    history = {"x_mm": x, "y_mm": 0 * x, "z_mm": 0 * x, "pass": np.array(["finish"] * 5 + ["lead"], dtype=object)}
    assert pieces(history).tolist() == [0, 0, 0, 1, 1, 2]


def test_the_scene_holds_wall_stock_cutter_and_paths_in_colour(outcome: Maker) -> None:
    scene = trimesh.load(io.BytesIO(scene_bytes(outcome())), file_type="glb")
    names = set(scene.geometry)
    assert {"0-wall", "0-stock", "0-cutter", "0-path-plain", "0-path-backward", "0-path-feed"} <= names
    wall = scene.geometry["0-wall"]
    np.testing.assert_allclose(wall.bounds, [[0, 0, -5], [28, 28, 0]], atol=1e-5)
    tree, data = glb_parts(scene_bytes(outcome()))
    assert tree["asset"]["extras"] == {"units": "mm", "up": "Z"}
    mesh = next(m for m in tree["meshes"] if m["name"] == "0-path-plain")["primitives"][0]
    colour = tree["accessors"][mesh["attributes"]["COLOR_0"]]
    view = tree["bufferViews"][colour["bufferView"]]
    rgba = np.frombuffer(data, np.uint8, 4 * colour["count"], view["byteOffset"]).reshape(-1, 4)
    # straight wall, corner, semi-finish
    assert len(np.unique(rgba, axis=0)) == 3


def glb_parts(glb: bytes) -> tuple[dict[str, Any], bytes]:
    """The JSON and the binary chunk of a GLB file."""
    n = int.from_bytes(glb[12:16], "little")
    return json.loads(glb[20 : 20 + n]), glb[28 + n :]


def test_only_the_program_in_use_that_holds_is_called_verified(outcome: Maker) -> None:
    files = program_files(outcome("backward"))
    assert sorted(files) == [f"0-{n}.{e}" for n in ("backward", "feed", "plain") for e in ("apt", "ngc")]
    verified = {n for n, data in files.items() if b"NOT VERIFIED" not in data}
    assert verified == {"0-backward.ngc", "0-backward.apt"}
    for made in (outcome("plain"), outcome("backward", "unproven")):
        assert all(b"NOT VERIFIED" in data for data in program_files(made).values())


def test_the_folder_holds_everything(outcome: Maker, tmp_path: Path) -> None:
    target = write_result(outcome(), tmp_path / "a" / "result")
    names = sorted(p.name for p in target.iterdir())
    assert names == sorted(["summary.json", "history.parquet", "report.html", "scene.glb",
                            *program_files(outcome())])  # fmt: skip
