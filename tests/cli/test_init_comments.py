"""`chipload init`: tools, stock and material that the comments of NC text and CL data state."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest

from chipload.jobs.drafts.comments import read_header
from command import call
from fusion_text import FUSION


def test_comments_of_other_posts() -> None:
    """FeatureCAM's APT, Heidenhain and Sinumerik: numbers as they stand in the texts."""
    apt = "UNITS/MM\nINSERT/[HOLDER=C40] 14MM CRB 2FL 32 LOC\nCUTTER/14.,0,7.,0,0,0,84.\nLOAD/TOOL,17\n"
    apt += "CSI_SET_FLUTE_LENGTH/32.\nCSI_SET_EXTENSION_LENGTH/60.\nINSERT/Stock Size X135. Y130. Z30.\nGOTO/0,0,0\n"
    found = read_header(apt, apt=True)
    tool = {k: v for k, (v, _) in found.cutters[17].items()}
    assert tool["diameter_mm"] == 14.0
    assert (tool["flutes"], tool["modulus_gpa"], tool["flute_length_mm"], tool["overhang_mm"]) == (2, 580.0, 32.0, 60.0)
    assert found.stock is not None
    assert found.stock[0] == ((0.0, 0.0, -30.0), (135.0, 130.0, 0.0))
    conversational = ";3.0mm DRILL FLUTE LEN 16.0 FLUTE EXT 25.0\n26 TOOL DEF 114 L+1.000 R+0.000\n"
    drill = read_header(conversational).cutters[114]
    assert [drill[k][0] for k in ("diameter_mm", "flute_length_mm", "overhang_mm")] == [3.0, 16.0, 25.0]
    created = read_header("(stockMin:0.00mm, -1.5mm, -12.70mm)\n(stockMax:4in, 100.00mm, 0.00mm)\nG21")
    assert created.stock is not None
    assert created.stock[0] == ((0.0, -1.5, -12.7), (101.6, 100.0, 0.0))
    vectric = read_header("( Material Size)\n( X= 100.000, Y= 80.000, Z= 12.000)\nG21")
    assert vectric.stock is not None
    assert vectric.stock[0] == ((0.0, 0.0, -12.0), (100.0, 80.0, 0.0))
    siemens = read_header('WORKPIECE(,"",,"BOX",112,0,-20,-80,-5,-5,100,60)')
    assert siemens.stock is not None
    assert siemens.stock[0] == ((-5.0, -5.0, -20.0), (100.0, 60.0, 0.0))
    # high-speed steel is a tool's
    assert read_header("(T1 HSS STEEL END MILL)").material is None


@pytest.mark.parametrize(
    ("text", "mm", "low", "high"),
    [
        # size, then the zero from the lower corner
        ("(STOCK/BLOCK,90.00, 60.00, 8.00,0.00, 0.00, 8.00)", 1.0, (0, 0, -8), (90, 60, 0)),
        ("(STOCK/BLOCK,4., 2., 1., 2., 1., 1.)", 25.4, (-50.8, -25.4, -25.4), (50.8, 25.4, 0)),
        ("(STOCK 6061 DX 4.00IN DY 2.00IN DZ 1.00IN)", 1.0, (0, 0, -25.4), (101.6, 50.8, 0)),
        ("(STOCK 60 X 40 X 20)", 1.0, (0, 0, -20), (60, 40, 0)),
        ("(STOCK SIZE - 4.0 X 2.5 X .75)", 25.4, (0, 0, -19.05), (101.6, 63.5, 0)),
        ("; Rohteil: 100x80x22.5 mm", 1.0, (0, 0, -22.5), (100, 80, 0)),
        ('(MATERIAL 6061 - BLANK 4" X 2" X 1")', 1.0, (0, 0, -25.4), (101.6, 50.8, 0)),
        ("(STOCK LOWER X=-50. Y=-30. Z=-20.)\n(STOCK UPPER X=50. Y=30. Z=1.)", 1.0, (-50, -30, -20), (50, 30, 1)),
    ],
)
def test_blocks_of_comments(
    text: str, mm: float, low: tuple[float, float, float], high: tuple[float, float, float]
) -> None:
    found = read_header(text, mm=mm).stock
    assert found is not None
    assert found[0] == (pytest.approx(low), pytest.approx(high))


