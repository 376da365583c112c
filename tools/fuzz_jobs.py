"""Extreme jobs of tools/fuzz.py: every number of a job set to what nobody means, loaded, checked and run.

`jobs` are those of the examples, loaded and checked as `chipload check` does. `runs` are small jobs that end within a
moment, those of every example made small (``fuzz_small``) and some of capabilities that no example has, which are run
too: what is accepted runs to its end, or for :data:`RUN_S` seconds of the processor while it tells its progress; what
is refused only when it is run, though `chipload check` finds nothing, is counted as nonsense. The first cases change
one number each, all further ones two to three, by their number.
"""

from __future__ import annotations

import functools
import io
import json
import math
import time
import tomllib
from collections.abc import Iterator
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from fuzz_readers import Nonsense
from fuzz_small import SMALL

if TYPE_CHECKING:
    from chipload.result import Result

#: seconds of the processor after which a run that goes on as it should is stopped
RUN_S = 2.0
#: what every number is set to
VALUES = ["0", "-1", "1e-9", "1e9", "nan", "inf", '"text"']
#: columns that are never below 0
SIZES = ("force_n", "torque_nm", "torque_mean_nm", "power_w", "chip_max_mm", "deflection_um", "t_s", "duration_s")
#: and what two to three are set to together
MORE = [*VALUES, "-1e9", "1e-3", "1e3", "1e300", "0.5", "7", "-0.5", "90", "[]", "true"]

PROGRAM = """
[program]
file = "part.ngc"
feed_mm_min = 600.0
tolerance_mm = 0.01
[machine]
name = "vmc"
[stock]
low_mm = [0.0, 0.0, -6.0]
high_mm = [24.0, 16.0, 0.0]
layer_mm = 1.0
[material]
name = "al7075-t6"
[[cutter]]
number = 1
diameter_mm = 8.0
flutes = 3
helix_deg = 30.0
flute_length_mm = 20.0
overhang_mm = 30.0
modulus_gpa = 580.0
corner_radius_mm = 0.5
runout_mm = 0.005
runout_deg = 30.0
shank_diameter_mm = 8.0
holder_mm = [[30.0, 28.0]]
gullet_mm2 = 8.0
chip_ratio = 4.0
strength_mpa = 3500.0
[stiffness]
holder_gpa = 210.0
grip_n_um = 100.0
grip_nm_rad = 1e5
spindle_n_um = 60.0
spindle_nm_rad = 5e5
work_n_um = 50.0
[[operation]]
kind = "simulate"
step_mm = 2.0
tolerance_mm = 0.005
[limits]
force_n = 800.0
torque_nm = 4.0
power_w = 2000.0
deflection_um = 60.0
"""
NC = "G21 G90 G17\nT1 M6\nS6000 M3\nG0 X-6 Y5 Z5\nZ-2\nG1 X20 F900\nG3 X22 Y7 J2\nG1 Y10\nG1 X4 Z-3\nG0 Z5\nM2\n"
SLOT = "G21 G90 G17\nT1 M6\nS6000 M3\nG0 X10 Y5 Z5\nG1 Z-2 F900\nX16\nG0 Z5\nM2\n"
DYNAMICS = """
[dynamics]
[[dynamics.mode]]
frequency_hz = 900.0
damping_ratio = 0.03
stiffness_n_um = 8.0
direction = "x"
[[dynamics.mode]]
frequency_hz = 950.0
damping_ratio = 0.03
stiffness_n_um = 9.0
direction = [0.0, 1.0]
"""
CLAMPS = """
[workpiece]
modulus_gpa = 71.7
poisson = 0.33
states = 2
cell_mm = 2.5
[[workpiece.clamp]]
face = "z-"
[[workpiece.clamp]]
face = "y-"
low_mm = [0.0, 0.0, -6.0]
high_mm = [24.0, 0.0, -4.0]
stiffness_n_um = 500.0
"""
FIT = """
name = "x"
source = "made up"
method = "{method}"
band_hz = 400.0
[cutter]
number = 1
diameter_mm = 10.0
flutes = 2
helix_deg = 30.0
flute_length_mm = 22.0
overhang_mm = 35.0
modulus_gpa = 580.0
[engagement]
milling = "slot"
axial_depth_mm = 2.0
[channels]
feed = "fx_n"
across = "fy_n"
axis = "fz_n"
on = "work"
[dynamometer]
feed_hz = 2000.0
[limits]
mean_percent = 50.0
"""


