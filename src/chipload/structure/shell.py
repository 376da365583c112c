"""Deflection and stress of a thin tube or cone under the cutting force, by a Fourier-Ritz shell.

Notation: s [mm] along the meridian from 0 to the length; theta around the axis; r = r0 + s sin f radius of the middle
surface, f [rad] the half angle of the cone (f > 0: wider away from s = 0); t thickness; u, v, w displacements along s,
along theta and along the outward normal; E modulus [MPa], m Poisson's ratio; C = E t / (1 - m^2) and
D = E t^3 / (12 (1 - m^2)). With ' for d/ds and the index th for d/dtheta the strains of the middle surface and the
changes of curvature are

    es = u',    et = (v_th + u sin f + w cos f) / r,    g = u_th / r + v' - v sin f / r,
    ks = -w'',  kt = -w_thth / r^2 + cos f v_th / r^2 - sin f w' / r,
    tw = 2 (-w'_th / r + sin f w_th / r^2 + cos f v' / r - sin f cos f v / r^2).

The energy is minimal over u = sum u_n(s) cos n theta, v = sum v_n(s) sin n theta, w = sum w_n(s) cos n theta, with u_n,
v_n, w_n integrals of Legendre polynomials that satisfy the end conditions. The harmonics are independent: each is
factored once, for all loads.

Valid for t / r below about 1/10, small displacements and constant thickness. The solution is never too soft (Ritz).
Under a point load the deflection converges as 1 / harmonics^2 and 1 / terms^2.
The stress under a point load does not converge: it requires the area on which the load acts.

Reference: [Leissa1973] ch. 1 (Donnell's and Novozhilov's relations for cones); [Timoshenko1959] ch. 15.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import ArrayLike, NDArray

from chipload.errors import InputError
from chipload.lazy import scipy

Floats = NDArray[np.float64]

ENDS = ("clamped", "diaphragms", "free")


@dataclass(frozen=True)
class Shell:
    """A thin tube or cone.

    Parameters
    ----------
    radius : r0 of the middle surface at s = 0 [mm]
    length : along the meridian [mm]
    thickness : of the wall [mm]
    modulus : E [MPa]
    poisson : Poisson's ratio, 0 .. below 0.5
    cone_angle : f [rad], within +-80 deg; 0: a tube
    ends : ``clamped``: at s = 0, the other end is free; ``diaphragms``: v = w = 0 and u free at both ends; ``free``:
        both ends are free, for loads in equilibrium

    Raises
    ------
    InputError
        A value is out of its range, or the cone closes to a point.
    """

    radius: float
    length: float
    thickness: float
    modulus: float
    poisson: float
    cone_angle: float = 0.0
    ends: Literal["clamped", "diaphragms", "free"] = "clamped"

    def __post_init__(self) -> None:
        for name, unit in (("radius", "mm"), ("length", "mm"), ("thickness", "mm"), ("modulus", "MPa")):
            value = getattr(self, name)
            if not 0.0 < value < math.inf:
                raise InputError(f"shell.{name} = {value:g}: must be above 0 {unit}")
        if not 0.0 <= self.poisson < 0.5:
            raise InputError(f"shell.poisson = {self.poisson:g}: must be from 0 to below 0.5")
        if not abs(self.cone_angle) <= math.radians(80.0):
            raise InputError(f"shell.cone_angle_deg = {math.degrees(self.cone_angle):g}: must be from -80 to 80")
        if self.ends not in ENDS:
            raise InputError(f"shell.ends = {self.ends!r}: must be one of {', '.join(ENDS)}")
        narrow = min(self.radius, float(self.radius_at(self.length)))
        if narrow <= 0.0:
            raise InputError(
                f"shell.length = {self.length:g} mm: the cone closes to a point at "
                f"{-self.radius / math.sin(self.cone_angle):g}; must be shorter"
            )
        if self.thickness > narrow:
            raise InputError(
                f"shell.thickness = {self.thickness:g} mm: must be at most the least radius {narrow:g}; "
                "this is for thin shells (below a tenth of it)"
            )

    def radius_at(self, s: ArrayLike) -> Floats:
        """Radius of the middle surface [mm], the shape of ``s`` [mm]."""
        return np.asarray(self.radius + np.asarray(s, dtype=np.float64) * math.sin(self.cone_angle))


@dataclass(frozen=True, eq=False)
class Ritz:
    """A shell with the stiffness of each of its harmonics factored.

    Parameters
    ----------
    shell : the wall
    harmonics : (h,) int, the orders n of the harmonics
    terms : number of polynomials for each displacement
    inverse : (h, 3 m, 3 m) float; inverse[i].T @ inverse[i] is the flexibility of harmonic i [mm/N], m = terms
    repeat : number of equal forces, evenly spaced around the axis
    """

    shell: Shell
    harmonics: NDArray[np.int64]
    terms: int
    inverse: Floats
    repeat: int = 1


def ritz(shell: Shell, harmonics: int = 80, terms: int = 40, repeat: int = 1) -> Ritz:
    """Factor the stiffness of each harmonic of a shell.

    Parameters
    ----------
    shell : the wall
    harmonics : greatest n, at least 2
    terms : number of polynomials for each of u, v, w, 4 .. 80
    repeat : number of equal loads, evenly spaced around the axis (2: a pair across the diameter); only harmonics that
        are multiples of it occur

    Raises
    ------
    InputError
        A number is out of range, or the shell is free and ``repeat`` is 1.
    """
    if harmonics < 2:
        raise InputError(f"shell.harmonics = {harmonics}: must be at least 2, with fewer nothing ovalises")
    if not 4 <= terms <= 80:
        raise InputError(f"shell.terms = {terms}: must be from 4 to 80")
    if repeat < 1:
        raise InputError(f"shell.repeat = {repeat}: must be at least 1")
    if shell.ends == "free" and repeat < 2:
        raise InputError("shell.ends = 'free': one force is not in balance: must be repeat = 2 or more")
    nodes, weights = legendre.leggauss(2 * terms + 8)
    s = 0.5 * shell.length * (nodes + 1.0)
    area = 0.5 * shell.length * weights * shell.radius_at(s)
    law = _law(shell)
    orders = np.arange(0, harmonics + 1, repeat)
    inverse = np.empty((len(orders), 3 * terms, 3 * terms))
    basis = _basis(shell, terms, s)
    for i, n in enumerate(orders):
        b = _strains(shell, basis, s, int(n))
        weight = (math.tau if n == 0 else math.pi) * area
        flat = (len(s) * 6, 3 * terms)
        stiffness = b.reshape(flat).T @ (law @ b * weight[:, None, None]).reshape(flat)
        rigid = _rigid_motions(shell, terms, int(n))
        stiffness[rigid, :] = stiffness[:, rigid] = 0.0
        stiffness[rigid, rigid] = 1.0
        scale = 1.0 / np.sqrt(np.diag(stiffness))
        lower = np.linalg.cholesky(stiffness * scale[:, None] * scale)
        inverse[i] = scipy.linalg.solve_triangular(lower, np.diag(scale), lower=True)
        inverse[i][:, rigid] = 0.0
    for array in (orders, inverse):
        array.setflags(write=False)
    return Ritz(shell, orders, terms, inverse, repeat)


def compliance(
    modes: Ritz,
    s_force: ArrayLike,
    s_point: ArrayLike | None = None,
    theta: ArrayLike = 0.0,
    length: float = 0.0,
    width: float = 0.0,
) -> Floats:
    """Displacement (u, v, w) of one point under unit forces along (s, theta, normal) at another.

    Parameters
    ----------
    modes : from :func:`ritz`
    s_force : float [mm], (k,) or a number, where the force acts, at theta = 0
    s_point : float [mm], place of the displacement; None: at the force
    theta : float [rad], angle from the force to the point
    length, width : patch over which the force is spread evenly, along s and around the axis [mm]; 0: a point. The
        displacement is that at the middle of the patch, or at s_point.

    Returns
    -------
    (k, 3, 3) float [mm/N], row: displacement, column: force; (3, 3) if all arguments are numbers.

    Raises
    ------
    InputError
        A point or the patch lies outside the wall.

    Notes
    -----
    A tube between diaphragms can move along s, and a free tube can also rotate. For forces that are not in equilibrium,
    the mean of u (and of v, if the tube is free) is then set to 0.
    """
    force, point, angle = np.broadcast_arrays(
        np.asarray(s_force, dtype=np.float64),
        np.asarray(s_force if s_point is None else s_point, dtype=np.float64),
        np.asarray(theta, dtype=np.float64),
    )
    shape = force.shape
    loads = _loads(modes, force.ravel(), length)
    rows = loads if s_point is None and length == 0.0 else _loads(modes, point.ravel(), 0.0)
    out = np.zeros((force.size, 3, 3))
    for i, n in enumerate(modes.harmonics):
        spread = modes.repeat * np.sinc(n * width / (math.tau * modes.shell.radius_at(force.ravel())))
        left = modes.inverse[i] @ rows
        right = left if rows is loads else modes.inverse[i] @ loads
        block = left.transpose(0, 2, 1) @ right * spread[:, None, None]
        c, d = np.cos(n * angle.ravel()), np.sin(n * angle.ravel())
        # u and w of forces along u and w go with cos; v with sin; a force along v shifts the pattern by a quarter wave
        even = np.stack([c, d, c], axis=1)[:, :, None] * block
        odd = np.stack([-d, c, -d], axis=1) * block[:, :, 1]
        out[:, :, 0] += even[:, :, 0]
        out[:, :, 2] += even[:, :, 2]
        out[:, :, 1] += odd
    return out.reshape(*shape, 3, 3)


def stress(
    modes: Ritz,
    s_force: float,
    s_point: ArrayLike,
    theta: ArrayLike,
    outside: bool = True,
    length: float = 0.0,
    width: float = 0.0,
) -> Floats:
    """Stress on a face of the wall under a unit normal force (outwards).

    Parameters
    ----------
    modes : from :func:`ritz`
    s_force : where the force acts, at theta = 0 [mm]
    s_point, theta : point of the stress, float [mm], [rad], shapes that broadcast to (k,)
    outside : on the outer face; False: on the inner one
    length, width : area over which the force is spread [mm]; without it the stress under the force is infinite

    Returns
    -------
    (k, 3) float [MPa/N]: along s, circumferential, shear.

    Raises
    ------
    InputError
        A point or the patch lies outside the wall, or ``s_point`` is the place of a point force.
    """
    point, angle = np.broadcast_arrays(np.asarray(s_point, dtype=np.float64), np.asarray(theta, dtype=np.float64))
    shape, at, angle = point.shape, point.ravel(), angle.ravel()
    _require_on_wall(modes.shell, at, 0.0)
    _require_patch(modes.shell, s_force, at, angle, length, width)
    strains = _strains_under_force(modes, s_force, at, angle, length, width)
    return _stress_of(modes.shell, strains, outside).reshape(*shape, 3)


def _strains_under_force(
    modes: Ritz, s_force: float, s_point: Floats, theta: Floats, length: float, width: float
) -> Floats:
    """(k, 6) strains and changes of curvature under a unit normal force, as of :func:`stress`."""
    shell = modes.shell
    load = _loads(modes, np.array([s_force]), length)[0, :, 2]
    out = np.zeros((len(s_point), 6))
    at, place = np.unique(s_point, return_inverse=True)
    basis = _basis(shell, modes.terms, at)
    for i, n in enumerate(modes.harmonics):
        q = modes.inverse[i].T @ (modes.inverse[i] @ load)
        q *= modes.repeat * np.sinc(n * width / (math.tau * float(shell.radius_at(s_force))))
        c, d = np.cos(n * theta), np.sin(n * theta)
        out += np.stack([c, c, d, c, c, d], axis=1) * (_strains(shell, basis, at, int(n)) @ q)[place]
    return out


def _stress_of(shell: Shell, strains: Floats, outside: bool) -> Floats:
    """(k, 3) stress along s, circumferential and shear stress on a face [MPa/N]."""
    z = 0.5 * shell.thickness if outside else -0.5 * shell.thickness
    es, et, g = (strains[:, j] + z * strains[:, 3 + j] for j in range(3))
    plane = shell.modulus / (1.0 - shell.poisson**2)
    along = plane * (es + shell.poisson * et)
    round_ = plane * (et + shell.poisson * es)
    shear = 0.5 * shell.modulus / (1.0 + shell.poisson) * g
    return np.stack([along, round_, shear], axis=1)


def equivalent(stresses: ArrayLike) -> Floats:
    """Von Mises stress (...) of stresses (..., 3): along s, circumferential, shear.

    >>> float(equivalent([3.0, 0.0, 0.0])), round(float(equivalent([0.0, 0.0, 1.0])), 6)
    (3.0, 1.732051)
    """
    a, b, shear = np.moveaxis(np.asarray(stresses, dtype=np.float64), -1, 0)
    return np.asarray(np.sqrt(a * a - a * b + b * b + 3.0 * shear * shear))


def greatest_stress(modes: Ritz, s_force: float, length: float, width: float, angles: int = 181) -> tuple[float, float]:
    """Greatest equivalent stress at the clamp and under the patch, for a unit normal force [MPa/N].

    The stress is evaluated on both faces, at ``angles`` places on half the circle at s = 0 (the other half is its
    mirror image) and at the middle and the ends of the patch. With diaphragms or free ends, the first value is
    that of the end at s = 0. ``s_force``, ``length`` and ``width`` are in mm, as in :func:`stress`.
    """
    theta = np.concatenate([np.linspace(0.0, math.pi, angles), np.zeros(3)])
    at = np.concatenate([np.zeros(angles), s_force + 0.5 * length * np.array([-1.0, 0.0, 1.0])])
    _require_on_wall(modes.shell, np.array([s_force]), length)
    _require_patch(modes.shell, s_force, at, theta, length, width)
    strains = _strains_under_force(modes, s_force, at, theta, length, width)
    both = np.array([equivalent(_stress_of(modes.shell, strains, face)) for face in (True, False)])
    return float(both[:, :angles].max()), float(both[:, angles:].max())


@dataclass(frozen=True, eq=False)
class Ovalisation:
    """Part of each harmonic in the deflection under the force, and the shape of the loaded rim.

    Parameters
    ----------
    harmonics : (h,) int
    share : (h,) float [mm/N], contribution of each harmonic to the normal deflection at the force
    beam : deflection of a beam with shear [mm/N]; None for a cone
    theta : (k,) float [rad]
    rim : (k,) float [mm/N], normal displacement around the wall at the height of the force
    """

    harmonics: NDArray[np.int64]
    share: Floats
    beam: float | None
    theta: Floats
    rim: Floats


def ovalisation(modes: Ritz, s_force: float, points: int = 181) -> Ovalisation:
    """Harmonics and rim of the wall under a unit normal force at ``s_force`` [mm]; see :class:`Ovalisation`."""
    load = _loads(modes, np.array([s_force]), 0.0)[0, :, 2]
    share = modes.repeat * np.sum((modes.inverse @ load) ** 2, axis=1)
    theta = np.linspace(-math.pi, math.pi, points)
    rim = np.cos(theta[:, None] * modes.harmonics) @ share
    beam = beam_compliance(modes.shell, s_force) if modes.shell.cone_angle == 0.0 else None
    return Ovalisation(modes.harmonics, share, beam, theta, rim)


def beam_compliance(shell: Shell, s_force: float) -> float:
    """Deflection of a tube as a beam with shear, clamped at s = 0, under a unit lateral force [mm/N].

    s^3 / (3 E I) + s / (k G A), I = pi r^3 t, A = 2 pi r t, k = 2 (1 + m) / (4 + 3 m). For tubes only.

    Reference: [Cowper1966] table 1 (thin-walled round tube).

    Raises
    ------
    InputError
        The shell is a cone.
    """
    if shell.cone_angle != 0.0:
        raise InputError(
            f"shell.cone_angle_deg = {math.degrees(shell.cone_angle):g}: must be 0, the beam is for tubes only"
        )
    area = math.tau * shell.radius * shell.thickness
    inertia = 0.5 * area * shell.radius**2
    factor = 2.0 * (1.0 + shell.poisson) / (4.0 + 3.0 * shell.poisson)
    shear = 0.5 * shell.modulus / (1.0 + shell.poisson)
    return s_force**3 / (3.0 * shell.modulus * inertia) + s_force / (factor * shear * area)


def _law(shell: Shell) -> Floats:
    """(6, 6) from (es, et, g, ks, kt, tw) to forces and moments per length."""
    m = shell.poisson
    plane = np.array([[1.0, m, 0.0], [m, 1.0, 0.0], [0.0, 0.0, 0.5 * (1.0 - m)]])
    stretch = shell.modulus * shell.thickness / (1.0 - m * m)
    law = np.zeros((6, 6))
    law[:3, :3] = stretch * plane
    law[3:, 3:] = stretch * shell.thickness**2 / 12.0 * plane
    return law


@lru_cache(maxsize=64)
def _polynomials(ends: str, which: int, terms: int) -> Floats:
    """(terms, terms + 2) Legendre coefficients of the functions of u, v or w (``which``) that fit the ends."""
    unit = np.eye(terms + 1)
    if ends == "clamped":
        times, made = (2 if which == 2 else 1), unit[:terms]
    elif ends == "diaphragms" and which > 0:
        times, made = 1, unit[1:]
    else:
        times, made = 0, unit[:terms]
    out = np.zeros((terms, terms + 2))
    whole = legendre.legint(made, times, lbnd=-1, axis=1)
    columns = min(whole.shape[1], terms + 2)
    out[:, :columns] = whole[:, :columns]
    out.setflags(write=False)
    return out


def _functions(shell: Shell, terms: int, which: int, s: Floats, order: int) -> Floats:
    """(q, terms) values of the derivative of ``order`` at s."""
    c = _polynomials(shell.ends, which, terms).T
    if order:
        c = np.asarray(legendre.legder(c, order, axis=0), dtype=np.float64)
    x = 2.0 * s / shell.length - 1.0
    return np.asarray(legendre.legvander(x, len(c) - 1) @ c * (2.0 / shell.length) ** order)


def _basis(shell: Shell, terms: int, s: Floats) -> tuple[Floats, ...]:
    """u, u', v, v', w, w', w'' of every function at s, each (q, terms)."""
    wanted = ((0, 0), (0, 1), (1, 0), (1, 1), (2, 0), (2, 1), (2, 2))
    return tuple(_functions(shell, terms, which, s, order) for which, order in wanted)


