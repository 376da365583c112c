"""The 3D view of report.html, opened as a file of its own in a browser: it shows, moves, prints, and asks nobody."""

import base64
from dataclasses import replace

import numpy as np
import pytest

from chipload.report.page import page_bytes
from chipload.report.presentation import Blank, Presentation
from chipload.report.removal import removal_meshes
from chipload.report.view import Buffers, _removal
from chipload.report.view_section import drawn_bodies, view_section
from square import MILL, ROWS, STOCK, VOLUMES, make_cut_result, square_result


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """report.html of the square that is cut."""
    folder = make_cut_result(tmp_path_factory.mktemp("report") / "r")
    result, blanks = square_result("cut"), {"program": Blank(STOCK, {1: MILL})}
    glb = (folder / "scene.glb").read_bytes()
    view = view_section(
        result, drawn_bodies(result, glb, removal_meshes(result, blanks)), removal_meshes(result, blanks), blanks
    )
    path = folder / "report.html"
    path.write_bytes(page_bytes(result, Presentation(lambda _: [], lambda: glb), view))
    return path


@pytest.fixture
def page(browser, written):
    page = browser.new_page(viewport={"width": 1000, "height": 900})
    page.set_default_timeout(120_000)
    asked, wrong = [], []
    page.on("request", lambda r: asked.append(r.url))
    page.on("pageerror", lambda e: wrong.append(str(e)))
    page.goto(written.as_uri())
    page.wait_for_selector(".view3d canvas")
    page.wait_for_function("document.querySelector('.cv-print img')?.src.length > 1000")
    yield page
    page.close()
    assert wrong == []
    assert [u for u in asked if not u.startswith(("data:", "blob:")) and u != written.as_uri()] == []


VIEW = "chiploadViewer.of('view3d')"


def test_the_report_shows_the_stock_at_its_slider_and_the_worst_first(page) -> None:
    state = page.evaluate(f"{VIEW}.state()")
    # the force exceeds its limit most at row 120
    assert state["row"] == 120
    assert page.inner_text(".cv-note") == "force 900 N, limit 800"
    slider = page.locator("input[type=range]")
    for share, volume in ((0.0, VOLUMES[0]), (1.0, VOLUMES[2])):
        slider.evaluate(
            "(e, s) => { e.value = Number(e.min) + s * (e.max - e.min); e.dispatchEvent(new Event('input')); }", share
        )
        state = page.evaluate(f"{VIEW}.state()")
        assert state["row"] == (0 if share == 0.0 else ROWS - 1)
        assert state["stock"]["volume"] == pytest.approx(volume, rel=0.01)
    page.get_by_role("button", name="play").click()
    # it begins again, since it stood at the end, and goes on by itself
    page.wait_for_function(f"{VIEW}.row < {ROWS - 1}")
    page.wait_for_function(f"{VIEW}.row > 3")


def test_it_prints_a_picture_and_does_not_scroll_sideways(page, pixels) -> None:
    page.emulate_media(media="print")
    assert page.locator(".cv-print").is_visible()
    assert not page.locator(".cv-box").is_visible()
    # the scale of colours, the message and a length stand below the picture
    assert page.locator(".cv-print .cv-ramp").is_visible()
    assert page.inner_text(".cv-print .cv-note") == page.text_content(".cv-box .cv-note")
    wide, share = page.evaluate(
        """() => { const line = document.querySelector('.cv-print .cv-scale div');
        return [line.getBoundingClientRect().width / document.querySelector('.cv-print img').clientWidth,
                Number(document.querySelector('.cv-box .cv-scale div').dataset.share)]; }"""
    )
    assert wide == pytest.approx(share, rel=0.01)
    picture = pixels(page.locator(".cv-print").screenshot())
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 100
    assert len(page.pdf()) > 20_000
    page.emulate_media(media="screen")
    for width in (420, 1280):
        page.set_viewport_size({"width": width, "height": 800})
        assert page.evaluate("document.documentElement.scrollWidth") <= width


def test_a_long_report_stays_small() -> None:
    one = square_result("long")
    n, own = 100_000, one.tracks[0]
    turn = np.linspace(0.0, 80.0 * np.pi, n)
    wide = np.linspace(2.0, 20.0, n)
    table = {
        "t_s": 0.01 * np.arange(n),
        "s_mm": np.cumsum(wide * 80.0 * np.pi / n) + np.arange(n) * 1e-3,
        "x_mm": 20.0 + wide * np.cos(turn),
        "y_mm": 20.0 + wide * np.sin(turn),
        "z_mm": -2.0 - np.sin(turn * 7.0),
        "line": np.arange(n) // 10,
        "tool": np.ones(n, dtype=np.int64),
        "force_n": 300.0 + 100.0 * np.sin(np.arange(n)) * np.random.default_rng(1).random(n),
    }
    result = replace(one, tracks=(replace(own, limits=(), findings=(), blocks=lambda: iter([table])),))
    blanks = {"program": Blank(STOCK, {1: MILL})}
    # the stock has at most so many frames and cells: a tenth of the rows makes one as large
    tenth = {name: column[::10] for name, column in table.items()}
    few = replace(result, tracks=(replace(result.tracks[0], blocks=lambda: iter([tenth])),))
    stocks = removal_meshes(few, blanks)
    view = view_section(result, drawn_bodies(result, _empty(), stocks), stocks, blanks)
    report = page_bytes(result, Presentation(lambda _: [], _empty), view)
    assert len(report) < 6_000_000 - 2_000_000  # figures bring plotly, 2 MB
    assert base64.b64decode(view[3].split(">")[1].split("<")[0])


