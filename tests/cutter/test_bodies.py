"""Tools that are bodies: profiles of revolution by other formulas than the code's, and files that state them."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from chipload.cutter.bodies import apt_body, dovetail, one_thread, saw, tap_core
from chipload.cutter.cutter import Cutter
from chipload.cutter.fctb import read_fctb
from chipload.cutter.fusion import read_fusion_tool
from chipload.cutter.table import cutter_from_table
from chipload.errors import InputError
from chipload.jobs.drafts.comments import read_header
from chipload.program.apt.writer import cutter_statement
from chipload.simulation.clearance.body import cutting_part

FLAT = {"number": 1, "overhang_mm": 40.0}


def bit(folder: Path, shape: str, **parameter: str) -> Path:
    path = folder / f"{shape}.fctb"
    path.write_text(json.dumps({"shape": f"{shape}.fcstd", "name": shape, "parameter": parameter}))
    return path


def test_a_barrel_of_apt_is_its_arc() -> None:
    """Points of the circle (rho + 15)^2 + (z - 10)^2 = 20^2, then a cylinder of 10 mm."""
    points = np.array(apt_body((10.0, 20.0, -15.0, 10.0, 0.0, 0.0, 16.0)))
    on_arc = points[points[:, 1] <= 10.0]
    np.testing.assert_allclose((on_arc[:, 0] + 15.0) ** 2 + (on_arc[:, 1] - 10.0) ** 2, 400.0, rtol=1e-12)
    assert points[-1].tolist() == [5.0, 16.0]
    assert (np.diff(points[:, 1]) > 0.0).all()


def test_an_ordinary_bull_nose_has_the_profile_of_the_cutter() -> None:
    """Where the corner does touch bottom and flank, the body is that of the cutter's own formulas."""
    cutter = Cutter(12.0, 2, 0.0, 20.0, 30.0, 2.1e5, corner_radius=2.0, bottom=math.radians(5), taper=math.radians(8))
    points = np.array(apt_body(cutter.apt))
    np.testing.assert_allclose(points[:, 0], cutter.radius_at(points[:, 1]), atol=1e-9)


def test_a_barrel_in_cl_data_is_drafted_as_a_cutter_and_written_as_it_was() -> None:
    text = "UNITS/MM\nCUTTER/10,20,-15,10,0,0,16\nLOADTL/3\nGOTO/0,0,0\nFINI"
    own = read_header(text, apt=True).cutters[3]
    assert {key: value for key, (value, _) in own.items()} == {
        "diameter_mm": 10.0, "barrel_radius_mm": 20.0, "corner_e_mm": 2.320508
    }  # fmt: skip
    cutter = Cutter(10.0, 2, 0.5, 16.0, 40.0, 6e5, corner_e=2.320508, barrel_radius=20.0)
    body = np.array(apt_body((10.0, 20.0, -15.0, 10.0, 0.0, 0.0, 16.0)))
    np.testing.assert_allclose(body[1:, 0], cutter.radius_at(body[1:, 1]), atol=1e-6)
    assert cutter_statement(cutter) == "CUTTER/10,20,-15,10,0,0,16"
    lens = read_header("UNITS/MM\nCUTTER/10,20,-19,20,0,0,16\nLOADTL/3\nGOTO/0,0,0\nFINI", apt=True).cutters[3]
    assert set(lens) == {"body_mm"}
    plain = read_header("UNITS/MM\nCUTTER/10,1\nLOADTL/3\nGOTO/0,0,0\nFINI", apt=True).cutters[3]
    assert "body_mm" not in plain


def test_the_body_of_a_cutter_is_its_profile() -> None:
    """Distances of points from a stepped cylinder: 8 mm wide up to 5 mm, 3 mm wide up to 20 mm."""
    steps = [[4.0, 0.0], [4.0, 5.0], [1.5, 5.0], [1.5, 20.0]]
    cutter = cutter_from_table({**FLAT, "body_mm": steps})
    assert (cutter.diameter, cutter.flute_length, cutter.overhang) == (8.0, 20.0, 40.0)
    body = cutting_part(cutter)
    found = [body.distance(*p) for p in ((6.0, 2.0), (3.0, 2.0), (3.0, 10.0), (0.5, 10.0), (0.0, -1.0))]
    assert found == pytest.approx([2.0, -1.0, 1.5, -1.0, 1.0])


