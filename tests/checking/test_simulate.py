"""Programs simulated from plain Python values, as a notebook does."""

from __future__ import annotations

import math
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import trimesh

import chipload
from chipload import Limits, SimulationSettings, Stock
from chipload.cutter.cutter import Cutter
from chipload.cutting.material import material_named
from chipload.errors import InputError
from chipload.jobs import load_job, run_job
from chipload.machine.machine import machine_named
from chipload.program.build import plunge, rapid
from chipload.program.program import Program
from chipload.simulation.removal import Columns
from chipload.stock.layers import LayeredStock
from cli.test_simulate import JOB, SLOT

MILL = Cutter(10.0, 2, math.radians(30.0), 20.0, 30.0, 580e3)
TABLE = chipload.Cutter(
    number=1, diameter_mm=10.0, flutes=2, helix_deg=30.0, flute_length_mm=20.0, overhang_mm=30.0, modulus_gpa=580.0
)
SPEED = 100.0 * math.pi
#: 2 mm deep, 30 mm long, and half a disc at its end
VOLUME = 2.0 * (300.0 + 0.5 * math.pi * 25.0)
CORNERS = ((0.0, -15.0, -5.0), (50.0, 15.0, 0.0))
BLOCK = Stock.block(*CORNERS)


def slot(tool: int = 1) -> Program:
    down = [rapid([-10.0, 0.0, z], SPEED, tool, "link") for z in (5.0, -2.0)]
    cut = plunge([30.0, 0.0, -2.0], 10.0, SPEED, tool, "cut")
    return Program.join([*down, cut, rapid([30.0, 0.0, 5.0], SPEED, tool, "link")])


def simulated(**changed):
    given = {
        "program": slot(), "stock": BLOCK, "cutters": MILL, "material": "al7075-t6", "machine": "vmc",
        "limits": Limits(force_n=1000.0), "step_mm": 2.0,
    } | changed  # fmt: skip
    return chipload.simulate(**given)


@pytest.fixture(scope="module")
def history():
    return simulated()


def same(a: Columns, b: Columns) -> None:
    assert list(a) == list(b)
    for name in a:
        if name not in ("line", "pass"):
            np.testing.assert_array_equal(a[name], b[name], err_msg=name)


def test_it_is_what_a_job_gives(history, tmp_path: Path) -> None:
    (tmp_path / "slot.ngc").write_text(SLOT)
    (tmp_path / "job.toml").write_text(JOB.replace("layer_mm = 1.0\n", ""))
    read = run_job(load_job(tmp_path / "job.toml")).outcome
    from_job = chipload.History.of(read)
    same(history.columns, from_job.columns)
    from_file = simulated(program=tmp_path / "slot.ngc")
    same(from_file.columns, from_job.columns)
    np.testing.assert_array_equal(from_file["line"], from_job["line"])
    assert {5, 6, 7} <= set(from_file["line"].tolist())


def test_a_slot_in_numbers(history) -> None:
    said = history.numbers
    assert said["removed_mm3"] == pytest.approx(VOLUME, rel=1e-3)
    assert history.stock.volume() == pytest.approx(7500.0 - VOLUME, rel=1e-4)
    assert (history.verdict, history.findings) == ("holds", ())
    assert [x.name for x in history.limits] == [
        "force_n", "spindle_torque_nm", "spindle_power_w", "cutter_stress_mpa", "axial_overrun_mm", "deflection_share"
    ]  # fmt: skip
    assert history.message.startswith("Holds at 95 %: force ")
    assert len(history) == len(history["force_n"]) == said["steps"]
    assert history["force_n"].max() == said["force_n"]["max"] == history.limits[0].worst


def test_stocks_of_every_kind_lose_the_same(history) -> None:
    box = trimesh.creation.box(bounds=CORNERS)
    layers = LayeredStock.of_mesh(box, [-5.0, -4.0, -3.0, -2.0, -1.0, 0.0], 40.0)
    whole = layers.volume()
    for stock in (box, Stock(box, layer_mm=1.0), layers, Stock(layers)):
        found = simulated(stock=stock)
        assert found.numbers["removed_mm3"] == pytest.approx(history.numbers["removed_mm3"], rel=1e-6)
    assert layers.volume() == whole


def test_values_files_and_tables_are_alike(history, tmp_path: Path) -> None:
    trimesh.creation.box(bounds=CORNERS).export(tmp_path / "box.stl")
    vmc, al = machine_named("vmc"), material_named("al7075-t6")
    solid = Stock.read(tmp_path / "box.stl", units="mm", layer_mm=0.5)
    found = simulated(cutters=TABLE, material=al, machine=vmc, stock=solid)
    assert found.provenance.inputs["stock"].startswith("box.stl sha256 ")
    # borders of what was cut before are found to 1e-4 rad at a block's floor, exactly over the faces of a mesh
    np.testing.assert_allclose(found["force_n"], history["force_n"], rtol=1e-6)
    other = simulated(program=slot(7), cutters=[TABLE])
    np.testing.assert_array_equal(other["force_n"], history["force_n"])
    assert set(other["tool"].tolist()) == {7}
    one = simulated(program=slot(7))
    np.testing.assert_array_equal(one["force_n"], history["force_n"])


