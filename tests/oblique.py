"""Cutting coefficients of a helical edge from orthogonal cutting tests.

Notation: tau [MPa] shear stress in the shear plane; beta_a [rad] friction angle on the rake face; phi_n [rad] shear
angle in the plane normal to the edge; r_c chip ratio, thickness uncut over thickness of the chip; alpha_n [rad] normal
rake; i [rad] inclination of the edge, for a milling cutter its helix; eta [rad] direction of the chip on the rake
face, from the normal to the edge; h [mm] chip thickness.

    tan(beta_n) = tan(beta_a) cos(eta),  eta = i (Stabler),
    D = sqrt(cos^2(phi_n + beta_n - alpha_n) + tan^2(eta) sin^2(beta_n)),
    Ktc = tau / sin(phi_n) [cos(beta_n - alpha_n) + tan(i) tan(eta) sin(beta_n)] / D,
    Krc = tau / (sin(phi_n) cos(i)) sin(beta_n - alpha_n) / D,
    Kac = tau / sin(phi_n) [cos(beta_n - alpha_n) tan(i) - tan(eta) sin(beta_n)] / D.

The edge coefficients are those of the orthogonal tests. What depends on h does so through r_c: the coefficients are
those at one h, a mean one of the cut.

Reference: [Altintas2012] ch. 2, mechanics of oblique cutting; [Budak1996].
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from chipload.cutting.material import Material
from chipload.errors import InputError

#: a number, or a function of the rake [rad] and the chip thickness [mm]
Value = float | Callable[[float, float], float]


@dataclass(frozen=True)
class Orthogonal:
    """What orthogonal tests of a material found.

    Parameters
    ----------
    name, source : as of a material; the source is never empty
    shear_stress : tau [MPa], above 0
    friction : beta_a [rad], 0 to below pi / 2
    shear_angle : phi_c [rad], or None where the chip ratio is given
    chip_ratio : r_c, above 0, or None where the shear angle is given
    edge : (Kte, Kfe) [N/mm] tangential and in the direction of feed
    """

    name: str
    source: str
    shear_stress: Value
    friction: Value
    shear_angle: Value | None = None
    chip_ratio: Value | None = None
    edge: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        if (self.shear_angle is None) == (self.chip_ratio is None):
            raise InputError(f"orthogonal tests of {self.name}: give one of shear_angle and chip_ratio, not both")


def oblique_coefficients(
    tests: Orthogonal, rake: float, inclination: float, thickness: float
) -> tuple[float, float, float]:
    """(Ktc, Krc, Kac) [MPa] of an edge.

    Parameters
    ----------
    tests : what orthogonal cutting found
    rake : alpha_n [rad]
    inclination : i [rad], from 0; below pi / 2
    thickness : h [mm], above 0, at which what depends on it is taken

    Raises
    ------
    InputError
        A number is out of range, or the tests give a shear stress, friction or shear angle that cannot be.

    Examples
    --------
    Without inclination and rake, friction 0, shear at 45 deg: Ktc = tau / (sin cos) = 2 tau, and nothing else.

    >>> soft = Orthogonal("soft", "made up for this example", 300.0, 0.0, shear_angle=math.pi / 4)
    >>> tuple(round(k, 9) for k in oblique_coefficients(soft, 0.0, 0.0, 0.1))
    (600.0, 0.0, 0.0)
    """
    label = f"orthogonal tests of {tests.name}"
    right = 0.5 * math.pi
    if not -right < rake < right:
        raise InputError(f"rake_deg = {math.degrees(rake):g}: must be between -90 and 90")
    if not 0.0 <= inclination < right:
        raise InputError(f"inclination_deg = {math.degrees(inclination):g}: must be from 0 to below 90")
    if not 0.0 < thickness < math.inf:
        raise InputError(f"chip thickness = {thickness:g} mm: must be above 0")
    stress = _at(tests.shear_stress, rake, thickness)
    friction = _at(tests.friction, rake, thickness)
    if not 0.0 < stress < math.inf:
        raise InputError(f"{label}: shear_stress = {stress:g} MPa: must be above 0")
    if not 0.0 <= friction < right:
        raise InputError(f"{label}: friction = {math.degrees(friction):g} deg: must be from 0 to below 90")
    if tests.chip_ratio is not None:
        ratio = _at(tests.chip_ratio, rake, thickness)
        if not 0.0 < ratio < math.inf:
            raise InputError(f"{label}: chip_ratio = {ratio:g}: must be above 0")
        shear = math.atan2(ratio * math.cos(rake), 1.0 - ratio * math.sin(rake))
    else:
        assert tests.shear_angle is not None
        shear = _at(tests.shear_angle, rake, thickness)
    flow = inclination
    normal = math.atan(math.tan(friction) * math.cos(flow))
    if not (0.0 < shear < right and shear + normal - rake < right):
        raise InputError(
            f"{label}: shear angle {math.degrees(shear):g} deg at rake {math.degrees(rake):g} deg, {thickness:g} mm: "
            f"must be above 0 and below {math.degrees(min(right, right - normal + rake)):g}"
        )
    bottom = math.hypot(math.cos(shear + normal - rake), math.tan(flow) * math.sin(normal))
    scale = stress / (math.sin(shear) * bottom)
    along = math.cos(normal - rake)
    return (
        scale * (along + math.tan(inclination) * math.tan(flow) * math.sin(normal)),
        scale * math.sin(normal - rake) / math.cos(inclination),
        scale * (along * math.tan(inclination) - math.tan(flow) * math.sin(normal)),
    )


def oblique_material(tests: Orthogonal, rake: float, helix: float, thickness: float) -> Material:
    """The material that a milling cutter of that rake and helix meets, at a mean chip thickness.

    The axial edge coefficient is 0: orthogonal tests do not find one.

    Parameters and errors as :func:`oblique_coefficients`; the numbers must also be those of a material.
    """
    Ktc, Krc, Kac = oblique_coefficients(tests, rake, helix, thickness)
    return Material(
        tests.name,
        Ktc,
        Krc,
        Kac,
        tests.edge[0],
        tests.edge[1],
        0.0,
        source=tests.source,
        conditions=f"orthogonal to oblique at a chip of {thickness:g} mm",
        cutter=f"normal rake {math.degrees(rake):g} deg, helix {math.degrees(helix):g} deg",
    )


def _at(value: Value, rake: float, thickness: float) -> float:
    """A constant, or a function's value at a rake and a chip thickness."""
    return value(rake, thickness) if callable(value) else value
