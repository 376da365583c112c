"""The cases of a sweep: combinations of values of a job's keys, each with samples of material and modes."""

from __future__ import annotations

import itertools
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from chipload.cutting.material import Material
from chipload.errors import InputError
from chipload.lazy import scipy

#: most cases of one sweep
MOST = 100_000


@dataclass(frozen=True)
class Case:
    """One job of a sweep.

    Parameters
    ----------
    number : from 1
    values : key path and value, as text, for each key that the sweep varies
    combination : number of its combination of values, from 1
    sample : number of its sample of the material, from 1; 0: the material as it is stated
    """

    number: int
    values: tuple[tuple[str, str], ...]
    combination: int
    sample: int = 0

    @property
    def overrides(self) -> tuple[str, ...]:
        """The values as ``--set`` takes them."""
        return tuple(f"{key}={value}" for key, value in self.values)

    @property
    def name(self) -> str:
        """Name of its folder."""
        return f"case-{self.number:06d}"


@dataclass(frozen=True)
class Samples:
    """Samples of the force coefficients and of the modes from their distributions.

    Parameters
    ----------
    count : for each combination; 0: none
    seed : of the Sobol sequence
    """

    count: int = 0
    seed: int = 1

    def __post_init__(self) -> None:
        """Refuse invalid counts."""
        if not 0 <= self.count <= MOST:
            raise InputError(f"--samples = {self.count}: must be from 0 to {MOST}")
        if self.seed < 0:
            raise InputError(f"--seed = {self.seed}: must be at least 0")

    def points(self, dimensions: int) -> NDArray[np.float64]:
        """(count, dimensions) points of a scrambled Sobol sequence in the unit cube."""
        from scipy.stats import qmc

        sobol = qmc.Sobol(dimensions, rng=np.random.default_rng(self.seed))
        return np.asarray(sobol.random(1 << (self.count - 1).bit_length())[: self.count])

    def of(self, material: Material, normal: NDArray[np.float64] | None = None) -> list[Material]:
        """Materials whose coefficients are samples of the normal distribution that ``material`` states.

        Tangential coefficients stay in the range that is believed.

        Parameters
        ----------
        normal : (count, 6) standard normal numbers; None: of :meth:`points`

        Raises
        ------
        InputError
            The material states neither spread nor covariance.
        """
        if not self.count:
            return []
        factor = _root(material.variances)
        if normal is None:
            normal = scipy.special.ndtri(np.clip(self.points(6), 1e-9, 1.0 - 1e-9))
        drawn = normal @ factor.T + np.array(material.coefficients)
        drawn[:, 0], drawn[:, 3] = np.clip(drawn[:, 0], 10.0, 2e4), np.clip(drawn[:, 3], 0.0, 1e3)
        drawn[:, 1] = np.clip(drawn[:, 1], 0.0, 2e4)
        names = ("Ktc", "Krc", "Kac", "Kte", "Kre", "Kae")
        return [
            replace(
                material, spread=0.0, spread_directions=None, covariance=None,
                source=f"sample {k} of {material.name}; {material.source}",
                **dict(zip(names, row.tolist(), strict=True)),
            )
            for k, row in enumerate(drawn, 1)
        ]  # fmt: skip


def _root(variances: NDArray[np.float64]) -> NDArray[np.float64]:
    """A square root of a covariance, (6, 6), which may be singular."""
    values, vectors = np.linalg.eigh(variances)
    return np.asarray(vectors * np.sqrt(np.clip(values, 0.0, None)))


def cases_of(over: Sequence[str], samples: int = 0) -> tuple[Case, ...]:
    """Return every combination of the values of ``over``, the last key varying fastest.

    Parameters
    ----------
    over : texts ``key.path=a,b,c``; a value with commas is a TOML list in brackets
    samples : of the material, for each combination

    Raises
    ------
    InputError
        A text is no ``key=values``, a key is named twice, or there are too many cases.

    >>> [case.overrides for case in cases_of(["cutter.0.diameter_mm=6,8", "operation.0.use=plain"])]
    [('cutter.0.diameter_mm=6', 'operation.0.use=plain'), ('cutter.0.diameter_mm=8', 'operation.0.use=plain')]
    """
    keys: dict[str, list[str]] = {}
    for text in over:
        key, equals, values = text.partition("=")
        key = key.strip()
        if not equals or not key or not values.strip():
            raise InputError(f"--over {text}: must be key.path=value,value, as cutter.0.diameter_mm=6,8,10")
        if key in keys:
            raise InputError(f"--over {key}: named twice: give all of its values at once")
        keys[key] = _values(values)
    total = max(samples, 1)
    for values_of_key in keys.values():
        total *= len(values_of_key)
        if total > MOST:
            raise InputError(f"--over: {total} cases and more: at most {MOST}: take fewer values")
    combinations = [tuple(zip(keys, chosen, strict=True)) for chosen in itertools.product(*keys.values())]
    numbered = itertools.count(1)
    return tuple(
        Case(next(numbered), values, k, sample)
        for k, values in enumerate(combinations, 1)
        for sample in (range(1, samples + 1) if samples else (0,))
    )


def _values(text: str) -> list[str]:
    """The values of a list that commas separate, each as TOML writes it or as bare text.

    >>> _values('6, 8.5, "a,b", [1, 2], plain')
    ['6', '8.5', '"a,b"', '[1, 2]', 'plain']
    """
    out, start, depth, quoted = [], 0, 0, ""
    for k, c in enumerate(text):
        if quoted:
            quoted = "" if c == quoted else quoted
        elif c in "\"'":
            quoted = c
        elif c in "[{":
            depth += 1
        elif c in "]}":
            depth -= 1
        elif c == "," and not depth:
            out.append(text[start:k].strip())
            start = k + 1
    out.append(text[start:].strip())
    if not all(out):
        raise InputError(f"--over ...={text}: a value is empty")
    if depth or quoted:
        try:
            tomllib.loads(f"value = {text}")
        except tomllib.TOMLDecodeError as err:
            raise InputError(f"--over ...={text}: {err}") from None
    return out
