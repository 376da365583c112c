"""Calibration cuts: against all subsets; a threshold that is known is recovered from the table."""

from __future__ import annotations

import csv
import io
import itertools
import math
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import LinearNDInterpolator

from chipload.errors import InputError
from chipload.planning.thinwall.depth import DepthRange
from chipload.planning.thinwall.experiments import Proposal, expected_misses, propose_cuts, propose_sites
from chipload.planning.thinwall.force_table import ForceTable
from chipload.planning.thinwall.table import FILLED, GIVEN, cuts_bytes, read_cuts, write_cuts
from chipload.planning.thinwall.threshold import calibrated, scatter

#: F = 100 d, from 0.05 to 2 mm
LAW = ForceTable(DepthRange(0.05, 2.0), np.array([0.05, 2.0]), np.array([5.0, 200.0]))


def grid(n: int, m: int) -> np.ndarray:
    u, v = np.meshgrid(np.linspace(0.0, 1.0, n), np.linspace(0.0, 1.0, m), indexing="ij")
    return np.column_stack([u.ravel(), v.ravel()])


def plate(x: np.ndarray) -> np.ndarray:
    """Like a clamped plate: stiff at its foot, its corners half as strong as the middle of its edge."""
    return 40.0 / (0.1 + x[:, 1]) ** 2 * (1.0 - 0.5 * (2.0 * x[:, 0] - 1.0) ** 2 * x[:, 1])


def brute_cost(S: tuple[int, ...], x: np.ndarray, y: np.ndarray, s: float) -> float:
    """The criterion by SciPy's interpolation: of y, and of one unit value after another for the weights."""
    rows = sorted(S, key=lambda i: tuple(x[i]))
    if np.linalg.matrix_rank(x[rows] - x[rows[0]]) < 2:
        return math.inf
    guess = LinearNDInterpolator(x[rows], np.column_stack([y[rows], np.eye(len(rows))]))(x)
    out = np.isnan(guess[:, 0])
    guess[out, 0] = y[rows].min()
    noise = np.where(out, 1.0, (guess[:, 1:] ** 2).sum(axis=1))
    return float(np.mean((guess[:, 0] - y) ** 2 + s**2 * noise))


@pytest.mark.parametrize(
    ("shape", "count", "s"),
    [((4, 3), 4, 0.1), ((4, 3), 3, 0.1), ((4, 3), 6, 0.0), ((4, 3), 6, 0.3), ((5, 3), 6, 0.1), ((9, 6), 5, 0.1)],
)
def test_no_subset_is_much_better(shape: tuple[int, int], count: int, s: float) -> None:
    """All subsets, of those that have the corners where there are enough."""
    x = grid(*shape)
    F = plate(x)
    found = tuple(propose_sites(x, F, count, s).tolist())
    corners = {i for i, p in enumerate(x.tolist()) if set(p) <= {0.0, 1.0}} if count > 3 else set()
    rest = [i for i in range(len(x)) if i not in corners]
    ours = brute_cost(found, x, np.log(F), s)
    subsets = itertools.combinations(rest, count - len(corners))
    best = min(brute_cost((*corners, *more), x, np.log(F), s) for more in subsets)
    assert len(set(found)) == count
    assert corners <= set(found)
    assert ours <= 1.05 * best


def test_what_is_missed_equals_what_another_interpolation_says() -> None:
    x = np.random.default_rng(4).random((60, 2))
    y = np.log(plate(x))
    bias, weight = expected_misses(np.arange(8), x, y)
    assert np.mean(bias**2 + 0.2**2 * weight) == pytest.approx(brute_cost(tuple(range(8)), x, y, 0.2), rel=1e-10)


def test_more_sites_miss_less() -> None:
    x = grid(7, 5)
    few, more = (expected_misses(propose_sites(x, plate(x), m, 0.02), x, np.log(plate(x)))[0] for m in (4, 7))
    assert abs(more).mean() < 0.5 * abs(few).mean()


def proposed(count: int = 6, **change) -> Proposal:
    x = grid(5, 4)
    points = np.column_stack([60.0 * x[:, 0], np.zeros(len(x)), 40.0 * x[:, 1]])
    F = np.clip(plate(x), 8.0, 120.0)
    given = {"bracket": 1.4, "steps": 2, "repeats": 1} | change
    return propose_cuts(x, points, F, LAW, count, 0.1, **given)


