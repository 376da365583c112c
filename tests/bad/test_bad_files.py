"""Files that are no regular files, are damaged, or pack more than they show: one line, bounded time and memory."""

from __future__ import annotations

import io
import os
import signal
import struct
import subprocess
import sys
import threading
import time
import zipfile
from pathlib import Path

import numpy as np
import pytest
import shapely

from chipload.control.linuxcnc.path import read_path
from chipload.control.logs import read_log
from chipload.cutter.fctb import read_fctb
from chipload.cutter.tooltable import read_tool_table
from chipload.cutting.material import read_material
from chipload.cutting.measured import read_forces
from chipload.errors import InputError
from chipload.examples import copy_example
from chipload.files import read_regular
from chipload.geometry import isolated
from chipload.geometry.dxf import read_dxf
from chipload.geometry.isolated import Isolated
from chipload.geometry.mesh import read_mesh
from chipload.geometry.sections import check_sections, read_meridian
from chipload.geometry.step import read_step_face
from chipload.geometry.step_faces import read_faces
from chipload.jobs import check_job, load_job
from chipload.machine.hal import read_sections as read_ini
from chipload.planning.thinwall.table import read_cuts
from chipload.program.gcode.reader import read_gcode, read_gcode_file
from chipload.program.heidenhain.reader import read_heidenhain_file
from chipload.stock.layers import LayeredStock
from chipload.tables import parse_toml
from chipload.web.result import open_result
from square import make_result

PLATE = Path(__file__).parents[2] / "tools" / "plate.step"
LOG = {"sample_s": 0.1, "current": {"column": "i", "unit": "A"}}
READERS = {
    ".toml": load_job,
    ".tml": read_material,
    ".ngc": read_gcode_file,
    ".h": read_heidenhain_file,
    ".ini": read_ini,
    ".tbl": lambda path: read_tool_table(path, 1, "mm"),
    ".fctb": read_fctb,
    ".csv": read_forces,
    ".log": lambda path: read_log(path, LOG),
    ".path": read_path,
    ".cuts": lambda path: read_cuts(path, 0.1),
    ".txt": lambda path: read_meridian(path, "mm"),
    ".stl": lambda path: read_mesh(path, unit="mm"),
    ".step": read_step_face,
    ".dxf": read_dxf,
    ".npz": LayeredStock.load,
}


# -- item 22: what is no regular file ---------------------------------------------------------------------------
@pytest.mark.parametrize("suffix", READERS)
@pytest.mark.parametrize("kind", ["pipe", "device", "folder", "long name", "zero byte"])
def test_only_a_regular_file_is_read(tmp_path: Path, suffix: str, kind: str) -> None:
    path = tmp_path / f"a{suffix}"
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "device":
        path.symlink_to("/dev/zero")
    elif kind == "folder":
        path.mkdir()
    elif kind == "long name":
        path = tmp_path / f"{'a' * 250}{suffix}"
    else:
        path = tmp_path / f"a\0{suffix}"
    with pytest.raises(InputError, match=r"(cannot be read|no such file)"):
        READERS[suffix](path)


