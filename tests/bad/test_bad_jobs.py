"""Jobs that are refused, each with its whole message."""

from __future__ import annotations

from pathlib import Path

import pytest

from chipload.errors import InputError, InputErrors
from chipload.jobs import load_job

FEED = " (feed of the cutter's centre)"
BY_SET = {
    "operation.0.feed_mm_min=-4": f"operation.0.feed_mm_min = -4: must be above 0{FEED}",
    "operation.0.feed_mm_min=nan": f"operation.0.feed_mm_min = nan: must be a finite number{FEED}",
    "operation.0.feed_mm_min=-inf": f"operation.0.feed_mm_min = -inf: must be a finite number{FEED}",
    "operation.0.feed_mm_min=fast": f"operation.0.feed_mm_min = 'fast': must be a number{FEED}",
    "operation.0.feed_mm_min=true": f"operation.0.feed_mm_min = True: must be a number{FEED}",
    "operation.0.feed_mm_min=1e6": f"operation.0.feed_mm_min = 1e+06: must be at most 100000{FEED}",
    "cutter.0.diameter_mm=nan": "cutter.0.diameter_mm = nan: must be a finite number (diameter, from 0.01 to 1000)",
    "cutter.0.diameter_mm=-3": "cutter.0.diameter_mm = -3: must be above 0",
    "cutter.0.flutes=2.5": "cutter.0.flutes = 2.5: must be a whole number",
    "cutter.0.corner_radius_mm=8": "cutter.0.corner_radius_mm = 8: must be at most diameter_mm / 2 = 5",
    "stock.top_mm=inf": "stock.top_mm = inf: must be a finite number (z of the top of the stock)",
    "operation.0.side=up": "operation.0.side = 'up': must be one of 'inside', 'outside', 'left', 'right'",
    "operation.0.kind=front": "operation.0.kind = 'front': must be one of 'contour', 'forward', 'pocket'",
    "operation.0.radial_depth_mm=10": "operation.0.radial_depth_mm = 10: must be below the cutter's diameter_mm = 10: "
    "take several passes or a larger cutter",
    "operation.0.axial_depth_mm=23": "operation.0.axial_depth_mm = 23: must be at most the cutter's "
    "flute_length_mm = 22: take several depths or a longer cutter",
    "operation.0.cutter=7": "operation.0.cutter = 7: no [[cutter]] has this number: state one of 1",
    "operation.0.strategies=[]": "operation.0.strategies = []: must name at least one of plain, backward, feed",
    'operation.0.strategies=["backward", "backward"]': "operation.0.strategies = ['backward', 'backward']: a strategy "
    "is listed twice: list each once",
    'operation.0.strategies=["feed"]': "operation.0.use = 'backward': must be one of operation.0.strategies = feed",
    "operation.0.strategies=feed": "operation.0.strategies = 'feed': must be a list, as ['feed']",
    "operation=[]": "operation: has no entry: state at least one [[operation]]",
    "stock=3": "stock = 3: must be a table, [stock]",
    "part.file=": "part.file = '': must not be empty",
    "part.units=inches": "part.units = 'inches': must be one of 'um', 'mm', 'cm', 'm', 'inch', 'foot': did you mean "
    "inch?",
    "limits.engagement_deg=0": "limits.engagement_deg = 0: must be above 0 (greatest engagement angle)",
    "operation.0.feed_mm_min=1"
    + "0" * 400: "operation.0.feed_mm_min: a number is too large: a whole number must be within 9223372036854775807",
}

#: a wrong `--set` says so itself
WRONG_SET = {
    "cutter.0.diametr_mm=12": "cutter.0.diametr_mm: unknown key; did you mean diameter_mm?",
    "cutter.0.diameter_inch=0.5": "cutter.0.diameter_inch: unknown key; did you mean diameter_mm?",
    "operation.0.feed_mm_s=10": "operation.0.feed_mm_s: unknown key; did you mean feed_mm_min?",
    "operation.0.speed_hz=50": "operation.0.speed_hz: unknown key; did you mean speed_rpm?",
    "cuter.0.diameter_mm=12": "cuter: unknown key; did you mean cutter?",
    "cutter.1.diameter_mm=12": "cutter.1: cutter has 1 entry: count from 0 to 0",
    "cutter.first.diameter_mm=12": "cutter.first: cutter has 1 entry: count from 0 to 0",
    "part.file.name=a": "part.file is a value, not a table: it has no key name",
    "nothing": "must be key.path=value, as cutter.0.diameter_mm=12",
    ".a=1": "must be key.path=value, as cutter.0.diameter_mm=12",
}

