"""The force model: force, torque and power from tooth engagement and force coefficients.

Notation: A the axis from the tip to the holder, T the direction that immersion is counted from less pi/2 (that of the
feed where the feed is normal to A), n = Rot(+90 deg about A) T; phi immersion, h chip thickness, s length along the
profile, rho, kappa, u, nu and engagement ranges as in :mod:`chipload.engagement.tooth_engagement`; theta rotation of
tooth 0 at the tip, counted as phi; lag of the edge at s as in :mod:`chipload.cutter.slices`; Ft, Fr, Fa and their
coefficients as in :mod:`chipload.cutting.material`.

Every force is the force ON THE CUTTER; the one on the work is its opposite. With a clockwise spindle (M3, seen from
above) the rim at phi lies in the direction u = cos(phi) n + sin(phi) T and moves along t = cos(phi) T - sin(phi) n. The
tangential force opposes the motion of the tooth, the radial one pushes it into the cutter along nu = sin(kappa) u -
cos(kappa) A, and the axial one, along the edge e = cos(kappa) u + sin(kappa) A, pulls a right-hand helix with
right-hand cut out of the holder:

    dF = -dFt t - dFr nu - dFa e,  dFt = (Ktc h + Kte) ds, likewise r and a;  torque rho dFt.

On a straight flank nu = u and e = A; on a flat bottom the radial force is the thrust, along A. With a counter-clockwise
spindle (M4, left-hand cutter) n is mirrored and everything else is unchanged.

Within an engagement range h is a sinusoid, and the integral over s has a closed form: a straight flank needs no slices.
If the material has a size effect, h^(1 - m) in place of h, the integral is a quadrature with an error of 1e-7 or less.

Reference: [Altintas2012] ch. 2, analytic forces of a helical end mill; [Engin2001] for kappa and the sign of the axial
force; [Kienzle1952] for the size effect.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material
from chipload.engagement.tooth_engagement import ToothEngagement, engagement_of_arcs
from chipload.engagement.tooth_surfaces import chips_of_teeth
from chipload.errors import InputError
from chipload.lazy import LateModule

_tooth_force = LateModule("chipload.cutting._tooth_force")

Floats = NDArray[np.float64]
Spindle = Literal["cw", "ccw"]

#: distance of samples over the revolution [rad]; the greatest is refined between them
SAMPLE_STEP = math.radians(1.0)

#: greatest number of engagement ranges of a step whose ends the search of the greatest load computes
EXACT_ROWS = 24


def _arrays(engagement: ToothEngagement, cutter: Cutter) -> tuple[Any, ...]:
    """Return tooth engagement as arrays for the kernels, after a check that the cutter has its teeth."""
    top = int(engagement.tooth.max(initial=-1))
    if top >= cutter.flutes:
        raise InputError(f"tooth engagement: tooth {top}: must be below cutter.flutes = {cutter.flutes}")
    return engagement.start, engagement.rows, engagement.tooth, engagement.slice, engagement.slices


def forces_over_turn(
    engagement: ToothEngagement, cutter: Cutter, material: Material, theta: ArrayLike
) -> tuple[Floats, Floats]:
    """Return the force on the cutter and the torque at given rotations.

    Parameters
    ----------
    engagement : of n steps
    cutter, material : number of teeth; coefficients
    theta : (m,) float [rad], rotation of tooth 0 at the tip

    Returns
    -------
    force : (n, m, 3) float [N] along T, n (mirrored where the spindle is counter-clockwise) and the axis; for the frame
        of the work see :func:`in_work`
    torque : (n, m) float [N mm]

    Examples
    --------
    One straight tooth straight ahead: Ft = (Ktc f_z + Kte) depth = (1000 * 0.1 + 10) * 2 pushes it towards +n.

    >>> mill = Cutter(10.0, 1, 0.0, 20.0, 30.0, 6e5)
    >>> plain = Material("plain", 1000.0, 300.0, 0.0, 10.0, 5.0, 0.0, source="made up for this example")
    >>> engagement = engagement_of_arcs([0.0], [math.pi], 0.1, mill, 2.0)
    >>> force, torque = forces_over_turn(engagement, mill, plain, [math.pi / 2])
    >>> force[0, 0].round(9).tolist(), torque.round(9).tolist()
    ([-70.0, 220.0, 0.0], [[1100.0]])
    """
    angles = np.ascontiguousarray(theta, dtype=np.float64)
    out = np.zeros((len(engagement), len(angles), 4))
    _tooth_force.turn_of(*_arrays(engagement, cutter), angles, cutter.flutes, np.array(material.law), out)
    return out[..., :3], out[..., 3]


def mean_forces(engagement: ToothEngagement, cutter: Cutter, material: Material) -> tuple[Floats, Floats]:
    """Return force on the cutter and torque averaged over a revolution; they do not depend on the lag of the edge.

    Returns
    -------
    force : (n, 3) float [N] along T, n (mirrored where the spindle is counter-clockwise) and the axis
    torque : (n,) float [N mm]

    Reference: [Altintas2012] ch. 2, average forces.
    """
    out = np.zeros((len(engagement), 4))
    _tooth_force.means(*_arrays(engagement, cutter), cutter.flutes, np.array(material.law), out)
    return out[:, :3], out[:, 3]


def greatest_forces(
    engagement: ToothEngagement,
    cutter: Cutter,
    material: Material,
    sample_step: float = SAMPLE_STEP,
    exact_rows: int | None = EXACT_ROWS,
) -> Mapping[str, Floats]:
    """Return the greatest in-plane force, torque and axial force over a revolution.

    The rotations where an engagement range begins or ends are found exactly; between them the load is smooth. It is
    sampled there at most ``sample_step`` apart and refined by golden section. Jumps (zero helix) count with their
    one-sided limits.

    In a step of more than ``exact_rows`` engagement ranges (None: no such limit) the ends are not computed, because
    their number times that of the ranges grows too fast. The revolution, or the pitch if all teeth are alike, is
    sampled ``sample_step`` apart and the best sample refined between its neighbours. A peak narrower than that may be
    missed.

    Returns
    -------
    mapping of (n,) float columns: ``force_t``, ``force_n`` [N] at the greatest in-plane resultant and its rotation
    ``theta`` [rad]; ``torque`` [N mm] the greatest; ``force_axis`` [N] the axial force of greatest size, signed.
    """
    if not 0.0 < sample_step <= math.radians(15.0):
        raise InputError(f"sample_step = {math.degrees(sample_step):g} deg: must be above 0 and at most 15")
    out = np.zeros((len(engagement), 5))
    exact = len(engagement.rows) if exact_rows is None else exact_rows
    _tooth_force.greatest(*_arrays(engagement, cutter), cutter.flutes, np.array(material.law), sample_step, exact, out)
    names = ("force_t", "force_n", "theta", "torque", "force_axis")
    return dict(zip(names, out.T, strict=True))


def in_work(force: ArrayLike, frame: ArrayLike) -> Floats:
    """Return forces along T, n and the axis in the frame of the work: F_T T + F_n n + F_A A.

    Parameters
    ----------
    force : (n, 3) or (n, m, 3) float [N]
    frame : (n, 3, 3) float, rows T, n (mirrored where the spindle is counter-clockwise) and A;
    ``ToothEngagement.frame``

    Returns
    -------
    float [N], the shape of ``force``.

    Examples
    --------
    The feed along y, the axis along z: n is -x.

    >>> in_work([[1.0, 2.0, 3.0]], [[[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]]).tolist()
    [[-2.0, 1.0, 3.0]]
    """
    f, frames = np.asarray(force, dtype=np.float64), np.asarray(frame, dtype=np.float64)
    if f.ndim not in (2, 3) or f.shape[-1] != 3 or frames.shape != (len(f), 3, 3):
        raise InputError(f"in_work: force {f.shape}, frame {frames.shape}: need (n, 3) or (n, m, 3), and (n, 3, 3)")
    out: Floats = (f if f.ndim == 3 else f[:, None, :]) @ frames
    return out.reshape(f.shape)


def forces_along(
    phi_in: ArrayLike,
    phi_out: ArrayLike,
    feed_per_tooth: ArrayLike,
    T: ArrayLike,
    cutter: Cutter,
    material: Material,
    axial_depth: float,
    *,
    spindle_speed: ArrayLike,
    spindle: Spindle = "cw",
    count: ArrayLike | None = None,
    sample_step: float = SAMPLE_STEP,
) -> dict[str, NDArray[Any]]:
    """Return force, torque, power and chip thickness of every step of a pass with a straight flank.

    Parameters
    ----------
    phi_in, phi_out : (n,) or (n, k) float [rad], engaged arcs counted clockwise from n, within 0 .. pi;
        ``Engagement.phi[..., 0]`` and ``[..., 1]``
    feed_per_tooth : () or (n,) float [mm], of the cutter's centre
    T : (n, 2) float, unit feed direction
    cutter : straight flank
    material : coefficients
    axial_depth : [mm], at most the flute length
    spindle_speed : () or (n,) float [rad/s], for the power
    spindle : ``cw`` (M3) or ``ccw`` (M4, a left-hand cutter)
    count : (n,) int, number of valid arcs; None: all k
    sample_step : [rad], of the search over the revolution

    Returns
    -------
    columns, (n,) float each
        ``force_x_n``, ``force_y_n`` on the cutter in the work frame where the in-plane resultant over the revolution is
        greatest, ``force_xy_n`` that resultant; ``force_x_mean_n``, ``force_y_mean_n``, ``force_z_mean_n`` over the
        revolution; ``force_z_n`` the axial force of greatest size, below 0 where the cutter is pulled out of its
        holder; ``torque_nm`` the greatest, ``torque_mean_nm``; ``power_w`` the mean; ``chip_max_mm`` the thickest
        chip. Where nothing is cut all are 0.

    Raises
    ------
    InputError
        As :func:`chipload.engagement.tooth_engagement.engagement_of_arcs`; T is not (n, 2) of unit vectors; a speed
        below 0.

    Examples
    --------
    A full slot with two teeth: their mean cutting force across the feed is N depth Ktc f_z / 4 but for the second order
    in the feed over the radius.

    >>> mill = Cutter(10.0, 2, 0.5, 20.0, 30.0, 6e5)
    >>> plain = Material("plain", 1000.0, 0.0, 0.0, 0.0, 0.0, 0.0, source="made up for this example")
    >>> slot = forces_along([0.0], [math.pi], 0.1, [[1.0, 0.0]], mill, plain, 2.0, spindle_speed=100.0)
    >>> float(slot["force_y_mean_n"][0].round(1))
    100.5
    """
    if spindle not in ("cw", "ccw"):
        raise InputError(f"spindle = {spindle!r}: must be cw or ccw")
    heading = np.asarray(T, dtype=np.float64)
    front = engagement_of_arcs(
        phi_in, phi_out, feed_per_tooth, cutter, axial_depth, count=count, clockwise=spindle == "cw"
    )
    engagement = chips_of_teeth(front, cutter)
    n = len(engagement)
    if heading.shape != (n, 2) or not np.all(np.abs(np.hypot(heading[:, 0], heading[:, 1]) - 1.0) < 1e-6):
        raise InputError(f"T of shape {heading.shape}: need ({n}, 2) unit vectors, one a step")
    speed = np.broadcast_to(np.asarray(spindle_speed, dtype=np.float64), (n,))
    if not ((speed >= 0.0) & np.isfinite(speed)).all():
        raise InputError("spindle_speed: must be finite and at least 0 rad/s")
    side = 1.0 if spindle == "cw" else -1.0
    left = side * np.column_stack([-heading[:, 1], heading[:, 0]])
    peak = greatest_forces(engagement, cutter, material, sample_step)
    mean, torque_mean = mean_forces(engagement, cutter, material)
    plane = peak["force_t"][:, None] * heading + peak["force_n"][:, None] * left
    mean_plane = mean[:, :1] * heading + mean[:, 1:2] * left
    return {
        "force_x_n": plane[:, 0],
        "force_y_n": plane[:, 1],
        "force_xy_n": np.hypot(peak["force_t"], peak["force_n"]),
        "force_x_mean_n": mean_plane[:, 0],
        "force_y_mean_n": mean_plane[:, 1],
        "force_z_mean_n": mean[:, 2],
        "force_z_n": peak["force_axis"],
        "torque_nm": peak["torque"] / 1000.0,
        "torque_mean_nm": torque_mean / 1000.0,
        "power_w": torque_mean * speed / 1000.0,
        "chip_max_mm": engagement.chip_max(),
    }
