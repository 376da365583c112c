"""O-words, subroutines and called files; every way that a text may run is bounded."""

import pytest

from chipload.errors import InputError
from chipload.program.gcode.reader import read_gcode, read_gcode_file


def xs(text, **options):
    commands, _ = read_gcode(text + "\nM2\n", **options)
    return commands.position[:, 0].tolist()


def test_if_elseif_else():
    text = "\n".join(
        f"#1={n}\nO1 if [#1 eq 0]\nG0 X10\nO1 elseif [#1 eq 1]\nG0 X11\nO1 elseif [#1 le 2]\n"
        f"G0 X12\nO1 else\nG0 X13\nO1 endif"
        for n in range(4)
    )
    assert xs(text) == [10.0, 11.0, 12.0, 13.0]


def test_while_do_and_repeat():
    assert xs("#1=0\nO1 while [#1 lt 3]\n#1=[#1+1]\nG0 X#1\nO1 endwhile") == [1.0, 2.0, 3.0]
    assert xs("#1=5\nO1 do\n#1=[#1+1]\nG0 X#1\nO1 while [#1 lt 3]") == [6.0]
    assert xs("G91\nO1 repeat [3]\nO2 repeat [2]\nG0 X1\nO2 endrepeat\nO1 endrepeat") == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    assert xs("O1 repeat [0]\nG0 X1\nO1 endrepeat\nO2 while [0]\nbogus!\nO2 endwhile\nG0 X9") == [9.0]


def test_break_and_continue():
    loop = "#1=0\nO1 while [#1 lt 5]\n#1=[#1+1]\nO2 if [#1 eq 3]\nO1 {}\nO2 endif\nG0 X#1\nO1 endwhile"
    assert xs(loop.format("break")) == [1.0, 2.0]
    assert xs(loop.format("continue")) == [1.0, 2.0, 4.0, 5.0]
    tail = "#1=0\nO1 do\n#1=[#1+1]\nO2 if [#1 eq 2]\nO1 {}\nO2 endif\nG0 X#1\nO1 while [#1 lt 4]\nG0 X8"
    assert xs(tail.format("break")) == [1.0, 8.0]
    assert xs(tail.format("continue")) == [1.0, 3.0, 4.0, 8.0]


def test_a_subroutine_has_its_own_parameters_and_returns_a_value():
    text = (
        "O<up> sub\n#2=[#1+1]\n#<x>=9\nO9 if [#1 gt 5]\nO<up> return [#1*2]\nO9 endif\nO<up> endsub [#2]\n#1=3 #2=4\n"
    )
    text += "O<UP> call [1]\nG0 X#<_value>\nX#<_value_returned>\nX#1\nX#2\nO<up> call [7]\nX#<_value>"
    assert xs(text) == [2.0, 1.0, 3.0, 4.0, 14.0]
    with pytest.raises(InputError, match=r"line 10: parameter #<x>: is read before it is set"):
        xs(text.replace("G0 X#<_value>", "G0 X#<x>"))


def test_recursion_with_labels_of_its_own():
    text = (
        "O<f> sub\nO1 if [#1 gt 1]\n#2=[#1-1]\nO<f> call [#2]\n#3=[#<_value>*#1]\nO1 else\n"
        "#3=1\nO1 endif\nO<f> endsub [#3]\n"
    )
    assert xs(text + "O<f> call [6]\nG0 X#<_value>") == [720.0]


def test_a_calculated_label():
    assert xs("O7 sub\nG0 X#1\nO7 endsub\n#5=7\nO#5 call [4]\nO[#5] call [5]") == [4.0, 5.0]


def test_saved_modes_come_back():
    commands, _ = read_gcode("O1 sub\nM73\nG91 G20 F50 S70 M3\nO1 endsub\nG0 X1\nO1 call\nG0 X1\nM70\nG91\nM72\nX4\nM2")
    assert commands.position[:, 0].tolist() == [1.0, 1.0, 4.0]
    assert commands.spindle.tolist() == [0.0, 0.0, 0.0]


def test_subroutines_by_number():
    text = "M98 P5 L2\nG90 G0 X9\nM2\nO5\nG91 G0 X1\nM99"
    commands, _ = read_gcode(text)
    assert commands.position[:, 0].tolist() == [1.0, 2.0, 9.0]
    _, findings = read_gcode("G0 X1\nM99")
    assert [x.code for x in findings] == ["nc-endless"]


def test_m2_ends_within_a_subroutine():
    assert xs("O1 sub\nM2\nO1 endsub\nO1 call\nG0 X1") == []


def test_percent_ends_a_text_that_begins_with_it():
    commands, _ = read_gcode("\n%\nG0 X1\n%\nG0 X2")
    assert commands.position[:, 0].tolist() == [1.0]


def test_files_are_called_from_the_folder_alone(tmp_path):
    inside = tmp_path / "inside"
    inside.mkdir()
    body = "O<{}> sub\nG0 X#1\nO<{}> endsub\n"
    (inside / "near.ngc").write_text(body.format("near", "near"))
    (tmp_path / "far.ngc").write_text(body.format("far", "far"))
    (inside / "link.ngc").symlink_to(tmp_path / "far.ngc")
    (inside / "main.ngc").write_text("O<near> call [4]\nM2\n")
    commands, _ = read_gcode_file(inside / "main.ngc")
    assert commands.position[:, 0].tolist() == [4.0]
    for label in ("../far", "far", "link"):
        with pytest.raises(InputError, match=rf"line 1: o{label} call: there is no o{label} sub"):
            read_gcode(f"O<{label}> call [1]\nM2", folder=inside)
    with pytest.raises(InputError, match="there is no onear sub in this text"):
        read_gcode("O<near> call [1]\nM2")


def test_an_error_in_a_called_file_names_it(tmp_path):
    (tmp_path / "sub1.ngc").write_text("O<sub1> sub\nG0 X\nO<sub1> endsub\n")
    with pytest.raises(InputError, match=r"^sub1.ngc: line 2: the block ends where a value is expected"):
        read_gcode("O<sub1> call\nM2", folder=tmp_path)


def test_every_loop_is_bounded():
    for text in (
        "O1 do\nO1 while [1]",
        "O1 repeat [999999999]\nO1 endrepeat",
        "O1 sub\nO1 endsub\nO2 while [1]\nO1 call\nO2 endwhile",
    ):
        with pytest.raises(InputError, match="more than 5000 blocks"):
            read_gcode(text + "\nM2", most_blocks=5000)


def test_progress_is_told_and_may_stop():
    seen = []
    read_gcode("G0 X1\n" * 20_000 + "M2", progress=lambda done, what: seen.append(done))
    assert seen == sorted(seen)
    assert 0.0 < seen[0] <= 1.0

    def stop(done, what):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        read_gcode("G0 X1\n" * 20_000 + "M2", progress=stop)
