"""The public set of cuts with references, and how the references are made.

    python benchmarks/cut_references.py        # writes benchmarks/cuts/cuts.toml anew; half a minute

Sixty questions about milling, each with the numbers that it needs, a reference and the method that the reference comes
from: forces over a turn, deflection and form error, natural frequencies, stability limits, times of programs. No
reference is computed by the package: they are brute force, closed forms, semi-discretisation, and a real LinuxCNC.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import brentq

TESTS = Path(__file__).parents[1] / "tests"
sys.path[0] = str(TESTS)  # in place of this folder, whose names are those of packages of the tests

from api.mechanics.test_stability import DAMPING, HZ, PER_DEPTH, K, lobes  # noqa: E402
from cycle_counts.cycles import LIMITS  # noqa: E402
from cycle_counts.programs import own_programs, recorded  # noqa: E402
from engagement.tooth_paths import Cut, greatest_wall_error, true_loads  # noqa: E402
from papers import test_insperger2004 as one_mode  # noqa: E402

CUTS = Path(__file__).with_name("cuts") / "cuts.toml"
LICENCE = "CC0-1.0"
#: Ktc, Krc, Kac [MPa], Kte, Kre, Kae [N/mm], made up with the sizes of an aluminium alloy and of a steel
LIGHT, HEAVY = (800.0, 300.0, 150.0, 20.0, 15.0, 5.0), (1900.0, 900.0, 300.0, 30.0, 40.0, 5.0)
#: diameter, flutes, helix, axial and radial depth, feed per tooth, up milling, runout; where ae = D it is a slot
FORCES = (
    (10.0, 4, 30.0, 5.0, 1.0, 0.06, False, 0.0), (10.0, 4, 30.0, 5.0, 1.0, 0.06, True, 0.0),
    (10.0, 4, 30.0, 5.0, 1.0, 0.06, False, 0.01), (10.0, 4, 45.0, 20.0, 0.5, 0.05, False, 0.0),
    (10.0, 4, 45.0, 20.0, 0.5, 0.05, False, 0.01), (10.0, 4, 45.0, 20.0, 0.05, 0.1, False, 0.0),
    (10.0, 4, 45.0, 20.0, 0.02, 0.2, True, 0.0), (12.0, 3, 38.0, 24.0, 1.2, 0.08, False, 0.005),
    (12.0, 3, 38.0, 6.0, 12.0, 0.05, False, 0.0), (12.0, 3, 38.0, 6.0, 12.0, 0.05, False, 0.01),
    (16.0, 5, 35.0, 16.0, 3.2, 0.1, False, 0.0), (16.0, 5, 35.0, 32.0, 0.8, 0.12, True, 0.005),
    (20.0, 4, 30.0, 10.0, 20.0, 0.1, False, 0.0), (20.0, 4, 30.0, 3.0, 14.0, 0.15, False, 0.0),
    (20.0, 2, 20.0, 20.0, 2.0, 0.2, False, 0.0), (6.0, 2, 30.0, 3.0, 6.0, 0.03, False, 0.0),
    (6.0, 3, 45.0, 9.0, 0.3, 0.04, False, 0.0), (6.0, 4, 40.0, 12.0, 0.1, 0.03, False, 0.003),
    (4.0, 2, 30.0, 4.0, 0.4, 0.02, True, 0.0), (4.0, 4, 35.0, 6.0, 0.2, 0.02, False, 0.005),
    (8.0, 2, 30.0, 8.0, 4.0, 0.05, False, 0.0), (8.0, 3, 40.0, 16.0, 0.8, 0.06, True, 0.01),
    (3.0, 2, 25.0, 1.5, 3.0, 0.012, False, 0.0), (20.0, 6, 45.0, 40.0, 0.4, 0.1, False, 0.01),
)  # fmt: skip
#: diameter, flutes, helix, axial depth, radial depth, feed per tooth, up milling, overhang
WALLS = (
    (10.0, 4, 30.0, 10.0, 0.5, 0.05, False, 35.0), (10.0, 4, 30.0, 10.0, 0.5, 0.05, True, 35.0),
    (12.0, 3, 38.0, 20.0, 0.3, 0.06, False, 45.0), (16.0, 5, 45.0, 30.0, 0.5, 0.08, False, 60.0),
    (6.0, 2, 30.0, 9.0, 0.2, 0.03, False, 25.0), (20.0, 2, 25.0, 20.0, 1.0, 0.1, True, 70.0),
)  # fmt: skip
#: diameter, fluted length, overhang, height of the force above the tip [mm]
BARS = (
    (10.0, 22.0, 35.0, 0.0), (10.0, 22.0, 35.0, 10.0), (6.0, 13.0, 30.0, 0.0), (16.0, 32.0, 80.0, 0.0),
    (4.0, 8.0, 20.0, 4.0), (20.0, 40.0, 100.0, 20.0),
)  # fmt: skip
#: length, height, thickness [mm], Young's modulus [GPa], height of force and place; a strip clamped at its foot
STRIPS = (
    (10.0, 100.0, 4.0, 70.0, 75.0),
    (10.0, 100.0, 4.0, 70.0, 50.0),
    (8.0, 60.0, 3.0, 114.0, 60.0),
    (15.0, 120.0, 6.0, 210.0, 90.0),
)
#: spindle speeds [rpm] of the stability limits
SLOT_RPM = (4200.0, 4875.0, 5680.0, 6500.0, 7000.0, 8200.0)
ONE_MODE = (
    (6000.0, "down", 5.0),
    (9500.0, "down", 5.0),
    (15700.0, "up", 5.0),
    (22000.0, "up", 5.0),
    (12000.0, "down", 0.5),
    (18900.0, "up", 0.5),
)
TIMES = (
    "line, G64",
    "zigzag, G61.1",
    "two circles, G64",
    "arcs at corners, G64 P",
    "slots of lines and arcs, G64 P",
    "pockets, G64 P",
)


def cutter(D: float, N: int, helix: float, flute: float, overhang: float, runout: float = 0.0) -> dict[str, Any]:
    """The keys of a carbide end mill."""
    known = {
        "diameter_mm": D, "flutes": N, "helix_deg": helix, "flute_length_mm": flute, "overhang_mm": overhang,
        "modulus_gpa": 580.0,
    }  # fmt: skip
    return known | ({"runout_mm": runout, "runout_deg": 0.0} if runout else {})


def material(K: tuple[float, ...]) -> dict[str, float]:
    """The six force coefficients by name."""
    names = ("ktc_mpa", "krc_mpa", "kac_mpa", "kte_n_mm", "kre_n_mm", "kae_n_mm")
    return dict(zip(names, K, strict=True))


def engagement(ap: float, ae: float, D: float, up: bool) -> dict[str, Any]:
    """Depths and sense of a straight cut."""
    if ae >= D:
        return {"axial_depth_mm": ap, "milling": "slot"}
    return {"axial_depth_mm": ap, "radial_depth_mm": ae, "milling": "up" if up else "down"}


def force_cuts() -> Iterator[dict[str, Any]]:
    """Greatest force, greatest and mean torque of steady cuts."""
    for k, (D, N, helix, ap, ae, fz, up, runout) in enumerate(FORCES):
        K = HEAVY if k % 3 == 1 else LIGHT
        known = true_loads(Cut(D, N, helix, ap, ae, fz, up, runout, 0.0, (), False), K, rotations=360)
        yield {
            "kind": "force", "cutter": cutter(D, N, helix, ap + 2.0, 4.0 * D, runout), "material": material(K),
            "engagement": engagement(ap, ae, D, up), "feed_per_tooth_mm": fz,
            "source": "true trochoids of all teeth before, each slice of each tooth, 360 rotations a turn",
            "uncertainty": 0.002,
            "reference": {"force_n": known[0], "torque_nm": known[1] / 1e3, "torque_mean_nm": known[2] / 1e3},
        }  # fmt: skip


def wall_cuts() -> Iterator[dict[str, Any]]:
    """Greatest form error of a wall by the bending of the cutter."""
    for D, N, helix, ap, ae, fz, up, overhang in WALLS:
        known = greatest_wall_error(Cut(D, N, helix, ap, ae, fz, up, 0.0, 0.0, (), False), LIGHT, overhang, 580e3)
        yield {
            "kind": "wall", "cutter": cutter(D, N, helix, ap + 2.0, overhang), "material": material(LIGHT),
            "engagement": engagement(ap, ae, D, up), "feed_per_tooth_mm": fz,
            "source": "each height when its edge passes there, each slice of each tooth, a bar of 0.8 of the diameter "
            "over the fluted length in closed form",
            "uncertainty": 0.005, "reference": {"form_error_um": 1e3 * known},
        }  # fmt: skip


def bars() -> Iterator[dict[str, Any]]:
    """Deflection of a stepped bar for each newton."""
    for D, flute, overhang, at in BARS:
        thin, thick = (580e3 * math.pi * d**4 / 64.0 for d in (0.8 * D, D))
        step = max(flute - at, 0.0)
        known = step**3 / (3.0 * thin) + ((overhang - at) ** 3 - step**3) / (3.0 * thick)
        yield {
            "kind": "bar", "cutter": cutter(D, 4, 30.0, flute, overhang), "height_mm": at,
            "source": "Euler-Bernoulli, closed form; 0.8 of the diameter over the fluted length", "uncertainty": 1e-9,
            "reference": {"compliance_um_n": 1e3 * known},
        }  # fmt: skip


def strips() -> Iterator[dict[str, Any]]:
    """Deflection and first frequency of a strip that is clamped at its foot, Poisson's ratio 0."""
    for k, (length, height, thick, gpa, at) in enumerate(STRIPS):
        inertia, E = length * thick**3 / 12.0, 1e3 * gpa
        plate = {"length_mm": length, "height_mm": height, "thickness_mm": thick, "modulus_gpa": gpa, "poisson": 0.0}
        bent = at**3 / (3.0 * E * inertia) + at / (5.0 / 6.0 * 0.5 * E * length * thick)
        yield {
            "kind": "strip", "plate": plate, "height_mm": at,
            "source": "Timoshenko's beam, closed form, shear factor 5/6", "uncertainty": 0.002,
            "reference": {"compliance_um_n": 1e3 * bent},
        }  # fmt: skip
        if k % 2 == 0:
            hz = 1.8751041**2 / (math.tau * (1e-3 * height) ** 2)
            hz *= math.sqrt(1e9 * gpa * (1e-3 * thick) ** 2 / (12.0 * 2700.0))
            yield {
                "kind": "mode", "plate": plate | {"density_kg_m3": 2700.0},
                "source": "Euler-Bernoulli, closed form; shear and rotation lower it by 0.2 %", "uncertainty": 0.003,
                "reference": {"frequency_hz": hz},
            }  # fmt: skip


