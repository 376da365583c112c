"""What the page shows of an impeller: its programs in order with stock, cutter and clearance, and its maps."""

from __future__ import annotations

import itertools
import json
import re
from dataclasses import dataclass

import numpy as np
import pytest

from chipload.cutter.catalogue import catalogue_named
from chipload.jobs.impeller.paths import walls_of
from chipload.planning.impeller.parametric import ImpellerShape, impeller_of
from chipload.report.removal import REMOVAL, read_cutter_parts, read_removal
from web_lists import VIEW, choose, drawn
from web_served import Served


@dataclass(frozen=True, eq=False)
class Shown:
    folder: object
    result: object
    used: list[int]


@pytest.fixture(scope="module")
def shown(example) -> Shown:
    done = example("impeller")
    result = done.result
    return Shown(done.folder, result, [k for k, t in enumerate(result.tracks) if t.in_use and t.columns])


def cutter_of(track):
    """D and r of a program by its name, `2-D30r2-30deg`, and its table angle [deg]."""
    size, angle = track.name.split("-")[-2:]
    d, r = (float(x) for x in size[1:].split("r"))
    return next(c for c in catalogue_named("wu2019").cutters if (c.diameter, c.corner_radius) == (d, r)), float(
        angle[:-3]
    )


def distance(points, tip, axis, cutter):
    """Of the nearest point from a bull-nose cutter without end: torus below, cylinder above."""
    h = (points - tip) @ axis
    d = np.linalg.norm(points - tip - h[:, None] * axis, axis=1)
    r, flat = cutter.corner_radius, 0.5 * cutter.diameter - cutter.corner_radius
    low = np.where(d > flat, np.hypot(d - flat, h - r) - r, np.abs(h - r) - r)
    return float(np.where(h < r, low, d - flat - r).min())


def test_clearance_and_angles_of_each_row(shown) -> None:
    shape = ImpellerShape(
        blades=11, channel=24.185, outer_radius=111.5, hub_radius=45.88, height=50.0, blade_height=39.35,
        outlet_height=24.0, wrap=np.radians(20.0),
    )  # fmt: skip
    walls = walls_of(impeller_of(shape), 0.0)
    for k in shown.used:
        track = shown.result.tracks[k]
        columns, (cutter, angle) = track.columns, cutter_of(track)
        assert columns["table_deg"] == pytest.approx(np.full(len(columns["t_s"]), angle), abs=1e-6)
        turn = np.radians(columns["pallet_deg"])
        for name, other in (("axis_x", np.cos(turn)), ("axis_y", np.sin(turn))):
            assert columns[name] == pytest.approx(np.sin(np.radians(angle)) * other, abs=1e-6)
        for row in np.linspace(0, len(columns["t_s"]) - 1, 12).astype(int):
            tip, axis = (np.array([columns[f"{n}"][row] for n in names]) for names in (
                ("x_mm", "y_mm", "z_mm"), ("axis_x", "axis_y", "axis_z")))  # fmt: skip
            found = sorted(distance(w.points, tip, axis, cutter) for w in walls)
            own = found[1] if str(columns["pass"][row]) in ("finish", "lead") else found[0]
            assert columns["tool_clearance_mm"][row] == pytest.approx(np.clip(own, 0.0, 20.0), abs=1e-6)


def test_each_program_begins_with_the_stock_that_those_before_it_leave(shown) -> None:
    stocks = [read_removal(shown.folder / REMOVAL, k) for k in shown.used]
    assert len(stocks) > 1
    for one, after in itertools.pairwise(stocks):
        assert after.volumes[0] == pytest.approx(one.volumes[-1], rel=0.01)
    rough = shown.result.operations[0]["roughing"]["programs"][0]
    # the check takes the same rows from the same blank with rays of its own, move by move
    assert stocks[0].volumes[0] - stocks[0].volumes[-1] == pytest.approx(rough["taken_mm3"], rel=0.02)
    for k, stock in zip(shown.used, stocks, strict=True):
        assert (np.diff(stock.volumes) <= 1e-6).all()
        ((_, parts),) = read_cutter_parts(shown.folder / REMOVAL, k).items()
        assert parts[0][0] == "flutes"
        assert 2.0 * parts[0][1][:, 0].max() == pytest.approx(cutter_of(shown.result.tracks[k])[0].diameter)


