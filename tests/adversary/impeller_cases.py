"""An impeller with one thing wrong on the machine: what its tools meet, where its axes go, how fast a cutter turns."""

from __future__ import annotations

import tomllib
from functools import cache
from pathlib import Path

import trimesh

import chipload
from adversary.base import Case, Change, Job, stated
from chipload import examples

CATALOGUE = """name = "one"
[[cutter]]
diameter_mm = 16.0
corner_radius_mm = 2.0
cutting_length_mm = 30.0
reach_mm = 70.0
holder_diameter_mm = 63.0
"""
#: a pallet 30 mm below the hub
PALLET = {"low_mm": (-150.0, -150.0, -80.0), "high_mm": (150.0, 150.0, -30.0)}
#: a piece of material that stands on the milled piece of the side, up to 2 mm above it
STOCK = {"low_mm": (70.0, -4.0, 30.0), "high_mm": (74.5, -0.4, 34.0)}


@cache
def _text() -> str:
    return (Path(examples.__file__).parent / "impeller" / "job.toml").read_text()


def impeller_job() -> Job:
    """A piece of a side of a blade, milled with one cutter while the pallet stands upright; it holds."""
    tables = tomllib.loads(_text())
    operation = dict(tables["operation"][0])
    for key in ("hand_picked", "rough"):
        del operation[key]
    operation |= {
        "check_mm": 4.0, "clearance_mm": 2.0, "table_deg": [90.0], "scallop_mm": 0.2, "most_cutters": 1,
        "tolerance_mm": 0.3, "paths": operation["paths"] | {"check_mm": 4.0, "chord_mm": 0.02},
    }  # fmt: skip
    tables |= {
        "surface": [
            {"body": "blade", "side": "plus", "along": (0.30, 0.34), "up": (0.50, 0.56), "points": (2, 2)},
        ],
        "catalogue": {"file": "cutters.toml"},
        "machine": {"file": "m.toml"},
        "machine_table": dict(PALLET),
        "stock": dict(STOCK),
        "operation": [operation],
    }
    machine = (Path(chipload.__file__).parent / "data" / "machines" / "horizontal-b.toml").read_text()
    return Job(tables, {"cutters.toml": CATALOGUE, "m.toml": machine})


def text_of(name: str, old: str, new: str) -> Change:
    """Replace a piece of a file beside the job, which must be there."""

    def change(job: Job) -> None:
        text = job.files[name]
        assert isinstance(text, str)
        assert old in text, old
        job.files[name] = text.replace(old, new, 1)

    return change


def clamp(job: Job) -> None:
    """A clamp beside the hub, in the way of the cutter in one of the other channels."""
    box = trimesh.creation.box(bounds=[[-130.0, -20.0, 0.0], [-60.0, 20.0, 60.0]])
    job.files["clamp.stl"] = bytes(box.export(file_type="stl"))
    job.tables["fixture"] = [{"file": "clamp.stl", "units": "mm", "spacing_mm": 3.0}]


def bracket(job: Job) -> None:
    """A block beside the part, above a tool that lies across the axis."""
    box = trimesh.creation.box(bounds=[[100.0, -40.0, 75.0], [160.0, 40.0, 105.0]])
    job.files["bracket.stl"] = bytes(box.export(file_type="stl"))
    job.tables["fixture"] = [{"file": "bracket.stl", "units": "mm", "spacing_mm": 3.0}]


def bracket_at_an_index_angle(job: Job) -> None:
    """The same block, with the index table at an angle at which the holder stands where it is."""
    bracket(job)
    job.tables["operation"][0]["table_deg"] = [50.0]


def without_pallet(job: Job) -> None:
    """Nothing that lies below the part is stated."""
    del job.tables["machine_table"]


def without_stock(job: Job) -> None:
    """Neither roughing nor the stock before finishing is stated."""
    del job.tables["stock"]


def case(name: str, wrong: str, change: Change, state, found: str = "") -> Case:
    """A case of the impeller."""
    return Case(name, wrong, change, state, found, impeller_job)


CASES = (
    case("impeller", "nothing: a side of a blade that holds", lambda job: None, "holds"),
    case(
        "impeller-holder-in-the-pallet",
        "a wide holder that dips into the pallet where the cutter does not",
        stated("machine_table", high_mm=(150.0, 150.0, -1.0)),
        "exceeds",
        "collision",
    ),
    case(
        "impeller-holder-too-near-the-pallet",
        "a holder that keeps less than clearance_mm from the pallet",
        stated("machine_table", high_mm=(150.0, 150.0, -5.5)),
        "exceeds",
        "collision",
    ),
    case(
        "impeller-holder-below-the-hub",
        "a holder that goes below the hub, and no pallet is stated",
        without_pallet,
        "unproven",
        "below-stock",
    ),
    case("impeller-clamp-in-the-way", "a clamp in the way in another channel", clamp, "exceeds", "collision"),
    case("impeller-bracket", "nothing: a block above the tool, which it does not meet", bracket, "holds"),
    case(
        "impeller-bracket-at-an-index-angle",
        "a block that the holder meets at another angle of the index table only",
        bracket_at_an_index_angle,
        "exceeds",
        "collision",
    ),
    case(
        "impeller-stock-not-stated",
        "finishing programs whose stock before them is not stated",
        without_stock,
        "unproven",
        "not-simulated",
    ),
    case(
        "impeller-neck-in-the-stock",
        "material in the way of the shank, which no roughing has taken",
        stated("stock", low_mm=(98.0, 4.0, 30.0), high_mm=(104.0, 84.0, 33.0)),
        "exceeds",
        "collision",
    ),
    case(
        "impeller-clamp-not-stated", "no clamps are stated", lambda job: None, "unchecked", "fixtures: none is stated"
    ),
    case(
        "impeller-beyond-travel",
        "an axis that cannot go as far as the program",
        text_of("m.toml", "min_mm = -200.0\nmax_mm = 500.0", "min_mm = -200.0\nmax_mm = 20.0"),
        "exceeds",
        "machine-limit",
    ),
    case(
        "impeller-tool-too-long",
        "a tool so long that the spindle cannot back off",
        text_of("cutters.toml", "reach_mm = 70.0", "reach_mm = 70.0\nlength_mm = 420.0"),
        "exceeds",
        "machine-limit",
    ),
    case(
        "impeller-cutter-too-fast",
        "a spindle speed above that of the cutter",
        text_of("cutters.toml", "reach_mm", "max_rpm = 800.0\nreach_mm"),
        "exceeds",
        "cutter-speed",
    ),
)
