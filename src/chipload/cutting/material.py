"""What a material asks of the edge: cutting and edge coefficients, and where they were measured.

Notation: per mm of depth a tooth meets Ft = Ktc h + Kte (tangential), Fr = Krc h + Kre (radial), Fa = Kac h + Kae
(axial), h [mm] the chip thickness; Kc [MPa], Ke [N/mm]. Reference: [Altintas2012] ch. 2, [Zhang2021] table 5.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from chipload.errors import InputError
from chipload.tables import nearest, read_table, shipped_names, shipped_table

#: key in the file -> field, lowest and highest value that is believed
_NUMBERS = {
    "ktc_mpa": ("Ktc", 10.0, 2e4),
    "krc_mpa": ("Krc", -2e4, 2e4),
    "kac_mpa": ("Kac", -2e4, 2e4),
    "kte_n_mm": ("Kte", 0.0, 1e3),
    "kre_n_mm": ("Kre", -1e3, 1e3),
    "kae_n_mm": ("Kae", -1e3, 1e3),
}
_TEXTS = ("name", "source", "conditions", "workpiece")
_KEYS = (*_TEXTS, *_NUMBERS, "chip_min_mm", "chip_max_mm", "spread")


@dataclass(frozen=True)
class Material:
    """Force coefficients of one pair of material and cutter.

    Parameters
    ----------
    name : as the job calls it
    Ktc, Krc, Kac : cutting coefficients [MPa], tangential, radial, axial; 10 <= Ktc <= 20000
    Kte, Kre, Kae : edge coefficients [N/mm]
    source : where the numbers were published or measured; never empty
    conditions : cutter and lubrication they were measured with
    workpiece : alloy and temper
    chip : (smallest, greatest) chip thickness they hold for [mm]; None: the source does not say
    spread : relative standard deviation of the coefficients; None: the source does not say
    size : exponents (m_t, m_r, m_a) of the size effect, from 0 to below 1; 0: none

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
    size: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        for key, (name, low, high) in _NUMBERS.items():
            value = getattr(self, name)
            if not low <= value <= high:
                unit = "MPa" if key.endswith("mpa") else "N/mm"
                raise InputError(f"material.{key} = {value:g}: must be from {low:g} to {high:g} {unit}")
        if not self.source.strip():
            raise InputError(
                "material.source is missing: a coefficient without a source is refused; "
                "say where it was published or measured"
            )
        if self.chip is not None and not 0.0 <= self.chip[0] < self.chip[1] < math.inf:
            raise InputError(
                f"material.chip_max_mm = {self.chip[1]:g}: must be above chip_min_mm = {self.chip[0]:g}, which must be "
                "at least 0"
            )
        if self.spread is not None and not 0.0 <= self.spread < 1.0:
            raise InputError(f"material.spread = {self.spread:g}: must be from 0 to below 1 (0.1 is 10 %)")

    @property
    def law(self) -> tuple[float, ...]:
        """Coefficients and exponents, (Ktc, Krc, Kac, Kte, Kre, Kae, m_t, m_r, m_a), as the kernels take them."""
        return (*self.coefficients, *self.size)

    @property
    def coefficients(self) -> tuple[float, float, float, float, float, float]:
        """(Ktc, Krc, Kac, Kte, Kre, Kae) in MPa and N/mm."""
        return (self.Ktc, self.Krc, self.Kac, self.Kte, self.Kre, self.Kae)


def _number(label: str, key: str, value: Any) -> float:
    """A number of the file, not a truth value and not a text."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise InputError(f"{label}: {key} = {value!r}: must be a number")
    return float(value)


def _from_table(label: str, table: dict[str, Any]) -> Material:
    """A material from the values of its file; ``label`` names it in messages."""
    for key in table:
        if key not in _KEYS:
            near = nearest(key, list(_KEYS))
            raise InputError(f"{label}: unknown key {key}: the nearest known one is {near}")
    for key in ("name", *_NUMBERS):
        if key not in table:
            raise InputError(f"{label}: {key} is missing: must be given, coefficients are never invented")
    for key in _TEXTS:
        if not isinstance(table.get(key, ""), str):
            raise InputError(f"{label}: {key} = {table[key]!r}: must be a text")
    numbers: dict[str, Any] = {name: _number(label, key, table[key]) for key, (name, _, _) in _NUMBERS.items()}
    chip = None
    if "chip_min_mm" in table or "chip_max_mm" in table:
        for key in ("chip_min_mm", "chip_max_mm"):
            if key not in table:
                raise InputError(f"{label}: {key} is missing: give both chip_min_mm and chip_max_mm or neither")
        chip = (
            _number(label, "chip_min_mm", table["chip_min_mm"]),
            _number(label, "chip_max_mm", table["chip_max_mm"]),
        )
    spread = _number(label, "spread", table["spread"]) if "spread" in table else None
    texts: dict[str, Any] = {key: table.get(key, "") for key in _TEXTS}
    try:
        return Material(**numbers, **texts, chip=chip, spread=spread)
    except InputError as err:
        raise InputError(f"{label}: {err}") from None


def read_material(path: str | Path) -> Material:
    """Read a material from a TOML file.

    Keys: ``name``, ``ktc_mpa``, ``krc_mpa``, ``kac_mpa``, ``kte_n_mm``, ``kre_n_mm``, ``kae_n_mm`` (N per mm of
    depth), ``source``; optional ``workpiece``, ``conditions``, ``chip_min_mm`` with ``chip_max_mm``, ``spread``.

    Raises
    ------
    InputError
        The file cannot be read, a key is unknown or missing, a number out of range, the source missing.
    """
    return _from_table(*read_table("material", path))


def material_names() -> tuple[str, ...]:
    """Names of the materials that come with chipload, sorted.

    >>> material_names()
    ('al6082-t6', 'al7075-carbide', 'al7075-hss', 'al7075-t6')
    """
    return shipped_names("material")


def material_named(name: str) -> Material:
    """The shipped material of that name.

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