def _forces() -> bytes:
    t = np.arange(4000) * 5e-5
    waves = [120.0 + 80.0 * np.cos(math.tau * 100.0 * t + k) for k in range(3)]
    rows = "\n".join(f"{a:.5f},{b:.3f},{c:.3f},{d:.3f}" for a, b, c, d in zip(t, *waves, strict=True))
    return f"t_s,fx_n,fy_n,fz_n\n{rows}\n".encode()


def _drawing() -> bytes:
    import ezdxf

    doc = ezdxf.new("R2010")
    doc.units = 4
    doc.modelspace().add_lwpolyline([(0, 0), (26, 0), (26, 18), (0, 18)], close=True)
    out = io.StringIO()
    doc.write(out)
    return out.getvalue().encode()


def _example(name: str) -> str:
    return resources.files("chipload.examples").joinpath(name, "job.toml").read_text("utf-8")


@functools.cache
def small_jobs() -> dict[str, dict[str, bytes]]:
    """Files of each small job by name; the job itself is job.toml."""
    fit = {"a.csv": _forces(), "b.csv": _forces()}
    cuts = "".join(
        f'[[measurement]]\nfile = "{f}"\nuse = "{use}"\nfeed_mm_min = {feed}\nspeed_rpm = 3000.0\n'
        for f, use, feed in (("a.csv", "fit", 300.0), ("b.csv", "fit", 900.0))
    )
    corner = resources.files("chipload.examples").joinpath("contour", "corner.dxf")
    contour = _example("contour").replace('["plain", "backward", "feed"]', '["plain"]')
    contour = contour.replace('use = "backward"', 'use = "plain"').replace("step_mm = 0.05", "step_mm = 0.5")
    pocket = _example("pocket").replace("housing.dxf", "closed.dxf").replace("step_mm = 0.2", "step_mm = 0.5")
    texts = {
        "program": (PROGRAM, {"part.ngc": NC.encode()}),
        "feeds": (
            PROGRAM.replace("[limits]", "[operation.feeds]\nslowest_percent = 30.0\nfastest_percent = 200.0\n[limits]"),
            {"part.ngc": NC.encode()},
        ),
        "dynamics": (PROGRAM + "stability_margin = 1.2\n" + DYNAMICS, {"part.ngc": SLOT.encode()}),
        "workpiece": (
            PROGRAM.replace("work_n_um = 50.0\n", "") + "deflection_workpiece_um = 20.0\n" + CLAMPS,
            {"part.ngc": SLOT.encode()},
        ),
        "contour": (contour, {"corner.dxf": corner.read_bytes()}),
        "pocket": (pocket, {"closed.dxf": _drawing()}),
        "average": (FIT.format(method="average").replace("band_hz = 400.0\n", "") + cuts, fit),
        "instantaneous": (FIT.format(method="instantaneous") + cuts, fit),
    }
    return {name: {"job.toml": text.encode(), **files} for name, (text, files) in texts.items()}


def leaves(value: Any, at: str = "") -> Iterator[str]:
    """Dotted places of the numbers of a table; of a list of numbers the list is left out."""
    if isinstance(value, dict):
        for key, held in value.items():
            yield from leaves(held, f"{at}.{key}" if at else key)
    elif isinstance(value, list):
        for k, held in enumerate(value):
            yield from leaves(held, f"{at}.{k}")
    elif isinstance(value, (int, float)) and not isinstance(value, bool):
        yield at


@functools.cache
def places(run: bool) -> tuple[tuple[str, str], ...]:
    """Every number: the job and its dotted place; of the examples, or of the small jobs that are run."""
    out = []
    if run:
        for name, files in small_jobs().items():
            out += [(f"small {name}", at) for at in leaves(tomllib.loads(files["job.toml"].decode()))]
        for name, small in SMALL.items():
            text = _example(name)
            out += [(name, at) for at in leaves(tomllib.loads(text[: text.index(small.cut)] if small.cut else text))]
    else:
        for folder in sorted(resources.files("chipload.examples").iterdir(), key=str):
            if folder.joinpath("job.toml").is_file():
                text = folder.joinpath("job.toml").read_text("utf-8")
                out += [(folder.name, at) for at in leaves(tomllib.loads(text))]
    return tuple(out)


