"""What to measure next: another form of the Gaussian update, all cuts tried, and coefficients learned from them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chipload.control.learning import TORQUE_ERROR, Signal, SignalKind, learn_material, tangential_shares
from chipload.control.log_alignment import PredictedTorque
from chipload.control.log_blocks import LogBlocks
from chipload.control.measurement_plan import (
    AIR_BLOCKS,
    IDLE,
    NOISE,
    CalibrationTool,
    CandidateCut,
    best_cut,
    calibration_cuts,
    covariance_after,
    cuts_of_program,
    relative_covariance,
)
from synthetic_cell import PRIOR, closed_form_program

#: a load whose cutting part is 70 %
LOAD = (0.7, 0.0, 0.0, 0.3, 0.0, 0.0)
GAIN_ERROR = 0.05


@pytest.fixture(scope="module")
def program() -> PredictedTorque:
    return closed_form_program(np.random.default_rng(3))


def in_information_form(cut: CandidateCut, greatest: float) -> np.ndarray:
    """The covariance after a log, of all unknowns at once: (Q^-1 + H' H / s^2)^-1, its block of Ktc and Kte."""
    air = np.zeros(AIR_BLOCKS)
    c, e = (np.concatenate([air, cut.weight * part]) / greatest for part in (cut.cutting, cut.edge))
    design = np.column_stack([c, e, c + e, c + e, np.ones(len(c))])
    prior = np.zeros((5, 5))
    prior[:2, :2] = np.linalg.inv(relative_covariance(PRIOR)[np.ix_([0, 3], [0, 3])])
    prior[2:, 2:] = np.diag([GAIN_ERROR**-2, TORQUE_ERROR**-2, IDLE**-2])
    return np.linalg.inv(prior + design.T @ design / NOISE**2)[:2, :2]


def test_the_best_cut_is_that_of_all_cuts_tried(program: PredictedTorque) -> None:
    whole, cuts = cuts_of_program(program, power=True)
    greatest = float((whole.weight * (whole.cutting + whole.edge)).max())
    e = np.array(LOAD)[[0, 3]]
    each = [float(e @ in_information_form(cut, greatest) @ e) for cut in cuts]
    cut, left = best_cut(cuts, LOAD, relative_covariance(PRIOR), greatest, GAIN_ERROR) or pytest.fail("no cut")
    assert cut is cuts[int(np.argmin(each))]
    assert left == pytest.approx(min(each), rel=1e-6)
    assert max(each) > 1.05 * left
    assert all(c.seconds <= 20.0 for c in cuts)
    # a longer log tells no less
    assert np.array(LOAD) @ covariance_after(relative_covariance(PRIOR), whole, greatest, GAIN_ERROR) @ LOAD <= left


def test_what_is_learned_from_a_cut_is_what_was_stated(program: PredictedTorque) -> None:
    """Torque logs of the best range and of the worst, learned by the method of logs: their bands within a fourth."""
    whole, cuts = cuts_of_program(program, power=False)
    greatest = float((whole.cutting + whole.edge).max())
    before = relative_covariance(PRIOR)
    stated = [math.sqrt(np.array(LOAD) @ covariance_after(before, cut, greatest, 0.0) @ LOAD) for cut in cuts]
    e = np.array(LOAD)[[0, 3]]
    for k in (int(np.argmin(stated)), int(np.argmax(stated))):
        cut, rng = cuts[k], np.random.default_rng(k)
        parts = [np.concatenate([np.zeros(AIR_BLOCKS), part]) for part in (cut.cutting, cut.edge)]
        n, found = len(parts[0]), []
        for _ in range(10):
            signal = 50.0 + sum(parts) + NOISE * greatest * rng.standard_normal(n)
            blocks = LogBlocks(
                "log", np.arange(n, dtype=float), signal, np.full(n, 800.0), *parts, np.zeros(n), np.zeros(n),
                np.ones(n, dtype=np.int64), np.ones(n, dtype=np.int64),
            )  # fmt: skip
            after = learn_material([blocks], Signal(SignalKind.TORQUE, 1.0, 0.0), PRIOR).material
            share = np.array([after.Ktc / PRIOR.Ktc, after.Kte / PRIOR.Kte])
            found.append(math.sqrt(e @ (tangential_shares(after) * np.outer(share, share)) @ e))
        assert np.mean(found) == pytest.approx(stated[k], rel=0.25)


def test_test_cuts_keep_within_what_the_program_does() -> None:
    """A slot of two teeth: mean torque N / (2 pi) (Ktc ap D fz + Kte ap pi D / 2); none above what the tool may."""
    tool = CalibrationTool(1, 10.0, 2, 6.0, 800.0, (0.02, 0.08), 1e9)
    cuts = calibration_cuts(tool, PRIOR, power=True)
    # depths of 2.5 and 5 mm; 10 mm are above the flutes
    assert len(cuts) == 8
    slot = cuts[-1]
    expected = 2.0 / math.tau * PRIOR.Ktc * 5.0 * 10.0 * np.array([0.02, 0.08])
    assert slot.cutting[[0, -1]] == pytest.approx(expected, rel=1e-3)
    assert slot.edge[0] == pytest.approx(2.0 / math.tau * PRIOR.Kte * 5.0 * math.pi * 5.0, rel=1e-3)
    torque = float((slot.cutting + slot.edge).max())
    less = calibration_cuts(CalibrationTool(1, 10.0, 2, 6.0, 800.0, (0.02, 0.08), 0.99 * torque), PRIOR, power=True)
    assert [c.name for c in less] == [c.name for c in cuts[:-1]]
