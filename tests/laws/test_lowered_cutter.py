"""A cutter that is lifted and lowered where a pass ended: its rim lies on the edge of its own cut, until it moves."""

import numpy as np
import pytest

from chipload.planning.pocket.clearing_path import CUT, LIFT, ClearingPath
from chipload.planning.pocket.motions import motions_of, programs_of, replay_motions, samples_of
from chipload.planning.pocket.request import Clearing
from chipload.program.program import Program
from chipload.simulation.verify import verify_contour

ASKED = Clearing("down", 0.15, 1.0, 20.0, 838.0, 0.0, 5.0, 0.2, link_feed=20.0, link_lift=0.0)
#: of the rows of a slot of 20 mm in steps of 1 mm, the one where the cutter is lowered again
LOWERED = 21


# straight on, half of the rim is engaged as soon as the cutter moves; across, a quarter
@pytest.mark.parametrize(("end", "engaged_deg"), [((24.0, 0.0), 180.0), ((20.0, 4.0), 90.0)])
def test_any_engagement_up_to_that_ahead_agrees_where_the_cutter_is_lowered(end, engaged_deg):
    path = ClearingPath(
        np.array([0.0, 20.0, 20.0, end[0]]), np.array([0.0, 0.0, 0.0, end[1]]), np.zeros((4, 2)), np.zeros(4),
        np.array([LIFT, CUT, LIFT, CUT]), np.zeros(4), np.zeros(4, dtype=np.int64), (), 1.0, 1.0, 0.0, (), {},
    )  # fmt: skip
    motions = motions_of(path, ASKED.heights, ASKED.feed, ASKED.link_feed)
    samples = samples_of(motions, 1.0)
    met, _ = replay_motions(motions, samples, 5.0)
    assert motions.kind[samples.motion[LOWERED]] == LIFT
    engagement = np.degrees(met.angle)
    assert engagement[LOWERED] == 0.0
    program = Program.join(programs_of(motions, ASKED.feed, ASKED.spindle_speed, 1))
    for planned, verdict in ((0.0, "proved"), (engaged_deg, "proved"), (engaged_deg + 1.0, "failed")):
        engagement[LOWERED] = planned
        history = {
            "x_mm": samples.centre[:, 0],
            "y_mm": samples.centre[:, 1],
            "z_mm": motions.height[samples.motion],
            "engagement_deg": engagement,
            # the first way down goes into the solid
            "pass": np.array(["entry", *["pocket"] * (len(engagement) - 1)]),
        }
        told = verify_contour(
            program, 5.0, history, stock=None, stock_top_mm=0.0, wall=(), material="left", passes=("pocket",),
            engagement_tolerance_deg=0.05, gouge_tolerance_mm=0.01, excess_tolerance_mm=0.01,
        )  # fmt: skip
        assert told.verdict == verdict, told.text
