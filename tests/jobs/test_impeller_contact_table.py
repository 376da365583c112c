"""The largest cutter of contact points at single table angles; the oracle is the source's gouge test over B."""

import math
from pathlib import Path

import numpy as np
import pytest

from chipload import examples
from chipload.jobs import load_job
from chipload.jobs.impeller import run
from chipload.jobs.impeller.contact_tables import ANGLES, contact_table
from chipload.jobs.impeller.surface_search import SearchInputs, searched_surfaces
from chipload.planning.impeller.compare import clear_somewhere, gouges
from chipload.planning.impeller.kept import anew


@pytest.fixture(scope="module")
def searched():
    job = load_job(Path(examples.__file__).parent / "impeller" / "job.toml").job
    machine, catalogue, part = run._machine(job), run._catalogue(job), run.read_part(job)
    table = run._tables(machine, job.operation)
    surface = run._surfaces(job, part.impeller, None)[0]
    inputs = SearchInputs([surface], table, catalogue, job.operation.clearance_mm)
    (found,) = searched_surfaces(inputs, anew, spread=False)
    return run._search_surface(job, 0, inputs, found, 0.0)


def test_the_cutter_is_clear_and_the_next_is_not(searched):
    head, rows = contact_table(searched)
    surface, degrees = searched.surface, np.radians(np.arange(0.0, 360.0, 1.0))
    assert [float(name.split(" deg")[0]) for name in head[2:]] == list(ANGLES)
    assert len(rows) == 12
    cutters = searched.answer.catalogue.cutters
    for row in rows[::3]:
        i, j = np.abs(surface.u - float(row[0])).argmin(), np.abs(surface.v - float(row[1])).argmin()
        point = int(i) * surface.shape[1] + int(j)
        for angle, cell in zip(ANGLES, row[2:], strict=True):
            size, span = cell.split(";")
            diameter, corner = (float(x) for x in size.split(","))
            low, high = (float(x) for x in span.split(" to "))
            own = next(c for c in cutters if (c.diameter, c.corner_radius) == (diameter, corner))
            middle = math.radians(0.5 * (low + high))
            assert gouges(surface.scene, point, own, math.radians(angle), middle, searched.clearance) is None
            larger = [c for c in cutters if c.diameter == diameter + 2.0]
            for c in larger:
                assert not clear_somewhere(
                    surface.scene, point, c, math.radians(angle), degrees, searched.clearance
                )  # fmt: skip