def test_a_file_larger_than_its_reader_takes(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    with path.open("wb") as file:
        file.truncate(1 << 40)
    with pytest.raises(InputError, match=r"^x: 1099511627776 bytes: must be at most 1000 bytes: split it$"):
        read_regular(path, "x", 1000)


# -- item 22: texts ---------------------------------------------------------------------------------------------
def test_a_code_of_400_digits() -> None:
    with pytest.raises(InputError, match=r"line 1: .*must be a whole number, it is inf"):
        read_gcode("G21 G" + "9" * 400 + "\nG1 X1 F100\nM30\n", dialect="sinumerik")


def test_forces_with_cr_are_those_with_lf(tmp_path: Path) -> None:
    text = "time_s,fx_n,fy_n,fz_n\n" + "".join(f"{k / 100:g},{k},{2 * k},{3 * k}\n" for k in range(40))
    for name, end in (("lf.csv", "\n"), ("cr.csv", "\r"), ("crlf.csv", "\r\n")):
        (tmp_path / name).write_bytes(text.replace("\n", end).encode())
    lf, cr, both = (read_forces(tmp_path / name)[0] for name in ("lf.csv", "cr.csv", "crlf.csv"))
    assert lf.force.tolist() == cr.force.tolist() == both.force.tolist() == [[k, 2 * k, 3 * k] for k in range(40)]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (f"flutes = {'9' * 400}", r"t: flutes: a number is too large: a whole number must be within \d+$"),
        (f"flutes = {'9' * 5000}", r"t: not a TOML file: "),
        (f"a = {'[' * 3000}{']' * 3000}", r"t: not a TOML file: lists or tables are nested too deep$"),
        (f"a = {'[' * 60}{']' * 60}", r"nested deeper than 50$"),
        ("a = 1\xff", r"t: not a TOML file: "),
    ],
)
def test_tables(text: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        parse_toml("t", text.encode("latin-1"))


@pytest.mark.parametrize("diameter", ["9" * 400 + " mm", "9" * 5000 + " mm", "1/" + "9" * 400 + " in"])
def test_a_tool_bit_with_a_long_number(tmp_path: Path, diameter: str) -> None:
    path = tmp_path / "a.fctb"
    path.write_text(f'{{"shape": "endmill.fcstd", "parameter": {{"Diameter": "{diameter}"}}}}')
    with pytest.raises(InputError, match=r"Diameter: \d+ characters: must be a length with its unit"):
        read_fctb(path)


def test_a_tool_table_with_a_long_number(tmp_path: Path) -> None:
    path = tmp_path / "a.tbl"
    path.write_text(f"T{'9' * 400} D1\n")
    with pytest.raises(InputError, match=r"line 1: a number is too large: must be below 1e\+09"):
        read_tool_table(path, 1, "mm")


def test_a_section_that_is_not_finite(tmp_path: Path) -> None:
    path = tmp_path / "hub.txt"
    path.write_text("1 2\n1e400 3\n")
    with pytest.raises(InputError, match=r"line 2: a number is not finite: '1e400 3'"):
        read_meridian(path, "mm")


# -- item 21: STL -----------------------------------------------------------------------------------------------
def box(count: int = 12) -> bytes:
    return bytes(80) + struct.pack("<I", count) + bytes(50 * 12)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (box()[:-7], r"its header states 12 triangles, which are 684 bytes, but the file has 677: export it again$"),
        (box(13), r"its header states 13 triangles, which are 734 bytes, but the file has 684: export it again$"),
        (b"x" * 50, r"50 bytes: not an STL file: export it again$"),
        # as long as a file of -1 triangles would be
        (b"x" * 34, r"34 bytes: not an STL file: export it again$"),
        (bytes(84), r"the file has no triangles"),
        (b"solid a\nfacet normal 0 0 0\nouter loop\nvertex 0 0\nendloop\nendfacet\nendsolid\n", r"0 vertices of three"),
        (b"solid a\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 0 0 1\nvertex 0 1 0\nendloop\nendfacet\n",
         r"truncated: no endsolid"),
        (b"solid a\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 0 0 1\nvertex 0 1 o\nendloop\nendfacet\n"
         b"endsolid", r"damaged: could not convert string to float"),
    ],
)  # fmt: skip
def test_a_damaged_stl(tmp_path: Path, data: bytes, message: str) -> None:
    (tmp_path / "a.stl").write_bytes(data)
    with pytest.raises(InputError, match=r"^stock\.file = a\.stl: .*" + message):
        read_mesh(tmp_path / "a.stl", unit="mm")


def test_every_length_of_a_truncated_stl_is_refused(tmp_path: Path) -> None:
    whole, path = box(), tmp_path / "a.stl"
    for count in range(0, len(whole), 7):
        path.write_bytes(whole[:count])
        with pytest.raises(InputError, match=r"not an STL file|no triangles"):
            read_mesh(path, unit="mm")


# -- item 20: STEP in a process of its own ----------------------------------------------------------------------
def test_the_faces_of_a_sound_file() -> None:
    """A box 40 x 30 x 10 with a rounded edge and a hole of radius 5: the area of the hole's wall is 2 pi 5 10."""
    model = read_faces(PLATE)
    assert len(model.faces) == 8
    assert any(abs(f.area - 100.0 * np.pi) < 1e-6 for f in model.faces if f.kind == "cylinder")


