"""A plate cut with the flank of an end mill: forces of the written program against a sum over the edges, deflection
against the load as the teeth distribute it, the volume, and what is refused."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chipload.errors import InputError
from chipload.examples import copy_example
from chipload.jobs import load_job, run_job
from chipload.jobs.thinwall.inputs import read_wall
from chipload.jobs.thinwall.run import propose, run
from chipload.planning.thinwall.blank import SIDES
from chipload.report.folder import write_result
from chipload.structure.places import normals_of, on_cut, on_side, weights
from chipload.structure.solid import displacement, factorise

SMALL = (
    "operation.0.refine=false",
    "wall.length_mm=10.0",
    "wall.height_mm=9.0",
    "wall.thickness_mm=2.4",
    "wall.foot_mm=4.0",
    "wall.allowance_mm=[0.3, 0.3]",
    "wall.elements=[6, 6]",
    "limits.deflection_workpiece_um=15.0",
    "checks.confidence=0.5",
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return copy_example("plate", tmp_path_factory.mktemp("flank") / "plate")


def job(folder, *change, milling="down", number=0):
    path = folder / f"flank-{milling}-{number}.toml"
    text = (folder / "flank.toml").read_text()
    for old, new in {
        'milling = "down"': f'milling = "{milling}"',
        "axial_depth_mm = 0.75": "axial_depth_mm = 1.25",
        "depth_max_mm = 0.4": "depth_max_mm = 0.3",
    }.items():
        assert old in text
        text = text.replace(old, new)
    path.write_text(text)
    return load_job(path, (*SMALL, *change))


@pytest.fixture(scope="module", params=["down", "up"])
def cut(request, folder):
    loaded = job(folder, milling=request.param)
    return loaded, request.param, run(loaded.job)


def pushes(cutter, material, feed_per_tooth, b, d, down, turns=720, n=400):
    """Normal force a length of a straight flank (turns, n) [N], positive where it pushes the wall away, and the heights
    (n,) above the lower end of the contact line. Chips lie between trochoids, begin f / (2 R) beyond the new wall, and
    run out along the face that the tooth before has cut."""
    R, z = cutter.radius, (np.arange(n) + 0.5) * b / n
    psi = math.acos(1.0 - d / R)
    Ktc, Krc, _, Kte, Kre, _ = material.coefficients
    theta = np.arange(turns)[:, None] * math.tau / cutter.flutes / turns
    F = np.zeros((turns, n))
    for j in range(cutter.flutes):
        phi = (theta + j * math.tau / cutter.flutes - z * math.tan(cutter.helix) / R + 1.0) % math.tau - 1.0
        beyond = 0.5 * feed_per_tooth / R
        cuts = (phi > math.pi - psi) & (phi < math.pi + beyond) if down else (phi > -beyond) & (phi < psi)
        chip = feed_per_tooth * np.sin(phi) * (1.0 - cutter.flutes * feed_per_tooth / math.tau * np.cos(phi) / R)
        chip += (feed_per_tooth * np.cos(phi)) ** 2 / (2.0 * R)
        chip = np.minimum(chip, R * (np.abs(np.cos(phi)) / math.cos(psi) - 1.0)).clip(0.0)
        radial, tangential = (Krc * chip + Kre) * np.abs(np.cos(phi)), (Ktc * chip + Kte) * np.sin(phi)
        F += np.where(cuts, radial + tangential * (1.0 if down else -1.0), 0.0) * b / n
    return F, z


def test_forces_of_the_written_program(cut):
    """Steps in even stock of every plan within half a percent of a sum over the edges of the teeth."""
    loaded, milling, result = cut
    inputs = read_wall(loaded.job)
    own = inputs.operations[0].cut
    checked = 0
    for name in ("constant", "unconstrained"):
        c = result.variants[name].columns
        depth = c["depth_mm"]
        within = (c["u"] > 0.3) & (c["u"] < 0.7) & (c["force_normal_n"] > 0.0)
        for d in np.unique(depth[within].round(9)):
            F, _ = pushes(own.cutter, own.material, own.posture.feed_per_tooth, 1.25, d, milling == "down")
            found = c["force_normal_n"][within & np.isclose(depth, d)]
            assert_allclose(found, np.abs(F.sum(axis=1)).max(), rtol=0.005)
            checked += len(found)
    assert checked > 20


def test_volume(cut):
    """What is cut is the stock above the foot; the flank leaves no cusps, and no gouge."""
    _, _, result = cut
    for variant in result.variants.values():
        assert_allclose(variant.columns["chip_volume_mm3"].sum(), 2 * 0.3 * 10.0 * 5.0, rtol=1e-3)
        assert max(variant.shape.gouge, -variant.shape.nearest) < 1e-6
        assert variant.shape.left < 1e-6


def test_deflection_as_the_teeth_distribute_it(cut):
    """The upper end of a contact line moves by the sum of C(end, z) dF(z), with the force where the teeth have it: at
    most what the plan is judged by, and not far below it."""
    loaded, milling, _ = cut
    inputs = read_wall(loaded.job)
    own = inputs.operations[0].cut
    wall = inputs.body.wall
    none = [np.zeros(wall.shape) for _ in range(2)]
    judged = wall.compliance(none, "k+", inputs.line).reshape(wall.shape)
    solid = wall.state(none)
    factored, j = factorise(solid), solid.grid.counts[1]
    for depth in (0.06, 0.1, 0.3):
        F, z = pushes(own.cutter, own.material, own.posture.feed_per_tooth, 1.25, depth, milling == "down")
        for i, k in ((0, 1), (0, 2), (3, 2)):
            # places are the rows of elements above the foot, 5 mm high
            share = k / (wall.shape[1] - 1)
            at = np.concatenate([share * 5.0 + z, [min(share * 5.0 + 1.25, 5.0)]])
            places = on_cut(
                on_side(solid.grid, SIDES[1], np.full(len(at), i / 6), (wall.foot + at / 5.0 * (j - wall.foot)) / j),
                solid.kept,
                SIDES[1],
            )
            n, w = normals_of(solid.grid, places, SIDES[1]), weights(solid.grid, places)
            moved = (w @ displacement(factored, w[[-1]].T @ n[-1:])[:] * n).sum(axis=1)[:-1]
            most = float(np.abs(F @ moved).max())
            bound = judged[i, k] * float(np.abs(F.sum(axis=1)).max())
            assert 0.85 * bound < most <= bound


def test_variable_depths_hold_and_save_time(cut):
    """Up milling pushes the wall less: there the greatest depth holds, in the same passes."""
    _, milling, result = cut
    variable, constant = (result.variants[name] for name in ("variable", "constant"))
    assert variable.over_with_error(True) <= 1.0
    assert variable.deflection <= 0.015
    # the time of the text, with its rounded places, against that of a plan
    assert (variable.seconds < constant.seconds * (1.0 - 1e-6)) is (milling == "down")
    assert (result.variants["unconstrained"].over_with_error(True) > 1.0) is (milling == "down")


def test_result_holds(folder, tmp_path):
    # at 15 um the first rows bend the cutter by more than the rigid model covers
    done = run_job(job(folder, "limits.deflection_workpiece_um=18", number=1))
    result = done.result
    assert result.verdict == "holds"
    write_result(result, done.presentation, tmp_path / "result")


@pytest.mark.core
@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("cutter.0.overhang_mm=5.0", "cutter.0.flute_length_mm=5.0"), r"overhang_mm = 5: must be above 5"),
        (("cutter.0.flute_length_mm=4.0",), r"flute_length_mm = 4: must be at least 5.*the shank would rub"),
        (("operation.0.lean_deg=45.0",), r"operation.0.lean_deg: not used with contact = flank"),
        (("operation.0.step_over_mm=1.0",), r"operation.0.step_over_mm: not used with contact = flank"),
        (("operation.0.contact=corner",), r"operation.0.axial_depth_mm: for contact = flank only"),
        (("operation.0.depth_max_mm=5.0",), r"at most 4, the radius of the cutter"),
    ],
)
def test_refused(folder, change, message):
    with pytest.raises(InputError, match=message):
        read_wall(job(folder, *change, number=2).job)


def test_no_calibration_cuts(folder):
    with pytest.raises(InputError, match=r"contact = flank: calibration cuts are proposed for contact = corner only"):
        propose(job(folder, number=3).job, 2, 0.1, 0.5, 3, 1)


def test_only_plates(folder):
    path = folder / "shell.toml"
    text = (copy_example("blade", folder / "blade") / "job.toml").read_text()
    at, end = text.index("lean_deg = 45.0"), text.index("depth_min_mm")
    path.write_text(text[:at] + 'contact = "flank"\naxial_depth_mm = 1.0\n' + text[end:])
    with pytest.raises(InputError, match=r"contact = flank: a flank touches a plane wall along a line"):
        load_job(path)
