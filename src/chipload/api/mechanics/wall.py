"""Form error of the wall that a cutter leaves as it bends under the forces of a steady cut."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from chipload.api.mechanics.cut import (
    CutEngagement,
    Floats,
    chips_of_cut,
    material_with_directions,
    read_only,
    straight_cutter,
)
from chipload.api.values import AnyCutter
from chipload.cutting.material import Material
from chipload.cutting.wall_error import wall_profile
from chipload.errors import InputError

#: heights where none are stated
HEIGHTS = 101


@dataclass(frozen=True, eq=False)
class WallErrors:
    """Form error of a wall over its height.

    Parameters
    ----------
    height_mm : (p,) float, above the tip
    error_um : (p,) float, positive where material is left, negative where it is cut away
    """

    height_mm: Floats
    error_um: Floats


def wall_form_error(
    cutter: AnyCutter,
    material: Material | str | Path,
    engagement: CutEngagement,
    feed_per_tooth_mm: float,
    *,
    height_mm: ArrayLike | None = None,
    work_um_n: float = 0.0,
) -> WallErrors:
    """Return the form error of the wall that the bending of the cutter leaves, over the depth of cut.

    A tooth makes the wall at the height z when its edge passes there at an immersion of 0 (up milling) or 180 deg (down
    milling). The load of all teeth at that moment bends the cutter, a stepped cantilever:

        e(z) = integral of f_n(z') [C(z', z) + c_w] dz'.

    Parameters
    ----------
    cutter : straight flank, evenly spaced teeth
    material : a value, the name of a shipped material, or a file
    engagement : of the cut; its arc begins at 0 (up milling) or ends at 180 deg (down milling), not both
    feed_per_tooth_mm : f_z, above 0
    height_mm : (p,) float, from 0 to the overhang; None: 101 heights over the depth of cut
    work_um_n : compliance c_w of the work normal to the wall, at least 0

    Returns
    -------
    WallErrors

    Raises
    ------
    InputError
        A number is out of range, no wall or two are made, the pitch is uneven, or only the tangential force of the
        material is known.

    References
    ----------
    [Altintas2012] ch. 2; [Kops1990] for the diameter of the fluted part.

    Examples
    --------
    No helix, down milling, a depth of 0.01 mm: the edge force alone, Kre ap = 10 * 0.01 N, bends a bar of steel by
    F l^3 / (3 E I) = 0.1 * 27000 / (3 * 600000 * 490.87) mm.

    >>> import chipload
    >>> bar = chipload.Cutter(diameter_mm=10, flutes=2, helix_deg=0, flute_length_mm=30, overhang_mm=30,
    ...                       modulus_gpa=600, fluted_factor=1.0)
    >>> metal = chipload.Material("plain", 1000.0, 300.0, 0.0, 0.0, 10.0, 0.0, source="made up for this example")
    >>> cut = chipload.engagement_of_cut(bar, axial_depth_mm=0.01, radial_depth_mm=0.1, milling="down")
    >>> error = wall_form_error(bar, metal, cut, 0.05).error_um
    >>> round(float(error[0]), 4), round(0.1 * 27000 / (3 * 600000 * 490.87) * 1000, 4)
    (0.0031, 0.0031)
    """
    mill, metal = straight_cutter(cutter), material_with_directions(material, "the error of a wall")
    if not 0.0 <= work_um_n < np.inf:
        raise InputError(f"work_um_n = {work_um_n:g}: must be at least 0 (0 is rigid)")
    up, down = engagement.entry_deg == 0.0, engagement.exit_deg == 180.0
    if up == down:
        found = "makes two walls" if up else "makes no wall"
        raise InputError(
            f"engagement: {engagement.entry_deg:g} to {engagement.exit_deg:g} deg: {found}: must begin at 0 or end at "
            "180, not both"
        )
    chips = chips_of_cut(mill, engagement, feed_per_tooth_mm)
    heights = np.linspace(0.0, engagement.axial_depth_mm, HEIGHTS) if height_mm is None else height_mm
    profile = wall_profile(
        chips, mill, metal, heights, milling="up" if up else "down", work_compliance=work_um_n / 1000.0
    )
    return WallErrors(read_only(heights), read_only(1000.0 * profile[0]))