def test_the_depths_bracket_the_modelled_threshold() -> None:
    found = proposed()
    for i in range(len(found.sites)):
        own = found.site == i
        once = own & (found.repeat == 0)
        assert found.force[once] == pytest.approx(100.0 * found.depth[once], rel=1e-9)
        expected = found.threshold[i] * 1.4 ** np.arange(-2.0, 3.0)
        expected = np.unique(np.clip(expected[expected >= 5.0], None, 200.0))
        assert found.force[once] == pytest.approx(expected, rel=1e-5)
        assert (np.diff(found.force[once]) > 0.0).all()
    assert sorted(np.unique(found.site[found.repeat == 1])) == [int(found.site[found.repeat == 1][0])]
    bias, weight = expected_misses(found.sites, grid(5, 4), np.log(np.clip(plate(grid(5, 4)), 8.0, 120.0)))
    assert found.bias == pytest.approx(math.sqrt((bias**2).mean()))
    assert found.noise == pytest.approx(0.1 * math.sqrt(weight.mean()))
    assert found.findings == ()


def fill(data: bytes, answer, mark: str = ",") -> str:
    """The table with its last columns filled in by ``answer(u, v, force, repeat)``."""
    rows = list(csv.DictReader(io.StringIO(data.decode())))
    text = [mark.join([*GIVEN, *FILLED])]
    for row in rows:
        values = [row[name] for name in GIVEN]
        values += answer(float(row["u"]), float(row["v"]), float(row["expected_normal_force_n"]), int(row["repeat"]))
        text.append(mark.join(v.replace(".", ",") if mark == ";" else v for v in values))
    return "\n".join(text) + "\n"


def truth(u: float, v: float) -> float:
    """A threshold other than the modelled one; its logarithm is plane, so that interpolation adds nothing."""
    return math.exp(4.0 - 1.5 * v + 0.4 * u)


@pytest.mark.parametrize("mark", [",", ";"])
def test_a_threshold_is_recovered_from_deflections(tmp_path: Path, mark: str) -> None:
    """Measured 20 % more force than expected, and 5 % to either side in the deflection of the repeats."""
    off = {1: 1.05, 2: 1.0 / 1.05}

    def measured(u: float, v: float, force: float, repeat: int) -> list[str]:
        F = 1.2 * force
        return [f"{F:.6f}", f"{1000 * 0.05 * F / truth(u, v) * off[repeat]:.6f}", ""]

    path = tmp_path / "cuts.csv"
    path.write_text(fill(cuts_bytes(proposed(repeats=6)), measured, mark))
    experiments, findings = read_cuts(path, 0.05)
    assert findings == ()
    x = grid(7, 5)
    expected = np.array([truth(*p) for p in x])
    found = calibrated(experiments, x, 0.0)
    assert found.source == "calibrated"
    assert found.force[~found.outside] == pytest.approx(expected[~found.outside], rel=1e-5)
    s, _ = scatter(experiments)
    assert math.log(1.05) <= s <= 1.2 * math.log(1.05)
    assert calibrated(experiments, x, 2.0).factor == pytest.approx(math.exp(-2.0 * s))


def test_a_threshold_is_bracketed_by_answers(tmp_path: Path) -> None:
    """Known only which cut was too much: never above the truth, and at most one step of the bracket below it."""

    def said(u: float, v: float, force: float, repeat: int) -> list[str]:
        return ["", "", "yes" if force > 1.1 * min(max(plate(np.array([[u, v]]))[0], 8.0), 120.0) else "no"]

    proposal = proposed(bracket=1.25, steps=2)
    path = tmp_path / "cuts.csv"
    path.write_text(fill(cuts_bytes(proposal), said))
    experiments, findings = read_cuts(path, 0.05)
    assert {f.code for f in findings} == {"force-expected"}
    assert len(experiments.force) == 7
    at = [int(abs(proposal.place - p).max(axis=1).argmin()) for p in experiments.place]
    ratio = experiments.force / (1.1 * proposal.threshold[at])
    assert (ratio <= 1.0 + 1e-3).all()
    assert (ratio > 1.0 / 1.25 - 1e-3).all()