def stability_limits() -> Iterator[dict[str, Any]]:
    """Greatest stable depth at a spindle speed."""
    mill = cutter(10.0, 4, 0.0, 22.0, 35.0)
    metal = material((1000.0, 4.0 * PER_DEPTH / 4.0, 200.0, 10.0, 5.0, 2.0))
    mode = {"frequency_hz": HZ, "direction": "y", "damping_ratio": DAMPING, "stiffness_n_um": K / 1e3}
    for rpm, limit in zip(SLOT_RPM, lobes(np.array(SLOT_RPM)), strict=True):
        yield {
            "kind": "stability", "cutter": mill, "material": metal, "mode": mode, "speed_rpm": rpm,
            "engagement": {"axial_depth_mm": 0.5, "milling": "slot"},
            "source": "constant directional matrix: the zero-order formula is exact [Altintas1995]",
            "uncertainty": 0.002, "reference": {"limit_depth_mm": float(limit)},
        }  # fmt: skip
    mill = cutter(10.0, 2, 0.0, 22.0, 35.0)
    metal = material((one_mode.KT / 1e6, one_mode.KN / 1e6, 0.0, 0.0, 0.0, 0.0))
    mode = {
        "frequency_hz": one_mode.HZ, "direction": "x", "damping_ratio": one_mode.DAMPING, "mass_kg": one_mode.MASS,
    }  # fmt: skip
    for rpm, milling, ae in ONE_MODE:
        arc = math.acos(1.0 - ae / 5.0)
        ends = (0.0, arc) if milling == "up" else (math.pi - arc, math.pi)
        depth = np.geomspace(0.05, 20.0, 40)
        grown = [one_mode.multiplier(rpm, d, ends, m=80) > 1.0 for d in depth]
        first = int(np.argmax(grown))
        limit = brentq(
            lambda d, r=rpm, e=ends: one_mode.multiplier(r, d, e) - 1.0, depth[first - 1], depth[first], rtol=1e-3
        )
        yield {
            "kind": "stability", "cutter": mill, "material": metal, "mode": mode, "speed_rpm": rpm,
            "engagement": engagement(0.5, ae, 10.0, milling == "up"),
            "source": "semi-discretisation with 160 steps a tooth period; the system of [Insperger2004]",
            "uncertainty": 0.02, "reference": {"limit_depth_mm": float(limit)},
        }  # fmt: skip


