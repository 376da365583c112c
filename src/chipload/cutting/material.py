"""Materials: cutting and edge coefficients, their source, range and uncertainty, and the files that contain them.

Notation: per mm of depth a tooth has the forces Ft = Ktc h + Kte (tangential), Fr = Krc h + Kre (radial) and
Fa = Kac h + Kae (axial), h [mm] the chip thickness; Kc [MPa], Ke [N/mm]. With a size effect Kc h becomes
Kc (h / 1 mm)^(-m) h, where Kc is the coefficient at a thickness of 1 mm and each direction has its own exponent m:
thin chips need a greater force per area.

Reference: [Altintas2012] ch. 2; [Kienzle1952] for the exponent; [Zhang2021] table 5 for the shipped numbers.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.cutting.learned import KnowledgeWorth, LearnedRecord, learned_of, learned_text
from chipload.errors import InputError
from chipload.number_text import number_text
from chipload.tables import nearest, read_table, shipped_names, shipped_table
from chipload.units import mm_min_from_mm_s, mm_s_from_mm_min

#: key in the file -> field, lowest and highest value that is believed
_NUMBERS = {
    "ktc_mpa": ("Ktc", 10.0, 2e4),
    "krc_mpa": ("Krc", 0.0, 2e4),
    "kac_mpa": ("Kac", -2e4, 2e4),
    "kte_n_mm": ("Kte", 0.0, 1e3),
    "kre_n_mm": ("Kre", -1e3, 1e3),
    "kae_n_mm": ("Kae", -1e3, 1e3),
}
#: keys that a material of which only the tangential force is known leaves out, all of them
_DIRECTIONS = ("krc_mpa", "kac_mpa", "kre_n_mm", "kae_n_mm")
_TEXTS = ("name", "source", "conditions", "workpiece", "cutter")
_EXPONENTS = ("exponent_t", "exponent_r", "exponent_a")
_RANGES = {"chip": ("chip_min_mm", "chip_max_mm"), "speed": ("speed_min_m_min", "speed_max_m_min")}
_SPREADS = ("spread_radial", "spread_axial")
_EXCESSES = ("peak_excess", "peak_excess_axial")
_KEYS = (
    *_TEXTS, *_NUMBERS, *_EXPONENTS, *_RANGES["chip"], *_RANGES["speed"], "spread", *_SPREADS, "covariance",
    *_EXCESSES, "tap_kc_mpa", "learned",
)  # fmt: skip

#: correlation of the errors of two coefficients whose material states a spread: between independent errors and one
#: error that all share; with it 95 of 100 random cuts are within their value at 95 % (tests/laws/test_load_budget.py)
CORRELATION = 0.5
#: the six coefficients in their order, as the rows and columns of their covariance
Covariance = tuple[tuple[float, float, float, float, float, float], ...]


@dataclass(frozen=True)
class Material:
    """Force coefficients of one pair of material and cutter.

    Parameters
    ----------
    name : as the job calls it
    Ktc, Krc, Kac : cutting coefficients [MPa], tangential, radial, axial; 10 <= Ktc <= 20000; with an exponent, those
        at a chip thickness of 1 mm
    Kte, Kre, Kae : edge coefficients [N/mm]
    source : where the numbers were published or measured; never empty
    conditions : cutter and lubrication they were measured with, or only the latter where ``cutter`` states the former
    workpiece : alloy and temper
    chip : (smallest, greatest) chip thickness they hold for [mm]; None: the source does not state it
    spread : relative standard deviation of each coefficient; None: the source does not state it
    exponents : (m_t, m_r, m_a) of the size effect, from 0 to below 1; 0: none, the linear law
    cutter : what they were measured with: form, diameter, teeth, helix, rake, substrate
    speed : (lowest, highest) cutting speed they hold for [mm/s]; None: the source does not state it
    peak_excess, peak_excess_axial : how far above what these coefficients predict the peaks of a force were measured,
        in the plane and along the axis, relative, in the worst of the runs; 0: not measured, or not above
    tangential : only the tangential force is known; the other coefficients are 0 and mean nothing: torque and power can
        be proved, directions and sizes of forces, deflections and stability cannot
    spread_directions : relative standard deviations of the radial and of the axial coefficients, where they are less
        sure than the tangential ones, whose ``spread`` then is; None: as ``spread``
    tap_kc : specific cutting force of tapping [MPa], > 0; None: not known
    covariance : (6, 6), of (Ktc, Krc, Kac, Kte, Kre, Kae) in products of MPa and N/mm, from a fit; instead of
        ``spread``; None: not known
    learned : what it was before, and the logs that changed it (``chipload learn``); None: it was not learned

    Raises
    ------
    InputError
        A number is out of range or the source is empty.
    """

    name: str
    Ktc: float
    Krc: float
    Kac: float
    Kte: float
    Kre: float
    Kae: float
    source: str
    conditions: str = ""
    workpiece: str = ""
    chip: tuple[float, float] | None = None
    spread: float | None = None
    exponents: tuple[float, float, float] = (0.0, 0.0, 0.0)
    cutter: str = ""
    speed: tuple[float, float] | None = None
    covariance: Covariance | None = None
    tangential: bool = False
    peak_excess: float = 0.0
    peak_excess_axial: float = 0.0
    spread_directions: tuple[float, float] | None = None
    tap_kc: float | None = None
    learned: LearnedRecord | None = None

    def __post_init__(self) -> None:
        for key, (name, low, high) in _NUMBERS.items():
            value = getattr(self, name)
            if not low <= value <= high:
                unit = "MPa" if key.endswith("mpa") else "N/mm"
                raise InputError(f"material.{key} = {value:g}: must be from {low:g} to {high:g} {unit}")
        if not self.source.strip():
            raise InputError(
                "material.source is missing: a coefficient without a source is refused; "
                "state where it was published or measured"
            )
        if self.chip is not None and not 0.0 <= self.chip[0] < self.chip[1] < math.inf:
            raise InputError(
                f"material.chip_max_mm = {self.chip[1]:g}: must be above chip_min_mm = {self.chip[0]:g}, which must be "
                "at least 0"
            )
        if self.spread is not None and not 0.0 <= self.spread < 1.0:
            raise InputError(f"material.spread = {self.spread:g}: must be from 0 to below 1 (0.1 is 10 %)")
        for key, value in zip(_SPREADS, self.spread_directions or (0.0, 0.0), strict=True):
            if not 0.0 <= value < 1.0:
                raise InputError(f"material.{key} = {value:g}: must be from 0 to below 1 (0.1 is 10 %)")
        for key, value in zip(_EXPONENTS, self.exponents, strict=True):
            if not 0.0 <= value < 1.0:
                raise InputError(f"material.{key} = {value:g}: must be from 0 (no size effect) to below 1")
        if self.speed is not None and not 0.0 <= self.speed[0] < self.speed[1] < math.inf:
            low, high = (mm_min_from_mm_s(v) / 1000.0 for v in self.speed)
            raise InputError(
                f"material.speed_max_m_min = {high:g}: must be above speed_min_m_min = {low:g}, which must be at "
                "least 0"
            )
        for key in _EXCESSES:
            if not 0.0 <= (excess := getattr(self, key)) <= 10.0:
                raise InputError(f"material.{key} = {excess:g}: must be from 0 to 10 (0.4 is 40 %)")
        if self.tap_kc is not None and not 10.0 <= self.tap_kc <= 2e4:
            raise InputError(f"material.tap_kc_mpa = {self.tap_kc:g}: must be from 10 to 20000 MPa")
        if self.covariance is not None:
            self._check_covariance()
        if self.tangential and any((self.Krc, self.Kac, self.Kre, self.Kae)):
            raise InputError("material: tangential with radial or axial coefficients: leave them at 0")

    def _check_covariance(self) -> None:
        """Refuse a matrix that is not a covariance; keep it as a tuple of rows."""
        if self.spread is not None:
            raise InputError("material.spread and material.covariance: give one of them: both state the same")
        c = np.asarray(self.covariance, dtype=np.float64)
        if c.shape != (6, 6) or not np.isfinite(c).all():
            raise InputError(f"material.covariance of shape {c.shape}: must be 6 rows of 6 finite numbers")
        scale = np.sqrt(np.abs(np.diagonal(c)))
        scale[scale == 0.0] = 1.0
        unit = c / np.outer(scale, scale)
        if not np.allclose(unit, unit.T, rtol=0.0, atol=1e-6) or np.linalg.eigvalsh(unit).min() < -1e-6:
            raise InputError("material.covariance: must be symmetric and without negative variances")
        object.__setattr__(self, "covariance", tuple(map(tuple, c.tolist())))

    @property
    def variances(self) -> NDArray[np.float64]:
        """Covariance (6, 6) of the coefficients: the fitted one, or (1 - r) diag(d^2) + r d d', d the spread of each
        times the coefficient, r the :data:`CORRELATION` of their errors.

        Raises
        ------
        InputError
            Neither is known.
        """
        if self.covariance is not None:
            return np.array(self.covariance)
        if self.spread is None:
            raise InputError(
                f"material {self.name}: neither spread nor covariance is known, so the uncertainty of its "
                "coefficients is unknown: give spread, or fit them"
            )
        own = (self.spread, *(self.spread_directions or (self.spread, self.spread)))
        deviation = np.array(own * 2) * self.coefficients
        return np.asarray(np.where(np.eye(6, dtype=np.bool_), 1.0, CORRELATION) * np.outer(deviation, deviation))

    @property
    def has_band(self) -> bool:
        """Whether the uncertainty of the coefficients is known, as a spread or a covariance."""
        return self.spread is not None or self.covariance is not None

    @property
    def greatest_spread(self) -> float:
        """Greatest relative standard deviation that is stated; 0: none is."""
        return max(self.spread or 0.0, *(self.spread_directions or (0.0,)))

    @property
    def law(self) -> tuple[float, ...]:
        """Coefficients and exponents (Ktc, Krc, Kac, Kte, Kre, Kae, m_t, m_r, m_a), in the order of the kernels."""
        return (*self.coefficients, *self.exponents)

    @property
    def coefficients(self) -> tuple[float, float, float, float, float, float]:
        """(Ktc, Krc, Kac, Kte, Kre, Kae) in MPa and N/mm."""
        return (self.Ktc, self.Krc, self.Kac, self.Kte, self.Kre, self.Kae)


def _number(label: str, key: str, value: Any) -> float:
    """Return a number of the file; refuse a Boolean or a text."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise InputError(f"{label}: {key} = {value!r}: must be a number")
    return float(value)


