"""What the page makes of a result, without a browser: against the numbers that the result was written with."""

import hashlib
import json
import math
import re
import struct
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import trimesh

from chipload.cutter.cutter import Cutter
from chipload.errors import Finding, InputError
from chipload.jobs.contour.figures import presentation_of
from chipload.jobs.contour.result import result_of
from chipload.program.apt.reader import read_apt
from chipload.report.answer import critical_html
from chipload.report.bodies import scene_bodies
from chipload.report.colouring import POINTS, WORDS, drawn_rows
from chipload.report.folder import write_result
from chipload.report.scene import legend
from chipload.report.view import parts_of
from chipload.result import LimitCheck, Track, TrackKind, Verdict, in_memory
from chipload.web import plots, scene
from chipload.web.asset_cache import CAPACITY, AssetCache
from chipload.web.checks import bound_of, findings, limits, row_of
from chipload.web.cutters import UNKNOWN, cutters_of
from chipload.web.folder_access import find_by_hash, list_folder, open_path, resolve_name, target_in
from chipload.web.panels.limits import finding_list, limit_table, time_line
from chipload.web.result import TextColumn, open_result
from chipload.web.source import follow_lines, source_of
from square import CL, FORCE, LINE, PROGRAM, ROWS, X, Y, make_result, square_result, two_variants, write_by_hand


@pytest.fixture
def root(tmp_path: Path) -> Path:
    (tmp_path / "square.ngc").write_text(PROGRAM)
    make_result(tmp_path / "r")
    return tmp_path


def parsed(document: bytes) -> tuple[dict, object]:
    """Header of a document of the view, and a reader of its arrays, by the words of its format."""
    assert document[:4] == b"CLV1"
    size = struct.unpack_from("<I", document, 4)[0]
    kinds = {"f4": "<f4", "u4": "<u4", "u2": "<u2", "u1": "u1"}

    def array(b: dict) -> np.ndarray:
        return np.frombuffer(document, kinds[b["t"]], b["n"], 8 + size + b["at"])

    return json.loads(document[8 : 8 + size]), array