def program_times() -> Iterator[dict[str, Any]]:
    """Time in which the axes move, on a machine without a limit of jerk."""
    programs, counts = own_programs(), recorded()
    limits = {axis: {"velocity_mm_s": LIMITS[axis][0], "acceleration_mm_s2": LIMITS[axis][1]} for axis in "XYZ"}
    for name in TIMES:
        yield {
            "kind": "time", "name": name, "axes": limits, "program": programs[name][1],
            "source": "LinuxCNC 2.9 without a screen, servo cycles of 1 ms in which it is not in position",
            "uncertainty": 0.002, "reference": {"time_s": counts[name][1] / 1e3},
        }  # fmt: skip


def text_of(value: Any) -> str:
    """A value as TOML."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {text_of(one)}" for key, one in value.items()) + " }"
    if isinstance(value, str):
        if "\n" in value:
            return f'"""\n{value.rstrip()}\n"""'
        return f'"{value}"'
    if isinstance(value, int):
        return str(value)
    return repr(float(f"{value:.6g}"))


def main() -> int:
    """Write the file."""
    made = (force_cuts(), wall_cuts(), bars(), strips(), stability_limits(), program_times())
    out = [
        "# Sixty questions about milling with their references: benchmarks/cut_references.py makes this file.",
        "# Licence of the file: CC0-1.0. Units are in the names; uncertainty is relative, of the reference.",
        "",
    ]
    count = 0
    for one in (cut for part in made for cut in part):
        count += 1
        rows = {"id": count, **one, "licence": LICENCE}
        out += ["[[cut]]", *(f"{key} = {text_of(value)}" for key, value in rows.items()), ""]
    CUTS.write_text("\n".join(out))
    print(f"{count} cuts: {CUTS}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