class Dying:
    """Functions that a child is made to call instead of those of the CAD kernel."""

    CODE = (
        "import os, signal, sys, time\n"
        "from types import ModuleType\n"
        "import chipload.geometry.isolated as isolated\n"
        "def dies(part=None): os.kill(os.getpid(), signal.SIGSEGV)\n"
        "def loops(part=None):\n    while True: pass\n"
        "def grows(part=None): return bytearray(8 << 30)\n"
        "def faults(part=None): raise RuntimeError('Standard_Failure \\x1b[2J')\n"
        "def reads(path, key): return path\n"
        "made = ModuleType('chipload.geometry.step')\n"
        "for f in (dies, loops, grows, faults, reads): setattr(made, f.__name__, f)\n"
        "sys.modules['chipload.geometry.step'] = made\n"
        "isolated._serve()\n"
    )


@pytest.mark.parametrize(
    ("function", "message"),
    [
        ("dies", r"damaged: the CAD kernel crashes on it: export it again from CAD, or repair it there$"),
        ("loops", r"the CAD kernel did not finish it within 1 s: export the part alone, or repair it in CAD$"),
        ("grows", r"the CAD kernel needs more than 4 GiB"),
        ("faults", r"damaged: the CAD kernel fails on it: RuntimeError Standard_Failure"),
    ],
)
def test_the_death_of_the_kernel_is_a_refusal(monkeypatch: pytest.MonkeyPatch, function: str, message: str) -> None:
    start = subprocess.Popen
    monkeypatch.setattr(
        isolated.subprocess, "Popen", lambda words, **how: start([sys.executable, "-c", Dying.CODE], **how)
    )
    with Isolated(PLATE, "part.file", "step.reads") as part:
        part._seconds = 1.0
        with pytest.raises(InputError, match=r"^part\.file = plate\.step: " + message):
            part.call(f"step.{function}")
        assert part._process is None


