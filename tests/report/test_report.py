"""The result folder: what is in it, and that each file says what the outcome says."""

from __future__ import annotations

import io
import json
import math
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
import trimesh

from chipload.errors import Finding, InputError, Severity
from chipload.geometry.contour import Contour
from chipload.jobs.contour.figures import presentation_of
from chipload.jobs.contour.outcome import ContourResult, Operation
from chipload.jobs.contour.programs import program_files
from chipload.jobs.contour.result import result_of
from chipload.jobs.contour.scene import scene_bytes
from chipload.planning.result import Event, StrategyResult
from chipload.report.folder import write_result
from chipload.report.page import limits_table, page_bytes
from chipload.report.presentation import Presentation
from chipload.report.shape import slab, stretches
from chipload.result import Coverage, Verdict
from chipload.result.history import write_history
from chipload.result.load import load_result
from chipload.result.summary import summary_bytes
from chipload.result.thinning import thin_rows

Maker = Callable[..., ContourResult]


def report(outcome: ContourResult) -> bytes:
    """report.html of an outcome."""
    return page_bytes(result_of(outcome), presentation_of(outcome))


def summary(outcome: ContourResult) -> bytes:
    """summary.json of an outcome."""
    return summary_bytes(result_of(outcome), dict.fromkeys(("plain", "backward", "feed"), 1800))


def history(outcome: ContourResult) -> bytes:
    """history.parquet of an outcome."""
    sink = io.BytesIO()
    write_history(result_of(outcome), sink)
    return sink.getvalue()


def with_operation(outcome: ContourResult, **changes: Any) -> ContourResult:
    """The outcome with another first operation."""
    operation: Operation = replace(outcome.operations[0], **changes)
    return replace(outcome, operations=(operation,))


def with_strategies(outcome: ContourResult, change: Callable[[StrategyResult], StrategyResult]) -> ContourResult:
    """The outcome with every strategy changed."""
    result = outcome.operations[0].result
    strategies = {n: change(s) for n, s in result.strategies.items()}
    return with_operation(outcome, result=replace(result, strategies=strategies))


def verdict(outcome: ContourResult) -> tuple[Verdict, str]:
    """Verdict and message of an outcome."""
    result = result_of(outcome)
    return result.verdict, result.message.partition(" Critical limit")[0].partition(" Not covered")[0]


def test_the_verdict_stands_on_the_strategy_in_use(outcome: Maker) -> None:
    # the engagement counts where the wall is made, the force everywhere: the semi-finish pass has 95 N
    assert verdict(outcome("backward")) == (
        Verdict.HOLDS,
        "Holds: engagement 12.7 of 13 deg in the finish pass, margin 2.48 %, at (5, 8.01, -5).",
    )
    assert verdict(outcome("plain")) == (
        Verdict.EXCEEDS,
        "Exceeds: engagement 18.7 deg exceeds 13 deg at (5, 7.96, -5), 44.1 % beyond the limit.",
    )


def test_the_first_lines_state_what_the_limits_do_not_cover(outcome: Maker) -> None:
    result = result_of(outcome("backward"))
    message, unchecked = result.first_lines
    assert (
        "Not covered: 4.5 s of cuts outside the finish pass (limits count where the wall is made): engagement reaches "
        "25 deg. The simulation agrees with the plan." in message
    )
    assert unchecked == "Not checked: default checks; limit torque_nm."
    assert result.limits[0].coverage.mask(1800).sum() == 900


@pytest.mark.parametrize("state", [Verdict.EXCEEDS, Verdict.UNPROVEN])
def test_what_the_simulation_does_not_confirm_does_not_hold(outcome: Maker, state: Verdict) -> None:
    assert verdict(outcome("backward", state)) == (
        state,
        f"{state.value.capitalize()}: simulation: 1800 rows compared.",
    )


def test_what_was_not_simulated_is_unproven(outcome: Maker) -> None:
    assert verdict(with_operation(outcome(), verifications={})) == (
        Verdict.UNPROVEN,
        "Unproven: the program was not checked by the simulation.",
    )


def test_what_the_machine_cannot_do_does_not_hold(outcome: Maker) -> None:
    far = Finding("travel", 0, "row 1: X = 401 mm", Severity.EXCEEDS)
    made = outcome()
    simulations = {n: replace(s, findings=(far,)) for n, s in made.operations[0].simulations.items()}
    made = with_operation(made, simulations={**simulations, "plain": made.operations[0].simulations["plain"]})
    assert verdict(made) == (Verdict.EXCEEDS, "Exceeds: row 1: X = 401 mm.")