def test_a_part_and_a_fixture(tmp_path: Path) -> None:
    """The slot is 0.1 mm deeper than the part's, and ends 2.5 mm before a clamp that its cutter then touches."""
    floor = trimesh.creation.box(bounds=[[0.0, -15.0, -5.0], [50.0, 15.0, -1.9]])
    clamp = trimesh.creation.box(bounds=[[33.0, -15.0, -1.0], [50.0, 15.0, 30.0]])
    found = simulated(
        part=chipload.FinishedPart(floor, 1.0), fixtures=[chipload.Fixture(clamp, 1.0)],
        limits=Limits(gouge_mm=0.05, excess_mm=0.5),
    )  # fmt: skip
    said = found.numbers
    assert found.verdict == "exceeds"
    assert said["gouge_mm"]["max"] == pytest.approx(0.1, abs=1e-6)
    assert {(c["what"], c["into"]) for c in said["collisions"]} == {
        ("cutting part", "fixture 0"),
        ("shank or holder", "fixture 0"),
    }
    assert max(c["depth_mm"] for c in said["collisions"]) == pytest.approx(2.0, abs=0.01)


def test_limits_that_do_not_hold_and_deflections_that_are_not_proved() -> None:
    assert simulated(limits=Limits(force_n=10.0)).verdict == "exceeds"
    assert simulated(limits=Limits(deflection_um=100.0)).verdict == "unproven"
    rigid = dict.fromkeys(
        ("holder_gpa", "grip_n_um", "grip_nm_rad", "spindle_n_um", "spindle_nm_rad", "work_n_um"), math.inf
    )
    assert (
        simulated(limits=Limits(deflection_um=100.0), stiffness=chipload.MachineStiffness(**rigid)).verdict == "holds"
    )


def test_a_program_beyond_the_machine_fails(history) -> None:
    far = Program.join([slot(), rapid([1000.0, 0.0, 5.0], SPEED, 1, "away")])
    found = simulated(program=far)
    assert found.verdict == "exceeds"
    assert "X goes from -10 to 1000 mm, 1010 mm: machine vmc travels 800 mm" in found.message


def test_a_program_of_five_axes_is_read_for_its_machine(tmp_path: Path) -> None:
    """The tip and the axis of a text, given as a Program, come back to the same axes and the same chips."""
    lean, more = "0.336824089,0.059391175,0.939692621", "0.394654826,0.098398500,0.913545458"
    (tmp_path / "lean.cls").write_text(
        "PARTNO/LEAN\nUNITS/MM\nLOADTL/1\nSPINDL/6000,RPM,CLW\nMULTAX/ON\nRAPID\n"
        f"GOTO/0,0,30,{lean}\nFEDRAT/600,MMPM\nGOTO/0,0,-1.5,{lean}\nGOTO/4,0,-1.5,{more}\nRAPID\nGOTO/4,0,30,{more}\n"
        "FINI\n"
    )
    given = {
        "machine": "cradle-ac", "stock": Stock.block((-30.0, -30.0, -20.0), (30.0, 30.0, 0.0), 1.0), "step_mm": None,
        "settings": chipload.SimulationSettings(2.0, tolerance_mm=0.01),
    }  # fmt: skip
    text = simulated(program=tmp_path / "lean.cls", **given)
    again = simulated(program=text.program.reading.program, **given)
    same(text.columns, again.columns)
    assert text["chip_volume_mm3"].sum() > 10.0
    axes = text.program.reading.axes, again.program.reading.axes
    np.testing.assert_allclose(axes[1][-1], axes[0][-1], atol=1e-6)


def test_pictures_have_the_columns_and_their_limits(history) -> None:
    figure = history.plot("force_n", "torque_nm", "power_w", "chip_max_mm", "deflection_um", x="s_mm")
    assert [t.name for t in figure.data] == ["force_n", "torque_nm", "power_w", "chip_max_mm", "deflection_um"]
    assert [t.name for t in history.plot().data][:2] == ["force_n", "torque_mean_nm"]  # those of its limits
    assert figure.layout.shapes[0].y0 == 1000.0
    np.testing.assert_array_equal(figure.data[0].x, history["s_mm"])
    np.testing.assert_array_equal(figure.data[0].y, history["force_n"])
    weak = chipload.simulate(slot(), BLOCK, MILL, "al7075-t6", "vmc", Limits(force_n=150.0), step_mm=4.0)
    line, marks = weak.plot("force_n").data
    assert (np.asarray(marks.y) > 150.0).all()
    assert len(marks.y) == int((weak["force_n"] > 150.0).sum()) > 0
    assert (np.asarray(line.x) == weak["t_s"]).all()
    with pytest.raises(InputError, match="plot: column 'force': not known: the nearest is force_n"):
        history.plot("force")
    with pytest.raises(InputError, match="plot: x = 'time': must be one of t_s, s_mm"):
        history.plot(x="time")


