"""The run of a feeds job: simulate the program, find feeds, simulate the new program from fresh stock."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from chipload.checking.default_checks import PROGRAM_COLUMNS, default_checks, with_checks
from chipload.checking.drilling import with_drilling
from chipload.checking.inputs import CheckInputs
from chipload.checking.limits import spindle_limits
from chipload.checking.preparation import resolution_of, time_rows
from chipload.checking.program_text import read_as
from chipload.checking.run import compliance_of_workpiece, simulate_program
from chipload.checking.stiffness import deflection_watch, stiffness_of, watched_columns, with_columns
from chipload.checking.workpiece_compliance import WorkpieceCompliance, with_compliance_error
from chipload.cutting.drilling import has_lips
from chipload.jobs.feeds.allowed import FeedRequest, allowed_feed_watch, with_new_feeds
from chipload.jobs.feeds.job import FeedsJob
from chipload.jobs.feeds.outcome import FeedResult, FeedsProgram
from chipload.jobs.simulation import run as simulation
from chipload.jobs.simulation.tables import LOADS
from chipload.program.program import RAPID
from chipload.program.read import ProgramReading, line_times
from chipload.progress import Progress, part_of, silent
from chipload.simulation.accuracy import AXIAL, axial_force
from chipload.simulation.checkpoint import Checkpoint
from chipload.simulation.chips import remove
from chipload.simulation.steps import steps_of
from chipload.simulation.strips import threads_of
from chipload.stock.layers import LayeredStock

#: resolution error that new feeds leave room for, over that at the programmed feeds: at the new ones other steps have
#: the worst loads, whose error is not yet known (example feeds: 1.07 % before, 1.51 % after)
SPARE = 2.0


def run(
    job: FeedsJob, progress: Progress = silent, checkpoint: Checkpoint | None = None, workers: int | None = None
) -> FeedsProgram:
    """Simulate the program of a job, give it new feeds, and simulate its new text from fresh stock.

    Parameters
    ----------
    checkpoint : the folder that keeps what is finished of the last simulation; None: all is kept in memory
    workers : threads that share a simulation; None: as :func:`chipload.simulation.strips.threads_of`

    Raises
    ------
    InputError
        A file cannot be read, the controller would refuse the program, its feeds cannot be changed in the text, or the
        stock and the cutters cannot be used.
    """
    machine, share = simulation.machine_of(job), 0.1
    reading = simulation.read_for(job, machine, part_of(progress, 0.0, share))
    inputs = simulation.inputs_of(job, machine)
    stock = inputs.stock.layered(reading.program, inputs.cutters)
    own = simulation.text_to_change(job, inputs, reading, stock, "feeds")
    compliance = compliance_of_workpiece(inputs, reading, stock, part_of(progress, share, 0.55))
    share = 0.55 if compliance is not None else share
    begin = 0.5 * (1.0 + share)
    feeds, reading = _new_feeds(
        job, inputs, own, reading, stock, compliance, part_of(progress, share, begin), threads_of(workers)
    )  # fmt: skip
    stock = inputs.stock.layered(reading.program, inputs.cutters)
    done = simulate_program(
        inputs, reading, stock, compliance=compliance, checkpoint=checkpoint, workers=workers,
        progress=part_of(progress, begin, 1.0),
    )  # fmt: skip
    done = replace(done, settings=simulation.operation_of(job))
    return FeedsProgram(**vars(simulation.program_of(job, machine, reading, done)), feeds=feeds)


def check(job: FeedsJob) -> tuple[list[str], bool]:
    """Return a line for each file of a job and for the simulations; nothing is simulated. Errors as :func:`run`."""
    machine = simulation.machine_of(job)
    reading, inputs = simulation.read_for(job, machine), simulation.inputs_of(job, machine)
    stock = inputs.stock.layered(reading.program, inputs.cutters)
    simulation.text_to_change(job, inputs, reading, stock, "feeds")
    return simulation.check_lines(job, simulation.program_of(job, machine, reading), 2)


def _new_feeds(
    job: FeedsJob,
    inputs: CheckInputs,
    own: tuple[str, str],
    reading: ProgramReading,
    stock: LayeredStock,
    compliance: WorkpieceCompliance | None,
    progress: Progress,
    threads: int,
) -> tuple[FeedResult, ProgramReading]:
    """The text with new feeds, from what the program cuts of a stock, which changes; and what it does then. ``own``:
    the text as it is, and its dialect.
    """
    op, cutters, material, machine = inputs.settings, inputs.cutters, inputs.material, inputs.machine
    seconds, fine = float(line_times(reading, machine)[1].sum()), resolution_of(op, cutters, reading.program)
    turning = np.unique(reading.program.spindle[reading.program.motion != RAPID])
    limits = {name: limit for name, limit in inputs.limits.stated.items() if name in LOADS}
    if "spindle" not in inputs.checks.off:
        limits |= spindle_limits(machine, turning)
    gives = stiffness_of(inputs.elasticity.stiffness, cutters, None if compliance is None else compliance.steps)
    bends = with_checks(inputs.checks, material, deflection_watch(gives, material))
    checks = default_checks(inputs.checks, cutters, material)
    program, times = time_rows(reading, cutters, machine, op.interpolation)
    # as it is: what its loads are, and how well they are known
    before = remove(
        program, stock, cutters, material, fine, times=times, watch=bends, workers=threads,
        progress=part_of(progress, 0.0, 0.5),
    )  # fmt: skip
    before = with_columns(before, (*watched_columns(gives), *PROGRAM_COLUMNS))
    if any(has_lips(c) for c in cutters.values()):
        before = with_drilling(before, cutters, material)
    if AXIAL in limits:
        before = replace(before, columns={**before.columns, AXIAL: axial_force(before.columns)})
    more = bends if limits.keys() & {"deflection_um", "deflection_workpiece_um"} else None
    errors = {name: SPARE * error for name, error in before.resolution_error.items()}
    errors = with_compliance_error(errors, before.columns, compliance)  # the compliance does not change with the feed
    before = replace(
        before, resolution_error=with_compliance_error(before.resolution_error, before.columns, compliance)
    )
    request = FeedRequest(job.operation.feeds, limits, fine.rotation, checks, errors, more)
    steps = steps_of(program, op.step_mm, op.tolerance_mm)
    # again, for the greatest feed of each step
    fresh = inputs.stock.layered(reading.program, cutters)
    allowed = remove(
        program, fresh, cutters, material, fine,
        times=times, accuracy=False, workers=threads,
        watch=allowed_feed_watch(steps, request, cutters, material, machine, before.columns),
        progress=part_of(progress, 0.5, 1.0),
    )  # fmt: skip
    return with_new_feeds(
        *own, reading, steps, before, allowed.columns, request, cutters, machine,
        lambda new: simulation.read_for(job, machine, text=read_as(new)), seconds,
    )  # fmt: skip