def test_summary_states_the_verdict_first_and_every_strategy(outcome: Maker) -> None:
    stated = json.loads(summary(outcome("plain")))
    assert list(stated)[:5] == ["schema_version", "capability", "job", "verdict", "message"]
    assert stated["verdict"] == "exceeds"
    assert [(t["name"], t["in_use"], t["verdict"]) for t in stated["tracks"]] == [
        ("plain", True, "exceeds"),
        ("backward", False, "holds"),
        ("feed", False, "exceeds"),
    ]
    plain = stated["tracks"][0]
    assert plain["limits"][0] == {
        "name": "engagement_deg",
        "column": "engagement_deg",
        "unit": "deg",
        "limit": 13.0,
        "worst": pytest.approx(18.738),
        "state": "exceeds",
        "track": "plain",
        "row": 900 + int(np.argmax(outcome().operations[0].result.strategies["plain"].history["engagement_deg"][900:])),
        "line": 0,
        "place": pytest.approx([5.0, 7.957, -5.0], abs=1e-3),
        "t_s": pytest.approx(plain["limits"][0]["row"] * 9.0 / 1799),
        "resolution_error": 0.0,
        "absolute_error": 0.0,
        "margin": pytest.approx(1.0 - plain["limits"][0]["worst"] / 13.0),
        "coverage": {
            "name": "finish pass", "reason": "where the wall is made", "ranges": [[900, 1800]],
            "excluded_s": pytest.approx(4.5, abs=0.01), "excluded_worst": 25.0,
        },
        "reason": "", "budget": None, "feed_law": None,
    }  # fmt: skip
    assert plain["time_s"] == 9.0
    assert [(f["code"], f["severity"]) for f in plain["findings"]] == [("lead-none", "note")]
    strategies = stated["operations"][0]["strategies"]
    assert list(strategies) == ["plain", "backward", "feed"]
    assert strategies["plain"]["engagement_deg"]["max"] == pytest.approx(18.738)
    assert strategies["plain"]["verification"]["verdict"] == "holds"
    assert stated["limits"] == plain["limits"]
    assert stated["unchecked"] == ["default checks: no coefficients", "limit torque_nm: not stated"]


@pytest.mark.parametrize("bad", [{"time_s": math.nan}, {"time_s": 9.0, "torque_nm": {"max": math.inf}}])
def test_a_number_that_is_none_is_a_fault(outcome: Maker, bad: dict[str, Any]) -> None:
    with pytest.raises(InputError, match="must be finite"):
        with_strategies(outcome(), lambda s: replace(s, summary=bad))
    # nor does one of another capability reach summary.json
    result = replace(result_of(outcome()), operations=(bad,))
    with pytest.raises(ValueError, match="should be a finite number"):
        summary_bytes(result, {})


def test_history_has_a_row_a_step(outcome: Maker) -> None:
    table = pq.read_table(io.BytesIO(history(outcome())))
    assert table.num_rows == 3 * 1800
    need = "operation track pass x_mm y_mm z_mm engagement_deg feed_mm_min force_x_n force_y_n torque_nm form_error_um"
    assert set(need.split()) <= set(table.column_names)
    assert table.column_names[:3] == ["operation", "track", "pass"]
    rows = table.to_pydict()
    # the track in use comes first, and each has a time of its own
    assert [rows["track"][k] for k in (0, 1800, 3600)] == ["backward", "plain", "feed"]
    t = np.array(rows["t_s"]).reshape(3, 1800)
    assert t[:, 0].tolist() == [0.0] * 3
    assert (np.diff(t) > 0.0).all()
    plain = [a for a, n, p in zip(rows["engagement_deg"], rows["track"], rows["pass"], strict=True)
             if (n, p) == ("plain", "finish")]  # fmt: skip
    assert max(plain) == pytest.approx(18.738)


def test_history_of_tracks_with_other_columns_has_nulls(outcome: Maker) -> None:
    def wider(s: StrategyResult) -> StrategyResult:
        return replace(s, history={**s.history, "line": np.ones(1800, dtype=np.int64)}) if s.name == "plain" else s

    table = pq.read_table(io.BytesIO(history(with_strategies(outcome(), wider))))
    assert table["line"].null_count == 2 * 1800