@pytest.mark.parametrize("text", ["(STOCK 6061 T6)", "(T1 BLANK 4 X 45)", "(STOCK TO LEAVE 0.5)", "(M6 X 1 X 20 BOLT)"])
def test_comments_that_state_no_block(text: str) -> None:
    assert read_header(text).stock is None


@pytest.mark.parametrize(("shift", "low"), [(0.0, [0.0, 0.0, -20.0]), (-30.0, [-30.0, -20.0, -20.0])])
def test_a_size_alone_lies_where_the_program_cuts(tmp_path: Path, shift: float, low: list[float]) -> None:
    """From its corner, or about its middle."""
    path = tmp_path / "part.nc"
    x, y = (np.array([5.0, 55.0]) + shift).tolist(), (np.array([5.0, 35.0]) + shift / 1.5).tolist()
    path.write_text(
        "%\nO00012\n(STOCK 60 X 40 X 20)\n(T1 D=10. CR=0. - ZMIN=-5. - FLAT END MILL)\nG90 G94 G17 G21\nT1 M6\n"
        "S3000 M3\n"
        f"G54 G0 X{x[0]:.3f} Y{y[0]:.3f}\nG43 Z10. H1\nG1 Z-5. F300.\nX{x[1]:.3f}\nY{y[1]:.3f}\nG0 Z10.\nM30\n%\n"
    )
    assert call("init", path, tmp_path / "job")[0] == 0
    stock = tomllib.loads((tmp_path / "job" / "job.toml").read_text())["stock"]
    assert stock["low_mm"] == pytest.approx(low)
    assert stock["high_mm"] == pytest.approx([low[0] + 60.0, low[1] + 40.0, 0.0])


def said_of(tools: str) -> dict[int, dict[str, object]]:
    """What comments state about each tool, but for its name and kind."""
    found = read_header(tools).cutters
    return {n: {k: v for k, (v, _) in own.items() if k not in ("name", "kind")} for n, own in found.items()}


@pytest.mark.parametrize(
    ("text", "stated"),
    [
        ("(TC: 5mm Endmill)\n(begin toolchange)\nM5\nM6 T1\nG43 H1", {1: {"diameter_mm": 5.0}}),
        ("N10 T7 M6 (BALL END MILL 6MM)", {7: {"diameter_mm": 6.0, "corner_radius_mm": 3.0}}),
        ('T2\n(1/4" ENDMILL)\nM6', {2: {"diameter_mm": 6.35}}),
        ("(DRILL 5.5 mm)\nG0 X1\nT3 M6", {}),
        ("N120T1M06\nN130 (End Mill {6 mm})\nN140G00Z20.000", {1: {"diameter_mm": 6.0}}),
        ("N120T1M06\nN130G00Z20.000\nN140 (End Mill {6 mm})", {}),
        ("(plate of 20 mm)\nT3 M6", {}),
        ("T1 M06 (3/8 4FL ENDMILL)", {1: {"diameter_mm": 9.525, "flutes": 4}}),
        ("(TOOL/MILL,3.17, 0.00, 0.00, 0.00)\nM6 T102", {102: {"diameter_mm": 3.17}}),
        ("( T5 | 6. DRILL | H5 | D5 )", {5: {"diameter_mm": 6.0}}),
        ("(T4 D=6. CR=0. TAPER=118deg - ZMIN=-12. - drill)", {4: {"diameter_mm": 6.0, "bottom_deg": 31.0}}),
    ],
)  # fmt: skip
def test_tools_of_other_posts(text: str, stated: dict[int, dict[str, object]]) -> None:
    """FreeCAD names a tool above its change, Mastercam in a table; a motion in between ends what a comment is about."""
    assert said_of(text) == {n: pytest.approx(own) for n, own in stated.items()}


