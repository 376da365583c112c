"""The public set of cuts: its references are those of the oracles, and the page states what chipload answers."""

from __future__ import annotations

import importlib.util
import itertools
import sys
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[1]


def benchmark(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(f"benchmark_{name}", ROOT / "benchmarks" / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module, path = importlib.util.module_from_spec(spec), list(sys.path)
    try:
        sys.path.insert(0, "")  # the place of the folder of a script
        spec.loader.exec_module(module)
    finally:
        sys.path[:] = path
    return module


@pytest.fixture(scope="module")
def bench() -> ModuleType:
    return benchmark("chipload_bench")


@pytest.fixture(scope="module")
def cuts(bench) -> list:
    return bench.read_cuts()


def test_every_question_has_what_another_program_needs(cuts) -> None:
    assert [cut["id"] for cut in cuts] == list(range(1, 61))
    assert all(cut["source"] and cut["licence"] == "CC0-1.0" and cut["uncertainty"] > 0.0 for cut in cuts)
    assert all(value > 0.0 or cut["kind"] == "wall" for cut in cuts for value in cut["reference"].values())


def test_the_references_are_those_of_the_oracles(cuts) -> None:
    """Some of each kind, made again: every sixth force, all beams, the limits in closed form."""
    made = benchmark("cut_references")
    again = [
        *itertools.islice(made.force_cuts(), 1, 24, 6), *made.bars(), *made.strips(),
        *itertools.islice(made.stability_limits(), 6), *made.program_times(),
    ]  # fmt: skip
    stated = {tuple(cut["reference"].values()): cut["kind"] for cut in cuts}
    for one in again:
        values = tuple(float(f"{value:.6g}") for value in one["reference"].values())
        assert stated[values] == one["kind"]


def test_the_page_states_the_answers(bench, cuts) -> None:
    scored = [(cut, bench.difference(cut)) for cut in cuts]
    assert max(off for cut, off in scored) < 0.02
    assert (ROOT / "docs" / "benchmark.md").read_text().partition(bench.MARK)[2] == bench.page_of(scored)
