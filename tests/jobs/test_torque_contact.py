"""Axial extent of the contact with a thin wall, which its deflection depends on, against the turns of the program."""

from __future__ import annotations

import math

import numpy as np

from chipload.examples import copy_example
from chipload.jobs import load_job
from chipload.jobs.torque.cut import cut, shell_stock
from chipload.jobs.torque.run import open_inputs
from chipload.progress import silent


def test_the_contact_of_a_helix_reaches_up_to_the_turn_before(tmp_path) -> None:
    """At each angle from the floor of the turn before, or the top of the stock, down to the tip, within a layer; in the
    level last turn that is less and less. Films that count as cut would make it as deep as the turns above.
    """
    folder = copy_example("tube", tmp_path / "tube")
    sets = ("simulation.step_mm=2.0", "simulation.tolerance_mm=0.01")
    job = load_job(folder / "job.toml", sets).job
    machine, material, _, written, _ = open_inputs(job)
    program = written.program
    found = cut(job, program, shell_stock(job, program), material, machine.rapid, silent)
    p = found.points
    angle = np.unwrap(np.arctan2(p[:, 1], p[:, 0]))
    sense = math.copysign(1.0, angle[-1] - angle[0])
    middle, height = 0.5 * (angle[1:] + angle[:-1]), 0.5 * (p[1:, 2] + p[:-1, 2])
    above = np.interp(sense * middle - math.tau, sense * angle, p[:, 2], left=0.0)
    deep = above.clip(max=0.0) - height
    # the way in and the way out are not on the circle
    on = np.abs(np.hypot(*p[1:, :2].T) - 26.0) < 1e-6
    assert on.sum() > 300
    layer = 0.125
    assert np.abs(found.far - found.near - deep)[on].max() < layer + 1e-9
    last = on & (np.abs(p[1:, 2] - p[:-1, 2]) < 1e-9)
    assert deep[last].max() > 2.5
    assert (found.far - found.near)[last].min() < 2.0 * layer
