"""Programs in tilted planes, simulated: the slot that they mill, by closed form, in the words of three controllers."""

from __future__ import annotations

import pytest

import chipload

CUTTER = chipload.Cutter(
    number=1, diameter_mm=10.0, flutes=3, helix_deg=30.0, flute_length_mm=30.0, overhang_mm=45.0, modulus_gpa=580.0
)
#: the face at x = 20 of a block of 40 mm: Z of the plane stands along X, its X along Y
HEADS = {
    "fanuc": "%\nO7\nG21 G90 G17 G54\nT1 M6\nS3000 M3\nG0 X0. Y0. Z90.\nG68.2 X20. Y0. Z0. I90. J90. K0.\nG53.1\n",
    "sinumerik": 'G71 G90 G17 G54\nT1 M6\nS3000 M3\nG0 X0 Y0 Z90\nCYCLE800(0,"TC1",0,27,20,0,0,90,0,90,0,0,0,-1,0)\n',
    "heidenhain": (
        "BEGIN PGM S MM\nTOOL CALL 1 Z S3000\nL X+0 Y+0 Z+90 FMAX M3\nCYCL DEF 7.0\nCYCL DEF 7.1 X+20\n"
        "PLANE SPATIAL SPA+90 SPB+0 SPC+90 TURN FMAX\n"
    ),
}
TAILS = {"fanuc": "G69\nM30\n%\n", "sinumerik": "CYCLE800()\nM30\n", "heidenhain": "PLANE RESET STAY\nEND PGM S MM\n"}
ENDING = {"fanuc": "nc", "sinumerik": "mpf", "heidenhain": "h"}


@pytest.mark.parametrize("dialect", HEADS)
def test_slot_in_a_side_face(dialect, tmp_path):
    moves = "G0 X-30. Y6. Z60.\nG0 Z-2.\nG1 X30. F400.\nG0 Z60.\n"
    if dialect == "heidenhain":
        moves = "L X-30 Y+6 Z+60 FMAX\nL Z-2 FMAX\nL X+30 F400\nL Z+60 FMAX\n"
    file = tmp_path / f"slot.{ENDING[dialect]}"
    file.write_text(HEADS[dialect] + moves + TAILS[dialect])
    history = chipload.simulate(
        file, chipload.Stock.block((-20, -20, -20), (20, 20, 20)), CUTTER, material="al7075-t6", machine="cradle-ac",
        limits=chipload.Limits(force_n=2000.0), dialect=dialect, step_mm=2.0,
    )  # fmt: skip
    assert history["chip_volume_mm3"].sum() == pytest.approx(10.0 * 2.0 * 40.0, rel=5e-3)
    # the tool stands along X of the workpiece and cuts 2 mm deep over the whole face
    assert history["x_mm"].max() > 70.0
    cuts = history["chip_volume_mm3"] > 0.0
    assert history["x_mm"][cuts].min() == pytest.approx(18.0, abs=1e-6)
    assert history["z_mm"][cuts].min() == pytest.approx(6.0, abs=1e-6)