def test_the_table_as_it_is_written(tmp_path: Path) -> None:
    path = tmp_path / "cuts.csv"
    write_cuts(path, proposed(count=3, repeats=0))
    lines = path.read_text().splitlines()
    assert lines[0] == (
        "cut,site,repeat,u,v,x_mm,y_mm,z_mm,depth_mm,expected_normal_force_n,normal_force_n,deflection_um,too_much"
    )
    assert lines[1].endswith(",,,")
    with pytest.raises(
        InputError, match="0 places filled in: must be at least 3, not on a line: fill in deflection_um"
    ):
        read_cuts(path, 0.05)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda t: t.replace("too_much", "verdict"), "line 1: column too_much is missing: keep the columns"),
        (lambda t: t.replace("no\n", "maybe\n", 1), "line 2: too_much = 'maybe': must be yes or no"),
        (lambda t: t.replace(",,,no", ",,-3,no", 1), "line 2: deflection_um = -3: must be above 0"),
        (lambda t: t.replace(",,,no", ",x,,no", 1), "line 2: normal_force_n = 'x': must be a number"),
        (
            lambda t: t.replace(",no\n", ",yes\n"),
            "line 2: u = .*: the least force .* N was too much already: cut shallower",
        ),
        (lambda t: t.replace(",no\n", ",no,1\n", 1), "line 2: 14 values: must be 13, one a column"),
    ],
)
def test_what_is_wrong_with_a_table_is_said(tmp_path: Path, change, message: str) -> None:
    path = tmp_path / "cuts.csv"
    path.write_text(change(fill(cuts_bytes(proposed()), lambda *_: ["", "", "no"])))
    with pytest.raises(InputError, match=message):
        read_cuts(path, 0.05)


def test_series_that_end_early_or_contradict_themselves_are_named(tmp_path: Path) -> None:
    path = tmp_path / "cuts.csv"
    path.write_text(fill(cuts_bytes(proposed()), lambda *_: ["10", "", "no"]))
    assert {f.code for f in read_cuts(path, 0.05)[1]} == {"series-never-too-much"}
    seen: dict[tuple, int] = {}

    def odd(u: float, v: float, force: float, repeat: int) -> list[str]:
        k = seen[u, v, repeat] = seen.get((u, v, repeat), -1) + 1
        return [f"{force:.4f}", "", "no" if k % 2 == 0 else "yes"]

    path.write_text(fill(cuts_bytes(proposed()), odd))
    assert "series-overlaps" in {f.code for f in read_cuts(path, 0.05)[1]}


def test_what_can_not_be_proposed_is_refused() -> None:
    x = grid(5, 4)
    xyz, F = np.zeros((20, 3)), np.full(20, 30.0)
    for message, change in (
        ("experiments.count = 2: must be from 3 to 20", {"count": 2}),
        ("all candidates lie on a line: add a candidate off it", {"candidates": [0, 1, 2, 3]}),
        ("bracket = 1, steps = 2: must be above 1", {"bracket": 1.0}),
        ("experiments.repeats = 9: must be from 0 to count = 4", {"repeats": 9}),
        ("experiments.scatter = -1: must be at least 0", {"scatter": -1.0}),
    ):
        given = {"count": 4, "scatter": 0.1, "bracket": 1.4, "steps": 2} | change
        if "candidates" in change:
            given["count"] = 3
        with pytest.raises(InputError, match=message):
            propose_cuts(x, xyz, F, LAW, given.pop("count"), given.pop("scatter"), **given)
    with pytest.raises(InputError, match=r"the smallest depth 0.05 mm needs 5 N, the greatest force to try is 1.4 N"):
        propose_cuts(x, xyz, np.full(20, 1.0), LAW, 4, 0.1, bracket=1.4, steps=1)
    far = propose_cuts(x, xyz, np.full(20, 500.0), LAW, 4, 0.1, bracket=1.4, steps=1)
    assert len(far.findings) == 4
    assert "none above the modelled threshold of 500 N within the depths 0.05 to 2 mm" in far.findings[0].text
