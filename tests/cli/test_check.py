"""`chipload check` refuses what `chipload run` refuses, with the same words, and reads every kind of file."""

from __future__ import annotations

import shutil
from dataclasses import replace
from importlib import resources
from pathlib import Path

import pytest
from typer.testing import CliRunner

from chipload import examples
from chipload.cli import app
from chipload.cutting.learned import LearnedRecord, LogEvidence
from chipload.cutting.material import material_text, read_material
from chipload.errors import InputError
from chipload.jobs import check_job, load_job, run_job
from chipload.jobs.inspection import inspect_file
from command import call

#: an example, what is changed in it, how both refuse it
REFUSED = [
    (
        "contour",
        ["operation.0.kind=pocket", 'operation.0.strategies=["pocket"]', "operation.0.use=pocket"],
        "open",
    ),
    ("contour", ["cutter.0.diameter_mm=24"], "does not reach the wall"),
    ("pocket", ["cutter.0.diameter_mm=60", "operation.0.radial_depth_mm=20"], "the cutter fits nowhere"),
    ("chips", ["cutter.0.number=0"], "tool 1: no [[cutter]] has this number"),
    ("chips", ["stiffness.holder_gpa=0.5"], "stiffness.holder_gpa = 0.5: must be from"),
    ("chips", ["operation.0.step_mm=1e-7"], "must be at most 50000000"),
    ("bracket", ["part.spacing_mm=1e-4"], "part: spacing_mm = 0.0001"),
    ("feeds", ["cutter.0.number=9"], "tool 1: no [[cutter]] has this number"),
    ("plate", ["wall.elements=[8, 2]", "wall.foot_mm=15"], "wall.elements = [8, 2]"),
    ("plate", ["operation.0.depth_max_mm=3", "wall.allowance_mm=[3, 3]", "operation.0.clearance_mm=4"], "depth"),
    ("tube", ["loop.acceleration_mm_s2=1e6"], "loop.acceleration_mm_s2 = 1e+06: must be at most"),
    ("tube", ["limits.torque_nm=0.05"], "the limit is 0.05 N m"),
    (
        "tube",
        ["torque_control.override.light_nm=2", "limits.torque_nm=1"],
        "torque_control.override.light_nm = 2: must be below",
    ),
    ("impeller", ["operation.0.table_deg=[1.5]"], "operation.0.table_deg: table angle 1.5 deg"),
    ("impeller", ["catalogue.name=wu2020"], "catalogue wu2020: not known"),
]


@pytest.mark.parametrize(("name", "sets", "part"), REFUSED, ids=[f"{n} {s[0]}" for n, s, _ in REFUSED])
def test_check_refuses_what_run_refuses(name: str, sets: list[str], part: str, tmp_path: Path) -> None:
    job = load_job(examples.copy_example(name, tmp_path / name) / "job.toml", sets)
    messages = []
    for act in (check_job, run_job):
        with pytest.raises(InputError) as caught:
            act(job)
        messages.append(str(caught.value))
    assert messages[0] == messages[1]
    assert part in messages[0]


FIT = """name = "x"
source = "test"
method = "instantaneous"
band_hz = {band}
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
feed = "Fx_n"
across = "Fy_n"
on = "work"
[[measurement]]
file = "cut.csv"
use = "fit"
feed_mm_min = 600.0
speed_rpm = 3000.0
"""


def a_fit(folder: Path, band: float) -> Path:
    rows = "".join(f"{k * 1e-4:.4f},{(k * 7) % 40},{(k * 11) % 40}\n" for k in range(6000))
    (folder / "cut.csv").write_text("t_s,Fx_n,Fy_n\n" + rows)
    path = folder / "fit.toml"
    path.write_text(FIT.format(band=band))
    return path


def test_a_fit_is_checked_as_it_is_run(tmp_path: Path) -> None:
    path = a_fit(tmp_path, 400.0)
    lines, holds = inspect_file(path) or ([], False)
    assert holds
    assert lines[0] == "fit.toml: valid: 1 measurements, method instantaneous"
    path = a_fit(tmp_path, 10.0)
    messages = []
    for act in (inspect_file, lambda p: run_job(load_job(p))):
        with pytest.raises(InputError) as caught:
            act(path)
        messages.append(str(caught.value))
    assert messages[0] == messages[1]
    assert messages[0].startswith("band_hz = 10: must be at least the spindle's 50 Hz")


@pytest.mark.parametrize(("key", "most"), [("feed_mm_min", "100000"), ("speed_rpm", r"1e\+06")])
def test_a_measurement_at_a_feed_that_no_machine_has_is_refused(tmp_path: Path, key: str, most: str) -> None:
    """A feed or a speed far beyond every machine."""
    with pytest.raises(InputError, match=rf"measurement\.0\.{key} = 1e\+09: must be at most {most}"):
        load_job(a_fit(tmp_path, 400.0), [f"measurement.0.{key}=1e9"])