def _range(label: str, table: dict[str, Any], low: str, high: str) -> tuple[float, float] | None:
    """Return two numbers of the file that are stated together or not at all."""
    if low not in table and high not in table:
        return None
    for key in (low, high):
        if key not in table:
            raise InputError(f"{label}: {key} is missing: give both {low} and {high} or neither")
    return _number(label, low, table[low]), _number(label, high, table[high])


def _matrix(label: str, value: Any) -> list[list[float]]:
    """Return rows of numbers of the file; the material checks their count."""
    if not isinstance(value, list) or not all(isinstance(row, list) and len(row) == len(value) for row in value):
        raise InputError(f"{label}: covariance: must be 6 rows of 6 numbers")
    return [[_number(label, "covariance", x) for x in row] for row in value]


def _from_table(label: str, table: dict[str, Any]) -> Material:
    """Return the material of the values of its file; ``label`` names it in messages."""
    for key in table:
        if key not in _KEYS:
            near = nearest(key, list(_KEYS))
            raise InputError(f"{label}: unknown key {key}: the nearest known one is {near}")
    tangential = not any(key in table for key in _DIRECTIONS)
    for key in ("name", *_NUMBERS):
        if key not in table and not (tangential and key in _DIRECTIONS):
            raise InputError(f"{label}: {key} is missing: must be given, coefficients are never invented")
    for key in _TEXTS:
        if not isinstance(table.get(key, ""), str):
            raise InputError(f"{label}: {key} = {table[key]!r}: must be a text")
    numbers: dict[str, Any] = {n: _number(label, key, table.get(key, 0.0)) for key, (n, _, _) in _NUMBERS.items()}
    numbers["tangential"] = tangential
    numbers |= {key: _number(label, key, table.get(key, 0.0)) for key in _EXCESSES}
    ranges: dict[str, Any] = {name: _range(label, table, *keys) for name, keys in _RANGES.items()}
    if (speed := ranges["speed"]) is not None:
        ranges["speed"] = (mm_s_from_mm_min(1000.0 * speed[0]), mm_s_from_mm_min(1000.0 * speed[1]))
    spread = _number(label, "spread", table["spread"]) if "spread" in table else None
    numbers["tap_kc"] = _number(label, "tap_kc_mpa", table["tap_kc_mpa"]) if "tap_kc_mpa" in table else None
    ranges["spread_directions"] = _range(label, table, *_SPREADS)
    if ranges["spread_directions"] is not None and spread is None:
        raise InputError(f"{label}: spread is missing: spread_radial and spread_axial state what differs from it")
    exponents: Any = tuple(_number(label, key, table.get(key, 0.0)) for key in _EXPONENTS)
    covariance: Any = _matrix(label, table["covariance"]) if "covariance" in table else None
    texts: dict[str, Any] = {key: table.get(key, "") for key in _TEXTS}
    learned = learned_of(label, table["learned"]) if "learned" in table else None
    try:
        return Material(
            **numbers, **texts, **ranges, spread=spread, exponents=exponents, covariance=covariance, learned=learned
        )
    except InputError as err:
        raise InputError(f"{label}: {err}") from None


