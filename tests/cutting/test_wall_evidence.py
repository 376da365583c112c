"""Coefficients from the form error of walls: closed form of a linear Gaussian, draws from the prior, the command."""

from __future__ import annotations

import math
import re
import tomllib
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import kstest, norm

from chipload.cutting.material import material_named, read_material
from chipload.cutting.wall_evidence import NAMES, learn_from_walls
from chipload.errors import InputError
from chipload.jobs.wall_measurement import learn_from_wall_file
from command import call

PRIOR = material_named("al7075-t6")
TEXT = """
material = "al7075-t6"
compliance_error = {error}
[cutter]
diameter_mm = 10.0
flutes = 4
helix_deg = 30.0
flute_length_mm = 22.0
overhang_mm = 40.0
modulus_gpa = 580.0
runout_mm = {runout}
"""
WALL = """
[[wall]]
milling = "{milling}"
axial_depth_mm = {depth}
radial_depth_mm = {width}
feed_per_tooth_mm = {feed}
noise_um = 1.0
place_um = {place}
height_mm = {heights}
error_um = {errors}
"""
CUTS = (("up", 12.0, 1.0, 0.05), ("down", 12.0, 2.0, 0.10), ("down", 6.0, 0.5, 0.15))
HEIGHTS = [1.0, 3.0, 5.0, 8.0, 11.0]


def walls_text(errors, compliance_error=0.1, place=3.0, runout=0.0) -> str:
    out = [TEXT.format(error=compliance_error, runout=runout)]
    for k, (milling, depth, width, feed) in enumerate(CUTS):
        own = [z for z in HEIGHTS if z <= depth]
        out.append(WALL.format(milling=milling, depth=depth, width=width, feed=feed, place=place, heights=own,
                               errors=[float(v) for v in errors[k][: len(own)]]))  # fmt: skip
    return "".join(out)


@pytest.fixture(scope="module")
def predicted(tmp_path_factory):
    """The walls, by what the file reader makes of them: their predictions, and those of the prior."""
    from chipload.jobs import wall_measurement

    path = tmp_path_factory.mktemp("walls") / "walls.toml"
    path.write_text(walls_text([[0.0] * 5] * 3, place=50.0))
    kept = []

    def keep(walls, *_):
        kept.extend(walls)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(wall_measurement, "learn_from_walls", keep)
        learn_from_wall_file(path)
    return kept, [wall.predict(PRIOR) for wall in kept]


def unit_errors(walls):
    """(n, 6) form error of each coefficient alone [um]: the force is linear in them."""
    columns = []
    for key, value in zip(NAMES, PRIOR.coefficients, strict=True):
        double = replace(PRIOR, **{key: 2.0 * value})
        columns.append(np.concatenate([wall.predict(double) - wall.predict(PRIOR) for wall in walls]))
    return np.array(columns).T


def test_the_closed_form_of_a_linear_gaussian(predicted) -> None:
    """With a known compliance the posterior is that of (S^-1 + H' R^-1 H)^-1, places integrated out into R."""
    walls = [replace(wall, place_um=3.0, noise_um=1.0) for wall in predicted[0]]
    rng = np.random.default_rng(0)
    seen = [replace(w, error_um=1.2 * e + rng.normal(0, 1, len(e))) for w, e in zip(walls, predicted[1], strict=True)]
    found = learn_from_walls(seen, PRIOR, 0.0)
    slope, values = unit_errors(walls), np.array(PRIOR.coefficients)
    blocks = [len(e) for e in predicted[1]]
    noise = np.eye(sum(blocks))
    for first, n in zip(np.cumsum([0, *blocks]), blocks, strict=False):
        noise[first : first + n, first : first + n] += 9.0
    precision = np.linalg.inv(PRIOR.variances / np.outer(values, values)) + slope.T @ np.linalg.solve(noise, slope)
    data = np.concatenate([w.error_um for w in seen]) - slope @ np.ones(6)
    wanted = 1.0 + np.linalg.solve(precision, slope.T @ np.linalg.solve(noise, data))
    np.testing.assert_allclose(np.array(found.material.coefficients) / values, wanted, rtol=1e-6)
    np.testing.assert_allclose(
        found.material.variances / np.outer(values, values), np.linalg.inv(precision), rtol=1e-5, atol=1e-10
    )


