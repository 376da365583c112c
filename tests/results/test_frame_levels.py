"""The levels that the example `frame` plans by an analytical law against the simulation of its program."""

from __future__ import annotations

import re

from page_values import Run


def test_planned_form_error_covers_the_simulated_one(example):
    """The plan takes the walls as stiff as they are after each level and the edge at its most compliant place: it
    is above the error of the simulation by moves, in the state of each line, by at most a half.
    """
    made = Run(example("frame_pockets").folder).summary["operations"][1]
    planned = re.search(r"with (.*) um of 50 planned", made["findings"][0])
    assert planned is not None
    worst = max(float(x) for x in re.findall(r"[\d.]+", planned[1]))
    simulated = Run(example("frame").folder).worst("form_error_um")
    assert simulated <= worst <= 1.5 * simulated