def read_material(path: str | Path) -> Material:
    """Read a material from a TOML file.

    Keys: ``name``, ``ktc_mpa``, ``krc_mpa``, ``kac_mpa``, ``kte_n_mm``, ``kre_n_mm``, ``kae_n_mm`` (N per mm of
    depth), ``source``; without all four radial and axial ones only the tangential force is known; optional
    ``workpiece``, ``conditions``, ``cutter``, ``chip_min_mm`` with ``chip_max_mm``, ``speed_min_m_min`` with
    ``speed_max_m_min``, ``exponent_t``, ``exponent_r``, ``exponent_a``, ``spread`` (with ``spread_radial`` and
    ``spread_axial`` where these differ) or ``covariance`` (6 rows of 6), ``peak_excess``, ``peak_excess_axial``,
    ``tap_kc_mpa``, and ``[learned]`` of ``chipload learn``.

    Raises
    ------
    InputError
        The file cannot be read, a key is unknown or missing, a number out of range, the source missing.
    """
    return _from_table(*read_table("material", path))


def material_text(material: Material) -> str:
    """Return the TOML text of a material for :func:`read_material`, with numbers to the last digit."""
    values: dict[str, Any] = {key: getattr(material, key) for key in _TEXTS if getattr(material, key)}
    for key, (name, _, _) in _NUMBERS.items():
        if not (material.tangential and key in _DIRECTIONS):
            values[key] = float(getattr(material, name))
    values |= {key: m for key, m in zip(_EXPONENTS, material.exponents, strict=True) if m}
    speed = material.speed and tuple(mm_min_from_mm_s(v) / 1000.0 for v in material.speed)
    for name, limits in (("chip", material.chip), ("speed", speed)):
        if limits is not None:
            values |= dict(zip(_RANGES[name], limits, strict=True))
    values |= {key: excess for key in _EXCESSES if (excess := getattr(material, key))}
    if material.tap_kc is not None:
        values["tap_kc_mpa"] = material.tap_kc
    if material.spread is not None:
        values["spread"] = material.spread
        values |= dict(zip(_SPREADS, material.spread_directions or (), strict=False))
    if material.covariance is not None:
        values["covariance"] = [list(row) for row in material.covariance]
    text = "".join(f"{key} = {json.dumps(value, ensure_ascii=False)}\n" for key, value in values.items())
    return text + (learned_text(material.learned) if material.learned is not None else "")


