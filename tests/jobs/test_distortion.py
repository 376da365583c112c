"""Distortion jobs: the plan in use, what a plan is made of, what is said and what is refused."""

from __future__ import annotations

import json

import numpy as np
import pytest
import trimesh

from chipload.errors import ChiploadError
from chipload.jobs import job_of, run_job
from chipload.jobs.distortion.plans import Clamping, MillingPlan, plans_of
from chipload.jobs.distortion.release import plate_release
from chipload.jobs.distortion.run import read_part
from chipload.jobs.distortion.shapes import SideCut, part_layers
from chipload.jobs.distortion.surface import part_surface
from chipload.result import Verdict
from chipload.structure.cells.workpiece import Elastic
from chipload.structure.stress_profile import m_shape, odd_shape

E, NU = 71_700.0, 0.33
SIZE = (60.0, 30.0, 12.0)
METAL = Elastic(E, NU)


def box(low, high):
    out = trimesh.creation.box(np.subtract(high, low))
    out.apply_translation(np.add(low, high) / 2.0)
    return out


def tray():
    """A block with one pocket: walls and floor 3 mm."""
    pocket = box((3, 3, 3), (SIZE[0] - 3, SIZE[1] - 3, SIZE[2] + 1))
    return trimesh.boolean.difference([box((0, 0, 0), SIZE), pocket], engine="manifold")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    out = tmp_path_factory.mktemp("tray")
    tray().export(out / "tray.stl")
    return out


def values(**more):
    job = {
        "residual_stress": {
            "shape": "m", "amplitude_mpa": 20.0, "across_share": 0.6, "rolling": "x", "source": "of this test",
        },
        "part": {"file": "tray.stl", "units": "mm", "spacing_mm": 10.0},
        "stock": {"low_mm": [0.0, 0.0, -2.0], "high_mm": [60.0, 30.0, 18.0]},
        "workpiece": {"modulus_gpa": 71.7, "poisson": 0.33, "cell_mm": 12.0},
        "setup": [{"side": "z-"}, {"side": "z+"}],
    }  # fmt: skip
    for key, value in more.items():
        job[key] = {**job[key], **value} if isinstance(value, dict) and key in job else value
    return job


@pytest.fixture(scope="module")
def chosen(folder):
    """A job that may choose."""
    choices = {"offset_mm": [4.0, 30.0], "stock_mm": [1.0], "flip": False}
    job = values(choices=choices, limits={"flatness_um": 50.0})
    job["residual_stress"]["odd_percent"] = 60.0
    return run_job(job_of(job, folder))


def test_the_flattest_plan_is_used(chosen):
    done, result = chosen.outcome, chosen.result
    highs = [flat.high for _, flat, _ in done.others]
    assert done.used.plan == done.others[0][0]
    assert highs == sorted(highs)
    assert {plan.offset for plan, _, _ in done.others} == {2.0, 4.0}, "a part that stands out of the plate is no plan"
    assert [t.name for t in result.tracks] == ["chosen plan", "stated plan"]
    assert done.used.flatness.value <= 0.5 * done.stated.flatness.value
    assert result.verdict is Verdict.HOLDS
    assert json.dumps(result.operations[0])


def test_the_report_draws_the_released_part(chosen):
    """The flatness of the drawn underside, over its magnification, is that of the result."""
    figures = {}
    text = "".join(chosen.presentation.sections(figures))
    assert 'id="shape"' in text
    designed, released = figures["shape"].data
    place, moved = (np.column_stack([t.x, t.y, t.z]).astype(float) for t in (designed, released))
    times = float(released.name.rsplit(" ", 1)[1])
    assert f"it is drawn {times:g} times as large" in text
    # corners of triangles that look down, at the lowest height
    rows = np.flatnonzero(np.repeat(chosen.outcome.surface.normals[:, 2] < -0.99, 3) & (np.abs(place[:, 2]) < 1e-9))
    plane, rise = np.column_stack([np.ones(len(rows)), place[rows, :2]]), (moved - place)[rows, 2] / times
    rest = rise - plane @ np.linalg.lstsq(plane, rise, rcond=None)[0]
    assert np.ptp(rest) == pytest.approx(chosen.outcome.used.flatness.value, rel=1e-3)


def test_what_is_not_in_the_model_is_said(chosen, folder):
    assert "limit distortion_um: not stated" in chosen.result.unchecked
    assert "milled-skin" not in [f.code for f in chosen.result.findings], "walls of 3 mm"


