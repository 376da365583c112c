"""A result as CSV, VTK and setup sheet: every number comes back as it stands; the mesh keeps its volume."""

from __future__ import annotations

import base64
import csv
import io
import re
import struct
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pyarrow.parquet as pq
import pypdf
import pytest
import trimesh

from chipload.errors import InputError
from chipload.report.pdf import SheetLine, one_page
from chipload.report.removal import read_removal
from chipload.report.setup_sheet import setup_pdf
from chipload.report.vtk import faces_file, polyline
from chipload.result import Result, SurfaceMap
from chipload.result.load import load_result
from chipload.stock.layers import LayeredStock
from command import call
from slot_job import slot_job


def read_vtk(path: Path) -> dict[str, np.ndarray]:
    """Arrays of a VTK file by name: base64 of the length (UInt64) and the values, little-endian."""
    kinds = {"Float64": "<f8", "Int64": "<i8", "UInt8": "u1"}
    out = {}
    for element in ElementTree.parse(path).getroot().iter("DataArray"):
        assert element.get("format") == "binary"
        data = base64.b64decode(element.text or "")
        (size,) = struct.unpack("<Q", data[:8])
        assert size == len(data) - 8
        values = np.frombuffer(data[8:], dtype=kinds[str(element.get("type"))])
        parts = int(element.get("NumberOfComponents", "1"))
        out[str(element.get("Name"))] = values.reshape(-1, parts) if parts > 1 else values
    return out


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("slot")
    slot_job(folder, step=3.0, end=28.0)
    code, _, said = call("run", folder / "job.toml", "--out", folder / "result")
    assert code in (0, 3), said
    return folder / "result"


@pytest.fixture(scope="module")
def exported(result: Path) -> Path:
    out = result.parent / "export"
    code, _, said = call("export", result, "--out", out)
    assert code == 0, said
    return out


def test_csv_has_every_column_and_row(result: Path, exported: Path) -> None:
    history = pq.read_table(result / "history.parquet")
    with (exported / "history.csv").open(newline="") as file:
        head, *rows = csv.reader(file)
    assert head == history.column_names
    assert len(rows) == history.num_rows > 10
    for name in ("force_n", "torque_nm", "x_mm", "t_s"):
        found = [float(row[head.index(name)]) for row in rows]
        np.testing.assert_array_equal(found, history[name].to_numpy())
    assert {row[head.index("track")] for row in rows} == {"program"}


def test_the_path_in_vtk(result: Path, exported: Path) -> None:
    history = pq.read_table(result / "history.parquet")
    found = read_vtk(exported / "path-program.vtp")
    np.testing.assert_array_equal(found["points"][:, 0], history["x_mm"].to_numpy())
    np.testing.assert_array_equal(found["force_n"], history["force_n"].to_numpy())
    assert found["connectivity"].tolist() == list(range(history.num_rows))
    assert found["offsets"].tolist() == [history.num_rows]
    numbers = [f.name for f in history.schema if str(f.type) in ("double", "int64", "bool", "int32")]
    full = [n for n in numbers if history[n].null_count < history.num_rows and n != "operation"]
    assert set(full) <= set(found)


def test_the_stock_keeps_its_volume(result: Path, exported: Path) -> None:
    """1200 mm3 less a slot of 6 by 2 by 20 mm: 960 mm3; layers and tiles keep it to 1e-3."""
    found = read_vtk(exported / "stock.vtu")
    faces = found["connectivity"].reshape(-1, 3)
    assert set(found["types"].tolist()) == {5}
    a, b, c = (found["points"][faces[:, k]] for k in range(3))
    volume = float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum()) / 6.0
    assert volume == pytest.approx(960.0, rel=1e-3)
    assert trimesh.load_mesh(exported / "stock.stl").volume == pytest.approx(volume, rel=1e-6)
    assert LayeredStock.load(result / "stock.npz").volume() == pytest.approx(volume, rel=1e-6)


def test_another_reader_reads_the_same(exported: Path) -> None:
    meshio = pytest.importorskip("meshio")
    read = meshio.read(exported / "stock.vtu")
    np.testing.assert_array_equal(read.points, read_vtk(exported / "stock.vtu")["points"])
    assert read.cells[0].type == "triangle"


def test_the_sheet_shows_verdict_program_and_limits(exported: Path) -> None:
    text = (exported / "setup.html").read_text()
    assert "<script" not in text
    for part in ("Holds at 95 %: ", "torque [N m]", "0-program.apt", "vmc", "X -8 to 28", "size: A4"):
        assert part in text