def test_ctrl_c_ends_the_child(monkeypatch: pytest.MonkeyPatch) -> None:
    start, made = subprocess.Popen, list[subprocess.Popen[bytes]]()

    def started(words: list[str], **how: object) -> subprocess.Popen[bytes]:
        made.append(start([sys.executable, "-c", Dying.CODE], **how))
        return made[-1]

    monkeypatch.setattr(isolated.subprocess, "Popen", started)
    part = Isolated(PLATE, "part.file", "step.reads")
    part._seconds = 60.0
    # another test, or what starts the tests in the background, may have it ignored
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        threading.Timer(1.0, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
        with pytest.raises(KeyboardInterrupt):
            part.call("step.loops")
    finally:
        signal.signal(signal.SIGINT, before)
    assert made[0].poll() is not None


def test_the_child_ends_with_its_model() -> None:
    model = read_faces(PLATE)
    process = model.faces[0].part._process
    assert process is not None
    assert process.poll() is None
    del model
    for _ in range(100):
        if process.poll() is not None:
            break
        time.sleep(0.05)
    assert process.poll() is not None


def test_a_child_executes_nothing_that_is_sent() -> None:
    """Neither another module's function nor an array of objects."""
    with pytest.raises(ValueError, match="is not served"):
        isolated._function("os.system")
    forged = np.array([{"a": 1}], dtype=object)
    with pytest.raises(ValueError, match="allow_pickle=False"):
        isolated.pack_value(forged)


# -- item 22: archives that hold more than they show ------------------------------------------------------------
def stock_bytes() -> bytes:
    stock = LayeredStock.block((0, 0, 0), (20, 10, 4), 2.0, 5.0)
    stock.remove(1, shapely.box(4, 4, 6, 30))
    return stock.to_bytes()


def test_a_stock_that_is_a_bomb(tmp_path: Path) -> None:
    """6 MB that are 6.4 GB unpacked: refused by what the archive says, not by unpacking it."""
    path = tmp_path / "stock.npz"
    zeros = bytes(1 << 24)
    with zipfile.ZipFile(io.BytesIO(stock_bytes())) as old, zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as new:
        for name in old.namelist():
            if name != "wkb.npy":
                new.writestr(name, old.read(name))
        with new.open("wkb.npy", "w", force_zip64=True) as file:
            for _ in range(80):
                file.write(zeros)
    assert path.stat().st_size < 2_000_000
    with pytest.raises(InputError, match=r"stock\.npz: holds 13\d{8} bytes unpacked: must be at most 1073741824"):
        LayeredStock.load(path)


def test_a_stock_whose_array_says_it_is_larger(tmp_path: Path) -> None:
    """The head of an array says 10^12 numbers: nothing is allocated for them."""
    path, head = tmp_path / "stock.npz", io.BytesIO()
    np.lib.format.write_array_header_1_0(head, {"descr": "<f8", "fortran_order": False, "shape": (10**12,)})
    with zipfile.ZipFile(io.BytesIO(stock_bytes())) as old, zipfile.ZipFile(path, "w") as new:
        for name in old.namelist():
            new.writestr(name, head.getvalue() if name == "bounds.npy" else old.read(name))
    with pytest.raises(InputError, match=r"stock\.npz: damaged: save the stock again"):
        LayeredStock.load(path)


def test_a_history_that_is_a_bomb(tmp_path: Path) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    folder = make_result(tmp_path / "result", scene=False)
    piece = pa.table({name: np.zeros(4_000_000, dtype=np.float32) for name in ("x_mm", "y_mm", "z_mm")})
    with pq.ParquetWriter(folder / "history.parquet", piece.schema, compression="zstd") as writer:
        for _ in range(13):
            writer.write_table(piece)
    assert (folder / "history.parquet").stat().st_size < 2_000_000
    with pytest.raises(
        InputError, match=r"52000000 rows: the page shows at most 50000000: run the job with longer steps"
    ):
        open_result(tmp_path.resolve(), "result")


# -- item 22: a damaged entity of a drawing ---------------------------------------------------------------------
def test_a_damaged_entity_is_dropped_and_said(tmp_path: Path) -> None:
    """A group code that became 0 makes an entity of a coordinate: the parser fails when that is asked for its layer."""
    import ezdxf

    doc = ezdxf.new("R2010")
    doc.units = 4
    doc.modelspace().add_line((0, 0), (10, 0))
    doc.modelspace().add_ellipse((50, 0), (5, 0), 0.5)
    path = tmp_path / "a.dxf"
    doc.saveas(path)
    text = path.read_text()
    assert text.count(" 11\n5.0\n") == 1
    path.write_text(text.replace(" 11\n5.0\n", "  0\n5.0\n"))
    drawing = read_dxf(path, units="mm")
    assert [0.0, 0.0, 10.0, 0.0] in [c.segments[0, :4].tolist() for c in drawing.contours]
    assert "dxf-skipped" in [f.code for f in drawing.findings]


# -- item 13 ----------------------------------------------------------------------------------------------------
def test_the_order_of_sections_does_not_depend_on_their_points() -> None:
    """Five equal rings 2 mm apart, the middle one with nine of ten points on one side."""
    angle = np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False)
    dense = np.sort(np.concatenate([np.linspace(-0.5, 0.5, 360), angle[4:-4]]))

    def ring(a: np.ndarray, z: float) -> np.ndarray:
        return np.stack([40.0 + 20.0 * np.cos(a), 4.0 * np.sin(a), z + 0.0 * a], axis=-1)

    rings = tuple(ring(dense if k == 2 else angle, 2.0 * k) for k in range(5))
    assert check_sections(rings) == rings
    with pytest.raises(InputError, match="section 2: is not between sections 1 and 3"):
        check_sections((rings[0], rings[3], rings[1]))


# -- item 21: check opens every file ----------------------------------------------------------------------------
@pytest.mark.parametrize("name", ["part.stl", "clamp.stl"])
def test_check_opens_the_bodies_of_a_job(tmp_path: Path, name: str) -> None:
    copy_example("bracket", tmp_path / "b")
    (tmp_path / "b" / name).write_text("a text that is no body\n")
    with pytest.raises(InputError, match=rf"{name}: 23 bytes: not an STL file"):
        check_job(load_job(tmp_path / "b" / "job.toml"))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("stock.layer_mm=1e-9", r"stock\.layer_mm = 1e-09: .* layers: must be at most 200000|stock\.layer_mm"),
        ("operation.0.step_mm=1e-8", r"operation\.0\.step_mm = 1e-08: .* steps: must be at most 50000000"),
        (
            "operation.0.stock_points_mm=1e-9",
            r"operation\.0\.stock_points_mm = 1e-09: .* columns of the stock: must be at most",
        ),
    ],
)
def test_check_refuses_the_sizes_that_run_refuses(tmp_path: Path, change: str, message: str) -> None:
    copy_example("bracket", tmp_path / "b")
    with pytest.raises(InputError, match=message):
        check_job(load_job(tmp_path / "b" / "job.toml", [change]))