def _strains(shell: Shell, basis: tuple[Floats, ...], s: Floats, n: int) -> Floats:
    """(q, 6, 3 terms) strains and changes of curvature of harmonic n, without their cos and sin."""
    r = shell.radius_at(s)[:, None]
    sf, cf = math.sin(shell.cone_angle), math.cos(shell.cone_angle)
    u, u1, v, v1, w, w1, w2 = basis
    b = np.zeros((len(s), 6, 3, u.shape[1]))
    b[:, 0, 0] = u1
    b[:, 1, 0], b[:, 1, 1], b[:, 1, 2] = sf * u / r, n * v / r, cf * w / r
    b[:, 2, 0], b[:, 2, 1] = -n * u / r, v1 - sf * v / r
    b[:, 3, 2] = -w2
    b[:, 4, 1], b[:, 4, 2] = cf * n * v / r**2, n * n * w / r**2 - sf * w1 / r
    b[:, 5, 1] = 2.0 * (cf * v1 / r - sf * cf * v / r**2)
    b[:, 5, 2] = 2.0 * (n * w1 / r - sf * n * w / r**2)
    return b.reshape(len(s), 6, -1)


def _rigid_motions(shell: Shell, terms: int, n: int) -> NDArray[np.int64]:
    """Coefficients that are set to 0: rigid motions without support."""
    if n > 0 or shell.ends == "clamped":
        return np.empty(0, dtype=np.int64)
    along = [0] if shell.cone_angle == 0.0 or shell.ends == "free" else []
    turn = [terms] if shell.ends == "free" else []
    return np.array(along + turn, dtype=np.int64)