def test_chips_are_bodies_with_the_volume_of_the_slot(result: Path, exported: Path) -> None:
    """Of each closed chip by the divergence theorem; dexels of 6 / 32 mm keep the 240 mm3 to 2 %."""
    found = read_vtk(exported / "chips-program.vtu")
    assert set(found["types"].tolist()) == {9}
    a, b, c, d = (found["points"][found["connectivity"].reshape(-1, 4)[:, k]] for k in range(4))
    each = (np.einsum("ij,ij->i", a, np.cross(b, c)) + np.einsum("ij,ij->i", a, np.cross(c, d))) / 6.0
    volumes = np.bincount(found["chip"], each)[1:]
    mesh = read_removal(result / "removal.npz", 0)
    assert mesh is not None
    kept = [mesh.volume(k) for k in range(len(mesh.rows) + 1)]
    np.testing.assert_allclose(volumes, -np.diff(kept)[: len(volumes)], atol=1e-3)
    assert volumes.min() > -1e-3
    assert volumes.sum() == pytest.approx(240.0, rel=0.02)
    history = pq.read_table(result / "history.parquet")
    rows = found["row"]
    assert history["line"].to_numpy()[rows].tolist() == found["line"].tolist()
    chip, first = np.unique(found["chip"], return_index=True)
    whole = history["chip_volume_mm3"].to_numpy().sum()
    assert found["chip_volume_mm3"][first].sum() == pytest.approx(whole, rel=1e-12)
    force = history["force_n"].to_numpy()
    bounds = np.concatenate([[0], mesh.rows + 1])
    expected = [force[bounds[k - 1] : bounds[k]].max() for k in chip]
    np.testing.assert_array_equal(found["force_n"][first], expected)


def test_chips_of_gltf_are_closed_and_carry_their_numbers(exported: Path) -> None:
    scene = trimesh.load(exported / "chips-program.glb")
    table = read_vtk(exported / "chips-program.vtu")
    chip, first = np.unique(table["chip"], return_index=True)
    assert sorted(scene.graph.nodes_geometry) == sorted(f"chip-{k}" for k in chip)
    volume = 0.0
    for number, k in zip(chip, first, strict=True):
        body = scene.geometry[f"chip-{number}"]
        volume += body.volume
        for name in ("force_n", "chip_volume_mm3", "row", "line"):
            assert body.metadata[name] == pytest.approx(float(table[name][k]))
    assert volume == pytest.approx(240.0, rel=0.02)


def test_a_field_of_finite_elements_keeps_its_vectors(result: Path, tmp_path: Path) -> None:
    """The cells of a displaced surface map come back from maps.npz and from the file of VTK as they stood."""
    from chipload.report.export import _map
    from chipload.result.history import maps_bytes

    moved = np.array([[0.0, 0.0, 0.0], [0.001, 0.0, 0.0], [0.0, -0.002, 0.003]])
    um = 1000.0 * np.linalg.norm(moved, axis=1)
    one = SurfaceMap("bent", "deflection_workpiece_um", np.eye(3), um, np.array([[0, 1, 2]]), displacement=moved)
    (tmp_path / "map.vtu").write_bytes(_map(one))
    found = read_vtk(tmp_path / "map.vtu")
    np.testing.assert_array_equal(found["displacement_mm"], moved)
    np.testing.assert_array_equal(found["deflection_workpiece_um"], um)
    (tmp_path / "maps.npz").write_bytes(maps_bytes(replace(load_result(result), maps=(one,))))
    np.testing.assert_array_equal(np.load(tmp_path / "maps.npz")["0-displacement"], moved)
    with pytest.raises(ValueError, match=r"displacement of shape \(2, 3\)"):
        replace(one, displacement=moved[:2])


def read_pdf(data: bytes) -> str:
    """The text of the only page, which is A4."""
    (page,) = pypdf.PdfReader(io.BytesIO(data)).pages
    assert (float(page.mediabox.width), float(page.mediabox.height)) == pytest.approx((595.28, 841.89))
    return re.sub(r"\s+", " ", page.extract_text())


def test_the_sheet_in_pdf(exported: Path) -> None:
    data = (exported / "setup.pdf").read_bytes()
    for part in ("HOLDS", "Holds at 95 %: ", "torque [N m]", "0-program.apt", "vmc", "X -8 to 28"):
        assert part in read_pdf(data)


def test_a_long_sheet_is_one_page_and_says_what_it_leaves_out(result: Path) -> None:
    whole: Result = load_result(result)
    many = tuple(f"limit number {k} (\u00b5m, \u221e): not stated, because nobody said so" for k in range(200))
    text = read_pdf(setup_pdf(replace(whole, unchecked=many)))
    assert "188 more in report.html" in text
    assert "(\u00b5m, ?)" in text
    assert one_page("", [SheetLine("word " * 4_000)]) is None
    assert "HOLDS" in read_pdf(setup_pdf(replace(whole, note="so " * 4_000)))


def test_what_is_refused(result: Path, exported: Path, tmp_path: Path) -> None:
    assert call("export", result, "--out", exported)[0] == 2
    code, _, said = call("export", tmp_path, "--out", tmp_path / "out")
    assert (code, "name a result folder" in said) == (2, True)
    assert not (tmp_path / "out").exists()
    with pytest.raises(InputError, match="there is nothing to write"):
        polyline([], {})
    with pytest.raises(InputError, match="force_n: 1 values: must be 2"):
        polyline([[0, 0, 0], [1, 0, 0]], {"force_n": np.zeros(1)})
    with pytest.raises(InputError, match="a face names a point outside 0 to 2"):
        faces_file(np.eye(3), [[0, 1, 3]])


def test_one_kind_alone(result: Path, tmp_path: Path) -> None:
    assert call("export", result, "--out", tmp_path / "a", "--csv")[0] == 0
    assert [p.name for p in (tmp_path / "a").iterdir()] == ["history.csv"]
