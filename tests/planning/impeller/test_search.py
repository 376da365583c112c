"""The largest cutter at a contact point: closed forms of a slot, a bowl and a bore; sampling; rotation."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chipload.errors import InputError
from chipload.planning.impeller.closed_form import axis_at, contact_limit, rho_limits
from chipload.planning.impeller.scene import Scene
from chipload.planning.impeller.search import CURVATURE, Sampling, limits

NONE = np.zeros((3, 3))


def scene(contact, normal, check, curvature=None, own=1, near=0.0):
    """One or more contact points of surface 0; check points of surface ``own``."""
    contact, normal, check = (np.atleast_2d(np.asarray(x, dtype=float)) for x in (contact, normal, check))
    if curvature is None:
        curvature = np.zeros((len(contact), 3, 3))
    surface = np.full(len(check), own)
    return Scene(contact, normal, curvature, np.zeros(len(contact), dtype=int), check, surface, near)


def channel(seed=0, points=20):
    """Two wavy walls 24 mm apart, contact points on the first with its exact normal and curvature."""
    u, v = (x.ravel() for x in np.meshgrid(np.linspace(-40, 40, 60), np.linspace(0, 40, 24)))

    def wall(x0, phase, u, v):
        return np.stack([x0 + 3.0 * np.sin(u / 15.0 + phase) + 0.1 * v, u, v], axis=-1)

    rng = np.random.default_rng(seed)
    a, b = rng.uniform(-30, 30, points), rng.uniform(6, 35, points)
    slope, bend = 0.2 * np.cos(a / 15.0), -3.0 / 225.0 * np.sin(a / 15.0)
    normal = np.stack([np.ones(points), -slope, np.full(points, -0.1)], axis=-1)
    length = np.linalg.norm(normal, axis=1)
    normal /= length[:, None]
    # graph x = f(y, z): second form f_yy / length on the tangent (slope, 1, 0), of length^2 1 + slope^2 along y
    tangent = np.stack([slope, np.ones(points), np.zeros(points)], axis=-1)
    up = np.stack([np.full(points, 0.1), np.zeros(points), np.ones(points)], axis=-1)
    curvature = np.empty((points, 3, 3))
    for k in range(points):
        J = np.stack([tangent[k], up[k]], axis=1)
        inv = np.linalg.pinv(J)
        curvature[k] = inv.T @ np.diag([bend[k] / length[k], 0.0]) @ inv
    check = np.concatenate([wall(0.0, 0.0, u, v), wall(24.0, 0.5, u, v)])
    own = np.repeat([0, 1], len(u))
    return Scene(wall(0.0, 0.0, a, b), normal, curvature, np.zeros(points, dtype=int), check, own, 2.0)


def admitted(s, c, table, pallets, r):
    """Least limit of contact point c at each B by the formulas, point by point; -inf where n < 0."""
    keep = ~((s.check_surface == s.surface[c]) & (((s.check - s.contact[c]) ** 2).sum(axis=1) < s.near**2))
    check = s.check[keep]
    out = np.full(len(pallets), -np.inf)
    for k, T in enumerate(axis_at(table, pallets)):
        if s.normal[c] @ T >= -1e-12:
            at_points = rho_limits(check, s.contact[c], s.normal[c], T, r).min(initial=np.inf)
            out[k] = min(at_points, contact_limit(s.normal[c], T, r, s.curvature[c]))
    return out


@pytest.mark.parametrize(("width", "r"), [(24.185, 2.0), (24.185, 0.0), (8.0, 4.0)])
def test_slot(width, r):
    # a slot along x, its far wall in the plane z = 0 of the contact: R = W / 2
    far = np.stack([np.linspace(-30, 30, 601), np.full(601, width), np.zeros(601)], axis=-1)
    s = scene([0, 0, 0], [0, 1, 0], np.concatenate([far + np.array([0, 0, z]) for z in np.linspace(-40, 40, 81)]))
    found = limits(s, [0.5 * math.pi], r, 40.0)
    # the tool axis lies in the plane of the slot at alpha = 90 deg only where B = 0 or pi
    assert found.rho[0, 0] == pytest.approx(0.5 * width - r, abs=1e-9)
    assert found.certified.all()


@pytest.mark.parametrize("n", [0.0, 0.3, 0.8])
def test_bowl(n):
    # inside of a sphere of radius Rs, whole surface as check points: rho = (Rs - r) sqrt(1 - n^2)
    Rs, r = 30.0, 2.0
    z = np.linspace(-1, 1, 201)
    t = np.linspace(0, 2 * np.pi, 721)
    ball = Rs * np.stack([np.outer(np.sqrt(1 - z * z), f(t)).ravel() for f in (np.cos, np.sin)], axis=-1)
    ball = np.column_stack([ball, np.repeat(Rs * z, len(t))])
    normal = np.array([-math.sqrt(1 - n * n), 0.0, n])
    contact = -Rs * normal
    K = (np.eye(3) - np.outer(normal, normal)) / Rs
    exact = (Rs - r) * math.sqrt(1 - n * n)
    axis = np.array([0.0, 0.0, 1.0])
    assert contact_limit(normal, axis, r, K) == pytest.approx(exact, abs=1e-9)
    far = ((ball - contact) ** 2).sum(axis=1) > 1.0
    V = (normal - n * axis) / math.sqrt(1 - n * n)
    # the flank of a cylinder with no end meets the upper half; only points at and below the corner's centres count
    low = (ball - contact - r * normal) @ axis < 1e-9
    assert rho_limits(ball[far & low], contact, normal, axis, r).min() == pytest.approx(exact, abs=1e-3)
    # the point of the bowl opposite in the plane of the corner's centres, exactly
    centre = contact + r * normal
    across = V * (-centre @ V * 2.0) + centre
    touch = across + r * across / np.linalg.norm(across)
    touch *= Rs / np.linalg.norm(touch)
    assert rho_limits([touch], contact, normal, axis, r)[0] == pytest.approx(exact, abs=1e-9)
    found = limits(scene(contact, normal, ball[far & low], [K]), [0.0], r, 40.0)
    assert found.rho[0, 0] == pytest.approx(exact, abs=1e-9)


def test_bore_parallel_to_the_axis():
    R, r = 17.0, 3.0
    t = np.linspace(0, 2 * np.pi, 180, endpoint=False)
    ring = np.stack([R * np.cos(t), R * np.sin(t)], axis=-1)
    bore = np.concatenate([np.column_stack([ring, np.full(180, z)]) for z in np.linspace(0, 30, 11)])
    contact, normal = np.array([R, 0.0, 10.0]), np.array([-1.0, 0.0, 0.0])
    K = np.diag([0.0, 1.0 / R, 0.0])
    found = limits(scene(contact, normal, bore, [K], own=0, near=0.5), [0.0], r, 40.0)
    assert found.rho[0, 0] == pytest.approx(R - r, abs=1e-9)
    # by the check points alone too
    assert limits(scene(contact, normal, bore[1:], [NONE], near=0.5), [0.0], r, 40.0).rho[0, 0] == pytest.approx(
        R - r, abs=1e-9
    )


def test_certificate_agrees_with_7200_samples():
    s = channel(points=3)
    tables = np.radians([25.0, 60.0, 90.0])
    found = limits(s, tables, 2.0, 40.0, sampling=Sampling(eps=1e-3))
    assert found.certified.all()
    B = np.linspace(0, 2 * np.pi, 7200, endpoint=False)
    for c in range(3):
        for t in range(3):
            sampled = admitted(s, c, tables[t], B, 2.0).max()
            assert sampled <= found.bound[c, t]
            assert found.bound[c, t] <= found.rho[c, t] + 1e-3 + 1e-12
            reached = admitted(s, c, tables[t], found.pallet[c, t : t + 1], 2.0)[0]
            assert reached == pytest.approx(found.rho[c, t], abs=1e-9)


def test_the_blockers_alone_forbid_more():
    s = channel(points=5)
    found = limits(s, [math.radians(40.0)], 2.0, 40.0)
    B = np.linspace(0, 2 * np.pi, 7200, endpoint=False)
    for c in range(5):
        who = found.blockers[c, 0]
        few = scene(s.contact[c], s.normal[c], s.check[who[who >= 0]], s.curvature[c : c + 1])
        if CURVATURE not in who:
            few = scene(s.contact[c], s.normal[c], s.check[who[who >= 0]])
        assert admitted(few, 0, math.radians(40.0), B, 2.0).max() <= found.bound[c, 0]


def test_only_the_best_table_angle_needs_the_proof():
    s = channel(points=12)
    tables = np.radians(np.arange(20.0, 91.0, 10.0))
    every, best = (limits(s, tables, 2.0, 40.0, every=e) for e in (True, False))
    assert best.certified.all()
    np.testing.assert_allclose(best.rho.max(axis=1), every.rho.max(axis=1), atol=1e-3)
    assert (best.bound.max(axis=1) >= every.rho.max(axis=1)).all()


@settings(max_examples=8, deadline=None)
@given(turn=st.floats(-3.0, 3.0))
def test_turning_the_scene_turns_the_answer(turn):
    s = channel(points=3)
    c, n = math.cos(turn), math.sin(turn)
    Q = np.array([[c, -n, 0], [n, c, 0], [0, 0, 1.0]])
    turned = Scene(
        s.contact @ Q.T, s.normal @ Q.T, Q @ s.curvature @ Q.T, s.surface, s.check @ Q.T, s.check_surface, s.near
    )
    tables = np.radians([30.0, 70.0])
    eps = Sampling(eps=1e-6)
    a, b = limits(s, tables, 2.0, 40.0, sampling=eps), limits(turned, tables, 2.0, 40.0, sampling=eps)
    np.testing.assert_allclose(a.rho, b.rho, atol=1.1e-6)


def test_the_same_point_turned_exactly():
    # one blocker, table and axis fixed: the closed form is invariant to rounding
    s = channel(points=4)
    for turn in (0.3, 1.7):
        c, n = math.cos(turn), math.sin(turn)
        Q = np.array([[c, -n, 0], [n, c, 0], [0, 0, 1.0]])
        for k in range(4):
            B = math.atan2(s.normal[k, 1], s.normal[k, 0]) + 0.8
            a = rho_limits(s.check[1440:], s.contact[k], s.normal[k], axis_at(0.9, B), 2.0)
            b = rho_limits(s.check[1440:] @ Q.T, Q @ s.contact[k], Q @ s.normal[k], axis_at(0.9, B + turn), 2.0)
            np.testing.assert_allclose(a, b, rtol=1e-9)


def test_two_workers_give_the_same_bytes():
    s = channel(points=130)
    one, two = (limits(s, [0.7], 2.0, 40.0, workers=w) for w in (1, 2))
    assert one.rho.tobytes() == two.rho.tobytes()
    assert one.blockers.tobytes() == two.blockers.tobytes()


def test_corner_larger_than_the_curvature():
    K = np.diag([0.0, 0.4, 0.0])
    found = limits(scene([0, 0, 0], [1, 0, 0], [[50.0, 0, 0]], [K]), [0.5], 3.0, 40.0)
    assert found.rho[0, 0] == -np.inf
    assert found.blockers[0, 0, 0] == CURVATURE


def test_table_that_never_faces_the_surface():
    found = limits(scene([0, 0, 0], [0, 0, -1], [[50.0, 0, 0]]), [0.3], 2.0, 40.0)
    assert found.rho[0, 0] == -np.inf
    assert found.certified[0, 0]


def test_refused():
    s = scene([0, 0, 0], [1, 0, 0], [[20.0, 0, 0]])
    with pytest.raises(InputError, match="tables: must be angles from 0 to pi"):
        limits(s, [4.0], 2.0, 40.0)
    with pytest.raises(InputError, match="pallets: must be ascending ranges"):
        limits(s, [1.0], 2.0, 40.0, pallets=[(1.0, 0.0)])
    with pytest.raises(InputError, match=r"scene.normal of contact point 0: must be a unit vector"):
        scene([0, 0, 0], [1, 1, 0], [[20.0, 0, 0]])
