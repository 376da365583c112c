"""`chipload check` of a STEP file: its faces as a job names them."""

from typer.testing import CliRunner

from chipload.cli import app
from step_files import written


def test_the_faces_of_a_box(tmp_path):
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox

    path = written(tmp_path / "box.step", BRepPrimAPI_MakeBox(40.0, 3.0, 30.0).Shape())
    done = CliRunner().invoke(app, ["check", str(path)])
    assert done.exit_code == 0
    lines = done.output.splitlines()
    assert lines[0] == "box.step: 6 faces"
    assert lines[1] == "face 1: plane, 90 mm2, 4 edges; x 0 to 0, y 0 to 3, z 0 to 30 mm"
    assert len(lines) == 7


def test_a_file_that_is_no_model(tmp_path):
    path = tmp_path / "empty.stp"
    path.write_text("nothing")
    done = CliRunner().invoke(app, ["check", str(path)])
    assert done.exit_code == 2
    assert done.output.strip() == "chipload: model = empty.stp: not a STEP file"