def test_a_path_keeps_its_places_and_its_red(root: Path) -> None:
    r = open_result(root, "r")
    shown = scene.page_scene(r, r.tracks[0], scene.bodies(r), "force_n")
    header, array = parsed(shown.document)
    c, path = header["colouring"], header["path"]
    assert (c["low"], c["high"], c["limit"], c["label"], c["unit"]) == (FORCE.min(), FORCE.max(), 800.0, "force", "N")
    for points in (array(c["points"]), array(path["points"])):
        assert points.reshape(ROWS, 3)[:, 0] == pytest.approx(X, abs=1e-4)
        assert points.reshape(ROWS, 3)[:, 1] == pytest.approx(Y, abs=1e-4)
    assert array(c["values"]) == pytest.approx(FORCE)
    assert np.flatnonzero(array(c["above"])).tolist() == np.flatnonzero(FORCE > 800.0).tolist()
    assert array(path["t"]) == pytest.approx(0.1 * np.arange(1, ROWS + 1))
    assert [(m["row"], m["kind"]) for m in header["marks"]] == [(120, "limit")]
    assert [(b["name"], b["kind"], b["index"]["n"] // 3) for b in header["bodies"]] == [("stock", "stock", 12)]
    # a box of 60 x 60 x 10, and the path within it
    assert (header["low"], header["high"]) == ([-10.0, -10.0, -12.0], [50.0, 50.0, -2.0])
    assert "does not change with the slider" in shown.notice
    words = scene.colour_column(r, r.tracks[0], "pass", None)
    assert words.words == (("square", WORDS[0]),)


def test_the_legend_of_a_painted_body_is_that_of_the_scene_or_none() -> None:
    box = trimesh.creation.box()
    box.visual.face_colors = (168, 122, 58, 255)
    good = legend("gouge [mm]", [(0.0, (255, 255, 255)), (0.5, (178, 24, 43))], [("not known", (250, 246, 225))])
    assert good["stops"] == [[0.0, "#ffffff"], [0.5, "#b2182b"]]
    for metadata, expected in (
        (good, good),
        ({**good, "stops": [[0.0, "url(http://evil.example)"]]}, None),
        ({**good, "stops": [["x", "#ffffff"]]}, None),
        ({**good, "stops": [[1e999, "#ffffff"]]}, None),
        ({"title": "x"}, None),
        ("text", None),
    ):
        box.metadata["legend"] = metadata
        glb = trimesh.Scene({"part": box}).export(file_type="glb", extension_webp=False)
        (body,) = scene_bodies(glb)
        assert body.legend == expected


def test_what_is_allowed_and_planned_is_drawn_with_the_torque(tmp_path: Path) -> None:
    one = square_result()
    allowed, planned = np.full(ROWS, 8.0), np.linspace(4.0, 5.0, ROWS)
    columns = {**one.tracks[0].columns, "torque_allowable_nm": allowed, "torque_planned_nm": planned}
    write_by_hand(replace(one, tracks=(replace(one.tracks[0], blocks=in_memory(columns)),)), tmp_path / "t")
    r = open_result(tmp_path, "t")
    track = r.tracks[0]
    figure = plots.plots(r, track, plots.bounds_of(r, track, ["torque_nm"]), "time", 0)
    drawn = {d["name"]: d for d in figure["data"]}
    assert drawn["torque_allowable_nm"]["y"].tolist() == [8.0] * len(drawn["torque_allowable_nm"]["y"])
    assert drawn["torque_planned_nm"]["y"].tolist() == pytest.approx(planned)
    assert drawn["torque_nm"]["y"].max() == 9.0
    assert {d["yaxis"] for d in drawn.values()} == {"y"}


def test_a_cutter_is_its_profile() -> None:
    ball = Cutter(10.0, 2, 0.5, 20.0, 30.0, 6e5, corner_radius=5.0, shank_diameter=8.0, holder=((40.0, 32.0),))
    (_, flutes), (_, shank), (_, holder) = parts_of(ball)
    low = flutes[:, 1] < 5.0
    assert np.hypot(flutes[low, 0], flutes[low, 1] - 5.0) == pytest.approx(5.0, abs=1e-5)
    assert (flutes[:, 1].min(), flutes[:, 1].max()) == pytest.approx((0.0, 20.0))
    assert (shank[2:, 0].max(), shank[:, 1].max()) == pytest.approx((4.0, 30.0))
    assert (holder[:, 0].max(), holder[:, 1].min(), holder[:, 1].max()) == (16.0, 30.0, 70.0)


def test_the_cutter_comes_from_the_cl_data_else_a_pointer_stands_for_it(root: Path) -> None:
    r = open_result(root, "r")
    made, unknown = cutters_of(r, r.tracks[0], 25.0)
    assert unknown == ""
    assert [kind for kind, _ in made[0]] == ["flutes"]
    assert made[0][0][1].max(axis=0) == pytest.approx((4.0, 25.0))
    (root / "r" / "0-program.apt").unlink()
    made, unknown = cutters_of(r, r.tracks[0], 25.0)
    assert unknown == UNKNOWN
    assert list(made) == [0]


def test_the_tracks_of_a_planned_result(outcome, tmp_path: Path) -> None:
    made = outcome()
    write_result(result_of(made), presentation_of(made), tmp_path / "p")
    r = open_result(tmp_path, "p")
    assert [t.title for t in r.tracks] == ["backward, in use", "plain", "feed"]
    assert [(float(t.t[0]), float(t.t[-1]), len(t)) for t in r.tracks] == [(0.0, 9.0, 1800)] * 3
    plain = r.tracks[1]
    # the limit does not count in the semi-finish pass, whose engagement of 25 degrees lies above the worst
    bound = bound_of(r, plain, "engagement_deg")
    values, passes = r.column(plain, "engagement_deg"), r.column(plain, "pass")
    assert isinstance(passes, TextColumn)
    finish = np.array([passes.words[k] == "finish" for k in passes.codes])
    assert (bound.above == (finish & (values > 13.0))).all()
    checks = limits(plain)
    assert [(c.name, c.state) for c in checks] == [
        ("engagement_deg", Verdict.EXCEEDS),
        ("force_xy_n", Verdict.HOLDS),
    ]
    # the row is in the corner, in the finish pass
    row = row_of(plain, checks[0])
    assert finish[row]
    assert values[row] == pytest.approx(checks[0].worst)
    found = [f.text for f in findings(r, plain)]
    assert "plain is not in use" in found
    assert "not checked: limit torque_nm: not stated" in found
    assert {b.name for b in scene.bodies(r)[0]} == {"0-wall", "0-stock"}
    # its stock before is closed, and is shown at every row
    assert len(scene.stock_of(r, plain).rows) > 10
    # the path jumps from the end of one pass to the beginning of the next, as its length shows
    assert np.flatnonzero(plain.apart).tolist() == [900]


def test_rows_follow_the_lines_of_a_text_that_numbers_otherwise(root: Path) -> None:
    r = open_result(root, "r")
    track = r.tracks[0]
    own = source_of(r, track)
    assert (own.name, own.note) == ("square.ngc", "")
    assert own.of_row.tolist() == LINE.tolist()
    assert own.row_of(2) == 0
    assert own.row_of(9) == 100
    assert own.row_of(11) is None
    (root / "square.ngc").write_text(PROGRAM + "\n")
    other = source_of(r, track)
    assert other.name == "0-program.apt"
    assert "square.ngc" in other.note
    # sides of the square are the lines 7 to 10 of the CL data too, by another count: its GOTOs
    goto = [k for k, text in enumerate(CL.splitlines(), 1) if text.startswith("GOTO")][1:]
    assert other.of_row.tolist() == np.repeat(goto, ROWS // 4).tolist()
    # a text whose axes do not stand where the tool cuts, as that of a turning table, is not followed
    away = "".join(f"GOTO/{x},500,500,0,0,1\n" for x in (0, 10, 20))
    (root / "r" / "1-away.apt").write_text(f"PARTNO/AWAY\nUNITS/MM\nFEDRAT/100,MMPM\n{away}FINI\n")
    path = root / "r" / "summary.json"
    path.write_text(path.read_text().replace('"0-program.apt"', '"1-away.apt","0-program.apt"'))
    both = open_result(root, "r")
    assert [Path(name).name for name in both.tracks[0].own.programs][:2] == ["1-away.apt", "0-program.apt"]
    assert source_of(both, both.tracks[0]).name == "0-program.apt"


def test_a_program_for_turning_axes_is_shown_with_the_lines_of_its_history(tmp_path: Path) -> None:
    """Its axes do not stand where the tool cuts, so no row can be followed: the history counts in its lines."""
    one = square_result()
    columns = dict(one.tracks[0].columns)
    tilted = {"axis_x": np.full(ROWS, 0.6), "axis_y": np.zeros(ROWS), "axis_z": np.full(ROWS, 0.8)}
    track = replace(one.tracks[0], programs=("0-turned.ngc", "0-program.apt"), blocks=in_memory({**columns, **tilted}))
    result = replace(one, tracks=(track,), provenance=replace(one.provenance, inputs={}))
    folder = write_by_hand(result, tmp_path / "r")
    (folder / "0-turned.ngc").write_text("".join(f"X{k} B30 C{k}\n" for k in range(1, 13)))
    r = open_result(tmp_path, "r")
    own = source_of(r, r.tracks[0])
    assert own.name == "0-turned.ngc"
    assert own.of_row.tolist() == LINE.tolist()
    # a text with fewer lines is another one
    (folder / "0-turned.ngc").write_text("X1 B30\n")
    assert source_of(r, r.tracks[0]).name == "0-program.apt"


def test_a_text_with_new_feeds_is_shown_in_the_place_of_the_old_one(root: Path) -> None:
    path = root / "r" / "summary.json"
    text = path.read_text()
    (root / "r" / "0-feeds.ngc").write_text(PROGRAM.replace("F", "F1"))
    (root / "outside.ngc").write_text(PROGRAM)
    for name, shown, note in (
        ("0-feeds.ngc", "0-feeds.ngc", "with its new feeds"),
        ("../outside.ngc", "square.ngc", ""),
        ("../../x", "square.ngc", ""),
    ):
        path.write_text(text.replace('"0-program.apt"', f'"{name}"'))
        r = open_result(root, "r")
        own = source_of(r, r.tracks[0])
        assert (own.name, own.note) == (shown, note)
        assert own.of_row.tolist() == LINE.tolist()
    # a text of another job than one that changes feeds has lines of its own
    path.write_text(
        text.replace('"0-program.apt"', '"0-feeds.ngc"').replace('"capability": "program"', '"capability": "torque"')
    )
    r = open_result(root, "r")
    assert r.result.capability == "torque"
    assert source_of(r, r.tracks[0]).name == "square.ngc"


def test_limits_are_listed_by_state_and_margin(root: Path) -> None:
    r = open_result(root, "r")
    track = r.tracks[0]
    checks = tuple(
        LimitCheck(name, 100.0, worst, state, "program", 10, 1, resolution_error=0.0)
        for name, worst, state in (
            ("force_n", 30.0, Verdict.HOLDS), ("torque_nm", 120.0, Verdict.EXCEEDS), ("power_w", 90.0, Verdict.HOLDS),
            ("chip_max_mm", 400.0, Verdict.EXCEEDS), ("deflection_um", None, Verdict.UNPROVEN),
        )
    )  # fmt: skip
    listed = limits(replace(track, own=replace(track.own, limits=checks)))
    assert [c.name for c in listed] == ["chip_max_mm", "torque_nm", "deflection_um", "power_w", "force_n"]


def test_a_check_without_a_row_leads_to_the_nearest_on_its_line(root: Path) -> None:
    r = open_result(root, "r")
    track = r.tracks[0]
    force, torque = limits(track)
    assert (force.row, row_of(track, force)) == (120, 120)
    assert (torque.row, row_of(track, torque)) == (None, 120)
    assert row_of(track, Finding("x", 9, "at its line")) == 100
    assert row_of(track, Finding("x", 3, "a line that does not move leads to the next that does")) == 0
    assert row_of(track, Finding("x", 0, "a place", place=(40.0, 0.8, -2.0))) == 50
    assert row_of(track, Finding("x", 11, "after the last line")) is None
    assert row_of(track, Finding("x", 0, "nowhere")) is None


def test_two_tracks_keep_their_own_time_and_the_one_in_use_comes_first(tmp_path: Path) -> None:
    write_by_hand(two_variants(), tmp_path / "two")
    r = open_result(tmp_path, "two")
    assert [t.title for t in r.tracks] == ["variable (depth_mm 2), in use", "constant (depth_mm 1)"]
    used, other = r.tracks
    assert (len(used), len(other)) == (ROWS, ROWS)
    assert (float(used.t[-1]), float(other.t[-1])) == pytest.approx((20.0, 40.0))
    assert (np.diff(used.t) > 0.0).all()
    assert (np.diff(other.t) > 0.0).all()
    assert r.column(used, "force_n").max() == pytest.approx(450.0)
    assert r.column(other, "force_n").max() == pytest.approx(900.0)
    # each track has its own checks, the one that fails shows it
    assert [(c.name, c.state.value, c.worst) for c in limits(used)] == [("force_n", "holds", 450.0)]
    assert [(c.name, c.state.value, c.worst) for c in limits(other)] == [("force_n", "exceeds", 900.0)]
    assert bound_of(r, used, "force_n").above.sum() == 0
    assert bound_of(r, other, "force_n").above.sum() == (FORCE > 800.0).sum()
    assert findings(r, other)[0].text == "line 8: the path leaves the workpiece"
    assert r.result.verdict is Verdict.HOLDS


def test_of_several_programs_the_one_of_the_critical_limit_is_shown_first_and_named(tmp_path: Path) -> None:
    """Two setups in use: the second is nearer to its limit."""
    first, second = two_variants().tracks
    near = replace(first.limits[0], worst=790.0, track="setup 2")
    tracks = (replace(first, name="setup 1"), replace(second, name="setup 2", in_use=True, limits=(near,), findings=()))
    write_by_hand(replace(two_variants(), tracks=tracks), tmp_path / "two")
    r = open_result(tmp_path, "two")
    assert (r.first, r.result.critical_program) == (1, "setup 2")
    assert ">setup 2: force 790 of 800 N<" in critical_html(r.result)
    assert "setup 2: force 790 of 800 N" in r.result.message
    write_by_hand(two_variants(), tmp_path / "one")
    r = open_result(tmp_path, "one")
    assert (r.first, r.result.critical_program) == (0, "")


def test_an_arc_and_a_path_that_comes_back_are_followed() -> None:
    text = "UNITS/MM\nRAPID\nGOTO/0,0,0\nFEDRAT/100,MMPM\nGOTO/10,0,0\nCIRCLE/10,5,0,0,0,1\nGOTO/10,10,0\nGOTO/0,10,0\n"
    program, _ = read_apt(text + "GOTO/0,0,0\nGOTO/10,0,0\nFINI")
    turn = np.linspace(-0.5 * math.pi, 0.5 * math.pi, 40)[1:]
    straight = np.linspace(0.0, 10.0, 21)[1:]
    nothing = np.zeros(20)
    p = np.concatenate(
        [
            np.column_stack([straight, nothing, nothing]),
            np.column_stack([10.0 + 5.0 * np.cos(turn), 5.0 + 5.0 * np.sin(turn), np.zeros(39)]),
            np.column_stack([10.0 - straight, nothing + 10.0, nothing]),
            np.column_stack([nothing, 10.0 - straight, nothing]),
            np.column_stack([straight, nothing, nothing]),
        ]
    )
    assert follow_lines(p, program).tolist() == [5] * 20 + [7] * 39 + [8] * 20 + [9] * 20 + [10] * 20


def test_a_million_rows_keep_their_extremes(tmp_path: Path) -> None:
    n = 1_000_000
    values = np.full(n, 100.0)
    values[[123_456, 777_777]] = (5000.0, -70.0)
    values[500_000:600_000] = np.nan
    t = np.arange(n) * 0.01
    table = {"t_s": t, "s_mm": t, "x_mm": t, "y_mm": np.sin(t), "z_mm": np.zeros(n), "force_n": values}
    track = Track("program", TrackKind.PROGRAM, True, float(t[-1]), blocks=in_memory(table))
    write_by_hand(replace(square_result(), tracks=(track,)), tmp_path / "big")
    r = open_result(tmp_path, "big")
    track = r.tracks[0]
    drawn = plots.plots(r, track, {"force_n": None}, "time", 0)["data"][0]
    assert len(drawn["x"]) < 3 * plots.POINTS
    assert (np.nanmax(drawn["y"]), np.nanmin(drawn["y"])) == (5000.0, -70.0)
    assert drawn["x"][int(np.nanargmax(drawn["y"]))] == t[123_456]
    assert np.isnan(drawn["y"]).any()
    # a part that is zoomed into is drawn row by row where it has few, and the whole stays
    near = plots.plots(r, track, {"force_n": None}, "time", 0, (), (2000.0, 2005.0))["data"][0]
    assert set(t[200_000:200_501]) <= set(near["x"])
    assert set(drawn["x"]) <= set(near["x"])
    assert len(near["x"]) < len(drawn["x"]) + 1.1 * plots.POINTS
    rows = drawn_rows(scene.view_path(r, track), values)
    assert len(rows) < 1.2 * POINTS
    assert {0, n - 1, 123_456, 777_777} <= set(rows.tolist())


def test_what_is_in_the_folder_and_what_is_not(root: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    outside = make_result(tmp_path_factory.mktemp("away") / "r")
    (root / "away").symlink_to(outside, target_is_directory=True)
    (root / "summary-away").mkdir()
    (root / "summary-away" / "summary.json").symlink_to(outside / "summary.json")
    (root / "note.toml").write_text("[tool]\nx = 1\n")
    (root / "job.toml").write_text('[program]\nfile = "square.ngc"\n')
    (root / ".hidden").mkdir()
    (root / ".hidden" / "job.toml").write_text("[program]\n")
    assert [(f.kind, f.name, f.word) for f in list_folder(root)[0]] == [
        ("job", "job.toml", ""),
        ("result", "r", "exceeds"),
    ]
    assert resolve_name(root, "r/summary.json") == root / "r" / "summary.json"
    for name in ("away", "../x", "/etc/passwd", "r/../r", "r\0", "summary-away/summary.json", "none"):
        with pytest.raises(InputError, match="opened folder"):
            resolve_name(root, name)
    assert open_path(root / "r").first == "."
    assert open_path(root / "job.toml").first == "job.toml"
    assert open_path(root).first is None
    assert find_by_hash(root, "square.ngc sha256 00") is None
    for out in ("", ".", "../x", "/x", "away/x", "a\\b"):
        with pytest.raises(InputError, match="must be the name of a folder in the opened one"):
            target_in(root, out)
    assert target_in(root, "new/deep") == root / "new" / "deep"


def test_a_result_beside_its_job_is_opened_with_it(tmp_path: Path) -> None:
    """`chipload run part/job.toml --out result`, then `chipload view result`: job and program are in reach."""
    job = tmp_path / "here" / "part" / "job.toml"
    job.parent.mkdir(parents=True)
    job.write_text('[program]\nfile = "square.ngc"\n')
    one = square_result()
    made_from = f"job.toml sha256 {hashlib.sha256(job.read_bytes()).hexdigest()}"
    inputs = {**one.provenance.inputs, "job": made_from}
    write_by_hand(replace(one, provenance=replace(one.provenance, inputs=inputs)), tmp_path / "here" / "result")
    opened = open_path(tmp_path / "here" / "result")
    assert (opened.root, opened.first) == (tmp_path / "here", "result")
    # another job of that name is not the one that it was made from
    job.write_text('[program]\nfile = "round.ngc"\n')
    opened = open_path(tmp_path / "here" / "result")
    assert (opened.root, opened.first) == (tmp_path / "here" / "result", ".")


EMPTY = pa.table({c: pa.array([], pa.float64()) for c in ("t_s", "s_mm", "x_mm", "y_mm", "z_mm")})


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda f: (f / "summary.json").write_text("[]"), "is not a result of schema version 1"),
        (lambda f: (f / "history.parquet").write_bytes(b"PAR1"), "cannot be read: run the job again"),
        (lambda f: (f / "history.parquet").unlink(), "is not in the opened folder"),
        (lambda f: pq.write_table(pa.table({"x_mm": [0.0]}), f / "history.parquet"), "no y_mm: nothing to show"),
        (lambda f: pq.write_table(EMPTY, f / "history.parquet"), "no row: nothing to show"),
    ],
)
def test_a_result_that_cannot_be_shown_says_why(root: Path, spoil, message: str) -> None:
    spoil(root / "r")
    with pytest.raises(InputError, match=message):
        open_result(root, "r")


def test_a_scene_that_cannot_be_read_is_said(root: Path) -> None:
    (root / "r" / "scene.glb").write_bytes(b"glTF nothing")
    assert scene.bodies(open_result(root, "r")) == ((), "scene.glb cannot be read: only the path is shown.")
    (root / "r" / "scene.glb").unlink()
    assert scene.bodies(open_result(root, "r"))[1] == "This result has no scene; only its path is shown."


def test_the_page_states_times_that_add_up(root: Path) -> None:
    """The parts that the page shows add up to the time of the program, as in summary.json."""
    model = json.loads((root / "r" / "summary.json").read_text())["tracks"][0]
    text = re.sub("<[^>]*>", "", time_line(open_result(root, "r").tracks[0].times))
    whole, *parts = (float(n) for n in re.findall(r"[\d.]+(?:e-?\d+)?", text))
    assert whole == pytest.approx(model["time_s"], rel=1e-3)
    assert len(parts) == 5
    assert sum(parts) == pytest.approx(whole, rel=1e-3)


def test_texts_are_escaped(root: Path) -> None:
    path = root / "r" / "summary.json"
    summary = json.loads(path.read_text())
    summary["tracks"][0]["findings"][0]["text"] = "<img src=x onerror=alert(1)>"
    summary["unchecked"] = ["<b>x"]
    for checks in (summary["limits"], summary["tracks"][0]["limits"]):
        checks[1] |= {"state": "unproven", "reason": "<s>"}
    path.write_text(json.dumps(summary))
    r = open_result(root, "r")
    html = limit_table(r.tracks[0]) + finding_list(findings(r, r.tracks[0]))
    for tag in ("<b>", "<img", "<s>"):
        assert tag not in html
    assert "&lt;img src=x" in html


def test_the_asset_cache_forgets_the_oldest() -> None:
    assets = AssetCache()
    first = assets.put(b"a" * (CAPACITY // 2))
    second = assets.put(b"b" * (CAPACITY // 2))
    key = first.removeprefix("/shape/").removesuffix(".bin")
    assert assets.get(key) is not None
    assets.put(b"c")
    assert assets.get(key) is None
    assert assets.get(second.removeprefix("/shape/").removesuffix(".bin")) is not None
    assert assets.get("../../etc/passwd") is None