def test_the_band_is_that_of_the_stress(folder):
    """Half as much stress and no odd term: half the flatness, and the band only that of the amplitude."""
    flat = []
    for amplitude in (20.0, 10.0):
        job = values(limits={"flatness_um": 1.0})
        job["residual_stress"] |= {"amplitude_mpa": amplitude, "odd_percent": 0.0, "spread_percent": 30.0}
        done = run_job(job_of(job, folder))
        flat.append(done.outcome.used.flatness)
        assert done.result.verdict is Verdict.EXCEEDS
    assert flat[0].value == pytest.approx(2.0 * flat[1].value, rel=1e-9)
    assert [flat[0].low, flat[0].high] == pytest.approx([0.7 * flat[0].value, 1.3 * flat[0].value], rel=1e-9)


def test_points_by_a_file_are_balanced_and_it_is_said(folder):
    z = np.linspace(0.0, 20.0, 41)
    s = -20.0 * np.cos(4.0 * np.pi * z / 20.0) + 1.0
    rows = [f"{a:.9g},{b:.9g},{0.6 * b:.9g}" for a, b in zip(z, s, strict=True)]
    (folder / "plate.csv").write_text("\n".join(["height_mm,along_mpa,across_mpa", *rows, ""]))
    stress = {"file": "plate.csv", "rolling": "y", "source": "points"}
    job = values()
    job["residual_stress"] = stress
    loaded = job_of(job, folder)
    assert loaded.job.unbalance == pytest.approx(1.0 / (2.0 / np.pi * 20.0), rel=0.02)
    assert np.allclose(loaded.job.profile.along_x, 0.6 * loaded.job.profile.along_y)
    finding = next(f for f in run_job(loaded).result.findings if f.code == "stress-balanced")
    assert "balanced by a constant and a linear term" in finding.text


def release(low, high, stocks, profiles):
    return plate_release(tray(), np.array(low), np.array(high), stocks, profiles, METAL, 12.0)


def test_a_face_of_the_plate_moves_as_a_beam_that_was_milled_on_one_side():
    """A strip of 4 mm from a plate of 12: its rolled underside takes the curvature of the closed form."""
    H, t, L = 12.0, 4.0, 90.0
    strip = box((0, 0, 0), (L, 5, t))
    profiles = m_shape(H, 20.0, 0.0), odd_shape(H, 0.0, 0.0)
    one = plate_release(strip, np.zeros(3), np.array([L, 5.0, H]), [0.0], profiles, METAL, 12.0)
    surface = part_surface(strip, 6.0)
    done = one.outcome(MillingPlan(0.0, False, (Clamping(SideCut("z+", 0.0)),)), surface, 0.0)
    z = np.linspace(0.0, t, 20_001)
    kappa = 12.0 / (E * t**3) * np.trapezoid(-20.0 * np.cos(4.0 * np.pi * z / H) * (z - t / 2), z)
    # the stress fades out over about one thickness at each end
    assert done.flatness.value == pytest.approx(abs(kappa) * L**2 / 8.0, rel=0.12)
    # the upper side was milled while the straight blank was held, so that it bends as much
    upper = next(value for name, value in done.faces.items() if name.startswith("z+"))
    assert upper.value == pytest.approx(done.flatness.value, rel=0.1)
    x = done.moved[:, 2][(surface.points[:, 2] == 0.0) & (np.abs(surface.points[:, 0] - L / 2) < 0.3 * L)]
    at = surface.points[(surface.points[:, 2] == 0.0) & (np.abs(surface.points[:, 0] - L / 2) < 0.3 * L), 0]
    assert 2.0 * np.polyfit(at, x, 2)[0] == pytest.approx(kappa, rel=0.02)


def test_order_of_the_same_cuts_leaves_the_same_shape():
    profiles = m_shape(20.0, 20.0, 0.6), odd_shape(20.0, 5.0, 0.6)
    one = release((0, 0, -2), (60, 30, 18), [1.0], profiles)
    cuts = SideCut("z+", 1.0), SideCut("z-", 0.0), SideCut("z+", 0.0)
    assert one.state(cuts) is one.state(cuts[::-1])
    volume = one.state(cuts).stock.volume()
    assert volume == pytest.approx(tray().volume, rel=1e-9)
    # 1 mm left: the outside of the blank stays, the pocket is 1 mm narrower all round and shallower
    rough = one.state(cuts[:2]).stock.volume()
    assert rough == pytest.approx(60 * 30 * 13.0 - 52 * 22 * 9.0, rel=1e-9)