def test_a_result_read_back_is_the_result(outcome: Maker, tmp_path: Path) -> None:
    made = outcome("plain")
    write_result(result_of(made), presentation_of(made), tmp_path / "r")
    ours, again = result_of(made), load_result(tmp_path / "r")
    assert (again.verdict, again.message) == (ours.verdict, ours.message)
    for a, b in zip(again.tracks, ours.tracks, strict=True):
        assert (a.name, a.in_use, a.time_s, a.limits, a.findings) == (b.name, b.in_use, b.time_s, b.limits, b.findings)
        for name, values in b.columns.items():
            np.testing.assert_array_equal(a.columns[name], values)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('"verdict": "exceeds"', '"verdict": "holds"', "verdict holds does not follow from its limits and findings"),
        ('"name": "force_xy_n"', '"name": "<b>"', "limit <b>: not known: no column of a history has this name"),
        ('"worst": 95.0', '"worst": null', "without a value it can only be unproven"),
        ('"limit": 13.0', '"limit": 14.0', "limits differ from those of the tracks in use"),
        ('"schema_version": 1', '"schema_version": 2', "is not a result of schema version 1"),
        ('"name": "feed"', '"name": "plain"', "must differ"),
    ],
)
def test_a_summary_that_contradicts_itself_is_refused(
    outcome: Maker, tmp_path: Path, old: str, new: str, message: str
) -> None:
    made = outcome("plain")
    write_result(result_of(made), presentation_of(made), tmp_path / "r")
    path = tmp_path / "r" / "summary.json"
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(InputError, match=re.escape(message)):
        load_result(tmp_path / "r")


def test_the_same_outcome_gives_the_same_bytes(outcome: Maker) -> None:
    for make in (summary, history, report, scene_bytes):
        assert make(outcome()) == make(outcome()), make.__name__
    one, two = outcome(), outcome()
    assert program_files(one, result_of(one)) == program_files(two, result_of(two))


def test_the_page_loads_nothing_from_elsewhere(outcome: Maker) -> None:
    html = report(outcome()).decode()
    # what a page loads stands in its own elements and styles; the library's text is data to it
    own = re.sub(r'<script( id="plotly" type="text/plain")?>.*?</script>', "", html, flags=re.S)
    assert "http" not in own.replace("application/json", "")
    assert not re.search(r"\b(src|href)\s*=|@import|url\(", own)
    assert html.count("<script") == 4


def test_the_page_states_the_verdict_before_all_else(outcome: Maker) -> None:
    html = report(outcome("plain")).decode()
    body = html[html.index("<main>") :]
    order = [
        "<b>exceeds</b>",
        "engagement 18.7 deg exceeds 13 deg",
        "<h2>Not checked",
        "<details open><summary><h2>Limits",
        "<details><summary><h2>Strategies",
        "<details><summary><h2>Operation 0",
        "Along the finish pass",
        "Plan view",
        "<details><summary><h2>Notes",
        "<details><summary><h2>Provenance",
    ]
    places = [body.index(x) for x in order]
    assert places == sorted(places)
    assert "limit torque_nm: not stated" in body
    assert "operation.0.x: a finding" in body


def test_what_holds_is_folded_and_what_does_not_comes_first(outcome: Maker) -> None:
    result = result_of(outcome("plain"))
    presentation = Presentation(lambda _: ["<h2>More</h2><p>a picture</p>"], lambda: b"")
    findings = (Finding("a", 3, "not known", Severity.UNPROVEN), Finding("b", 0, "a remark"))
    html = page_bytes(replace(result, findings=findings), presentation).decode()
    main = html[html.index("<main>") : html.index("</main>")]
    shown = re.sub(r"<details>.*?</details>", "", main, flags=re.S)
    assert "not known" in shown
    assert "a remark" in main
    for folded in ("a remark", "a picture", "<h2>Strategies", "<h2>Provenance"):
        assert folded not in shown, folded
    assert re.findall(r"<details>.*?<h2>(.*?)</h2>", main) == ["Strategies", "More", "Notes", "Provenance"]


def test_limits_of_many_tracks_are_folded(outcome: Maker) -> None:
    """Of six tracks the one in use shows all, another what does not hold and a row for the rest."""
    tracks = result_of(outcome("plain")).tracks
    used = next(t for t in tracks if t.in_use)
    others = [replace(t, name=f"{t.name} {k}", in_use=False) for k in range(2) for t in tracks if not t.in_use]
    broken = replace(used, name="broken", in_use=False)
    table = "".join(limits_table([used, *others, broken]))
    rows = [re.sub("<[^>]*>", "|", row) for row in re.findall(r"<tr(?! class=.more).*?</tr>", table)[1:]]
    assert len(rows) == 2 + 2 * (1 + 2) + 2
    assert sum("all limits (2)" in row for row in rows) == 2
    assert [("exceeds" in row, "the other limits (1)" in row) for row in rows if "broken" in row] == [
        (True, False), (False, True),
    ]  # fmt: skip


def test_the_table_of_limits_has_the_numbers_of_the_result(outcome: Maker) -> None:
    made = outcome("plain")
    html = report(made).decode()
    table = html[html.index("<h2>Limits</h2>") :]
    rows = re.findall(r"<tr(?! class=.more).*?</tr>", table[: table.index("</table>")])[1:]
    cells = [[re.sub("<[^>]*>", "", c) for c in re.findall(r"<td[^>]*>(.*?)</td>", row)] for row in rows]
    wanted = {(t.name, c.column.title, c.state.value, f"{c.limit:g}", f"{c.worst:.3g}")
              for t in result_of(made).tracks for c in t.limits}  # fmt: skip
    assert {(c[0].removesuffix(" in use"), *c[1:5]) for c in cells} == wanted
    assert len(cells) == 6
    # the track in use first, its worst state first
    assert [c[0] for c in cells[:2]] == ["plain in use"] * 2
    assert [c[2] for c in cells[:2]] == ["exceeds", "holds"]


