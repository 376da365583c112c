"""What the coefficients of a material can prove at a confidence, and what stays unproven.

Notation: an edge of 1 mm has at a chip h the loads L of :mod:`chipload.cutting.material`, linear in the coefficients K
with the covariance C; u = sqrt(g C g') / L, g = dL/dK. A limit is proved at a confidence up to exp(-z u) of it, z its
normal quantile; runout, resolution and the rest of the budget of a load come on top.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

from chipload.checking.settings import CheckSettings
from chipload.cutting.load_parts import with_spread
from chipload.cutting.material import Material
from chipload.units import mm_min_from_mm_s

#: chip [mm] at which the spread of a load is stated; the middle of the range where it is outside
CHIP_MM = 0.1


@dataclass(frozen=True)
class CheckProof:
    """Whether a check can be proved with a material.

    Parameters
    ----------
    check : in words
    share : of the limit up to which the nominal value may be; None: it cannot be proved, or the material does not count
    text : what it depends on, or why it is unproven
    """

    check: str
    share: float | None
    text: str


def usual_chip(material: Material) -> float:
    """Chip thickness [mm] at which the spreads are stated."""
    low, high = material.chip or (0.0, math.inf)
    return CHIP_MM if low <= CHIP_MM <= high else 0.5 * (low + high)


def load_deviations(material: Material, chip: float) -> tuple[float, float]:
    """Return the relative standard deviations of the tangential and of the whole force on an edge.

    >>> plain = Material("plain", 1000.0, 0.0, 0.0, 0.0, 0.0, 0.0, source="made up for this example", spread=0.1)
    >>> [round(u, 12) for u in load_deviations(plain, 0.1)]
    [0.1, 0.1]
    """
    known = with_spread(material)
    width = chip ** (1.0 - np.array(material.exponents))
    basis = np.hstack([np.diag(width), np.eye(3)])
    force = basis @ np.array(material.coefficients)
    covariance = basis @ known.variances @ basis.T
    size = float(np.linalg.norm(force))
    along = force / size
    return math.sqrt(covariance[0, 0]) / float(force[0]), math.sqrt(float(along @ covariance @ along)) / size


def proved_shares(material: Material, confidence: float = CheckSettings.confidence) -> tuple[float, float]:
    """Return the shares of a limit of torque and of force up to which it is proved, by the coefficients alone.

    >>> plain = Material("plain", 1000.0, 0.0, 0.0, 0.0, 0.0, 0.0, source="made up for this example", spread=0.25)
    >>> [round(x, 3) for x in proved_shares(plain)]
    [0.663, 0.663]
    """
    z = NormalDist().inv_cdf(confidence)
    torque, force = (math.exp(-z * u) for u in load_deviations(material, usual_chip(material)))
    return torque, force


def material_proofs(material: Material, confidence: float = CheckSettings.confidence) -> tuple[CheckProof, ...]:
    """Return what each check of a program can prove with a material."""
    torque, force = proved_shares(material, confidence)
    lacks = "unproven: the radial and axial coefficients are not known"
    bends = "with the stiffness of cutter, holder and workpiece"
    loads = [("force", ""), ("deflection, form error", bends), ("stress of the cutter", "with its strength")]
    sizes = any(material.exponents)
    chatter = "at the nominal coefficients, with stated or measured dynamics; [dynamics] spread counts the others"
    sle = "unproven: the coefficients have a size effect (exponents)" if sizes else "with stated or measured dynamics"
    return (
        CheckProof("torque, power", torque, ""),
        *(CheckProof(name, None if material.tangential else force, lacks if material.tangential else text)
          for name, text in loads),
        CheckProof("chatter", None, lacks if material.tangential else chatter),
        CheckProof("surface location error", None, lacks if material.tangential else sle),
        CheckProof("chip thickness", None, "by geometry: no coefficient counts"),
    )  # fmt: skip


def proofs_text(material: Material, confidence: float = CheckSettings.confidence) -> str:
    """Return the lines of what a material states and proves."""
    m, known = material, with_spread(material)
    names = ("Ktc", "Krc", "Kac", "Kte", "Kre", "Kae")
    deviation = np.sqrt(np.diagonal(known.variances))
    lines = [f"{m.name}: {m.workpiece}", ""]
    for k, (name, value) in enumerate(zip(names, m.coefficients, strict=True)):
        if m.tangential and name[1] != "t":
            continue
        size = f", size effect h^-{m.exponents[k]:g}" if k < 3 and m.exponents[k] else ""
        spread = f" +- {100.0 * deviation[k] / abs(value):.0f} %" if value else ""
        lines.append(f"{name} {value:g} {'MPa' if k < 3 else 'N/mm'}{spread}{size}")
    sure = deviation > 0.0
    if sure.sum() > 1 and not m.tangential:
        r = (known.variances[np.ix_(sure, sure)] / np.outer(deviation[sure], deviation[sure]))[
            np.triu_indices(sure.sum(), 1)
        ]
        span = f"{r.min():.2f}" if np.ptp(r) < 0.005 else f"{r.min():.2f} to {r.max():.2f}"
        lines.append(f"correlation of their errors {span}")
    if not m.has_band:
        lines.append("its spread is not stated: 25 % is assumed")
    chip = "chips of any thickness: the source states no range"
    lines += ["", chip if m.chip is None else f"chips of {m.chip[0]:g} to {m.chip[1]:g} mm; outside loads are unproven"]
    if m.speed is None:
        lines.append("any cutting speed: the source states no range")
    else:
        low, high = (mm_min_from_mm_s(v) / 1000.0 for v in m.speed)
        lines.append(f"cutting speeds of {low:g} to {high:g} m/min; outside loads are unproven")
    lines += [
        "",
        f"What it proves at {100.0 * confidence:g} %, by its coefficients alone, at a chip of {usual_chip(m):g} mm:",
    ]
    for proof in material_proofs(m, confidence):
        share = "" if proof.share is None else f"nominal value up to {proof.share:.2f} of the limit"
        lines.append(f"  {proof.check}: {', '.join(x for x in (share, proof.text) if x)}")
    return "\n".join([*lines, "", f"Source: {m.source}", f"Conditions: {m.conditions or 'not stated'}"])