def test_draws_from_the_prior(predicted) -> None:
    """150 cells, coefficients, compliance, places and noise drawn: 95 % intervals hold 90 % or more."""
    walls, _ = predicted
    slope, values = unit_errors(walls), np.array(PRIOR.coefficients)
    share, rng, ranks = PRIOR.variances / np.outer(values, values), np.random.default_rng(7), []
    blocks = np.cumsum([len(w.height_mm) for w in walls])[:-1]
    for _ in range(150):
        x, u = rng.multivariate_normal(np.ones(6), share), 0.1 * rng.standard_normal()
        error = [
            part + rng.normal(0.0, 3.0) + rng.normal(0.0, 1.0, len(part))
            for part in np.split((1.0 + u) * slope @ x, blocks)
        ]
        # linear in the coefficients: the prediction is the sum of the parts, which saves the force model
        cells = [
            replace(w, error_um=e, noise_um=1.0, place_um=3.0, predict=of_parts(part, values))
            for w, e, part in zip(walls, error, np.split(slope, blocks), strict=True)
        ]
        found = learn_from_walls(cells, PRIOR, 0.1)
        sd = np.sqrt(np.diagonal(found.material.variances)) / values
        own = (np.array(found.material.coefficients) / values - x) / sd
        # the force along the normal of the wall at the first height, as the walls tell it best
        best = slope[0] / np.linalg.norm(slope[0])
        spread = math.sqrt(best @ (found.material.variances / np.outer(values, values)) @ best)
        ranks.append(norm.cdf([*own, best @ (np.array(found.material.coefficients) / values - x) / spread,
                               (found.compliance[0] - 1.0 - u) / found.compliance[1]]))  # fmt: skip
    u = np.array(ranks)
    inside = ((u > 0.025) & (u < 0.975)).mean(axis=0)
    assert (inside > 0.90).all(), inside
    assert all(kstest(column, "uniform").pvalue > 1e-3 for column in u.T)
    # what is learned: the spread of the normal force shrinks to that of the compliance
    before = math.sqrt(best @ share @ best)
    assert spread < 0.75 * before


def of_parts(part, values):
    """A prediction that is linear in the coefficients."""
    return lambda material: part @ (np.array(material.coefficients) / values)


def test_the_command(tmp_path, predicted) -> None:
    """A wall of a material that is 20 % harder, with runout; then the file again, a wrong unit, another wall."""
    path, out = tmp_path / "walls.toml", tmp_path / "after.toml"
    path.write_text(walls_text([1.2 * e for e in predicted[1]], 0.02, 0.5))
    code, text, err = call("learn-wall", path, "--out", out)
    assert (code, err) == (0, ""), text
    found = read_material(out)
    normal = unit_errors(predicted[0])[0]
    ratio = np.array(found.coefficients) / np.array(PRIOR.coefficients)
    assert normal @ ratio / normal.sum() == pytest.approx(1.2, abs=0.06)
    assert "compliance of cutter and holder: " in text
    assert tomllib.loads(out.read_text())["learned"]["log"][0]["name"] == "walls.toml"
    (tmp_path / "again.toml").write_text(path.read_text().replace('"al7075-t6"', '"after.toml"'))
    assert call("learn-wall", tmp_path / "again.toml", "--out", out)[0] == 0
    for change, message in (
        (1000.0, "times what is predicted"), (0.001, "check its unit (a factor of 0.001)"), (math.nan, "error_um"),
    ):  # fmt: skip
        # the place of a wall may be all of a value in mm
        path.write_text(walls_text([change * e for e in predicted[1]], 0.02, 5.0 if change == 0.001 else 0.5))
        code, _, err = call("learn-wall", path, "--out", out)
        assert code == 2
        assert message in err
    whole = walls_text(predicted[1], 0.02, 0.5)
    for pattern, list_of, message in (
        (r"height_mm = \[[^]]*\]", "height_mm = []", "height_mm: has no entry: state at least one\n"),
        (r"height_mm = \[[^]]*\]", "height_mm = [1.0]", "height_mm has 1 values, error_um "),
        (r"height_mm = \[[^,]*,", "height_mm = [110.0,", "height_mm = 110: must be from 0 to axial_depth_mm = "),
    ):
        path.write_text(re.sub(pattern, list_of, whole, count=1))
        code, _, err = call("learn-wall", path, "--out", out)
        assert (code, message in err) == (2, True), err
    # values that no wall has, and walls that no material explains
    waves = [e + 6.0 * np.cos(np.pi * np.arange(len(e))) for e in predicted[1]]
    strange = [share * e for share, e in zip((2.0, 0.4, 1.0), predicted[1], strict=True)]
    for errors, expected, message in ((waves, 3, "(wall-misfit)"), (strange, 2, "no material explains")):
        path.write_text(walls_text(errors, 0.02, 0.5))
        code, text, err = call("learn-wall", path, "--out", out)
        assert (code, message in text + err) == (expected, True), text + err
    with pytest.raises(InputError, match="wall: none is stated"):
        learn_from_walls([], PRIOR, 0.1)