def test_reason_and_coverage_of_a_limit_stand_below_its_row_in_full_width(outcome: Maker) -> None:
    used = next(t for t in result_of(outcome("plain")).tracks if t.in_use)
    why = "the value is known to 2.14 %, and the limit lies within this"
    coverage = Coverage("finish pass", "limits count where the wall is made", ((0, 1),), 1.0, 1.0)
    limit = replace(used.limits[0], state=Verdict.UNPROVEN, reason=why, coverage=coverage)
    note, table = limits_table([replace(used, limits=(limit, used.limits[1]))])
    assert "covers every step of its track, where the line below it names no others" in note
    columns = len(re.findall("<th[ >]", table))
    below = re.findall(r'<tr class="more[^"]*"><td></td><td colspan="(\d+)">(.*?)</td></tr>', table)
    assert (int(below[0][0]), below[0][1]) == (columns - 1, f"{why} \u00b7 covers: finish pass")


def test_a_pass_that_never_cut_is_still_shown(outcome: Maker) -> None:
    def air(s: StrategyResult) -> StrategyResult:
        return replace(s, history={k: v if v.dtype == object else 0.0 * v for k, v in s.history.items()})

    made = with_strategies(outcome(), air)
    assert b"Along the finish pass" in report(made)
    assert scene_bytes(made)


def test_names_from_outside_cannot_become_markup(outcome: Maker) -> None:
    evil = "</script><script>alert(1)</script>"
    event = Event("x", 1.0, 1.0, evil)
    made = with_strategies(outcome(), lambda s: replace(s, events=(event,)))
    html = report(replace(made, title=evil, findings=(Finding("x", 0, evil),))).decode()
    assert evil not in html
    assert "&lt;script&gt;alert(1)" in html


def test_a_long_history_stays_small_and_keeps_its_extremes(outcome: Maker) -> None:
    html = report(outcome(rows=60_000))
    assert len(html) < 12e6


def test_thinning_keeps_the_extremes_of_every_stretch() -> None:
    rng = np.random.default_rng(1)
    values = rng.normal(size=50_000)
    values[31_234], values[17] = 40.0, -40.0
    keep = thin_rows(values, 2000)
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
    assert stretches(history).tolist() == [0, 0, 0, 1, 1, 2]


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
    done = outcome("backward")
    files = program_files(done, result_of(done))
    assert sorted(files) == [f"0-{n}.{e}" for n in ("backward", "feed", "plain") for e in ("apt", "ngc")]
    verified = {n for n, data in files.items() if b"NOT VERIFIED" not in data}
    assert verified == {"0-backward.ngc", "0-backward.apt"}
    for made in (outcome("plain"), outcome("backward", Verdict.UNPROVEN)):
        assert all(b"NOT VERIFIED" in data for data in program_files(made, result_of(made)).values())
    # what is found of the whole result counts as well: a guess of a draft, or a coarse run
    result = result_of(done)
    coarse = replace(result, findings=(Finding("job-coarse", 0, "a first result", Severity.UNPROVEN),))
    for name, data in program_files(done, coarse).items():
        assert b"NOT VERIFIED: Unproven: a first result" in data or "backward" not in name


def test_the_verdict_is_told_when_its_files_are_written_and_before_the_pictures_are_made(
    outcome: Maker, tmp_path: Path
) -> None:
    made, told = outcome(), list[str]()
    result, shown = result_of(made), presentation_of(made)

    def verdict() -> None:
        (fresh,) = tmp_path.iterdir()
        told.extend(sorted(p.name for p in fresh.iterdir()))

    def scene() -> bytes:
        told.append("scene")
        return shown.scene()

    def blanks() -> Any:
        told.append("blanks")
        return shown.blanks()

    presentation = replace(shown, scene=scene, blanks=blanks)
    write_result(result, presentation, tmp_path / "result", verdict=verdict)
    files = sorted(["history.parquet", "summary.json", *program_files(made, result)])
    assert told == [*files, "blanks", "scene"]


def test_the_folder_holds_everything(outcome: Maker, tmp_path: Path) -> None:
    made = outcome()
    target = write_result(result_of(made), presentation_of(made), tmp_path / "a" / "result")
    names = sorted(p.name for p in target.iterdir())
    assert names == sorted(["summary.json", "history.parquet", "removal.npz", "report.html", "scene.glb",
                            *program_files(made, result_of(made))])  # fmt: skip