def test_the_report_holds_or_names_every_program_in_use_and_stays_small(shown) -> None:
    report = (shown.folder / "report.html").read_text()
    assert len(report.encode()) < 7_000_000
    names = re.findall(r'class="view3d-data" data-name="([^"]+)"', report)
    used = [shown.result.tracks[k].name for k in shown.used]
    # that of the critical limit comes first; what would make the file too large is named instead
    summary = json.loads((shown.folder / "summary.json").read_text())
    first = re.match(r"Holds: ([^:]+): ", summary["message"])[1]
    used.sort(key=lambda name: name != first)
    left = [name for name in used if name not in names]
    assert names == [name for name in used if name not in left] != []
    assert not left or f"Not in this file, to keep it small: {', '.join(left)}." in report


def test_maps_hold_the_numbers_of_the_summary(shown) -> None:
    maps = {m.name: m for m in shown.result.maps}
    points = next(iter(maps.values())).points
    assert len(points) == 20 * 10
    left = [m for m in maps.values() if m.column == "scallop_mm"]
    assert len(left) == 3
    # the rest on all of a surface is not less than what is left between two passes of its patches
    worst = max(p["scallop_greatest_mm"] for w in shown.result.operations[0]["programs"] for p in w["patches"])
    assert max(float(m.values.max()) for m in left) > 0.5 * worst
    angles = np.concatenate([m.values for m in maps.values() if m.column == "table_deg"])
    assert set(np.unique(np.round(angles[np.isfinite(angles)], 6))) <= set(range(20, 91, 5))


def test_the_page_shows_them(shown, browser) -> None:
    served = Served(shown.folder.parent)
    page = browser.new_page(viewport={"width": 1280, "height": 720})
    wrong = []
    try:
        page.set_default_timeout(60_000)
        page.on("pageerror", lambda e: wrong.append(str(e)))
        page.goto(served.address(f"?show={shown.folder.name}"))
        page.wait_for_selector(".cv-ramp")
        page.wait_for_selector(".cl-now")
        # it opens with the program of the critical limit
        number = next(k for k in shown.used if shown.result.tracks[k].name == shown.result.critical_program)
        first = shown.result.tracks[number]
        assert page.inner_text(".cl-space .cv-title").startswith("tool clearance [mm]")
        # the patches of all surfaces have one legend
        titles = page.locator(".cl-space .cv-title").all_inner_texts()
        assert titles.count("patch: cutter, table angle") == 1
        volumes = []
        rows = len(first.columns["t_s"])
        for row in (0, rows // 2, rows - 1):
            page.evaluate(f"{VIEW}.go({row})")
            drawn(page)
            volumes.append(page.evaluate(f"{VIEW}.state().stock.volume"))
        stock = read_removal(shown.folder / REMOVAL, number)
        assert volumes == pytest.approx([stock.volumes[stock.frame_of(r)] for r in (0, rows // 2, rows - 1)], rel=0.01)
        assert volumes[0] > volumes[1] > volumes[2]
        name = next(m.name for m in shown.result.maps if m.column == "largest_diameter_mm")
        choose(page, "surface map", f"{name}: largest diameter")
        page.wait_for_function(f"n => {VIEW}.state().map == n", arg=name)
        # blades and hub stay, the painted surfaces make room
        seen = page.evaluate(f"{VIEW}.solids.filter(s => s.group.visible).map(s => s.body.name)")
        assert sorted(seen) == ["blades", "hub"], seen
        # the next program follows in the timeline
        page.locator(".cl-tabs").get_by_text("tools", exact=True).click()
        page.wait_for_selector(".cl-time span")
        listed = page.locator(".cl-time span").all_inner_texts()
        for k, line in zip(shown.used, listed, strict=False):
            assert line.startswith(f"{shown.result.tracks[k].name}, T")
    finally:
        page.close()
        served.end()
    assert wrong == []
