"""`chipload init`: sizes of tools by their names reach the compensation and the cycles of the draft."""

from pathlib import Path

from command import call


def test_a_name_with_one_number_is_a_diameter(tmp_path: Path) -> None:
    path = tmp_path / "part.mpf"
    path.write_text(
        'G17 G54 G90 G71 G94\nT="FRAESER_16"\nM6\nS3000 M3 F600\nG0 X-20 Y-20 Z5\nG1 Z-5\nG41 X0 Y-10\nY40\nX60\n'
        "G40 X80\nG0 Z10\nCYCLE77(10,0,2,-4,,20,30,20,2,0,0,500,100,0,1,30)\nM30\n"
    )
    code, said, _ = call("init", path, tmp_path / "job")
    assert code == 0
    assert "nc-diameter-unknown" not in said
    assert "G41 D9001: the 16 mm of cutter 9001 are taken" in said
    assert "nc-pocket-path" in said


def test_a_tap_of_a_comment_has_the_pitch_of_its_feed(tmp_path: Path) -> None:
    path = tmp_path / "part.nc"
    path.write_text(
        "%\nO00012\n(T1 D=10. CR=0. - ZMIN=-2. - FLAT END MILL)\n(T2 D=8. CR=0. - ZMIN=-12. - RIGHT HAND TAP)\n"
        "G90 G94 G17 G21\nT1 M6\nS3000 M3\nG54 G0 X0. Y0.\nG43 Z10. H1\nG1 Z-2. F300.\nG41 D1 X20.\nY20.\nG40 X40.\n"
        "G0 Z10.\nT2 M6\nS500 M3\nG54 G0 X5. Y5.\nG43 Z10. H2\nG98 G84 X5. Y5. Z-12. R3. F625.\nG80\nM30\n%\n"
    )
    code, said, _ = call("init", path, tmp_path / "job")
    assert code == 0
    assert "thread_pitch_mm: correct whichever" not in said
    assert "thread_pitch_mm = 1.25" in (tmp_path / "job" / "job.toml").read_text()
