"""What comes with chipload is listed with numbers and units; templates are read back by the product; coarse runs."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path

import pytest

from chipload.cli.shipped import entry_lines
from chipload.jobs import load_job
from chipload.jobs.coarse import coarser
from chipload.jobs.shipped import LISTINGS
from chipload.tables import shipped_names
from command import call
from slot_job import slot_job, slot_text


def rows_of(command: str) -> tuple[list[str], dict[str, dict[str, str]]]:
    code, said, _ = call(command, "--tabs")
    assert code == 0
    head, *rows = csv.reader(io.StringIO(said), delimiter="\t", quoting=csv.QUOTE_NONE)
    assert all(len(row) == len(head) for row in rows)
    return head, {row[0]: dict(zip(head, row, strict=True)) for row in rows}


def test_machines_with_their_numbers() -> None:
    """Numbers of data/machines/vmc.toml as they stand there."""
    _, found = rows_of("machines")
    assert tuple(found) == shipped_names("machine")
    vmc = found["vmc"]
    assert [vmc[k] for k in ("axes", "feed [mm/min]", "spindle [rpm]", "power [W]", "torque [N m]", "dialect")] == [
        "XYZ", "12000", "60..15000", "11000", "70", "linuxcnc",
    ]  # fmt: skip
    assert vmc["travel x y z [mm]"] == "-400..400 -250..250 -250..250"
    assert all(row["source"] for row in found.values())


def test_materials_with_their_numbers_and_sources() -> None:
    _, found = rows_of("materials")
    assert tuple(found) == shipped_names("material")
    six, group = found["al6082-t6"], found["group-2-steel"]
    assert (six["Ktc Krc Kac [MPa]"], six["Kte Kre Kae [N/mm]"], six["proves at 95 % [of limit]"]) == (
        "631 99 273", "13 10 2.8", "torque, power to 0.68, force to 0.70",
    )  # fmt: skip
    assert (group["Ktc Krc Kac [MPa]"], group["exponent"], group["chip [mm]"], group["spread [%]"]) == (
        "1500", "0.22", "0.05..1", "30",
    )  # fmt: skip
    # exp(-1.645 * 0.3)
    assert group["proves at 95 % [of limit]"] == "torque, power to 0.61"
    assert found["steel-1045-from-group-2"]["spread [%]"] == "30 50 58"
    assert all("doi" in row["source"] or "catalogue" in row["source"] for row in found.values())


def test_a_material_in_full() -> None:
    code, said, _ = call("materials", "group-2-steel")
    assert code == 0
    assert "Ktc 1500 MPa +- 30 %, size effect h^-0.22" in said
    assert "torque, power: nominal value up to 0.61 of the limit" in said
    assert "force: unproven: the radial and axial coefficients are not known" in said
    _, said, _ = call("materials", "steel-1045-from-group-2")
    assert "force: nominal value up to 0.61 of the limit" in said
    assert "surface location error: unproven: the coefficients have a size effect" in said
    assert "chips of 0.05 to 1 mm; outside loads are unproven" in said
    code, _, error = call("materials", "stel")
    assert code == 2
    assert "material stel: not known" in error


def test_cutters_and_examples() -> None:
    code, said, _ = call("cutters", "--tabs")
    assert code == 0
    assert "wu2019\t10..80\t2\t36\t" in said
    _, found = rows_of("examples")
    assert {"chips", "contour", "pocket", "blade"} <= set(found)


@pytest.mark.parametrize(
    ("kind", "said"),
    [
        ("material", "material my-material: Ktc 800, Krc 200, Kac 150"),
        ("machine", "machine my-machine: X -300 to 300"),
        ("catalogue", "catalogue my-catalogue: 2 cutters, 10 to 16 mm"),
        ("controller", "rules of a fuzzy controller: my-controller"),
        ("fixture", "a closed mesh of 12 triangles, 101500 mm3"),
    ],
)
def test_a_template_is_read_back(kind: str, said: str, tmp_path: Path) -> None:
    code, written, _ = call("init", f"--{kind}", tmp_path / "mine")
    assert code == 0
    (file,) = (tmp_path / "mine").iterdir()
    assert f'file = "{file.name}"' in written
    code, found, err = call("check", file)
    assert (code, said in found) == (0, True), err
    # it is not overwritten
    before = file.read_bytes()
    assert call("init", f"--{kind}", tmp_path / "mine")[0] == 2
    assert file.read_bytes() == before


def test_a_template_in_a_job(tmp_path: Path) -> None:
    call("init", "--material", "--machine", "--fixture", tmp_path)
    slot_job(tmp_path, step=0.5, end=28.0)
    fixture = '[[fixture]]\nfile = "fixture.stl"\nunits = "mm"\nspacing_mm = 2.0\n'
    text = (
        slot_text(0.5)
        .replace('name = "vmc"', 'file = "machine.toml"')
        .replace('name = "al7075-t6"', 'file = "material.toml"')
    )
    (tmp_path / "job.toml").write_text(text + fixture)
    code, said, err = call("check", tmp_path / "job.toml")
    assert code == 0, said + err


def test_what_init_refuses(tmp_path: Path) -> None:
    assert "the folder is missing: use chipload init FILE DIR" in call("init", tmp_path / "a.nc")[2]
    assert "a template takes no file: use chipload init --material DIR" in call("init", "a", "b", "--material")[2]


def test_a_coarse_run_of_a_thin_wall_plans_what_is_cut(tmp_path: Path) -> None:
    """The example asks for two plans that are compared only: least error, and compensated."""
    assert call("example", "plate", tmp_path / "plate")[0] == 0
    asked = coarser(load_job(tmp_path / "plate" / "job.toml"))
    assert {"operation.0.least_error=false", "operation.0.compensate_um=0.0"} <= set(asked)
    operation = load_job(tmp_path / "plate" / "job.toml", asked).job.operation
    assert (operation.least_error, operation.compensate_um) == (False, 0.0)


def test_a_coarse_run_says_so(tmp_path: Path) -> None:
    """The same slot with coarser steps: unproven, the torque within a tenth, the overrides in the provenance."""
    slot_job(tmp_path, step=0.5, end=28.0)
    job = tmp_path / "job.toml"
    asked = coarser(load_job(job))
    assert asked == (
        "operation.0.step_mm=4", "operation.0.tolerance_mm=0.02", "stock.chord_mm=0.05", "stock.layer_mm=1.2",
        "operation.0.corner_slices=8", "operation.0.join_mm=0.12", "operation.0.resolution_error=false",
    )  # fmt: skip
    call("run", job, "--out", tmp_path / "fine")
    code, said, _ = call("run", job, "--coarse", "--out", tmp_path / "coarse")
    assert code == 3
    assert "worst values: torque" in said
    fine, coarse = (json.loads((tmp_path / n / "summary.json").read_bytes()) for n in ("fine", "coarse"))
    assert coarse["verdict"] == "unproven"
    assert coarse["findings"][0]["code"] == "job-coarse"
    assert "job-coarse" not in [f["code"] for f in fine["findings"]]
    assert coarse["provenance"]["overrides"] == list(asked)
    assert coarse["tracks"][0]["rows"] < 0.5 * fine["tracks"][0]["rows"]
    sizes = [(tmp_path / n / "removal.npz").stat().st_size for n in ("fine", "coarse")]
    assert sizes[1] < 0.5 * sizes[0]
    torque = [next(c["worst"] for c in s["limits"] if c["name"] == "torque_nm") for s in (fine, coarse)]
    assert torque[1] == pytest.approx(torque[0], rel=0.1)


@pytest.mark.parametrize("command", ["machines", "materials", "cutters", "examples"])
def test_a_pipe_gets_names_and_sources_whole_in_80_columns(command, monkeypatch) -> None:
    monkeypatch.delenv("COLUMNS", raising=False)
    code, said, _ = call(command)
    assert code == 0
    lines = [line.rstrip() for line in said.splitlines()]
    assert max(map(len, lines)) <= 80
    listing = LISTINGS[command]()
    text = " ".join(said.split())
    assert all(any(line == row[0] or line.startswith(f"{row[0]} ") for line in lines) for row in listing.rows)
    if len(listing.head) > 3:
        assert all(" ".join(row[-1].split()) in text for row in listing.rows)


@pytest.mark.parametrize("width", [60, 80])
def test_long_tables_are_entries_of_short_lines(width) -> None:
    """What a terminal of 80 columns shows: names whole, no line longer, all numbers of the table."""
    listing = LISTINGS["machines"]()
    lines = entry_lines(listing, width)
    assert max(map(len, lines)) <= width
    assert [line for line in lines if not line.startswith(" ")] == [row[0] for row in listing.rows]
    text = " ".join(" ".join(line.split()) for line in lines)
    assert all(cell in text for row in listing.rows for cell in row[:-1])
