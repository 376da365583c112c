"""The score of chipload on the public set of cuts.

    python benchmarks/chipload_bench.py [--write] [--kind KIND ...]

Reads `benchmarks/cuts/cuts.toml`, answers each question through the public interface, and prints a row for each kind:
number, median and greatest difference from the reference, and how many are within 1 and 5 % of it. `--write` writes the
table and all answers to `docs/benchmark.md`.
"""

from __future__ import annotations

import argparse
import sys
import tomllib
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np

import chipload

CUTS = Path(__file__).with_name("cuts") / "cuts.toml"
PAGE = Path(__file__).parents[1] / "docs" / "benchmark.md"
MARK = "<!-- what follows is written by benchmarks/chipload_bench.py --write -->\n"
TITLES = {
    "force": "forces over a turn", "wall": "form error of a wall", "bar": "bending of a cutter",
    "strip": "bending of a strip", "mode": "natural frequency of a strip", "stability": "stability limit",
    "time": "time of a program",
}  # fmt: skip


def read_cuts() -> list[dict[str, Any]]:
    """The questions of the file."""
    return tomllib.loads(CUTS.read_text())["cut"]


def metal_of(values: dict[str, float]) -> chipload.Material:
    """A material of six coefficients."""
    names = ("ktc_mpa", "krc_mpa", "kac_mpa", "kte_n_mm", "kre_n_mm", "kae_n_mm")
    return chipload.Material("of the question", *(values[name] for name in names), source="benchmarks/cuts/cuts.toml")


def answer(cut: dict[str, Any]) -> dict[str, float]:
    """Chipload's numbers for a question, under the names of its references."""
    if cut["kind"] == "time":
        return {"time_s": program_time(cut)}
    if cut["kind"] in ("strip", "mode"):
        plate = chipload.Plate(**cut["plate"], elements=(2, 10, 1))
        if cut["kind"] == "mode":
            return {"frequency_hz": float(chipload.modes(plate, 1).frequency_hz[0])}
        place = [[0.5 * plate.length_mm, cut["height_mm"]]]
        return {"compliance_um_n": float(chipload.compliance(plate, place)[0])}
    mill = chipload.Cutter(**cut["cutter"])
    if cut["kind"] == "bar":
        return {"compliance_um_n": float(chipload.compliance(mill, cut["height_mm"])[0])}
    metal = metal_of(cut["material"])
    if cut["kind"] == "stability":
        return {"limit_depth_mm": limit_depth(cut, mill, metal)}
    engagement = chipload.engagement_of_cut(mill, **cut["engagement"])
    if cut["kind"] == "wall":
        errors = chipload.wall_form_error(mill, metal, engagement, cut["feed_per_tooth_mm"]).error_um
        return {"form_error_um": float(errors[np.argmax(np.abs(errors))])}
    turn = chipload.tooth_forces(mill, metal, engagement, cut["feed_per_tooth_mm"], 3000.0)
    force = float(np.linalg.norm(turn.force_n, axis=1).max())
    return {"force_n": force, "torque_nm": turn.greatest_torque_nm, "torque_mean_nm": turn.mean_torque_nm}


def limit_depth(cut: dict[str, Any], mill: chipload.Cutter, metal: chipload.Material) -> float:
    """Greatest stable depth [mm]: the margin times the depth, asked again where the margin is far from 1."""
    mode, stated, longest = chipload.Mode(**cut["mode"]), dict(cut["engagement"]), cut["cutter"]["flute_length_mm"]
    while True:
        engagement = chipload.engagement_of_cut(mill, **stated)
        found = chipload.stability_margin(mill, metal, engagement, 0.05, cut["speed_rpm"], [mode])
        margin, depth = float(found.margin[0]), engagement.axial_depth_mm
        if 0.5 < margin < 2.0 or depth >= longest:
            return margin * depth
        stated["axial_depth_mm"] = min(depth * (1.5 if margin >= 2.0 else 0.5), longest)


def program_time(cut: dict[str, Any]) -> float:
    """Seconds in which the axes of the machine of the question move."""
    sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
    from cycle_counts.clock import cycles_of, machine_of

    return cycles_of(cut["program"], machine_of("".join(cut["axes"]))) / 1e3


def difference(cut: dict[str, Any]) -> float:
    """The greatest relative difference of an answer from its references."""
    found = answer(cut)
    return max(abs(found[name] / known - 1.0) for name, known in cut["reference"].items())


def table_of(scored: list[tuple[dict[str, Any], float]]) -> list[str]:
    """Rows of Markdown: a row for each kind, and one for all."""
    by_kind: dict[str, list[float]] = defaultdict(list)
    for cut, off in scored:
        by_kind[cut["kind"]].append(off)
    rows = [
        "| kind | questions | median difference | greatest | within 1 % | within 5 % |",
        "|:--|--:|--:|--:|--:|--:|",
    ]
    for kind, off in [*by_kind.items(), ("all", [off for _, off in scored])]:
        near, wide = (sum(one <= bound for one in off) for bound in (0.01, 0.05))
        rows.append(
            f"| {TITLES.get(kind, kind)} | {len(off)} | {100.0 * float(np.median(off)):.3f} % "
            f"| {100.0 * max(off):.2f} % | {near} | {wide} |"
        )
    return rows


def answers_of(scored: list[tuple[dict[str, Any], float]]) -> list[str]:
    """Rows of Markdown: a row for each question."""
    rows = ["| id | kind | reference | chipload | difference |", "|--:|:--|:--|:--|--:|"]
    for cut, off in scored:
        found = answer(cut)
        known = ", ".join(f"{name} {value:.4g}" for name, value in cut["reference"].items())
        ours = ", ".join(f"{found[name]:.4g}" for name in cut["reference"])
        rows.append(f"| {cut['id']} | {TITLES[cut['kind']]} | {known} | {ours} | {100.0 * off:.2f} % |")
    return rows


def page_of(scored: list[tuple[dict[str, Any], float]]) -> str:
    """Both tables as they stand on the page."""
    return "\n".join(["", *table_of(scored), "", *answers_of(scored), ""])


def main() -> int:
    """Answer, print, write."""
    parser = argparse.ArgumentParser(description="The score of chipload on the public set of cuts.")
    parser.add_argument("--write", action="store_true", help="write docs/benchmark.md")
    parser.add_argument("--kind", action="append", choices=list(TITLES), help="only this kind; repeatable")
    args = parser.parse_args()
    cuts = [cut for cut in read_cuts() if not args.kind or cut["kind"] in args.kind]
    scored = [(cut, difference(cut)) for cut in cuts]
    print("\n".join(table_of(scored)))
    if args.write:
        head = PAGE.read_text().partition(MARK)[0]
        PAGE.write_text(head + MARK + page_of(scored))
    return 0


if __name__ == "__main__":
    sys.exit(main())