def test_a_tap_is_the_cylinder_of_the_minor_diameter(tmp_path: Path) -> None:
    """M8 x 1.25: D1 = 6.647 mm, table of ISO 724."""
    assert 2.0 * tap_core(8.0, 1.25, 20.0)[0][0] == pytest.approx(6.647, abs=5e-4)
    found = read_fctb(bit(tmp_path, "tap", Diameter="8 mm", Pitch="1,25 mm", CuttingEdgeLength="20 mm"))
    assert found["diameter_mm"] == pytest.approx(6.647, abs=5e-4)
    geometry = {"DC": 8, "LCF": 20, "LB": 40, "TP": 1.25}
    library = [{"type": "tap right hand", "unit": "millimeters", "geometry": geometry, "post-process": {"number": 2}}]
    (tmp_path / "a.json").write_text(json.dumps({"data": library}))
    own = cutter_from_table({"number": 2, "file": "a.json", "tool": 2}, tmp_path)
    assert own.diameter == pytest.approx(6.647, abs=5e-4)
    assert own.body


def test_bodies_of_freecad(tmp_path: Path) -> None:
    thread = read_fctb(
        bit(tmp_path, "threadmill", Diameter="5 mm", NeckDiameter="3 mm", NeckLength="20 mm", Crest="0,1 mm",
            cuttingAngle="60,0 \u00b0", Flutes="0")
    )  # fmt: skip
    assert thread["body_mm"] == one_thread(5.0, 3.0, 0.1, math.radians(60.0), 20.0)
    # a tooth 1 mm high at 30 deg a side is 2 tan 30 + 0.1 mm high
    assert thread["body_mm"][3][1] == pytest.approx(2.0 / math.sqrt(3.0) + 0.1)
    cone = read_fctb(
        bit(tmp_path, "dovetail", Diameter="20 mm", NeckDiameter="6 mm", NeckLength="15 mm", DovetailHeight="5 mm",
            CuttingAngle="45 deg")
    )  # fmt: skip
    assert cone["body_mm"] == dovetail(20.0, 6.0, 5.0, math.radians(45.0), 15.0)
    assert cone["body_mm"][1] == pytest.approx((5.0, 5.0))
    sizes = {"Diameter": "60 mm", "BladeThickness": "2 mm", "CapDiameter": "8 mm", "CapHeight": "3 mm"}
    assert read_fctb(bit(tmp_path, "slittingsaw", **sizes))["body_mm"] == saw(60.0, 2.0, (8.0, 3.0))
    v = read_fctb(bit(tmp_path, "vbit", Diameter="10 mm", TipDiameter="1 mm", CuttingEdgeAngle="90 \u00b0"))
    assert (v["taper_deg"], v["shank_diameter_mm"], v["diameter_mm"]) == (45.0, 10.0, 1.0)
    assert v["flute_length_mm"] == pytest.approx(4.5)
    with pytest.raises(InputError, match="shape slittingsaw: BladeThickness: must be given and above 0"):
        read_fctb(bit(tmp_path, "slittingsaw", Diameter="60 mm"))


def test_a_t_slot_cutter_of_fusion_has_a_neck(tmp_path: Path) -> None:
    geometry = {"DC": 20, "LCF": 6, "LB": 40, "SFDM": 16, "shoulder-diameter": 9, "NOF": 6, "HA": 10}
    one = {"type": "slot mill", "unit": "millimeters", "geometry": geometry, "post-process": {"number": 1}}
    (tmp_path / "a.json").write_text(json.dumps({"data": [one]}))
    own = read_fusion_tool(tmp_path / "a.json", 1)
    assert (own["diameter_mm"], own["flute_length_mm"], own["shank_diameter_mm"]) == (20, 6, 9)
    assert "body_mm" not in own


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"body_mm": [[4.0, 2.0]]}, "body_mm: 1 points: must be at least 2"),
        ({"body_mm": [[4.0, 1.0], [4.0, 5.0]]}, "must begin with 0, the tip, and not go down"),
        ({"body_mm": [[4.0, 0.0], [4.0, 5.0], [3.0, 4.0]]}, "must begin with 0, the tip, and not go down"),
        ({"body_mm": [[-4.0, 0.0], [4.0, 5.0]]}, "radii: must be at least 0"),
        (
            {"body_mm": [[4.0, 0.0], [4.0, 5.0]], "flute_length_mm": 6.0},
            "flute_length_mm = 6: must be 5",
        ),
        ({"body_mm": [[4.0, 0.0], [4.0, 5.0]], "diameter_mm": 6.0}, "diameter_mm = 6: must be 8, as of body_mm"),
    ],
)
def test_what_is_no_body(table: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        cutter_from_table({**FLAT, **table})