def knowledge_text(material: Material) -> str:
    """Return what a learned material was before and is now, by which logs, and what that is worth; empty: not learned.

    >>> knowledge_text(material_named("al7075-t6"))
    ''
    """
    own = material.learned
    if own is None:
        return ""
    deviation = np.sqrt(np.diagonal(material.variances))
    out = []
    for name, k, unit, (before, share) in (("Ktc", 0, "MPa", own.ktc), ("Kte", 3, "N/mm", own.kte)):
        value = material.coefficients[k]
        now = number_text(200.0 * deviation[k] / value, 2) if value else "0"
        was = f"{number_text(before)} +- {number_text(200.0 * share, 2)} %"
        out.append(f"{name} {number_text(value)} {unit} +- {now} % (two standard deviations), {was} in {own.prior}")
    return "; ".join([*out, f"learned from {own.logs_text}", *(worth.text for worth in own.worth)])


def with_worth(material: Material, worth: KnowledgeWorth) -> Material:
    """Return a learned material with the worth of its knowledge to one more job, in place of an earlier one of it."""
    if material.learned is None:
        raise InputError(f"material {material.name}: was not learned from logs")
    others = tuple(w for w in material.learned.worth if w.job != worth.job)
    return replace(material, learned=replace(material.learned, worth=(*others, worth)))


