"""Results made by formula, so that the report is tested without a planner; what makes a run of all tests faster."""

from __future__ import annotations

import gc
import math
import shutil
from collections.abc import Callable, Generator, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cad_kernel
import processor_time
from chipload.cutter.cutter import Cutter
from chipload.errors import Finding
from chipload.geometry.contour import Contour
from chipload.jobs.contour.outcome import ContourResult, Operation, PlanVerification
from chipload.jobs.contour.text_simulation import SimulatedText
from chipload.machine.machine import machine_named
from chipload.planning.result import Event, OperationResult, StrategyResult
from chipload.program.build import follow, plunge, rapid, retract
from chipload.program.program import Program
from chipload.result import Provenance, Verdict

#: folders and files whose tests are quick: `make quick`, marker `core`
CORE = (
    "control", "cutter", "cutting", "engagement", "geometry", "machine", "program", "report", "result", "stability",
    "stock", "test_docs_reference.py", "test_errors.py", "test_extras.py", "test_gallery.py", "test_packages.py",
    "test_words.py",
)  # fmt: skip
CHROMIUM = Path("/usr/bin/chromium")
#: run by freecadcmd, not by Python
collect_ignore = ["integrations/freecad_job.py"]
EXAMPLES = Path(__file__).parents[1] / "src" / "chipload" / "examples"
WALL = Contour.from_bulges([[0, 28], [0, 8], [8, 0], [28, 0]], [0, math.tan(math.pi / 8), 0, 0])
CENTRES = Contour.from_bulges([[5, 28], [5, 8], [8, 5], [28, 5]], [0, math.tan(math.pi / 8), 0, 0])
BEFORE = Contour.from_bulges([[0.1, 28], [0.1, 8], [8, 0.1], [28, 0.1]], [0, math.tan(math.pi / 8), 0, 0])


def pytest_configure() -> None:
    """Collect 7,500 tests without the garbage collector, which would look through all of them again and again; and let
    Hypothesis draw values without reading the source of each imported module for constants.
    """
    gc.disable()
    try:
        from hypothesis.internal.conjecture import providers
    except ImportError:  # another version keeps them elsewhere, or Hypothesis is not installed: slower, not wrong
        return
    if hasattr(providers, "_get_local_constants"):
        constants = providers._local_constants
        providers._get_local_constants = lambda: constants


def pytest_collection_finish() -> None:
    """Leave what was collected out of each later collection of garbage."""
    gc.enable()
    gc.freeze()


CAD = cad_kernel.used()


def pytest_unconfigure() -> None:
    """End the process that has loaded the CAD kernel."""
    CAD.close()


SPENT = processor_time.Spent()


def pytest_runtest_logstart() -> None:
    """What is spent between two tests counts for none."""
    SPENT.since()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport() -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """State the processor time of a test in its reports, which workers send as well."""
    report = yield
    report.user_properties.append((processor_time.NAME, SPENT.since()))
    return report


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """Tell how much processor time each folder took."""
    lines = processor_time.table(report for reports in terminalreporter.stats.values() for report in reports)
    if lines:
        terminalreporter.section("processor time")
        terminalreporter.write("".join(f"{line}\n" for line in lines))


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Choose whether the CAD kernel is started and asked again."""
    CAD.used = not cad_kernel.is_about_cad(item.path)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the tests of :data:`CORE`."""
    own = Path(__file__).parent
    for item in items:
        if item.path.is_relative_to(own) and item.path.relative_to(own).parts[0] in CORE:
            item.add_marker(pytest.mark.core)


@pytest.fixture(scope="session")
def browser() -> Iterator[object]:
    """Chromium without a window. One for all tests: a second one in the same process is refused."""
    if not CHROMIUM.exists():
        pytest.skip("no chromium: the page is not opened in a browser")
    playwright = pytest.importorskip("playwright.sync_api", reason="no playwright: the page is not opened in a browser")
    flags = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    with playwright.sync_playwright() as p:
        chromium = p.chromium.launch(executable_path=str(CHROMIUM), args=flags)
        yield chromium
        chromium.close()


