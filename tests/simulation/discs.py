"""Oracle: mean loads of a cutter that goes along a wall, as a fine stack of discs in closed form."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material

#: speed of the spindle [rad/s]
SPEED = 300.0


def mean_loads_of_discs(
    radii: NDArray[np.float64], deep: float, rest: float, cutter: Cutter, feed: float, material: Material
) -> dict[str, float]:
    """Means over a revolution: of each disc phi goes from acos(-rest / rho) to pi, h = f sin(kappa) sin(phi).

    ``radii`` (n,) of the profile [mm] at even heights from 0 to ``deep``, ``rest`` from the axis to the edge of the
    stock [mm], on the right of a motion along x with ``feed`` [mm/s].
    """
    f = math.tau * feed / (cutter.flutes * SPEED)
    drho, dz = np.diff(radii), deep / (len(radii) - 1)
    rho, kappa, ds = 0.5 * (radii[1:] + radii[:-1]), np.arctan2(dz, drho), np.hypot(drho, dz)
    into = rho > rest
    rho, kappa, ds = rho[into], kappa[into], ds[into]
    phi = np.arccos(-rest / rho)
    s1, c1 = np.sin(phi), np.cos(phi)
    s, c = 1.0 + c1, -s1  # integrals of sin and cos from phi to pi
    ss, sc = 0.5 * (math.pi - phi + s1 * c1), -0.5 * s1**2
    h = f * np.sin(kappa)
    m, share = material, cutter.flutes / math.tau
    # t = (cos, -sin) along the feed and left of it, u = (sin, cos); phi = pi on the right, where the stock is
    tangential_x, tangential_y = m.Ktc * h * sc + m.Kte * c, -(m.Ktc * h * ss + m.Kte * s)
    normal = m.Krc * h, m.Kre
    normal_x, normal_y = normal[0] * ss + normal[1] * s, normal[0] * sc + normal[1] * c
    once = normal[0] * s + normal[1] * (math.pi - phi)
    up = m.Kac * h, m.Kae
    up_x, up_y = up[0] * ss + up[1] * s, up[0] * sc + up[1] * c
    up_once = up[0] * s + up[1] * (math.pi - phi)
    sk, ck = np.sin(kappa), np.cos(kappa)
    return {
        "force_x_mean_n": float(-share * (ds * (tangential_x + sk * normal_x + ck * up_x)).sum()),
        "force_y_mean_n": float(-share * (ds * (tangential_y + sk * normal_y + ck * up_y)).sum()),
        "force_z_mean_n": float(-share * (ds * (sk * up_once - ck * once)).sum()),
        "torque_mean_nm": float(share * (ds * rho * (m.Ktc * h * s + m.Kte * (math.pi - phi))).sum() / 1000.0),
    }
