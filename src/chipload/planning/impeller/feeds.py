"""Feeds of finishing passes within the strength and the deflection of each cutter.

Notation: f feed over the greatest one, from :data:`LEAST` to 1; delta [mm] greatest lateral deflection of the cutter at
its contact, sigma [MPa] its greatest equivalent stress over a revolution. Both rise with f.

The chip of a pass is simulated at places along it (``engagement.py``), from the allowance on the surface and from all
passes before it in the order of the programs; force, stress and deflection are those of the common force model. The
feed of a pass is the greatest at which delta and sigma are allowed at each of its places, reduced by :data:`ERROR` for
the samples of the chip and by the spread of the coefficients. Where even the least feed exceeds a limit the pass keeps
that feed, and its loads show it.

Not included: entry of the teeth, chatter, deflection of the workpiece.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.catalogue import Catalogue, CatalogueCutter
from chipload.cutter.cutter import Cutter
from chipload.cutter.strength import ToolStrength
from chipload.cutting.force import forces_over_turn
from chipload.cutting.material import Material
from chipload.cutting.strength import allowed_stress, cutter_stress
from chipload.engagement.tooth_engagement import ToothEngagement
from chipload.errors import InputError
from chipload.planning.impeller.engagement import EarlierPoses, PassPlaces, engagement_at
from chipload.planning.impeller.scene import Floats
from chipload.planning.impeller.step_over import step_over
from chipload.structure.beam import compliance

#: least ratio of the feed of a pass to the greatest feed
LEAST = 0.02
#: relative error of the loads by the samples of the chip
ERROR = 0.1
#: places of a pass at which its chip is simulated
PLACES = 3
#: rotations of a tooth pitch at which the force is taken, halvings of the feed
_ROTATIONS, _HALVINGS = 24, 9
#: pose by which cutters are compared before there is a path: N.A of a cutter that leans along the wall
_LEAN = 0.2


@dataclass(frozen=True)
class ForceTerms:
    """Data for the calculation of finishing feeds.

    Parameters
    ----------
    material : force coefficients, in all directions
    flutes, helix, modulus : of every cutter of the catalogue; rad, MPa
    allowance : that stands on the surfaces before finishing [mm]
    deflection : greatest of a cutter at its contact [mm]
    spindle : [rad/s]
    overhang : of cutters whose reach the catalogue does not state [mm]; None: all state it
    strength : of the cutters' material
    """

    material: Material
    flutes: int
    helix: float
    modulus: float
    allowance: float
    deflection: float
    spindle: float
    overhang: float | None = None
    strength: ToolStrength = field(default_factory=ToolStrength)

    def __post_init__(self) -> None:
        for key in ("allowance", "deflection"):
            value = getattr(self, key)
            if not 0.0 < value < math.inf:
                raise InputError(f"forces.{key}_mm = {value:g}: must be above 0")

    @property
    def error(self) -> float:
        """Relative error of the loads: of the samples, and the spread of the coefficients."""
        return ERROR + self.material.greatest_spread

    def cutter(self, size: CatalogueCutter) -> Cutter:
        """A cutter of the catalogue as a bar with teeth; above its cutting part it has the diameter of its thinnest
        part.

        Raises
        ------
        InputError
            Its overhang is not known, or shorter than its cutting length.
        """
        overhang = self.overhang if size.reach is None else size.reach
        name = f"{size.label} mm"
        if overhang is None:
            raise InputError(
                f"operation.0.forces.overhang_mm: missing: the catalogue states no reach of {name}: state the overhang"
            )
        length = overhang if size.cutting_length is None else size.cutting_length
        if length > overhang:
            raise InputError(
                f"operation.0.forces.overhang_mm = {overhang:g}: must be at least the cutting length of {name}, "
                f"{length:g} mm"
            )
        above = [x for x in (size.shank_diameter, size.neck_diameter) if x is not None]
        return Cutter(
            size.diameter, self.flutes, self.helix, length, overhang, self.modulus, corner_radius=size.corner_radius,
            shank_diameter=min(above, default=None), strength=self.strength,
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class PassLoads:
    """Loads of the passes of a setting, each at its own feed.

    Parameters
    ----------
    feed : (n,) of each place [mm/s]
    place : (n, 3) [mm]
    force : (n,) greatest size of the force on the cutter over a revolution [N]
    deflection : (n,) delta [mm]
    stress : (n,) sigma [MPa]
    allowed : sigma that is allowed [MPa]
    most : delta that is allowed [mm]
    error : relative, of all
    """

    feed: Floats
    place: Floats
    force: Floats
    deflection: Floats
    stress: Floats
    allowed: float
    most: float
    error: float

    @property
    def columns(self) -> tuple[tuple[str, Floats, float, str], ...]:
        """Name, values (n,), limit and unit of each limited quantity."""
        return (
            ("deflection of the cutter", 1000.0 * self.deflection, 1000.0 * self.most, "µm"),
            ("stress of the cutter", self.stress, self.allowed, "MPa"),
        )


def loads_of(
    engagement: ToothEngagement, places: PassPlaces, cutter: Cutter, material: Material, factor: Floats
) -> tuple[Floats, Floats, Floats]:
    """Force [N], deflection [mm] and stress [MPa] (n,) of steps whose feed is ``factor`` (n,) times that of the tooth
    engagement.

    The deflection is that of a bar under the force at the mean height of the teeth's contact with material.
    """
    step = np.repeat(np.arange(len(engagement)), np.diff(engagement.start))
    rows = engagement.rows.copy()
    rows[:, 4:7] *= factor[step][:, None]
    fed = replace(engagement, rows=rows)
    theta = np.linspace(0.0, math.tau / cutter.flutes, _ROTATIONS, endpoint=False)
    force = forces_over_turn(fed, cutter, material, theta)[0]
    own = engagement.slices[engagement.slice]
    height = own[:, 2] + 0.5 * (rows[:, 3] - rows[:, 2]) * own[:, 3]
    weight = (rows[:, 3] - rows[:, 2]) * (rows[:, 1] - rows[:, 0])
    total = np.bincount(step, weight, len(engagement))
    mean = np.bincount(step, weight * height, len(engagement)) / np.where(total > 0.0, total, 1.0)
    contact = ((places.contact - places.tip) * places.axis).sum(axis=1).clip(0.0, cutter.overhang)
    lateral = np.hypot(force[..., 0], force[..., 1]).max(axis=1)
    bend = lateral * compliance(cutter, mean.clip(0.0, cutter.overhang), contact)
    peaks = 1.0 + material.peak_excess
    size = np.linalg.norm(force, axis=2).max(axis=1)
    return peaks * size, peaks * bend, peaks * cutter_stress(fed, cutter, material)


def allowed_factor(engagement: ToothEngagement, places: PassPlaces, cutter: Cutter, terms: ForceTerms) -> Floats:
    """Greatest f (n,) at which deflection and stress of a step are allowed; :data:`LEAST` where none is."""
    stress = allowed_stress(cutter)

    def fits(factor: Floats) -> NDArray[np.bool_]:
        _, bend, sigma = loads_of(engagement, places, cutter, terms.material, factor)
        return np.maximum(bend / terms.deflection, sigma / stress) * (1.0 + terms.error) <= 1.0

    n = len(engagement)
    low, high = np.full(n, LEAST), np.ones(n)
    whole = fits(high)
    for _ in range(_HALVINGS if not whole.all() else 0):
        middle = np.sqrt(low * high)
        ok = fits(middle)
        low, high = np.where(ok, middle, low), np.where(ok, high, middle)
    return np.where(whole, 1.0, low)


def places_of(
    contact: Floats, normal: Floats, curvature: Floats, tip: Floats, axis: Floats, feed: Floats
) -> PassPlaces:
    """Places whose directions of feed are made unit."""
    return PassPlaces(contact, normal, curvature, tip, axis, feed / np.linalg.norm(feed, axis=1)[:, None])


def nominal_feeds(catalogue: Catalogue, terms: ForceTerms, scallop: float, feed: float) -> tuple[float, ...]:
    """Feed [mm/s] of each cutter on a plane wall with the step-over of the scallop, at a lean of 78 deg along it.

    The comparison before there are paths; the feeds of programs come from their own chips.
    """
    out = []
    N, d = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
    A = np.array([0.0, math.sqrt(1.0 - _LEAN**2), _LEAN])
    for size in catalogue.cutters:
        cutter, r = terms.cutter(size), size.corner_radius
        step = float(step_over([N], [A], [d], np.zeros((1, 3, 3)), size.rho, r, scallop)[0])
        V = (N - _LEAN * A) / math.sqrt(1.0 - _LEAN**2)
        tip = r * N + size.rho * V - r * A
        x = np.linspace(-1.0, 1.0, 3)[:, None] * 1.5 * size.diameter
        before = EarlierPoses.of(tip - step * np.array([0.0, 1.0, 0.0]) + x * d, np.tile(A, (3, 1)), size.rho, r)
        places = PassPlaces(np.zeros((1, 3)), N[None], np.zeros((1, 3, 3)), tip[None], A[None], d[None])
        engagement = engagement_at(places, cutter, per_tooth(feed, terms), terms.allowance, before)
        out.append(feed * float(allowed_factor(engagement, places, cutter, terms)[0]))
    return tuple(out)


def per_tooth(feed: float, terms: ForceTerms) -> float:
    """Feed per tooth [mm] at a feed [mm/s]."""
    return feed * math.tau / (terms.spindle * terms.flutes)


@dataclass(frozen=True, eq=False)
class PassRows:
    """Rows of a program that mill one track, in the order in which they are milled.

    Parameters
    ----------
    rows : (n,) numbers in the program
    tip, axis : (n, 3) of them
    contact, normal, curvature : (n, 3), (n, 3), (n, 3, 3) of the surface at them
    """

    rows: NDArray[np.int64]
    tip: Floats
    axis: Floats
    contact: Floats
    normal: Floats
    curvature: Floats

    def places(self) -> PassPlaces | None:
        """:data:`PLACES` of them, none at the ends; None: the track has no length."""
        n = len(self.rows)
        if n < 2 or float(np.linalg.norm(self.tip[-1] - self.tip[0])) == 0.0:
            return None
        at = np.unique(np.linspace(0, n - 1, PLACES + 2).round().astype(np.int64)[1:-1])
        feed = self.tip[np.minimum(at + 1, n - 1)] - self.tip[np.maximum(at - 1, 0)]
        some = np.linalg.norm(feed, axis=1) > 0.0
        at, feed = at[some], feed[some]
        if not len(at):
            return None
        return places_of(self.contact[at], self.normal[at], self.curvature[at], self.tip[at], self.axis[at], feed)


def pass_feeds(
    settings: Sequence[tuple[CatalogueCutter, Sequence[PassRows]]],
    terms: ForceTerms,
    feed: float,
    given: Sequence[Sequence[float]] | None = None,
) -> list[tuple[list[float], PassLoads]]:
    """For each setting in its order the feed [mm/s] of each of its passes, and the loads.

    Parameters
    ----------
    settings : cutter and passes, both in the order in which they are milled
    feed : greatest of all [mm/s]
    given : feed of each pass [mm/s]; None: the greatest that is allowed
    """
    earlier, counts = EarlierPoses.none(), []
    total = 0
    parts = []
    for size, passes in settings:
        own = []
        for one in passes:
            own.append(total)
            if len(one.rows):
                parts.append(EarlierPoses.of(one.tip, one.axis, size.rho, size.corner_radius))
                total += len(parts[-1].tip)
        counts.append(own)
    if parts:
        earlier = EarlierPoses(*(np.vstack([getattr(x, k) for x in parts]) for k in ("tip", "axis", "shape")))
    out = []
    for number, ((size, passes), own) in enumerate(zip(settings, counts, strict=True)):
        cutter = terms.cutter(size)
        found = [(k, p) for k, one in enumerate(passes) if (p := one.places()) is not None]
        feeds = np.full(len(passes), feed)
        whole = _join_places([p for _, p in found])
        owner = np.repeat([k for k, _ in found], [len(p) for _, p in found]).astype(np.int64)
        engagement = engagement_at(
            whole, cutter, per_tooth(feed, terms), terms.allowance, earlier, np.array(own, dtype=np.int64)[owner]
        )
        if given is None:
            np.minimum.at(feeds, owner, feed * allowed_factor(engagement, whole, cutter, terms))
        else:
            feeds = np.asarray(given[number], dtype=np.float64)
        loads = loads_of(engagement, whole, cutter, terms.material, feeds[owner] / feed)
        out.append(
            (
                feeds.tolist(),
                PassLoads(feeds[owner], whole.contact, *loads, allowed_stress(cutter), terms.deflection, terms.error),
            )
        )
    return out


def _join_places(places: Sequence[PassPlaces]) -> PassPlaces:
    names = ("contact", "normal", "curvature", "tip", "axis", "feed")
    if not places:
        return PassPlaces(*(np.zeros((0, 3, 3) if name == "curvature" else (0, 3)) for name in names))
    return PassPlaces(*(np.concatenate([getattr(p, name) for p in places]) for name in names))