#: lines of the example, what they become, what is said
IN_FILE = [
    ("diameter_mm = 10.0", "diametr_mm = 10.0", "cutter.0.diametr_mm: unknown key; did you mean diameter_mm?"),
    ("feed_mm_min = 600.0", "", f"operation.0.feed_mm_min: missing: state it{FEED}"),
    ("feed_mm_min = 600.0", "feed_mm_s = 10.0", "operation.0.feed_mm_s: unknown key; did you mean feed_mm_min?"),
    ("top_mm = 0.0", "", "stock.top_mm: missing: state it (z of the top of the stock)"),
    ("[stock]", "[stok]", "stok: unknown key; did you mean stock?"),
    ('use = "backward"', "", "operation.0.use: missing: state which of plain, backward, feed is released"),
    ("lead_mm = 3.0", "", "operation.0.lead_mm: missing: state it (kind = contour needs it)"),
    ('name = "vmc"', "", "machine: none is stated: state either machine.name or machine.file"),
    ('name = "vmc"', 'name = "vmc"\nfile = "a.toml"', "machine: both are stated: state either machine.name or "
     "machine.file"),
    ("number = 1", "number = 1\nside_radius_mm = 60.0", "cutter.0.side_radius_mm: the radius of the flank arc of "
     "a barrel cutter is barrel_radius_mm: state that"),
    ("number = 1", "", "cutter.0.number is missing: state it; dimensions of a cutter are never guessed"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "message"), BY_SET.items(), ids=[k[:40] for k in BY_SET])
def test_a_wrong_value_is_named(job_dir: Path, text: str, message: str) -> None:
    with pytest.raises(InputError) as caught:
        load_job(job_dir / "job.toml", [text])
    assert str(caught.value) == f"job.toml: {message}"


@pytest.mark.parametrize(("text", "message"), WRONG_SET.items(), ids=list(WRONG_SET))
def test_a_wrong_set_is_named(job_dir: Path, text: str, message: str) -> None:
    with pytest.raises(InputError) as caught:
        load_job(job_dir / "job.toml", [text])
    assert str(caught.value) == f"--set {text}: {message}"


@pytest.mark.parametrize(("line", "instead", "message"), IN_FILE, ids=[x[2][:40] for x in IN_FILE])
def test_a_wrong_line_is_named(job_dir: Path, line: str, instead: str, message: str) -> None:
    path = job_dir / "job.toml"
    text = path.read_text()
    assert line in text
    path.write_text(text.replace(line, instead, 1))
    with pytest.raises(InputError) as caught:
        load_job(path)
    assert str(caught.value) == f"job.toml: {message}"


def test_all_errors_are_listed(job_dir: Path) -> None:
    with pytest.raises(InputErrors) as caught:
        load_job(job_dir / "job.toml", ["operation.0.feed_mm_min=-4", "operation.0.side=up", "part.join_mm=-1"])
    assert set(str(caught.value).splitlines()) == {
        f"job.toml: operation.0.feed_mm_min = -4: must be above 0{FEED}",
        "job.toml: operation.0.side = 'up': must be one of 'inside', 'outside', 'left', 'right'",
        "job.toml: part.join_mm = -1: must be at least 0 (gaps up to this width are closed and reported)",
    }