@pytest.mark.parametrize(
    ("file", "said"),
    [
        ("contour/corner.dxf", "corner.dxf: 0 closed and 1 open contours; x 0 to 28, y 0 to 28 mm"),
        ("bracket/part.stl", "part.stl: a closed mesh of 36 triangles, 39300 mm3; x 0 to 60, y 0 to 40, z -20 to 0 mm"),
        ("hecc/cutters.toml", "cutters.toml: catalogue long-reach: 19 cutters, 4 to 25 mm"),
        ("plate/ti6al4v.toml", "ti6al4v.toml: material "),
        ("tube/controller.toml", "controller.toml: rules of a fuzzy controller: tube"),
    ],
)
def test_files_that_a_job_names_are_checked_alone(file: str, said: str) -> None:
    lines, holds = inspect_file(Path(examples.__file__).parent / file) or ([], False)
    assert holds
    assert any(line.startswith(said) for line in lines)


def test_a_folder_is_the_cell_that_its_files_state(tmp_path: Path) -> None:
    """A job and its material, what was learned of it, a spindle, modes, and a file that is refused."""
    shutil.copytree(Path(examples.__file__).parent / "feeds", tmp_path / "cell")
    folder = tmp_path / "cell"
    learned = replace(read_material(folder / "al7075-t6.toml"), name="shop", learned=LearnedRecord(
        "al7075-t6", (767.0, 0.25), (27.7, 0.25), (LogEvidence("monday.csv", "ab" * 32, (1, 900), 80, 2),)
    ))  # fmt: skip
    (folder / "shop.toml").write_text(material_text(learned))
    (folder / "spindle.toml").write_text(
        'input = "power"\nefficiency = 0.81\ntorque_constant_error_share = 0.04\nidle_w = [50.0, 0.1]\n'
        "idle_error_share = 0.1\n[range]\ntorque_nm = [0.5, 20.0]\nspeed_rpm = [2000, 8000]\n"
    )
    (folder / "modes.toml").write_text(
        '[[mode]]\ndirection = "x"\nfrequency_hz = 1200.0\ndamping_ratio = 0.03\nstiffness_n_um = 20.0\n'
    )
    (folder / "wrong.toml").write_text('name = "wrong"\nktc_mpa = 700.0\n')
    (folder / "walls.toml").write_text(
        'material = "shop.toml"\ncompliance_error = 0.1\n[cutter]\ndiameter_mm = 10.0\nflutes = 4\nhelix_deg = 30.0\n'
        "flute_length_mm = 22.0\noverhang_mm = 40.0\nmodulus_gpa = 580.0\n[[wall]]\nmilling = 'down'\n"
        "axial_depth_mm = 12.0\nradial_depth_mm = 2.0\nfeed_per_tooth_mm = 0.1\nnoise_um = 1.0\nplace_um = 5.0\n"
        "height_mm = [1.0, 6.0, 11.0]\nerror_um = [38.0, 22.0, 21.0]\n"
    )
    (folder / "columns.toml").write_text('sample_s = 0.1\n[power]\ncolumn = "P"\nunit = "kW"\n')
    code, out, err = call("check", folder)
    assert (code, err) == (3, "")
    lines = out.splitlines()
    for said in (
        "shop.toml: material shop: Ktc 767.01, ",
        "learned: Ktc 767 MPa +- 6 % (two standard deviations), 767 +- 50 % in al7075-t6; ",
        "spindle.toml: spindle identified by its power, efficiency 0.81 +- 4 %",
        "modes.toml: 1 mode of a hammer test, 1200 Hz",
        "walls.toml: 1 measured wall of shop with 3 values, for chipload learn-wall",
        "columns.toml: columns of a log: power P [kW], a row each 0.1 s; for --columns",
        "wrong.toml: refused: ",
        "job.toml: names al7075-t6, which was learned further: shop.toml (shop) knows it better",
    ):
        assert any(line.startswith(said) for line in lines), (said, lines)
    (tmp_path / "none").mkdir()
    assert call("check", tmp_path / "none")[0] == 2


def test_a_log_is_named_by_its_columns(tmp_path: Path) -> None:
    log = tmp_path / "monday.csv"
    log.write_text("time_s,power_w,line\n0,100,1\n1,,2\n2.5,200,3\n")
    code, out, _ = call("check", log)
    assert (code, out.splitlines()) == (0, [
        "finding: line 3: 1 rows are left out: a number is missing or above 1e+30 (log-row)",
        "monday.csv: a log of 2 samples over 2.5 s: power, line",
    ])  # fmt: skip
    log.write_text("hz,re,im\n1,2,3\n")
    code, _, err = call("check", log)
    assert code == 2
    assert "no column of time and of current, power or torque by a known name" in err


def test_a_program_is_checked_without_a_machine() -> None:
    """A plain one on the plain machine, one with rotary axes on the first machine that has them; both say so."""
    place = Path(examples.__file__).parent
    for file, machine in (("feeds/pocket.nc", "vmc"), ("trunnion/cone.cls", "xyzbc-trunnion")):
        done = CliRunner().invoke(app, ["check", str(place / file)])
        assert done.exit_code == 0
        assert done.output.startswith(f"no machine is stated: {machine} is assumed; ")