def _loads(modes: Ritz, s: Floats, length: float) -> Floats:
    """(k, 3 terms, 3) work of unit forces along u, v, w at s, spread over ``length``, on each function."""
    shell, terms = modes.shell, modes.terms
    _require_on_wall(shell, s, length)
    nodes, weights = legendre.leggauss(terms + 2) if length > 0.0 else (np.zeros(1), np.full(1, 2.0))
    out = np.zeros((len(s), 3, terms, 3))
    places = (s[:, None] + 0.5 * length * nodes).ravel()
    for which in range(3):
        values = _functions(shell, terms, which, places, 0).reshape(len(s), len(nodes), terms)
        out[:, which, :, which] = np.einsum("kqm,q->km", values, 0.5 * weights)
    return out.reshape(len(s), 3 * terms, 3)


def _require_on_wall(shell: Shell, s: Floats, length: float) -> None:
    """Refuse places that are not on the wall."""
    slack = 1e-9 * shell.length
    bad = ~((s - 0.5 * length >= -slack) & (s + 0.5 * length <= shell.length + slack))
    if bad.any():
        patch = f" with a patch of {length:g} mm" if length else ""
        raise InputError(f"shell: s = {s[bad][0]:g} mm{patch}: must lie on the wall, from 0 to {shell.length:g}")


def _require_patch(shell: Shell, s_force: float, s: Floats, theta: Floats, length: float, width: float) -> None:
    """Refuse the stress at the place of a point force."""
    if (length == 0.0 or width == 0.0) and (np.hypot(s - s_force, shell.radius_at(s) * theta) == 0.0).any():
        raise InputError(
            f"shell.stress: s = {s_force:g} mm: under a point force the stress has no limit; give the length and the "
            "width of the patch on which the cutter acts"
        )