def two_programs():
    """The square that is cut, and as a second program in use the first half of it."""
    one = square_result("cut")
    (own,) = one.tracks
    table = {name: column[: ROWS // 2] for name, column in own.columns.items()}
    half = replace(own, name="half", limits=(), findings=(), blocks=lambda: iter([table]))
    result = replace(one, tracks=(own, half))
    blanks = {name: Blank(STOCK, {1: MILL}) for name in ("program", "half")}
    return result, blanks, removal_meshes(result, blanks)


def test_each_program_in_use_can_be_chosen(browser, tmp_path) -> None:
    result, blanks, stocks = two_programs()
    glb = (make_cut_result(tmp_path / "r") / "scene.glb").read_bytes()
    view = view_section(result, drawn_bodies(result, glb, stocks), stocks, blanks)
    path = tmp_path / "report.html"
    path.write_bytes(page_bytes(result, Presentation(lambda _: [], lambda: glb), view))
    page = browser.new_page()
    page.goto(path.as_uri())
    page.wait_for_selector(".view3d canvas")
    chosen = page.get_by_label("program")
    assert chosen.locator("option").all_inner_texts() == ["program", "half"]
    bodies = page.evaluate(f"{VIEW}.state().bodies")
    for name, rows, volume in (("half", ROWS // 2, VOLUMES[1]), ("program", ROWS, VOLUMES[2])):
        chosen.select_option(name)
        page.wait_for_function(f"n => {VIEW}.path.count == n", arg=rows)
        page.evaluate(f"{VIEW}.go({rows - 1})")
        state = page.evaluate(f"{VIEW}.state()")
        assert state["stock"]["volume"] == pytest.approx(volume, rel=0.01)
        assert state["bodies"] == bodies
        assert len(bodies) == 1
        slider = page.locator("input[type=range]")
        assert float(slider.get_attribute("max")) == pytest.approx(float(result.tracks[0].columns["t_s"][rows - 1]))
    page.close()


def test_a_program_that_makes_the_report_too_large_is_named(monkeypatch) -> None:
    from chipload.report import view_section as module

    result, blanks, stocks = two_programs()
    monkeypatch.setattr(module, "LARGEST", 10_000)
    view = view_section(result, drawn_bodies(result, _empty(), stocks), stocks, blanks)
    assert "Not in this file, to keep it small: half." in view[1]
    assert len(view) == 4
    # the one of the critical limit stands first, wherever it is run
    turned = replace(result, tracks=result.tracks[::-1])
    turned_stocks = replace(stocks, meshes={1 - k: mesh for k, mesh in stocks.meshes.items()})
    assert view_section(turned, drawn_bodies(turned, _empty(), turned_stocks), turned_stocks, blanks)[1] == view[1]


def test_the_stock_is_rounded_by_less_than_its_cells_and_not_at_all_on_the_page() -> None:
    _, _, stocks = two_programs()
    mesh = stocks.meshes[0]
    for cells in (0.0, 0.0625):
        out = Buffers()
        packed = _removal(mesh, out, cells)
        kinds = {"u2": "<u2", "u4": "<u4"}
        vertices, quads = (
            np.cumsum(np.frombuffer(out.data, kinds[b["t"]], b["n"], b["at"]).reshape(n, -1), axis=1, dtype=kind).T
            for b, n, kind in ((packed["vertices"], 3, np.uint16), (packed["quads"], 4, np.uint32))
        )
        found = np.minimum(vertices[quads] * np.array(packed["step"]), 65535)
        off = np.abs(found - mesh.corners).max(axis=(0, 1)) * (mesh.high - mesh.low) / 65535
        assert (max(packed["step"]) > 1.0) == (cells > 0.0)
        assert (off <= 0.5 * cells * mesh.cell + 1e-3 * (cells > 0.0)).all()


def _empty() -> bytes:
    import trimesh

    return trimesh.Scene([trimesh.creation.box()]).export(file_type="glb", extension_webp=False)


def test_a_stock_that_cannot_be_drawn_is_told_with_its_reason(tmp_path) -> None:
    from chipload.report.removal import REMOVAL, read_cutter_parts, read_removal, removal_bytes
    from chipload.web.result import open_result
    from chipload.web.scene import bodies, page_scene

    # its bottom is open
    open_box = STOCK.copy()
    open_box.update_faces(open_box.face_normals[:, 2] > -0.5)
    blanks = {"program": Blank(open_box, {1: MILL})}
    result = square_result("cut")
    stocks = removal_meshes(result, blanks)
    assert not stocks.meshes
    assert "the mesh is not closed" in stocks.refused[0]
    folder = make_cut_result(tmp_path / "r")
    (folder / REMOVAL).write_bytes(removal_bytes(result, stocks, blanks))
    assert read_removal(folder / REMOVAL, 0) is None
    # the cutter is kept without its stock
    assert [kind for kind, _ in read_cutter_parts(folder / REMOVAL, 0)[1]] == ["flutes", "shank", "holder"]
    shown = open_result(tmp_path, "r")
    notice = page_scene(shown, shown.tracks[0], bodies(shown), "force_n").notice
    assert f"The stock is not drawn: {stocks.refused[0]}." in notice
    glb = (folder / "scene.glb").read_bytes()
    assert (
        "The stock is not drawn: stock: " in view_section(result, drawn_bodies(result, glb, stocks), stocks, blanks)[1]
    )