def test_errors_of_keys_tables_and_cutters_are_listed_together(job_dir: Path) -> None:
    """A wrong value does not hide what a kind needs, a source that is not named, or a cutter without numbers."""
    path = job_dir / "job.toml"
    gone = ("lead_mm = ", "tolerance_mm = ", 'name = "vmc"', "flutes = ", "overhang_mm = ", "top_mm = ")
    lines = path.read_text().splitlines()
    assert all(sum(line.startswith(x) for line in lines) == 1 for x in gone)
    path.write_text("\n".join(line for line in lines if not line.startswith(gone)))
    with pytest.raises(InputErrors) as caught:
        load_job(path, ["limits.torque_nm=-1"])
    assert set(str(caught.value).splitlines()) == {
        "job.toml: limits.torque_nm = -1: must be above 0 (greatest torque on the cutter)",
        "job.toml: stock.top_mm: missing: state it (z of the top of the stock)",
        "job.toml: operation.0.lead_mm: missing: state it (kind = contour needs it)",
        "job.toml: operation.0.tolerance_mm: missing: state it (kind = contour needs it)",
        "job.toml: machine: none is stated: state either machine.name or machine.file",
        "job.toml: cutter.0.flutes is missing: state it; dimensions of a cutter are never guessed",
        "job.toml: cutter.0.overhang_mm is missing: state it; dimensions of a cutter are never guessed",
    }


def test_a_misspelt_key_hides_only_what_it_leaves_missing(job_dir: Path) -> None:
    path = job_dir / "job.toml"
    path.write_text(path.read_text().replace("lead_mm = ", "leed_mm = ").replace('name = "vmc"', 'nam = "vmc"'))
    with pytest.raises(InputErrors) as caught:
        load_job(path, ["limits.torque_nm=-1"])
    assert sorted(str(caught.value).splitlines()) == [
        "job.toml: limits.torque_nm = -1: must be above 0 (greatest torque on the cutter)",
        "job.toml: machine.nam: unknown key; did you mean name?",
        "job.toml: operation.0.leed_mm: unknown key; did you mean lead_mm?",
    ]


def test_contradictions_are_listed_together(job_dir: Path) -> None:
    with pytest.raises(InputErrors) as caught:
        load_job(job_dir / "job.toml", ["operation.0.radial_depth_mm=10", "operation.0.axial_depth_mm=23"])
    assert [line.split(":")[1].split()[0] for line in str(caught.value).splitlines()] == [
        "operation.0.radial_depth_mm",
        "operation.0.axial_depth_mm",
    ]


def test_a_job_without_limits_is_refused(job_dir: Path) -> None:
    path = job_dir / "job.toml"
    path.write_text(path.read_text().split("[limits]")[0])
    with pytest.raises(InputError) as caught:
        load_job(path)
    assert str(caught.value) == (
        "job.toml: limits: none is stated, so nothing would be checked: state at least one of engagement_deg, "
        "force_xy_n, torque_nm, form_error_um"
    )


def test_two_cutters_of_one_number_are_refused(job_dir: Path) -> None:
    path = job_dir / "job.toml"
    text = path.read_text()
    block = text[text.index("[[cutter]]") : text.index("[[operation]]")]
    path.write_text(text.replace("[[operation]]", block + "[[operation]]"))
    with pytest.raises(InputError) as caught:
        load_job(path)
    assert str(caught.value) == "job.toml: cutter.1.number = 1: is taken by another cutter: give each its own"


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"[part\n", "not a TOML file: Expected ']' at the end of a table declaration (at line 1, column 6)"),
        (b"\xff\xfe\x00", "not a TOML file: 'utf-8' codec can't decode byte 0xff in position 0: invalid start byte"),
        (
            b"",
            "part: missing: state it\njob.toml: stock: missing: state it\njob.toml: machine: missing: state it\n"
            "job.toml: material: missing: state it\njob.toml: cutter: missing: state it\n"
            "job.toml: operation: missing: state it",
        ),
    ],
)
def test_what_is_no_job_is_refused(tmp_path: Path, data: bytes, message: str) -> None:
    path = tmp_path / "job.toml"
    path.write_bytes(data)
    with pytest.raises(InputError) as caught:
        load_job(path)
    assert str(caught.value) == f"job.toml: {message}"


def test_a_job_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        load_job(tmp_path / "job.toml")
    assert str(caught.value) == f"{tmp_path / 'job.toml'}: cannot be read: No such file or directory"


def test_deep_nesting_is_refused_and_not_a_fault(tmp_path: Path) -> None:
    path = tmp_path / "job.toml"
    path.write_text("a = " + "[" * 20_000)
    with pytest.raises(InputError):
        load_job(path)