def test_a_simulation_is_estimated(tmp_path: Path) -> None:
    job = load_job(examples.copy_example("chips", tmp_path / "chips") / "job.toml", ["operation.0.step_mm=3"])
    lines, _ = check_job(job)
    steps = len(run_job(job).outcome.simulated.removal.columns["line"])
    assert lines[-1].startswith(f"estimate: {steps} steps, ")


def test_a_limit_of_the_engagement_that_the_wall_alone_exceeds(tmp_path: Path) -> None:
    """5 mm radius, 0.1 mm deep: cos = 0.98, 11.48 deg; 11 deg needs at most 5 (1 - cos 11 deg) = 0.0919 mm."""
    folder = examples.copy_example("contour", tmp_path / "contour")
    whole = CliRunner().invoke(app, ["check", str(folder / "job.toml")])
    assert whole.exit_code == 0
    assert "cannot be kept" not in whole.output
    done = CliRunner().invoke(app, ["check", str(folder / "job.toml"), "--set", "limits.engagement_deg=11"])
    assert done.exit_code == 3
    wanted = "limits.engagement_deg = 11 cannot be kept: operation 0 needs 11.48 deg along a straight wall"
    assert wanted in done.output
    assert "state a radial depth of at most 0.09186 mm" in done.output


def test_a_wall_that_does_not_carry_the_smallest_depth(tmp_path: Path) -> None:
    """The threshold is the limit over the compliance: a thousandth of the limit, a thousandth of the force."""
    folder = examples.copy_example("plate", tmp_path / "plate")
    words = ["check", str(folder / "job.toml"), "--set", "wall.elements=[6,6]"]
    whole = CliRunner().invoke(app, words)
    assert whole.exit_code == 0
    assert "cannot be kept" not in whole.output
    done = CliRunner().invoke(app, [*words, "--set", "limits.deflection_workpiece_um=0.05"])
    assert done.exit_code == 3
    assert "the limit cannot be kept at" in done.output


def test_check_lists_every_name_and_file_that_is_wrong(tmp_path: Path) -> None:
    """Where keys are wrong too, and where nothing else is; near names are proposed."""
    with resources.as_file(resources.files(examples) / "bracket") as source:
        shutil.copytree(source, tmp_path / "job")
    job = tmp_path / "job" / "job.toml"
    right = job.read_text()
    wrong = {
        '"vmc-fanuc"': ('"vcm-fanuc"', "machine vcm-fanuc: not known: the nearest is vmc-fanuc"),
        '"bracket.nc"': ('"brackt.nc"', "program.file = brackt.nc: no such file: did you mean bracket.nc?"),
        '"clamp.stl"': ('"clam.stl"', "fixture.0.file = clam.stl: no such file: did you mean clamp.stl?"),
        '"part.stl"': ('"zzz.stl"', "part.file = zzz.stl: no such file: is not in job"),
    }
    text = right
    for old, (new, _) in wrong.items():
        text = text.replace(old, new)
    for keys in (False, True):
        job.write_text(text.replace("spacing_mm", "spacng_mm") if keys else text)
        code, _, said = call("check", job)
        lines = said.splitlines()
        assert code == 2
        for _, expected in wrong.values():
            assert sum(line.startswith(f"chipload: job.toml: {expected}") for line in lines) == 1, expected
        assert len(lines) == len(wrong) + 2 * keys
    assert "job.toml: part.spacng_mm: unknown key; did you mean spacing_mm?" in said


def test_a_mistyped_file_word_or_name_is_named_as_such(tmp_path: Path) -> None:
    with resources.as_file(resources.files(examples) / "contour") as source:
        shutil.copytree(source, tmp_path / "job")
    job = tmp_path / "job" / "job.toml"
    for words, expected in (
        (
            ("run", job.with_name("jbo.toml"), "--out", tmp_path / "r"),
            "No such file or directory: did you mean job.toml?",
        ),
        (
            ("check", job, "--set", "operation.0.kind=contur"),
            "must be one of 'contour', 'forward', 'pocket': did you mean contour?",
        ),
        (("example", "contuor", tmp_path / "c"), "example contuor: not known; did you mean contour?"),
        (("example", "contuor"), "example contuor: not known; did you mean contour?"),
        (("machines", "tormach-400"), "the nearest is tormach-440"),
    ):
        code, _, said = call(*words)
        assert (code, expected in said) == (2, True), said
    code, _, said = call("chek", job)
    assert code == 2
    assert "No such command 'chek'. Did you mean 'check'" in said


def test_the_shell_completes_names() -> None:
    for line, names in (
        ("chipload example co", {"cone", "contour"}),
        ("chipload machines tormach-4", {"tormach-440"}),
        ("chipload materials al6082", {"al6082-t6"}),
        ("chipload check a.nc --control hei", {"heidenhain"}),
        ("chipload simulate a.nc --machine vmc-l", {"vmc-light"}),
    ):
        words = {"_CHIPLOAD_COMPLETE": "complete_bash", "COMP_WORDS": line, "COMP_CWORD": str(len(line.split()) - 1)}
        done = CliRunner().invoke(app, [], prog_name="chipload", env=words)
        assert set(done.output.split()) == names, line
