"""engagement.npz of the examples against the columns of their histories, which were found at other rotations."""

from __future__ import annotations

import numpy as np
import pytest

from chipload.report.engagement import ENGAGEMENT, read_engagement


@pytest.mark.parametrize(("name", "force"), [("contour", "force_xy_n"), ("chips", "force_n")])
def test_samples_have_the_force_and_the_chip_of_their_rows(example, name, force):
    done = example(name)
    tracks = list(done.result.tracks)
    for k, track in enumerate(tracks):
        found = read_engagement(done.folder / ENGAGEMENT, k)
        assert found is not None
        columns = {c: np.asarray(track.columns[c])[found.row] for c in (force, "chip_max_mm", "torque_mean_nm")}
        sizes = found.turn[..., :2] if force == "force_xy_n" else found.turn[..., :3]
        most = np.linalg.norm(sizes, axis=2).max(axis=1)
        # a share of a tooth period apart, the history's at 1 degree or exact: within what lies between two rotations
        assert most == pytest.approx(columns[force], rel=0.01)
        # the mean over the revolution is a sum here and a closed form there: where an edge is in cut for a few of the
        # rotations only, one of them counts; over all steps that evens out
        mean, most = found.turn[..., 3].mean(axis=1), columns["torque_mean_nm"].max()
        assert mean == pytest.approx(columns["torque_mean_nm"], rel=0.02, abs=2e-3 + 0.06 * most)
        # the teeth that are shown are those of the instant of the greatest force, the mean is that of all instants
        assert mean.sum() == pytest.approx(columns["torque_mean_nm"].sum(), rel=0.012)
        # h at even angles of each range
        share = np.linspace(0.0, 1.0, 41)[:, None]
        low, high, along, offset, across = found.ranges[:, :5].T
        phi = low + share * (high - low)
        thick = (along * np.sin(phi) + across * np.cos(phi) + offset).max(axis=0)
        # a step that begins or ends a cut has the greatest of several instants, of which one is shown
        shown = np.maximum.reduceat(thick, found.start[:-1])
        assert (shown <= columns["chip_max_mm"] * (1.0 + 2e-3)).all()
        assert shown == pytest.approx(columns["chip_max_mm"], rel=2e-3 if name == "contour" else 0.03)
        assert np.median(shown / columns["chip_max_mm"]) == pytest.approx(1.0, rel=2e-3)
    if name == "contour":
        assert [read_engagement(done.folder / ENGAGEMENT, k).stride for k in range(len(tracks))]
