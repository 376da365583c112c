"""Bodies of a scene: none is left out, one of very many triangles is drawn with fewer and within what is stated."""

import numpy as np
import trimesh

from chipload.report.bodies import bodies_note, scene_bodies


def scene_of(**meshes: trimesh.Trimesh) -> bytes:
    scene = trimesh.Scene()
    for name, mesh in meshes.items():
        scene.add_geometry(mesh, node_name=name, geom_name=name)
    return scene.export(file_type="glb", extension_webp=False)


def test_a_body_of_many_triangles_keeps_its_shape_within_what_is_stated() -> None:
    ball = trimesh.creation.icosphere(subdivisions=5, radius=30.0)
    (body,) = scene_bodies(scene_of(stock=ball), most=5000)
    assert (body.triangles, len(ball.faces)) == (20480, 20480)
    assert 1000 < len(body.faces) <= 5000
    assert 0.0 < body.moved_mm < 5.0
    # the mean of points on a sphere lies within it, by no more than stated
    away = 30.0 - np.linalg.norm(body.vertices, axis=1)
    assert away.min() > -1e-3
    assert away.max() <= body.moved_mm
    drawn = trimesh.Trimesh(body.vertices, body.faces)
    assert abs(drawn.volume / ball.volume - 1.0) < 0.05
    assert bodies_note((body,)).startswith(f"stock has 20480 triangles: drawn with {len(body.faces)}, within ")


def test_bodies_have_their_kind_and_colour_and_paths_are_left_to_the_view() -> None:
    box = trimesh.creation.box()
    box.visual.face_colors = (10, 20, 30, 255)
    scene = scene_of(**{"0-wall": box, "fixture 0": box.copy(), "part": box.copy(), "0-cutter": box.copy()})
    found = scene_bodies(scene)
    assert sorted((b.name, b.kind) for b in found) == [("0-wall", "wall"), ("fixture 0", "fixture"), ("part", "part")]
    assert {tuple(b.colours.tolist()) for b in found} == {(10, 20, 30, 255)}
    assert {b.moved_mm for b in found} == {0.0}
    assert bodies_note(found) == ""
