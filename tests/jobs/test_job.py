"""What a job says, and what `--set` does to it."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Sequence
from pathlib import Path

import pytest
from pydantic import ValidationError

from chipload.jobs import CAPABILITIES, load_job
from chipload.jobs.contour.job import ContourJob
from chipload.jobs.contour.tables import MAY, NEEDS, OperationTable
from chipload.jobs.reference import reference


def loaded(path: str | Path, overrides: Sequence[str] = ()) -> ContourJob:
    """The job of a file that is planned."""
    job = load_job(path, overrides).job
    assert isinstance(job, ContourJob)
    return job


def test_the_example_is_read_whole(job_dir: Path) -> None:
    job = loaded(job_dir / "job.toml")
    assert job.part_file == job_dir / "corner.dxf"
    assert (job.machine, job.material) == ("vmc", job_dir / "al7075-carbide.toml")
    assert job.cutters[1].diameter == 10.0
    assert job.cutters[1].helix == pytest.approx(math.radians(30.0))
    assert job.operations[0].strategies == ("plain", "backward", "feed")
    assert job.limits["engagement_deg"] == 13.0
    assert job.findings == ()


def test_paths_are_relative_to_the_job_and_not_to_here(job_dir: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(job_dir.parent)
    job = loaded("job/job.toml", ["part.file=sub/a.dxf", "machine.file=own.toml"])
    assert job.part_file == job_dir / "sub" / "a.dxf"
    assert job.machine == job_dir / "own.toml"


def test_an_absolute_path_stays(job_dir: Path) -> None:
    assert loaded(job_dir / "job.toml", ["part.file=/elsewhere/a.dxf"]).part_file == Path("/elsewhere/a.dxf")


@pytest.mark.parametrize(
    ("text", "read"),
    [
        ("cutter.0.diameter_mm=12", lambda j: j.cutters[1].diameter == 12.0),
        ("operation.0.joint=clothoid", lambda j: j.operations[0].joint == "clothoid"),
        ('operation.0.joint="clothoid"', lambda j: j.operations[0].joint == "clothoid"),
        ("operation.0.feed_mm_min = 450.5", lambda j: j.operations[0].feed_mm_min == 450.5),
        ('part.layers=["WALL"]', lambda j: j.table.part.layers == ("WALL",)),
        ("limits.torque_nm=3", lambda j: j.limits["torque_nm"] == 3.0),
        ("cutter.0.corner_radius_mm=1", lambda j: j.cutters[1].corner_radius == 1.0),
    ],
)
def test_set_reaches_every_key(job_dir: Path, text: str, read: object) -> None:
    job = loaded(job_dir / "job.toml", [text])
    assert read(job)  # type: ignore[operator]
    assert job.overrides == (text,)


def test_the_later_set_wins(job_dir: Path) -> None:
    job = loaded(job_dir / "job.toml", ["operation.0.step_mm=0.1", "operation.0.step_mm=0.2"])
    assert job.operations[0].step_mm == 0.2


def test_another_kind_names_the_keys_that_it_does_not_use(job_dir: Path) -> None:
    named = ['operation.0.strategies=["pocket"]', "operation.0.use=pocket"]
    job = loaded(job_dir / "job.toml", ["operation.0.kind=pocket", *named])
    unused = ("joint", "semifinish_depth_mm", "tolerance_mm", "lead_mm")
    assert job.findings == tuple(f"operation.0.{key}: not used by kind = pocket" for key in unused)


def test_a_limit_that_is_not_stated_is_listed_as_unchecked(job_dir: Path) -> None:
    path = job_dir / "job.toml"
    path.write_text("\n".join(x for x in path.read_text().splitlines() if not x.startswith(("torque", "form_error"))))
    assert loaded(path).unchecked == ("torque_nm", "form_error_um")


def test_every_key_of_a_kind_exists() -> None:
    for table in (NEEDS, MAY):
        assert {key for keys in table.values() for key in keys} <= set(OperationTable.model_fields)


def test_the_page_of_keys_is_that_of_the_tables() -> None:
    """Made again by: python -c "from chipload.jobs.reference import reference; print(reference(), end='')"."""
    page = Path(__file__).parents[2] / "docs" / "jobs.md"
    assert page.read_text("utf-8") == reference()
    for key in ("radial_depth_mm", "force_n", "low_mm", "units_if_unstated", "clearance_mm"):
        assert f"| `{key}` |" in reference()


def _rows_of_keys() -> list[tuple[str, str, str, str]]:
    """Kind of job, table, key and example of each row of the page of keys."""
    out, kind, table = [], "", ""
    for line in reference().splitlines():
        if line.startswith("Such a job has"):
            kind = line.split("`")[1].strip("[]")
        elif line.startswith("### "):
            table = line.strip("#` []")
        elif line.startswith("| `"):
            cells = line.split(" | ")
            out.append((kind, table, cells[0].strip("| `"), cells[3].strip("`")))
    return out


def test_the_example_of_a_key_is_a_value_that_it_takes() -> None:
    rows = _rows_of_keys()
    assert len(rows) > 300
    roots = {(c.key, bool(c.inner)): c.root for c in CAPABILITIES}
    for kind, table, key, example in rows:
        value = tomllib.loads(f"v = {example}")["v"]
        inner = {key.split(".")[-1]: value}
        for name in reversed(key.split(".")[:-1]):
            inner = {name: inner}
        # a table of an operation belongs to the kind of job that it makes
        table, _, part = table.partition(".")
        inner = {part: inner} if part else inner
        for raw in (inner,) if table == "Keys before the first table" else ({table: inner}, {table: [inner]}):
            try:
                roots[kind, bool(part)].model_validate(raw)
            except ValidationError as err:
                place = (table, *([part] if part else []), *key.split("."))
                wrong = [
                    e
                    for e in err.errors()
                    if e["type"] != "missing"
                    and tuple(x for x in e["loc"] if isinstance(x, str) and x in place) == place
                ]
                shaped = [e for e in err.errors() if e["loc"] == (table,) and e["type"] != "too_short"]
                if not wrong and not shaped:
                    break
        else:
            raise AssertionError((kind, table, key, example))
