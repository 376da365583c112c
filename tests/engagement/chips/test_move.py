"""Moves as polynomials against the interpolations that they stand for."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chipload.engagement.chips.move import Move
from chipload.errors import InputError
from chipload.machine.kinematics import forward
from chipload.machine.machine import machine_named

T = np.linspace(0.0, 1.0, 57)
P0, P1, A0, A1 = [1.0, 2.0, 3.0], [5.0, -1.0, 2.0], np.array([0.3, 0.1, 1.0]), np.array([-0.6, 0.5, 1.0])
U0, U1 = A0 / np.linalg.norm(A0), A1 / np.linalg.norm(A1)


def test_lerp_is_the_normalised_mean():
    tip, axis = Move.lerp(P0, A0, P1, A1).at(T)
    want = U0 + T[:, None] * (U1 - U0)
    np.testing.assert_allclose(axis, want / np.linalg.norm(want, axis=1)[:, None], atol=1e-14)
    np.testing.assert_allclose(tip, np.array(P0) + T[:, None] * (np.array(P1) - P0), atol=1e-14)


def test_slerp_turns_at_an_even_rate():
    _, axis = Move.slerp(P0, A0, P1, A1).at(T)
    whole = math.acos(U0 @ U1)
    np.testing.assert_allclose(np.arccos(np.clip(axis[1:] @ U0, -1, 1)), T[1:] * whole, atol=1e-9)
    np.testing.assert_allclose(axis @ np.cross(U0, U1), 0.0, atol=1e-12)


def test_machine_linear_is_the_machine():
    machine = machine_named("cradle-ac")
    q0, q1 = np.zeros(9), np.array([3.0, -2.0, 80.0, 0.4, 0.0, 0.9, 0.0, 0.0, 0.0])
    tip, axis = Move.machine_linear(machine, q0, q1).at(T)
    want_tip, want_axis = forward(machine, q0 + T[:, None] * (q1 - q0))
    np.testing.assert_allclose(tip, want_tip, atol=1e-10)
    np.testing.assert_allclose(axis, want_axis, atol=1e-10)


@pytest.mark.parametrize("way", [Move.lerp, Move.slerp])
def test_rates_by_differences(way):
    move, d = way(P0, A0, P1, A1), 1e-6
    for k in range(2):
        want = (move.at(T[1:-1] + d)[k] - move.at(T[1:-1] - d)[k]) / (2.0 * d)
        np.testing.assert_allclose(move.rates(T[1:-1])[k], want, atol=1e-8)


def test_a_move_that_no_polynomial_of_order_32_fits_is_refused():
    def at(t):
        return np.column_stack([np.sin(90.0 * t), 0 * t, 0 * t]), np.tile([0.0, 0.0, 1.0], (len(t), 1))

    with pytest.raises(InputError, match="must be within 1e-10 mm: split the move"):
        Move.of(at)


def test_axis_into_the_layer_is_refused_between_the_ends_too():
    machine = machine_named("cradle-ac")
    q0, q1 = np.zeros(9), np.zeros(9)
    q0[3], q1[3] = -0.3, 1.7
    with pytest.raises(InputError, match=r"must be at least 0\.01"):
        Move.machine_linear(machine, q0, q1)


@pytest.mark.parametrize(
    ("axis", "text"), [([0, 0, 0], "must have a length above 0"), ([0, math.nan, 1], "must be three finite numbers")]
)
def test_refused_axis(axis, text):
    with pytest.raises(InputError, match=text):
        Move.lerp(P0, axis, P1, A1)
