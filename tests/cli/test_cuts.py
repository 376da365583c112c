"""Calibration cuts proposed for a wall, filled in and read back, by the command line."""

import csv
from pathlib import Path

import numpy as np
import pytest

from chipload import examples
from chipload.jobs import load_job
from chipload.jobs.thinwall.inputs import read_wall
from chipload.planning.thinwall.table import read_cuts
from command import call


@pytest.fixture
def job(tmp_path: Path) -> Path:
    return examples.copy_example("plate", tmp_path / "plate") / "job.toml"


def test_proposed_filled_in_and_read_back(job: Path) -> None:
    """Deflections as of springs of the finite elements' compliance: what is read back is the limit over it."""
    table = job.parent / "cuts.csv"
    code, said, err = call("cuts", job, "--out", table, "--sites", 5, "--steps", 1, "--repeats", 1)
    assert (code, err) == (0, "")
    assert "at 5 places" in said
    with table.open() as file:
        rows = list(csv.DictReader(file))
    assert all(r["deflection_um"] == r["normal_force_n"] == r["too_much"] == "" for r in rows)
    # corners are always among the places
    inputs = read_wall(load_job(job).job)
    corners = {(u, v) for u in (0.0, 1.0) for v in (inputs.body.foot, 1.0)}
    at = np.array([(float(r["u"]), float(r["v"])) for r in rows])
    assert all(np.abs(at - c).sum(axis=1).min() < 1e-6 for c in corners)
    thresholds = inputs.finished_threshold()
    u, v = np.meshgrid(*inputs.body.places, indexing="ij")
    places = np.column_stack([u.ravel(), v.ravel()])

    def bears(r):
        near = np.abs(places - (float(r["u"]), float(r["v"]))).sum(axis=1)
        assert near.min() < 1e-6
        return float(thresholds.force.ravel()[near.argmin()]) / inputs.depths.factor

    for r in rows:
        force = 1.1 * float(r["expected_normal_force_n"])
        r |= {"normal_force_n": f"{force:.9g}", "deflection_um": f"{54.0 * force / bears(r):.9g}"}
    with table.open("w", newline="") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)
    made, findings = read_cuts(table, 0.054)
    assert findings == ()
    np.testing.assert_allclose(made.force, [bears(r) for r in rows], rtol=1e-6)
    job.write_text(job.read_text() + '\n[threshold]\nfile = "cuts.csv"\ndeviations = 2.0\n')
    # one cut a place and two deviations leave so little that the smallest depth is too much at most places
    code, said, _ = call("check", job)
    assert code == 3
    assert "threshold of the finished side k-, calibrated" in said
    assert "the limit cannot be kept at 56 of 130 places" in said


def test_only_a_wall_is_calibrated(tmp_path: Path) -> None:
    path = examples.copy_example("contour", tmp_path / "c") / "job.toml"
    code, _, err = call("cuts", path, "--out", tmp_path / "cuts.csv")
    assert (code, err) == (2, "chipload: job.toml: has no [wall]: calibration cuts need a thin-wall job\n")
    assert not (tmp_path / "cuts.csv").exists()