def test_upside_down_and_mirrored_are_the_same():
    profiles = odd_shape(20.0, 20.0, 0.6), m_shape(20.0, 0.0, 0.6)
    surface = part_surface(tray(), 10.0)
    up = release((0, 0, -2), (60, 30, 18), [], profiles)
    down = release((0, 0, -2), (60, 30, 18), [], tuple(p.upside_down() for p in profiles))
    setups = (Clamping(SideCut("z-", 0.0)), Clamping(SideCut("z+", 0.0)))
    flat = [r.outcome(MillingPlan(2.0, f, setups), surface, 0.0).flatness.value for r, f in ((up, True), (down, False))]
    assert flat[0] == pytest.approx(flat[1], rel=1e-9)


def test_clamps_that_press_flat_leave_the_bow_and_their_force_is_said(folder):
    """Roughed and released, then pressed flat by its whole underside: the bow comes back when it is let go."""
    clamp = [{"face": "z-"}]
    free = values(
        stock={"low_mm": [0, 0, 0], "high_mm": [60, 30, 20]}, setup=[{"side": "z+", "stock_mm": 1.0}, {"side": "z+"}]
    )
    flat = values(
        stock={"low_mm": [0, 0, 0], "high_mm": [60, 30, 20]},
        setup=[{"side": "z+", "stock_mm": 1.0}, {"side": "z+", "clamp": clamp, "hold": "flat"}],
    )
    lies, pressed = (run_job(job_of(job, folder)) for job in (free, flat))
    floor = next(name for name in lies.outcome.used.faces if name.startswith("z+ at 3 mm"))
    assert pressed.outcome.used.faces[floor].value > 1.5 * lies.outcome.used.faces[floor].value
    text = next(f.text for f in pressed.result.findings if f.code == "pressed-flat")
    assert text.startswith("setup 2: the clamps press the part flat with ")


def test_plans_of_a_job(folder):
    loaded = job_of(values(choices={"offset_mm": [2.0], "stock_mm": [0.5], "flip": False}), folder).job
    names = [p.name for p in plans_of(loaded, 0.0, SIZE[2])]
    assert len(names) == len(set(names)) == 6
    assert names[0] == "part 2 mm up in the plate: z- to 0 mm, z+ to 0 mm"
    assert "part 2 mm up in the plate: z- to 0.5 mm, z+ to 0.5 mm, z+ to 0 mm, z- to 0 mm" in names


def test_layers_of_a_slope():
    """A wedge: layers follow its slope, and their volume is within 0.1 % of it."""
    mesh = box((0, 0, 0), (30, 10, 10))
    mesh.vertices[mesh.vertices[:, 2] > 5.0, 0] *= 0.5
    layers = part_layers(mesh, *mesh.bounds, [0.0])
    assert layers.stock(list(layers.shapes)).volume() == pytest.approx(mesh.volume, rel=1e-3)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"setup": [{"side": "z+"}]}, r"setup: .* mm2 of the part are milled in no setup, as at .*: add a setup"),
        (
            {"stock": {"low_mm": [0, 0, 0], "high_mm": [50, 30, 20]}},
            r"part: from x = 0 to 60 mm, stands out of the stock",
        ),
        ({"setup": [{"side": "z+", "hold": "flat"}]}, r"setup.0.hold = flat: state the clamps"),
        ({"residual_stress": {"points_mpa": [[0, 1, 1], [5, 1, 1]]}}, r"shape and points_mpa are stated: state one of"),
        (
            {"setup": [{"side": "z-"}, {"side": "z+", "clamp": [{"face": "z-", "directions": "z"}]}]},
            "motion along x, motion along y, rotation about z are free",
        ),
        (
            {"stock": {"low_mm": [0, 0, 5], "high_mm": [60, 30, 5]}},
            r"stock.high_mm: z = 5 must be above that of low_mm, 5",
        ),
    ],
)
def test_refused(folder, change, text):
    with pytest.raises(ChiploadError, match=text):
        run_job(job_of(values(**change), folder))


def test_points_of_another_plate_are_refused(folder):
    job = values()
    job["residual_stress"] = {
        "points_mpa": [[0, -10, -6], [5, 10, 6], [10, -10, -6]], "rolling": "x", "source": "of a plate of 10 mm",
    }  # fmt: skip
    with pytest.raises(ChiploadError, match=r"its points end at a height of 10 mm: must be at the upper side .* 20 mm"):
        job_of(job, folder)


def test_the_part_is_read(folder):
    assert read_part(job_of(values(), folder).job).volume == pytest.approx(tray().volume)
