"""Tools by the comments of posts: kind and numbers. Oracle: comments read by a person; tables of ASME and ISO."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from chipload.jobs.drafts.comments import read_header
from chipload.jobs.drafts.cutters import cutter_table
from chipload.program.tool_sizes import drill_size, thread_size
from command import call

IN = 25.4
#: text, unit, kind, and the keys that it states besides name and modulus
POSTS = [
    # Fusion 360 and HSMWorks: Haas, Fanuc, Sinumerik, Heidenhain, GRBL
    ("(T1 D=10. CR=0.5 - ZMIN=-5. - BULLNOSE END MILL)", 1.0, "bull nose", {"d": 10.0, "r": 0.5}),
    ("(T4 D=4.2 CR=0. TAPER=118DEG - ZMIN=-17.2 - DRILL)", 1.0, "drill", {"d": 4.2, "bottom": 31.0}),
    ("(T5 D=0.25 CR=0. - ZMIN=-0.6 - RIGHT HAND TAP)", IN, "tap", {"d": 6.35}),
    ("(T9 D=10. CR=0. TAPER=45DEG - ZMIN=-1. - CHAMFER MILL)", 1.0, "chamfer mill", {"d": 10.0, "bottom": 45.0}),
    ("(T9 D=6. CR=0. TAPER=90DEG - ZMIN=-1. - COUNTER SINK)", 1.0, "countersink", {"d": 6.0, "bottom": 45.0}),
    ("(T1 D=2. CR=0. - ZMIN=0. - FACE MILL)", IN, "face mill", {"d": 50.8}),
    ("(T12 D=8. CR=4. - ZMIN=-3. - BALL END MILL)", 1.0, "ball nose", {"d": 8.0, "r": 4.0}),
    ("; T2 D=8 CR=0 - ZMIN=-24 - flat end mill", 1.0, "end mill", {"d": 8.0}),
    (";  #7 D=6 TAPER=118deg - ZMIN=-9 - ZMAX=+12 - drill", 1.0, "drill", {"d": 6.0, "bottom": 31.0}),
    ("( Tool 2: Flat End Mill 2 Flutes, Diam = 4mm, Len = 12.00mm)", 1.0, "end mill", {"d": 4.0, "flutes": 2}),
    # Mastercam, new and old
    ("(T4|3/8 FLAT ENDMILL|H4|D4|WEAR COMP|TOOL DIA. - .375)", IN, "end mill", {"d": 9.525}),
    ("(TOOL - 4 DIA. OFF. - 5 LEN. - 6 DIA. - .375)", IN, None, {"d": 9.525}),
    ("(T7 | NO. 7 DRILL | H7 )", IN, "drill", {"d": 5.1054}),
    ("(T8 | 1/4-20 TAPRH | H8 )", IN, "tap", {"d": 6.35, "pitch": 1.27}),
    ("(T3 | 3/8 BULL ENDMILL 0.0625 RAD | H3)", IN, "bull nose", {"d": 9.525, "r": 1.5875}),
    ("(T6 | 1/4 SPOTDRILL | H6 )", IN, "spot drill", {"d": 6.35}),
    ("(T2 | 1/2 CHAMFER MILL | H2)", IN, "chamfer mill", {"d": 12.7}),
    # SolidWorks CAM, CAMWorks
    ("T1 M6 (DIA-0.3750 3/8 ENDMILL)", IN, "end mill", {"d": 9.525}),
    ("T1 M6 (3/8 EM CRB 4FL 1.25 LOC)", IN, "end mill", {"d": 9.525, "flutes": 4, "flute": 31.75}),
    ("(T05  1/2 X 90DEG  CRB SPOT DRILL)", IN, "spot drill", {"d": 12.7, "bottom": 45.0}),
    ("T5 M6 (#7 (0.201) JOBBER DRILL)", IN, "drill", {"d": 5.1054}),
    ('T1 M6 (2.5" SHOULDER TYPE FACE MILL)', 1.0, "face mill", {"d": 63.5}),
    ("T7 M6 (M8X1.25 TAP)", 1.0, "tap", {"d": 8.0, "pitch": 1.25}),
    # FeatureCAM, Esprit, NX, hyperMILL, BobCAD, Edgecam
    ("(TOOL #3 - 0.2500 DIA ENDMILL)", IN, "end mill", {"d": 6.35}),
    ("(TOOL 5 : EM 0.5 R.03)", IN, "end mill", {"d": 12.7, "r": 0.762}),
    ("(TOOL NAME : EM12R1)\nT1 M6", 1.0, "end mill", {"d": 12.0, "r": 1.0}),
    ("(TOOL NAME : D16R0.8)\nT1 M6", 1.0, None, {"d": 16.0, "r": 0.8}),
    ("; T12 | NAME / DM=8 CR=0.5 TL=142", 1.0, None, {"d": 8.0, "r": 0.5}),
    ("(TOOL #1 0.5  1/2 FLAT ROUGH - STANDARD)", IN, "end mill", {"d": 12.7}),
    ("(TOOL NO. 1 - 10MM SLOT DRILL)", 1.0, "end mill", {"d": 10.0}),
    # Vectric, FreeCAD, Carbide, PathPilot
    ("N120T1M06\n( V-Bit {90 deg 32mm})", 1.0, "chamfer mill", {"d": 32.0, "bottom": 45.0}),
    ('(T1= End Mill {0.25"})', 1.0, "end mill", {"d": 6.35}),
    ("(TC: 5mm Drill)\nM6 T2", 1.0, "drill", {"d": 5.0}),
    ("(TOOL/MILL,6.35, 0.50, 0.00, 0.00)\nT2 M6", 1.0, "end mill", {"d": 6.35, "r": 0.5}),
    ("(TOOL/DRILL,5., 118., 40.)\nT2 M6", 1.0, "drill", {"d": 5.0, "bottom": 31.0}),
    ("( T5 : .250 DIA 4 FLUTE ENDMILL )", IN, "end mill", {"d": 6.35, "flutes": 4}),
    ("(Tool Number = 3)\n(Tool Diameter = 0.2500)\n(Tool Description: 1/4 Drill)\nT3 M6", IN, "drill", {"d": 6.35}),
    # by hand
    ('(T7 = 1/4" DRILL)', 1.0, "drill", {"d": 6.35}),
    ("(T22 .238 B DRILL)", IN, "drill", {"d": 6.0452}),
    ("(T1 .5 ENDMILL)", IN, "end mill", {"d": 12.7}),
    ("(T3 R3 BALL NOSE D6)", 1.0, "ball nose", {"d": 6.0, "r": 3.0}),
    ("(T6 1/2 REAMER)", IN, "reamer", {"d": 12.7}),
    ("(T9 PROBE)", 1.0, "probe", {}),
    ("(T4 1-1/2 SHELL MILL 5 FLUTE)", IN, "face mill", {"d": 38.1, "flutes": 5}),
    ("(T3 8.5 DRILL 135DEG)", 1.0, "drill", {"d": 8.5, "bottom": 22.5}),
    ("(T3 M6 TAP DRILL 5.0)", 1.0, "drill", {"d": 5.0}),
    ('T="DRILL_8.5"', 1.0, "drill", {"guess": 8.5}),
    ("(T2 - #4 CTR DRILL)", IN, "spot drill", {"d": 7.9375}),
    ("(TOOL -2- DRILL DIA 8.5 DEG 118. )", 1.0, "drill", {"d": 8.5, "bottom": 31.0}),
    # above a retraction and the change; CAMWorks names its operations below it
    ("(3/8 EM CRB 4FL)\nG91 G28 X0 Y0 Z0\nT14 M06\n( Contour Mill1 )", IN, "end mill", {"d": 9.525, "flutes": 4}),
    # PowerMill, hyperMILL: on the line of TOOL CALL, above and below it
    ("; TOOL : 10mm Ballnosed, D=10.0 R=5.0\nTOOL CALL 3 Z S800\n; FINISH", 1.0, "ball nose", {"d": 10.0, "r": 5.0}),
    ("TOOL CALL 12 Z S4500 F900 ; SCHAFTFRAESER D12 R0.5 Z4", 1.0, "end mill", {"d": 12.0, "r": 0.5, "flutes": 4}),
    # a text that never changes its tool: Vectric, Estlcam, by hand on GRBL
    ('T1\nG21\n(Tool: V-Bit {90 deg 0.5"})\nG0X25.', 1.0, "chamfer mill", {"d": 12.7, "bottom": 45.0}),
    ("(Required tools:)\n(End mill 3mm)\nG21", 1.0, "end mill", {"d": 3.0}),
    ('; 1/8" flat end mill\nG21 ; mm', 1.0, "end mill", {"d": 3.175}),
    # a text by hand with one tool, in words, by a variable, and by the settings of a CAM program
    ("( the Cutter is assumed to be a 10mm ball nose )\n#<t> = 2\nT#<t> M6", 1.0, "ball nose", {"d": 10.0, "r": 5.0}),
    ('(tool 4 is 1" in diameter and must be in the tool table)\nT4 M6', 1.0, None, {"d": 25.4}),
    (";torus_radius = 0.25\n;tool_radius = 0.79375\nT1 M6", 1.0, None, {"d": 1.5875}),
    ("(T2 DRILL 8.5 DIA HOLES)", 1.0, "drill", {"d": 8.5}),
    # Brother
    ("(T3 D=6 CR=0 - RIGHT HAND TAP)\nG100 T3 X10. Y10. G43 Z30. H3", 1.0, "tap", {"d": 6.0}),
]  # fmt: skip
KEYS = {
    "d": "diameter_mm", "r": "corner_radius_mm", "bottom": "bottom_deg", "flutes": "flutes", "flute": "flute_length_mm",
    "pitch": "thread_pitch_mm", "guess": "number_mm",
}  # fmt: skip


@pytest.mark.parametrize(("text", "mm", "kind", "stated"), POSTS, ids=[text.split("\n")[0] for text, *_ in POSTS])
def test_a_comment_of_a_post(text: str, mm: float, kind: str | None, stated: dict[str, float]) -> None:
    (tool,) = read_header(text, mm=mm).cutters.values()
    assert (tool["kind"][0].value if "kind" in tool else None) == kind
    numbers = {key: tool[long][0] for key, long in KEYS.items() if long in tool}
    assert numbers == {key: pytest.approx(value) for key, value in stated.items()}


@pytest.mark.parametrize(
    "text",
    [
        "(T1 IS 5 MM ABOVE THE PART)\n",
        "(DRILL 4 HOLES)\nG0 X1\nT3 M6",
        "(G21 G90)",
        "(OP 10 SIDE 2)\nT1 M6",
        "(T100)",
        "(Tool: 6 mm high)",
        '(Cutter does not descend more than 0.94" below top)\nG0 X1',
        "(Engraving a 37 tick, 300.0 degree, 1.700 dia bezel)\nG0 X1",
        "(END MILL, 12 MM DEEP)\nT1 M6",
        "(T1 END MILL FOR THE 40. DIA BORE)",
        ";tool_radius = 0.79375\nG0 X1\nT1 M6\nT2 M6",
    ],
)
def test_comments_that_describe_no_tool(text: str) -> None:
    assert not [own for own in read_header(text).cutters.values() if "diameter_mm" in own]


def test_a_reamer_reaches_the_depth_of_its_tip() -> None:
    """Its lead is short: with a point of 90 deg a reamer of 10 mm would leave the last 5 mm of its hole narrower."""
    stated = read_header("(T6 D=10. REAMER)").cutters[6]
    keys = {e.key: e.value for e in cutter_table(6, [stated], 20.0).entries if e.value is not None}
    assert "bottom_deg" not in keys
    assert (keys["diameter_mm"], keys["flutes"]) == (10.0, 6)


def test_sizes_by_name() -> None:
    """Ends of the tables of ASME B94.11M, and threads whose pitch is one inch over the number."""
    assert [round(drill_size(f"#{n} DRILL") / IN, 4) for n in (1, 29, 80)] == [0.228, 0.136, 0.0135]
    assert [round(drill_size(f"{c} DRILL") / IN, 3) for c in "AFZ"] == [0.234, 0.257, 0.413]
    assert thread_size("10-24") == pytest.approx((0.19 * IN, IN / 24))
    assert thread_size("M10X1.25") == (10.0, 1.25)
    assert thread_size("OP 20-30 NOTHING 99") is None or thread_size("2000-13") is None


#: an end mill and a tap without comments, a drill by its motions, a face mill by its comment
PROGRAM = """%
O1 (PLATE)
(T3 | 50. FACE MILL | H3)
G21 G90 G94 G17 G54
T1 M6
S3000 M3
G0 X0. Y0.
G43 H1 Z5.
G81 X5. Y5. Z-9. R2. F200.
G80
T2 M6
S500 M3
G43 H2 Z5.
G84 X5. Y5. Z-8. R2. F500.
G80
T3 M6
S1000 M3
G0 X-40. Y0.
G43 H3 Z5.
G1 Z-1. F200.
X40. F400.
G0 Z50.
M30
%
"""


def test_tools_without_a_comment_by_their_motions(tmp_path: Path) -> None:
    """A tap of 1 mm pitch has F500 at S500, the coarse thread of 6 mm; a face mill has low inserts."""
    (tmp_path / "plate.nc").write_text(PROGRAM)
    _, _, error = call("init", tmp_path / "plate.nc", tmp_path / "job")
    assert not error
    drill, tap, face = tomllib.loads((tmp_path / "job" / "job.toml").read_text())["cutter"]
    assert (drill["name"], drill["bottom_deg"], drill["flutes"]) == ("drill", 31.0, 2)
    assert (tap["name"], tap["thread_pitch_mm"]) == ("tap", 1.0)
    # the minor diameter of M6: 6 - 1.0825 P
    assert tap["body_mm"][0][0] == pytest.approx(0.5 * (6.0 - 1.0825), abs=1e-3)
    assert (face["diameter_mm"], face["flute_length_mm"], face["flutes"]) == (50.0, 10.0, 4)
    code, out, error = call("check", tmp_path / "job" / "job.toml")
    assert code in (0, 3), out + error


PECKS = """%
O7
(T3 D=0.25 CR=0. TAPER=90DEG - SPOT DRILL)
(T4 D=0.201 CR=0. TAPER=118DEG - ZMIN=-0.85 - DRILL)
G90 G94 G17 G20 G54
T3 M6
S5000 M3
G0 X-1.4 Y-0.6
G43 Z0.6 H3
G98 G82 X-1.4 Y-0.6 Z-0.1 R0.1 P0.25 F10.
G80
T4 M6
S4500 M3
G0 X-1.4 Y-0.6
G43 Z0.6 H4
G98 G83 X-1.4 Y-0.6 Z-0.85 R0.1 Q0.1 F12.
G80
M30
%
"""


@pytest.mark.slow  # 34 pecks whose chips are added to the hole of a spot drill
def test_pecks_go_back_into_their_own_hole_in_layers(tmp_path: Path) -> None:
    """Each peck returns in a rapid to where it has drilled: no rapid through material, as by moves."""
    (tmp_path / "peck.nc").write_text(PECKS)
    assert call("init", tmp_path / "peck.nc", tmp_path / "job")[0] == 0
    job = tmp_path / "job" / "job.toml"
    code, out, error = call(
        "run",
        job,
        "--accept",
        "--out",
        tmp_path / "r",
        "--set",
        "stock.layer_mm=0.5",
    )
    assert "rapid" not in out.splitlines()[0], out + error
    assert code in (0, 3)


POCKETS = {
    "part.mpf": "; T1 D=6 CR=0 - ZMIN=-5 - flat end mill\nG71 G17 G90 G94 G54\nT1 M6\nS8000 M3\nG0 X0 Y0 Z10\n"
    "POCKET4(10,0,2,-5,12,15,10,2.5,0,0,500,100,0,11,4)\nM30\n",
    "part.h": "BEGIN PGM A MM\n; T1 D=6 CR=0 - ZMIN=-5 - flat end mill\nTOOL CALL 1 Z S8000\nM3\nL X+15 Y+10 R0 FMAX\n"
    "L Z+10 R0 FMAX\nCYCL DEF 252 POCKET Q215=0 Q223=24 Q366=0 Q370=1.3 Q207=500 Q351=1 Q201=-5 Q202=2.5 Q206=100 "
    "Q200=2 Q203=+0 Q204=10 Q385=400\nCYCL CALL\nM30\nEND PGM A MM\n",
}


@pytest.mark.parametrize("name", POCKETS)
def test_the_pocket_of_a_tool_that_a_comment_states(tmp_path: Path, name: str) -> None:
    """A pocket of 24 mm is cut by the 6 mm of the comment: the block that is drafted holds its path, 5 mm deep."""
    (tmp_path / name).write_text(POCKETS[name])
    code, output, _ = call("init", str(tmp_path / name), str(tmp_path / "job"))
    assert code == 0, output
    assert "known" not in output
    job = tomllib.loads((tmp_path / "job" / "job.toml").read_text())
    assert job["cutter"][0]["diameter_mm"] == 6.0
    low, high = job["stock"]["low_mm"], job["stock"]["high_mm"]
    assert high[0] - low[0] >= 2 * (12.0 - 3.0)
    assert low[2] <= -5.0
