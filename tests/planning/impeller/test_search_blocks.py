"""The answer of blocks of contact points, one after the other, is that of all of them to the last bit."""

from __future__ import annotations

import itertools

import numpy as np

from chipload.cutter.catalogue import Catalogue, CatalogueCutter
from chipload.jobs.impeller.checkpoint import part_bytes
from chipload.planning.impeller.answer import join_answers, largest_cutters
from chipload.planning.impeller.parametric import ImpellerShape, impeller_of
from chipload.planning.impeller.surfaces import ContactSampling, surface_of

TABLES = np.radians([30.0, 55.0, 90.0])
#: the largest reach only some contact points, the smallest not all
CUTTERS = Catalogue("blocks", tuple(CatalogueCutter(d, r) for r in (1.5, 2.0) for d in (50.0, 80.0)))


def test_blocks_have_the_answer_of_all_points() -> None:
    how = ContactSampling((0.03, 0.97), (0.3, 0.98), (4, 3), 4.0, 2.0)
    scene = surface_of(impeller_of(ImpellerShape()), "blade", "minus", how).scene
    whole = largest_cutters(scene, CUTTERS, TABLES, 0.5)
    # some of each kind, so that each column is compared
    assert len({*whole.cutter.tolist()}) > 1
    assert whole.unreachable
    for ends in ((0, 1, 12), (0, 5, 6, 12)):
        blocks = itertools.pairwise(ends)
        parts = [largest_cutters(scene, CUTTERS, TABLES, 0.5, points=np.arange(a, b)) for a, b in blocks]
        assert part_bytes(join_answers(parts)) == part_bytes(whole)