def case(number: int, run: bool) -> tuple[str, tuple[str, ...]]:
    """The job and the overrides of a case."""
    all_places = places(run)
    singles = len(all_places) * len(VALUES)
    if number < singles:
        name, at = all_places[number // len(VALUES)]
        return name, (f"{at}={VALUES[number % len(VALUES)]}",)
    rng = np.random.default_rng([number, int(run)])
    names = sorted({name for name, _ in all_places})
    name = names[int(rng.integers(len(names)))]
    own = [at for n, at in all_places if n == name]
    chosen = rng.choice(len(own), size=int(rng.integers(2, 4)), replace=False)
    return name, tuple(f"{own[k]}={MORE[int(rng.integers(len(MORE)))]}" for k in chosen)


def folder_of(name: str, run: bool, place: Path) -> tuple[Path, tuple[str, ...]]:
    """The folder of a job, which is written where it is not there yet, and the overrides that make it small."""
    from chipload.examples import copy_example

    folder, own = place / name.replace(" ", "-"), name.removeprefix("small ")
    sets = SMALL[name].sets if run and name in SMALL else ()
    if not folder.exists():
        if not run:
            copy_example(name, folder)
        elif name in SMALL:
            SMALL[name].write(folder)
        else:
            folder.mkdir()
            for file, data in small_jobs()[own].items():
                (folder / file).write_bytes(data)
    return folder, sets


def carry_out(number: int, run: bool, place: Path) -> str:
    """Load and check the job of a case, or run it where that is asked; how it ends.

    Returns
    -------
    str
        ``read``: every limit holds, ``findings``: one does not, ``long``: it was stopped on its way.
    """
    from chipload.errors import Cancelled
    from chipload.jobs import check_job, load_job, run_job
    from chipload.result.summary import summary_bytes

    name, overrides = case(number, run)
    folder, sets = folder_of(name, run, place)
    loaded = load_job(folder / "job.toml", (*sets, *overrides))
    if not run:
        lines, holds = check_job(loaded)
        for line in lines:
            if any(word in f" {line} " for word in (" nan ", " inf ")):
                raise Nonsense(line)
        return "read" if holds else "findings"
    until = time.process_time() + RUN_S

    def progress(_done: float, _what: str) -> None:
        if time.process_time() > until:
            raise Cancelled("long enough")

    try:
        done = run_job(loaded, progress)
    except Cancelled:
        return "long"
    text = summary_bytes(done.result, {})
    json.loads(text, parse_constant=_not_finite)
    judge(done.result)
    return "read" if done.result.verdict.exit_code == 0 else "findings"


def judge(result: Result) -> None:
    """Refuse what no result may say.

    Raises
    ------
    Nonsense
        A number that is not finite, a time or a load below 0, a limit that holds and is exceeded, or a track whose
        limits hold though its work is not that of its volume.
    """
    for track in result.tracks:
        if track.time_s is not None and not 0.0 <= track.time_s < math.inf:
            raise Nonsense(f"{track.name} takes {track.time_s} s")
        for column, values in track.columns.items():
            held = np.asarray(values)
            if held.dtype.kind == "f" and not np.isfinite(held).all():
                raise Nonsense(f"column {column} of {track.name} is not finite")
            if column in SIZES and len(held) and float(held.min()) < -1e-9 * float(np.abs(held).max()):
                raise Nonsense(f"column {column} of {track.name} is {held.min():g}")
        for check in track.limits:
            beyond = check.worst is not None and (check.worst - check.limit) * (-1.0 if check.column.least else 1.0)
            if check.state.value == "holds" and beyond > 1e-9 * abs(check.limit):
                raise Nonsense(f"{track.name}: {check.name} {check.worst} of {check.limit} holds")
        error = max((check.resolution_error for check in track.limits), default=0.0)
        for tool, balance in track.energy_balance.items():
            if track.in_use and result.verdict.exit_code == 0 and abs(balance) > 0.1 + error:
                raise Nonsense(f"{track.name}: energy balance {balance:.3g} of tool {tool}, and every limit holds")


def _not_finite(text: str) -> float:
    raise Nonsense(f"summary.json holds {text}")