@pytest.mark.parametrize(
    ("comment", "name"),
    [
        ("Output Time:2024-04-02 20:11:48", None),
        ("DATE=DD-MM-YY - 2024 TIME=HH:MM - 10:45", None),
        ("FEB 3 2024", None),
        ("SET VALUE 3", None),
        ("MATERIAL: 2024", "al2024-t3-from-group-22"),
        ("STOCK AL2024-T351", "al2024-t3-from-group-22"),
        ("7075 T6", "al7075-t6"),
        ("MATERIAL - STEEL MM - 1030 - 200 BHN", "group-2-steel"),
        ("AISI 1018", "steel-1018-from-group-1"),
        ("MATERIAL: STAINLESS 316L", "stainless-304-316l-from-group-14"),
        ("MATERIAL: STAINLESS", "group-14-stainless"),
        ("MATERIAL TI-6AL-4V", "titanium-6al4v-from-group-37"),
        ("STOCK: INCONEL 718", "nickel-718-from-group-34"),
        ("MATERIAL STEEL 4140 PREHARD", "steel-4140-from-group-7"),
        ("T1 HSS STEEL END MILL", None),
    ],
)  # fmt: skip
def test_the_material_of_a_comment(comment: str, name: str | None) -> None:
    """A year is no alloy."""
    found = read_header(f"({comment})").material
    assert (found and found[0]) == name


def test_a_material_that_is_not_shipped_is_named(program: Path, tmp_path: Path) -> None:
    program.write_text(FUSION.replace("STEEL 1045", ": DELRIN"))
    _, said, _ = call("init", program, tmp_path / "job")
    why = "no shipped material is like DELRIN; chipload materials lists all"
    assert f'question: [material]: which material is it? name = "al7075-t6": {why}' in said


def test_the_place_of_an_origin_is_no_material() -> None:
    assert read_header("(Z Origin for Material  = Material Surface)").unknown_material == ""
    assert read_header("(MATERIAL = DELRIN)").unknown_material == "DELRIN"


def test_a_machine_that_is_too_small_is_a_question(tmp_path: Path) -> None:
    text = "%\nO1\nG21 G90 G54\nT1 M6\nS3000 M3\nG0 X-50. Y0. Z10.\nG1 Z-2. F500.\nX2050. F1500.\nG0 Z50.\nM30\n%\n"
    (tmp_path / "plate.nc").write_text(text)
    _, said, _ = call("init", tmp_path / "plate.nc", tmp_path / "job")
    assert "too small: X goes from -50 to 2050 mm, 2100 mm; travel, speeds" in said


def test_a_drill_has_a_point_and_two_flutes(program: Path, tmp_path: Path) -> None:
    program.write_text(FUSION.replace("(T3 D=8. CR=0. - ZMIN=-2. - flat end mill)", "(T3 | 8. DRILL | H3 | D3)"))
    call("init", program, tmp_path / "job")
    (cutter,) = tomllib.loads((tmp_path / "job" / "job.toml").read_text())["cutter"]
    assert (cutter["diameter_mm"], cutter["bottom_deg"], cutter["flutes"]) == (8.0, 31.0, 2)
    assert cutter["name"] == "8. DRILL"


def test_a_text_without_a_change_of_tools(program: Path, tmp_path: Path) -> None:
    """T alone changes nothing: what cuts is tool 0, with the size of the only tool that the text names."""
    program.write_text("(TOOL 2: 1/2 FLAT)\n" + FUSION[FUSION.index("G21") :].replace("T3 M6", "T2"))
    call("init", program, tmp_path / "job")
    (cutter,) = tomllib.loads((tmp_path / "job" / "job.toml").read_text())["cutter"]
    assert (cutter["number"], cutter["diameter_mm"]) == (0, 12.7)
