"""The numbers that README.md and the pages of docs/ state of the shipped examples, read from results.

A page marks each such number: ``3.14<!--plate.variable_min-->``. The comment names the entry of
``docs/figures/values.toml`` that stands before it; a reader of the page does not see it. ``tools/figures.py`` runs the
examples at their own settings, writes that file from their results, and writes the marked numbers anew.
``tests/results/test_page_values.py`` fails where a result, the file and a page differ.
"""

from __future__ import annotations

import hashlib
import json
import re
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parent.parent
EXAMPLES = ROOT / "src" / "chipload" / "examples"
VALUES = ROOT / "docs" / "figures" / "values.toml"
#: pages with marked numbers
PAGES = (ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md")), *sorted(EXAMPLES.glob("*/README.md")))
#: a number or a word, and the entry that states it
MARK = re.compile(r"([-+\w.,%]+)<!--(\w+)\.(\w+)-->")
#: number with its digits grouped, a power of ten, or a word
Text = dict[str, str]
#: [mm] of the frame, as tools/frame_step.py writes it, and its cutter
LENGTH, WIDTH, WALL, CORNER, RADIUS = 40.0, 24.0, 1.5, 5.0, 4.0
MIDDLE = 0.5 * LENGTH


@dataclass(frozen=True)
class Run:
    """A result folder of an example.

    Parameters
    ----------
    folder : that ``chipload run`` wrote
    """

    folder: Path

    @cached_property
    def summary(self) -> Mapping[str, Any]:
        """Of the result."""
        return dict(json.loads((self.folder / "summary.json").read_text(encoding="utf-8")))

    @property
    def operation(self) -> Mapping[str, Any]:
        """Of its first operation."""
        return dict(self.summary["operations"][0])

    def limit(self, name: str, track: str = "") -> Mapping[str, Any]:
        """A limit check, of the result or of a track."""
        owner = self.summary if not track else self.track(track)
        return next(check for check in owner["limits"] if check["name"] == name)

    def worst(self, name: str, track: str = "") -> float:
        """Its worst value."""
        return float(self.limit(name, track)["worst"])

    def error(self, name: str, track: str = "") -> str:
        """Its resolution error in percent."""
        return f"{100.0 * self.limit(name, track)['resolution_error']:.2g}"

    def track(self, name: str) -> Mapping[str, Any]:
        """A track by its name."""
        return next(track for track in self.summary["tracks"] if track["name"] == name)

    def tracks_with(self, limit: str) -> list[str]:
        """Names of the tracks in use that have a limit."""
        used = (track for track in self.summary["tracks"] if track["in_use"])
        return [track["name"] for track in used if any(check["name"] == limit for check in track["limits"])]

    def lines(self, program: str) -> int:
        """Number of lines of a written program."""
        return len((self.folder / program).read_text(encoding="utf-8").splitlines())


def contour(run: Run) -> Text:
    """A corner, three strategies."""
    made = run.operation["strategies"]
    return {
        "straight_deg": f"{made['plain']['engagement_deg']['wanted']:.1f}",
        "plain_deg": f"{run.worst('engagement_deg', 'plain'):.1f}",
        "backward_deg": f"{run.worst('engagement_deg', 'backward'):.1f}",
        "feed_deg": f"{run.worst('engagement_deg', 'feed'):.1f}",
        "plain_form_um": f"{run.worst('form_error_um', 'plain'):.1f}",
        "backward_form_um": f"{run.worst('form_error_um', 'backward'):.1f}",
        "time_s": f"{made['backward']['time_s']:.1f}",
        "plain_s": f"{made['plain']['time_s']:.1f}",
    }


def pocket(run: Run) -> Text:
    """A pocket with islands."""
    made = run.operation["strategies"]["pocket"]
    return {
        "cleared_percent": f"{made['cleared_percent']:.3f}",
        "engagement_deg": f"{run.worst('engagement_deg'):.4g}",
        "torque_nm": f"{run.worst('torque_nm'):.3g}",
        "time_s": f"{made['time_s']:.0f}",
        "cutting_s": f"{made['cutting_s']:.0f}",
        "link_s": f"{made['link_s']:.0f}",
        "lines": f"{run.lines(made['program'] + '.ngc'):,}",
        "left_mm2": f"{made['leftover_mm2']:.2f}",
    }


def trunnion(run: Run) -> Text:
    """A program that is only read."""
    return {
        "motions": f"{run.operation['program']['motions']:,}",
        "time_s": f"{run.operation['program']['time_s']:.0f}",
        "verdict": run.summary["verdict"],
    }


def chips(run: Run) -> Text:
    """A five-axis step."""
    return {
        "volume_mm3": f"{run.operation['chip_volume_mm3']:,.0f}",
        "steps": f"{run.operation['steps']:,}",
        "force_n": f"{run.worst('force_n'):.0f}",
        "torque_nm": f"{run.worst('torque_nm'):.2f}",
    }


def chips_blade(run: Run) -> Text:
    """A five-axis pass of a flank."""
    return {"volume_mm3": f"{run.operation['chip_volume_mm3']:,.0f}", "force_n": f"{run.worst('force_n'):.0f}"}


def chatter(run: Run) -> Text:
    """A cutter that chatters, before and after."""
    made, before = run.operation["speeds"], run.operation["speeds"]["before"]
    return {
        "before_rpm": f"{before['speed_rpm']:.0f}",
        "before_margin": f"{before['margin_min']:.2f}",
        "chatter_hz": f"{before['chatter_hz']:.0f}",
        "rpm": f"{made['after']['speed_rpm']:.0f}",
        "margin": f"{made['after']['margin_min']:.3g}",
        "before_s": f"{made['time_before_s']:.1f}",
        "time_s": f"{made['time_after_s']:.1f}",
    }


def bracket(run: Run) -> Text:
    """A program with three faults."""
    made = run.operation
    return {
        "gouge_mm": f"{made['gouge_mm']['max']:.2f}",
        "gouge_line": str(made["gouge_mm"]["line"]),
        "undercut_um": f"{-made['form_error_um']['least']:.0f}",
        "undercut_line": str(made["form_error_um"]["line"]),
        "collision_mm": f"{made['collisions'][0]['depth_mm']:.2f}",
    }


def feeds(run: Run) -> Text:
    """New feeds for a program."""
    made = run.operation["feeds"]
    return {
        "before_s": f"{made['time_before_s']:.1f}",
        "time_s": f"{made['time_after_s']:.1f}",
        "before_n": f"{made['before']['force_n']:.0f}",
        "force_n": f"{made['after']['force_n']:.0f}",
        "before_nm": f"{made['before']['torque_nm']:.2f}",
        "torque_nm": f"{made['after']['torque_nm']:.2f}",
        "force_error_percent": run.error("force_n"),
        "slower": str(made["lines_slower"]),
        "faster": str(made["lines_faster"]),
    }


def part(run: Run) -> Text:
    """A housing that bends."""
    made = run.operation["feeds"]
    return {
        "before_s": f"{made['time_before_s']:.1f}",
        "time_s": f"{made['time_after_s']:.1f}",
        "deflection_um": f"{run.worst('deflection_workpiece_um'):.1f}",
        "form_um": f"{run.worst('form_error_um'):.0f}",
    }


def _wall(run: Run) -> Text:
    """The variants of a thin wall."""
    made = run.operation["variants"]
    out = {}
    for name, short in (
        ("variable", "variable"),
        ("constant", "constant"),
        ("unconstrained", "free"),
        ("least_error", "least"),
    ):
        out[f"{short}_min"] = f"{made[name]['time_min']:.2f}"
        out[f"{short}_um"] = f"{made[name]['deflection_workpiece_um_max']:.1f}"
        out[f"{short}_form_um"] = f"{made[name]['form_error_um_max']:.1f}"
    return out | {
        "error_percent": run.error("deflection_workpiece_um", "variable"),
        "constant_error_percent": run.error("deflection_workpiece_um", "constant"),
        "free_over": str(made["unconstrained"]["over_threshold"]),
        "variable_rms_um": f"{made['variable']['form_error_um_rms']:.1f}",
        "compensated_rms_um": f"{made['compensated']['form_error_um_rms']:.1f}",
    }


def plate(run: Run) -> Text:
    """A titanium plate."""
    return _wall(run)


def blade(run: Run) -> Text:
    """A titanium blade."""
    return _wall(run)


def _controllers(run: Run) -> Text:
    """The controllers of a thin wall, with latency."""
    made, late = run.operation, run.operation["with_latency"]
    fuzzy, constant = (late["controllers"][name]["time_s"] for name in ("fuzzy", "constant"))
    out = {}
    for name, short in (
        ("constant", "constant"),
        ("model", "model"),
        ("model_not_derated", "whole"),
        ("pi", "pi"),
        ("fuzzy", "fuzzy"),
        ("fuzzy_feedforward", "both"),
    ):
        one = late["controllers"][name]
        share = one["torque_nm_max"] / made["torque_limit_nm"]
        out[f"{short}_s"] = f"{one['time_s']:.1f}"
        out[f"{short}_share"] = f"{share:.2f}"
        out[f"{short}_over_percent"] = f"{max(100.0 * (share - 1.0), 0.0):.0f}"
        out[f"{short}_um"] = f"{one['form_error_um_max']:.1f}"
    return out | {
        "limit_nm": f"{made['torque_limit_nm']:.3f}",
        "shorter_percent": f"{late['compared']['shorter_percent']:.0f}",
        "shorter_model_percent": f"{late['compared']['shorter_than_model_percent']:.0f}",
        "fuzzy_shorter_percent": f"{100.0 * (1.0 - fuzzy / constant):.0f}",
        "ideal_s": f"{made['ideal_time_s']:.1f}",
        "torque_error_percent": run.error("torque_over_percent"),
        "form_error_percent": run.error("form_error_um"),
        "rigid_share": f"{run.worst('deflection_share'):.2f}",
    }


def tube(run: Run) -> Text:
    """A thin tube."""
    return _controllers(run)


def cone(run: Run) -> Text:
    """A thin cone."""
    return _controllers(run)


def frame(run: Run) -> Text:
    """The walls of the frame in the elastic part; of each face the form error of its worst step at 95 %."""
    made, check, stress = run.operation, run.limit("form_error_um"), run.limit("stress_mpa")
    share = check["budget"]["value"] / check["worst"]
    return {
        "verdict": run.summary["verdict"],
        "form_um": f"{check['worst']:.1f}",
        "form_95_um": f"{check['budget']['value']:.1f}",
        "bound_percent": f"{100.0 * check['resolution_error']:.0f}",
        "cutter_um": f"{made['deflection_um']['cutter_max']:.1f}",
        "part_um": f"{made['deflection_um']['workpiece_max']:.1f}",
        "stress_mpa": f"{stress['budget']['value']:.0f}",
        "gouge_um": f"{1e3 * run.worst('gouge_mm'):.1f}",
        "excess_um": f"{1e3 * made['excess_mm']['max']:.0f}",
        "time_s": f"{made['time_s']:.1f}",
        "states": str(made["states"]),
        "change_percent": f"{made['state_change_percent']:.0f}",
        "unknowns": f"{made['unknowns']:,}",
        **{name: f"{share * worst:.1f}" for name, worst in face_errors(run.folder).items()},
    }


def face_errors(folder: Path) -> dict[str, float]:
    """Greatest form error [um] of the steps that make each wall of the frame, and of its corners."""
    import numpy as np

    from chipload.result import load_result

    columns = load_result(folder).tracks[0].columns
    error = np.abs(np.nan_to_num(np.asarray(columns["form_error_um"], dtype=np.float64)))
    x, y = (np.asarray(columns[name], dtype=np.float64) for name in ("x_mm", "y_mm"))
    faces, within = dict[str, float](), np.zeros(len(x), dtype=np.bool_)
    for side, low, high in (("left", WALL, MIDDLE - 0.5 * WALL), ("right", MIDDLE + 0.5 * WALL, LENGTH - WALL)):
        own = (x > low) & (x < high)
        for wall, gap, along, ends in (
            ("west", x - low, y, (WALL, WIDTH - WALL)), ("east", high - x, y, (WALL, WIDTH - WALL)),
            ("south", y - WALL, x, (low, high)), ("north", WIDTH - WALL - y, x, (low, high)),
        ):  # fmt: skip
            straight = (along > ends[0] + CORNER) & (along < ends[1] - CORNER)
            here = own & straight & (np.abs(gap - RADIUS) < 0.1)
            faces[f"{side}_{wall}_95_um"] = float(error[here].max())
            within |= here
    return {**faces, "corners_95_um": float(error[~within].max())}


def frame_pockets(run: Run) -> Text:
    """The programs of the frame."""
    made = run.summary["operations"]
    times = [one["strategies"]["pocket"] for one in made]
    levels = re.match(r"levels of (.*) mm, with (.*) um of", made[1]["findings"][0])
    assert levels is not None
    planned = [float(x) for x in re.findall(r"[\d.]+", levels[2])]
    return {
        "levels_mm": "+".join(re.findall(r"[\d.]+", levels[1])),
        "planned_um": f"{max(planned):g}",
        "rough_s": f"{times[0]['time_s']:.1f}",
        "finish_s": f"{times[1]['time_s']:.1f}",
        "engagement_deg": f"{run.worst('engagement_deg'):.1f}",
        "torque_nm": f"{run.limit('torque_nm')['budget']['value']:.2f}",
    }


def frame_roughing(run: Run) -> Text:
    """The first program of the frame in its block."""
    return {"verdict": run.summary["verdict"], "gouge_um": f"{1e3 * run.worst('gouge_mm'):.1f}"}


def frame_distortion(run: Run) -> Text:
    """The frame after its release; the plans by what is left to a second clamping."""
    plans = {tuple(s["stock_mm"] for s in p["setups"]): p for p in run.operation["plans"] if not p["upside_down"]}
    check = run.limit("flatness_um")
    return {
        "flatness_um": f"{check['worst']:.1f}",
        "flatness_high_um": f"{check['worst'] * (1.0 + check['resolution_error']):.1f}",
        "once_um": f"{plans[0.0,]['distortion_um']['value']:.1f}",
        "released_um": f"{plans[1.0, 0.0]['distortion_um']['value']:.1f}",
        "cell_percent": f"{100.0 * run.operation['cell_error']:.1f}",
    }


def notebooks(run: Run) -> Text:
    """The program of the notebook."""
    return {"force_n": f"{run.worst('force_n'):.0f}", "deflection_um": f"{run.worst('deflection_um'):.1f}"}


def impeller(run: Run) -> Text:
    """The impeller with an index table."""
    made, words = run.operation, ("no", "one", "two", "three", "four", "five")
    partitions = made["ways"]
    used = next(one for one in partitions if one["in_use"])
    single = next(one for one in partitions if len(one["cutters"]) == 1 and "picked" not in one["name"])
    picked = next(one for one in partitions if "picked" in one["name"])
    sizes = [point["diameter_mm"] for row in made["surfaces"] for point in row["pointwise"]]
    return {
        "contact_points": f"{made['cc_points']:,}",
        "check_points": f"{made['check_points']:,}",
        "one_mm": f"{made['diameter_mm']:g}",
        "one_corner_mm": f"{made['corner_radius_mm']:g}",
        "one_deg": f"{made['table_deg']:g}",
        "least_mm": f"{min(sizes):g}",
        "most_mm": f"{max(sizes):g}",
        "used": words[len(used["cutters"])],
        "used_min": f"{used['time_min']:.0f}",
        "single_min": f"{single['time_min']:.0f}",
        "picked_min": f"{picked['time_min']:.0f}",
        "gouge_mm": f"{max(run.worst('gouge_mm', track) for track in run.tracks_with('gouge_mm')):.3f}",
    }


def hecc(run: Run) -> Text:
    """NASA's impeller."""
    made = run.operation
    return {
        "contact_points": f"{made['cc_points']:,}",
        "check_points": f"{made['check_points']:,}",
        "unreached": str(made["unreachable"]),
    }


@dataclass(frozen=True)
class Source:
    """A job of the shipped examples whose numbers pages state.

    Parameters
    ----------
    example, job : folder of the example, and its job file
    values : reads the numbers from its result
    pictures : files ``docs/NAME.png`` that show it
    long : takes many minutes: run by ``make real``, and by ``tools/figures.py`` only where it is named
    files : keys of the job that name a file of another result: the source that makes it, and the file
    """

    example: str
    values: Callable[[Run], Text]
    job: str = "job.toml"
    pictures: tuple[str, ...] = ()
    long: bool = False
    files: Mapping[str, tuple[str, str]] = field(default_factory=dict)

    def sets(self, results: Path) -> list[str]:
        """The words of the command that name these files where all results stand in one folder."""
        return [f"{key}={results / source / name}" for key, (source, name) in self.files.items()]


SOURCES: Mapping[str, Source] = {
    "contour": Source("contour", contour, pictures=("contour",)),
    "pocket": Source("pocket", pocket, pictures=("pocket",)),
    "trunnion": Source("trunnion", trunnion, pictures=("trunnion",)),
    "chips": Source("chips", chips, pictures=("chips",)),
    "chips_blade": Source("chips", chips_blade, "blade.toml", long=True),
    "chatter": Source("chatter", chatter, pictures=("chatter",)),
    "bracket": Source("bracket", bracket, pictures=("bracket", "page")),
    "feeds": Source("feeds", feeds, pictures=("feeds", "page_compare")),
    "part": Source("part", part, pictures=("part", "part_deflection", "page_home", "questions")),
    "plate": Source("plate", plate, pictures=("plate",)),
    "blade": Source("blade", blade, pictures=("blade",)),
    "tube": Source("tube", tube, pictures=("tube",)),
    "cone": Source("cone", cone, pictures=("cone",)),
    "frame_pockets": Source("frame", frame_pockets),
    "frame_roughing": Source(
        "frame", frame_roughing, "roughing.toml", files={"program.file": ("frame_pockets", "0-pocket.ngc")}
    ),
    "frame": Source(
        "frame",
        frame,
        "walls.toml",
        pictures=("frame",),
        files={
            "program.file": ("frame_pockets", "1-pocket.ngc"),
            "stock.file": ("frame_roughing", "stock.npz"),
        },
    ),
    "frame_distortion": Source("frame", frame_distortion, "distortion.toml"),
    "notebooks": Source("notebooks", notebooks, pictures=("notebooks",)),
    "impeller": Source("impeller", impeller, pictures=("impeller", "page_impeller")),
    "hecc": Source("hecc", hecc, pictures=("hecc",), long=True),
}


def values_of(name: str, folder: Path) -> Text:
    """Return the entries of a job from its result folder."""
    return SOURCES[name].values(Run(folder))


def fingerprint(folder: Path, picture: str) -> str:
    """Return a digest of what a picture of a result shows: numbers to four digits, of the page the first line too."""
    summary = Run(folder).summary
    shown = [summary["verdict"], summary["message"] if picture.startswith("page") else ""]
    for track in summary["tracks"]:
        numbers = [track["time_s"], track["rows"], *(check["worst"] for check in track["limits"])]
        shown += [track["name"], *(None if x is None else f"{x:.4g}" for x in numbers)]
    return hashlib.sha256(json.dumps(shown).encode()).hexdigest()[:16]


def read_values() -> dict[str, Text]:
    """Return the stored entries: a table for each job, and ``pictures``, the digest that each picture was made from."""
    return tomllib.loads(VALUES.read_text(encoding="utf-8")) if VALUES.exists() else {}


def write_values(values: Mapping[str, Text]) -> None:
    """Store entries, in the order of :data:`SOURCES`."""
    lines = ["# Written by tools/figures.py (make figures) from the results of the shipped examples: do not edit."]
    for name in (*SOURCES, "pictures"):
        if name in values:
            lines += ["", f"[{name}]", *(f'{key} = "{text}"' for key, text in values[name].items())]
    VALUES.parent.mkdir(exist_ok=True)
    VALUES.write_text("\n".join(lines) + "\n", encoding="utf-8")


def numbered(text: str, values: Mapping[str, Text]) -> str:
    """Return a page with its marked numbers written from the entries.

    >>> numbered("in 3.06<!--plate.variable_min--> min", {"plate": {"variable_min": "3.14"}})
    'in 3.14<!--plate.variable_min--> min'
    """
    return MARK.sub(lambda found: f"{values[found[2]][found[3]]}<!--{found[2]}.{found[3]}-->", text)
