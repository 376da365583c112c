"""The scene file against trimesh, which writes and reads the same content."""

from __future__ import annotations

import io
import json
import struct
from typing import Any

import numpy as np
import pytest
import trimesh

from chipload.report.bodies import scene_bodies
from chipload.report.gltf import GltfScene, node_names, select_nodes

COLOUR = (34, 120, 132, 255)
RUNS = [(1, 4), (6, 9)]
POINTS = np.random.default_rng(3).uniform(-9.0, 9.0, (9, 3))


def _both() -> tuple[bytes, bytes]:
    """A path of two runs, a box in one colour and a ball in many with metadata, by this writer and by trimesh."""
    made = (trimesh.creation.box((1.0, 2.0, 3.0)), trimesh.creation.icosphere(1))
    box, ball = (trimesh.Trimesh(m.vertices, m.faces, process=False) for m in made)
    ball.visual.vertex_colors = np.random.default_rng(4).integers(0, 255, (len(ball.vertices), 4), dtype=np.uint8)
    ball.metadata = {"legend": {"title": "excess [mm]"}}
    own = GltfScene()
    own.add_lines("path", POINTS, RUNS, COLOUR)
    own.add_mesh("stock", box.vertices, box.faces, (168, 122, 58, 255))
    own.add_mesh("part", ball.vertices, ball.faces, ball.visual.vertex_colors, ball.metadata)
    lines = [trimesh.path.entities.Line(np.arange(a - 1, b), color=np.array(COLOUR, np.uint8)) for a, b in RUNS]
    scene, painted = trimesh.Scene(), box.copy()
    painted.visual.face_colors = (168, 122, 58, 255)
    path = trimesh.path.Path3D(entities=lines, vertices=POINTS, process=False)
    for name, body in (("path", path), ("stock", painted), ("part", ball)):
        scene.add_geometry(body, node_name=name, geom_name=name)
    return own.to_bytes(), scene.export(file_type="glb", extension_webp=False)


def _parts(glb: bytes) -> tuple[dict[str, Any], bytes]:
    size = struct.unpack_from("<I", glb, 12)[0]
    assert struct.unpack_from("<I", glb, 8)[0] == len(glb)
    tree = json.loads(glb[20 : 20 + size])
    del tree["asset"]
    return tree, glb[28 + size :]


def test_a_scene_has_the_tree_and_the_arrays_that_trimesh_writes() -> None:
    own, peer = _both()
    assert _parts(own) == _parts(peer)


def test_an_empty_scene_is_a_file_without_bodies() -> None:
    glb = GltfScene().to_bytes()
    assert node_names(glb) == []
    assert scene_bodies(glb) == ()


def test_of_a_selection_the_other_bodies_are_not_read() -> None:
    glb = _both()[0]
    some = trimesh.load(io.BytesIO(select_nodes(glb, frozenset({"part"}))), file_type="glb", force="scene")
    assert set(some.geometry) == {"part"}
    whole = trimesh.load(io.BytesIO(glb), file_type="glb", force="scene").geometry["part"]
    assert np.array_equal(some.geometry["part"].vertices, whole.vertices)


@pytest.mark.parametrize(("without", "names"), [((), ["stock", "part"]), (("stock",), ["part"])])
def test_bodies_are_those_beside_the_path_and_the_kinds_left_out(without: tuple[str, ...], names: list[str]) -> None:
    assert sorted(body.name for body in scene_bodies(_both()[0], without=without)) == sorted(names)


def test_no_body_is_read_where_all_are_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(trimesh, "load")
    assert scene_bodies(_both()[0], without=("stock", "part")) == ()