def made_strategy(name: str, rows: int = 900) -> StrategyResult:
    """A strategy on the corner whose engagement rises in the corner if it is `plain`; the numbers are not physics."""
    s = np.linspace(0.0, CENTRES.length, rows)
    p, T, kappa = CENTRES.at(s)
    a = 11.478 + (7.26 * (kappa > 0) if name != "backward" else 1.2 * np.exp(-(((s - 20.0) / 0.5) ** 2)))
    feed = np.full(rows, 600.0) * (np.sin(np.radians(11.478)) / np.sin(np.radians(a)) if name == "feed" else 1.0)
    force = 4.0 * a * feed / 600.0
    two = 2 * rows
    history = {
        "pass": np.array(["semifinish"] * rows + ["finish"] * rows, dtype=object),
        "s_mm": np.concatenate([s, CENTRES.length + s]),
        "t_s": np.linspace(0.0, 9.0, two),
        "x_mm": np.concatenate([p[:, 0] + 0.1, p[:, 0]]),
        "y_mm": np.concatenate([p[:, 1] + 0.1, p[:, 1]]),
        "z_mm": np.full(two, -5.0),
        "engagement_deg": np.concatenate([np.full(rows, 25.0), a]),
        "feed_mm_min": np.concatenate([np.full(rows, 600.0), feed]),
        "force_x_n": np.concatenate([np.full(rows, 90.0), force * T[:, 1]]),
        "force_y_n": np.concatenate([np.full(rows, 30.0), -force * T[:, 0]]),
        "force_xy_n": np.concatenate([np.full(rows, 95.0), force]),
        "torque_nm": np.concatenate([np.full(rows, 0.4), force / 300.0]),
        "form_error_um": np.concatenate([np.zeros(rows), force / 8.0]),
    }
    start = np.array([*CENTRES.start, 5.0])
    parts = [rapid(start, 314.159, 1, "finish"), plunge([*CENTRES.start, -5.0], 10.0, 314.159, 1, "finish")]
    parts += [follow(CENTRES, -5.0, 10.0, 314.159, 1, "finish"), retract([*CENTRES.end, 5.0], 314.159, 1, "finish")]
    span = {
        c: {"min": float(v.min()), "max": float(v.max())} for c, v in (("engagement_deg", a), ("force_xy_n", force))
    }
    return StrategyResult(
        name,
        Program.join(parts),
        history,
        {**span, "torque_nm": span["force_xy_n"], "form_error_um": {"max": float(force.max() / 8.0)}, "time_s": 9.0},
        (Event("lead-none", 5.0, 28.0, "no room to lead in"),),
        np.arange(two) >= rows,
        {"wall": (WALL,), "stock": (BEFORE,), "finish path": (CENTRES,)},
    )


def made_outcome(use: str = "backward", verdict: Verdict = Verdict.HOLDS, rows: int = 900) -> ContourResult:
    """A whole run of one operation with three strategies; ``verdict`` is that of the simulation."""
    names = ("plain", "backward", "feed")
    result = OperationResult("contour", use, {n: made_strategy(n, rows) for n in names}, ("made by formula",))
    cutter = Cutter(10.0, 4, math.radians(30.0), 22.0, 35.0, 5.8e5)
    checks = {n: PlanVerification(verdict, "1800 rows compared", {"gouge_mm": 0.0}) for n in names}
    settings = {"kind": "contour", "use": use, "feed_mm_min": 600.0}
    limits = {"engagement_deg": 13.0, "force_xy_n": 200.0}
    errors = dict.fromkeys(
        ("engagement_deg", "force_n", "torque_nm", "torque_mean_nm", "power_w", "form_error_um"), 0.0
    )
    simulations = {n: SimulatedText(s.program, s.history, (), errors, None) for n, s in result.strategies.items()}
    return ContourResult(
        "corner",
        (Operation(result, settings, cutter, 0.0, 5.0, checks, simulations, limits),),
        machine_named("vmc"),
        ("torque_nm",),
        (Finding("made", 0, "operation.0.x: a finding"),),
        Provenance({"job": "x"}, (), "vmc", {}, {}),
    )


@pytest.fixture
def outcome() -> Callable[..., ContourResult]:
    """A maker of outcomes."""
    return made_outcome


@pytest.fixture
def job_dir(tmp_path: Path) -> Path:
    """A copy of the contour example."""
    target = tmp_path / "job"
    shutil.copytree(EXAMPLES / "contour", target)
    return target