def texts_beyond_range(material: Material, chip_max_mm: float, speed_mm_s: float) -> tuple[str, ...]:
    """Return a text for each measured range that a cut leaves; none if it leaves none or no range is known.

    Parameters
    ----------
    material : with its ranges
    chip_max_mm : thickest chip [mm] of a step. Every chip has a thin end; a step is below the range only if its
        thickest chip is
    speed_mm_s : cutting speed at the rim [mm/s]

    Examples
    --------
    >>> steel = Material("steel", 1800.0, 600.0, 200.0, 30.0, 40.0, 2.0, source="made up", chip=(0.01, 0.1))
    >>> texts_beyond_range(steel, 0.15, 2000.0)
    ('material steel: a chip of 0.15 mm: its coefficients were measured from 0.01 to 0.1 mm',)
    """
    out = []
    if material.chip is not None and not material.chip[0] <= chip_max_mm <= material.chip[1]:
        low, high = material.chip
        out.append(f"a chip of {chip_max_mm:g} mm: its coefficients were measured from {low:g} to {high:g} mm")
    if material.speed is not None and not material.speed[0] <= speed_mm_s <= material.speed[1]:
        low, high, speed = (mm_min_from_mm_s(v) / 1000.0 for v in (*material.speed, speed_mm_s))
        out.append(f"a speed of {speed:g} m/min: its coefficients were measured from {low:g} to {high:g} m/min")
    return tuple(f"material {material.name}: {text}" for text in out)


def need_directions(material: Material, what: str) -> None:
    """Refuse a material with the tangential force alone where ``what`` also needs the direction of the force.

    Raises
    ------
    InputError
        It is one.
    """
    if material.tangential:
        raise InputError(
            f"material {material.name}: only its tangential force is known, {what} needs the radial and axial "
            "coefficients too: give a material with all six, or fit them (chipload fit)"
        )


def material_names() -> tuple[str, ...]:
    """Return the names of the shipped materials, sorted.

    >>> material_names()[:5]
    ('al2024-t3-from-group-22', 'al6061-t6-from-al6082-t6', 'al6082-t6', 'al7075-carbide', 'al7075-hss')
    """
    return shipped_names("material")


def material_named(name: str) -> Material:
    """Return the shipped material with this name.

    Raises
    ------
    InputError
        There is none; the message names the nearest.

    Examples
    --------
    >>> material_named("al7075-t6").Ktc
    767.01
    """
    return _from_table(*shipped_table("material", name))