def test_pandas_has_every_column(history) -> None:
    table = history.to_pandas()
    assert isinstance(table, pd.DataFrame)
    assert list(table.columns) == list(history.columns)
    assert table["chip_volume_mm3"].sum() == pytest.approx(VOLUME, rel=1e-3)
    assert table.loc[table["force_n"].idxmax(), "force_n"] == history["force_n"].max()


def test_a_notebook_shows_the_verdict_and_text_is_escaped(history) -> None:
    html = history._repr_html_()
    assert "color:#0b6b4f'>Holds at 95 %: force " in html
    assert "greatest force [N]" in html


def test_the_result_folder_is_that_of_a_run(history, tmp_path: Path) -> None:
    out = history.save(tmp_path / "r")
    assert {"summary.json", "history.parquet", "report.html", "scene.glb", "stock.npz"} <= {
        p.name for p in out.iterdir()
    }
    assert LayeredStock.load(out / "stock.npz").volume() == history.stock.volume()


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"machine": "vmx"}, "machine vmx: not known: the nearest is vmc"),
        ({"material": "al7075"}, "material al7075: not known: the nearest are al7075-carbide"),
        ({"limits": {"force_n": 3.0}}, "limits: dict: must be a Limits"),
        ({"stiffness": {"spindle_n_um": 3.0}}, "stiffness: dict: must be a MachineStiffness"),
        ({"stock": 3.0}, "stock: float: must be a Stock, a closed mesh or a layered stock"),
        ({"limits": Limits(gouge_mm=3.0)}, "limits.gouge_mm: needs the finished part: state [part] or leave it out"),
        ({"step_mm": -1.0}, "step_mm = -1: must be above 0"),
        ({"step_mm": math.nan}, "step_mm = nan: must be a finite number"),
        ({"settings": SimulationSettings(1.0)}, "step_mm = 2: stated with settings, which state it: leave one out"),
        ({"cutters": []}, "cutters: missing: give at least one"),
        ({"cutters": [MILL, MILL]}, "cutters: numbers 1, 1: give each cutter its own"),
        ({"cutters": [replace(MILL, number=3), replace(MILL, number=4)]}, "tool 1: no [[cutter]] has this number"),
        ({"cutters": [10.0]}, "cutters: float: give a chipload.Cutter"),
        ({"stock": Stock.block(CORNERS[1], CORNERS[0])}, "each side must be above 0"),
        ({"dialect": "fanuc"}, "dialect: applies to a program file: leave it out with a Program"),
        ({"program": Program.join([slot(1), slot(2)])}, "cutters: the program uses tools 1, 2: give a cutter for each"),
        ({"program": "nowhere.ngc"}, "nowhere.ngc: cannot be read"),
    ],
)
def test_what_is_wrong_is_said(changed, said) -> None:
    with pytest.raises(InputError) as caught:
        simulated(**changed)
    assert said in str(caught.value)


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: Limits(force_n=-3.0), "limits.force_n = -3: must be above 0"),
        (lambda: Limits(force_n=True), "limits.force_n = True: must be a number"),
        (lambda: Limits(stable_probability=1.0), "limits.stable_probability = 1: must be below 1"),
        (lambda: SimulationSettings(1.0, interpolation="arc"), "interpolation = 'arc': must be one of slerp, lerp"),
        (lambda: SimulationSettings(1.0, corner_slices=2.5), "corner_slices = 2.5: must be a whole number"),
        (lambda: chipload.MachineStiffness(spindle_n_um=0.0), "stiffness.spindle_n_um = 0: must be above 0"),
        (lambda: chipload.CheckSettings(deflection_of_feed=math.inf), "checks.deflection_of_feed = inf: must be a fin"),
        (lambda: Stock.block((0, 0), (1, 1, 1)), "stock.low_mm = (0.0, 0.0): must be three numbers"),
        (lambda: Stock(LayeredStock.block(*CORNERS, 1.0, 40.0), 1.0), "stock.layer_mm: leave it out"),
        (lambda: chipload.Mode(frequency_hz=0.0, direction="x"), "dynamics.mode.frequency_hz = 0: must be above 0"),
        (lambda: chipload.WorkpieceClamp(face="z"), "workpiece.clamp.face = 'z': must be one of x-, x+"),
    ],
)
def test_a_value_out_of_range_is_refused_when_it_is_made(make, text) -> None:
    with pytest.raises(InputError) as caught:
        make()
    assert text in str(caught.value)


def test_the_package_is_light_until_it_is_asked() -> None:
    code = (
        "import sys, chipload; assert not {'numpy', 'pydantic', 'plotly', 'pandas'} & set(sys.modules); "
        "chipload.simulate; assert 'numpy' in sys.modules and 'pandas' not in sys.modules; "
        "print(chipload.History.__name__)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "History\n"
    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        _ = chipload.nothing
