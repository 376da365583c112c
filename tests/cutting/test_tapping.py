"""Torque of taps against another maker's formula, and against the spindle."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from chipload.checking.tap_torque import tap_torques
from chipload.cutter.bodies import tap_core
from chipload.cutter.cutter import Cutter
from chipload.cutting.material import material_named, material_text, read_material
from chipload.cutting.tapping import SPREAD, tap_torque
from chipload.errors import InputError, Severity
from chipload.machine.machine import machine_named
from chipload.program.build import plunge, rapid
from chipload.program.program import Program

STEEL, VMC = material_named("steel-1045-from-group-2"), machine_named("vmc")


@pytest.mark.parametrize(("diameter", "pitch"), [(6.0, 1.0), (10.0, 1.5), (16.0, 2.0)])
def test_two_makers_agree(diameter, pitch):
    """[Lubero]: kc P^2 D / 8000 with 2500 to 2600 MPa for steel of 500 to 950 MPa."""
    other = 2550.0 * pitch**2 * diameter / 8000.0
    own = tap_torque(2.0 * tap_core(diameter, pitch, 20.0)[0][0], pitch, STEEL.tap_kc)
    assert own == pytest.approx(other, rel=0.1)


def test_the_formula_by_hand():
    """M8 x 1.25 in a hole of 6.8 mm, D - D0 as of the core, kc 3900, K 1.15."""
    d = 6.8 + 1.0825 * 1.25
    by_hand = math.tan(math.pi / 6.0) * 3900.0 * 1.15 * (d - 6.8) ** 2 * (d + 2.0 * 6.8) / 24000.0
    assert tap_torque(6.8, 1.25, 3900.0) == pytest.approx(by_hand, rel=1e-4)


@pytest.mark.parametrize(
    ("spindle_nm", "severity"), [(70.0, Severity.NOTE), (1.1, Severity.UNPROVEN), (0.9, Severity.EXCEEDS)]
)
def test_a_tap_against_the_spindle(spindle_nm, severity):
    """An M5 x 0.8 tap: nominal 1.0, at 95 % 1.6 N m."""
    core = tap_core(5.0, 0.8, 20.0)
    tap = Cutter(2.0 * core[0][0], 1, 0.0, 20.0, 40.0, 2e5, body=core, thread_pitch=0.8, number=3)
    spindle, feed = 30.0, 0.8 * 30.0 / math.tau
    program = Program.join(
        [
            rapid([0.0, 0.0, 2.0], spindle, 3, "link"),
            plunge([0.0, 0.0, -8.0], feed, spindle, 3, "tap"),
            plunge([0.0, 0.0, 2.0], feed, -spindle, 3, "tap"),
        ]
    )
    machine = replace(VMC, torque=1e3 * spindle_nm, torque_curve=())
    (found,) = tap_torques(program, {3: tap}, STEEL, machine)
    assert (found.code, found.severity) == ("tap-torque", severity)
    nominal = tap_torque(tap.diameter, 0.8, 3900.0)
    assert nominal == pytest.approx(1.0, abs=0.1)
    assert f"at 95 % {nominal * math.exp(1.64485 * SPREAD):.2g} N m" in found.text
    assert tap_torques(program, {3: tap}, material_named("al7075-t6"), machine) == ()
    assert tap_torques(program, {3: replace(tap, thread_pitch=None)}, STEEL, machine) == ()


def test_the_key_of_a_file(tmp_path):
    (tmp_path / "m.toml").write_text(material_text(STEEL), encoding="utf-8")
    assert read_material(tmp_path / "m.toml").tap_kc == 3900.0
    with pytest.raises(InputError, match=r"material.tap_kc_mpa = 5: must be from 10 to 20000 MPa"):
        replace(STEEL, tap_kc=5.0)
