"""Modes of vibration of cutter and workpiece at the cut.

Notation: f natural frequency [Hz], w = 2 pi f, z damping ratio, k modal stiffness [N/mm], m = k / w^2 modal mass [t];
a unit direction in the machine's x and y, or x, y and z; U = direction / sqrt(m), so that r = U q with
q'' + 2 z w q' + w^2 q = U^T F for the displacement r of the cutter from the work under the force F on the cutter. A
mode of the workpiece enters in the same way: cutter and work part by the sum of both.

With directions in x and y alone the axial motion is taken as rigid.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.errors import InputError

Floats = NDArray[np.float64]

#: values that are believed: frequency [Hz], damping ratio, stiffness [N/mm]
FREQUENCY, DAMPING, STIFFNESS = (1.0, 50_000.0), (1e-5, 0.5), (10.0, 1e8)


@dataclass(frozen=True, eq=False)
class Modes:
    """Modes of one cutter, in its holder, with those of the workpiece.

    Parameters
    ----------
    frequency : (M,) float [Hz]
    damping : (M,) float, damping ratio
    stiffness : (M,) float [N/mm], modal stiffness at the tip
    direction : (M, 2) float, in x and y of the machine, or (M, 3) in x, y and z; made unit vectors

    Raises
    ------
    InputError
        Shapes do not agree, or a value is outside of what is believed.

    Examples
    --------
    >>> one = Modes([100.0], [0.02], [5000.0], [[0.0, 2.0]])
    >>> one.direction.tolist(), float(one.mass[0].round(8))
    ([[0.0, 1.0]], 0.01266515)
    """

    frequency: Floats
    damping: Floats
    stiffness: Floats
    direction: Floats

    def __post_init__(self) -> None:
        for name, (low, high), unit in (
            ("frequency", FREQUENCY, " Hz"), ("damping", DAMPING, ""), ("stiffness", STIFFNESS, " N/mm"),
        ):  # fmt: skip
            value = np.array(getattr(self, name), dtype=np.float64)
            if value.ndim != 1 or value.shape != np.shape(self.frequency) or len(value) == 0:
                raise InputError(f"modes.{name} of shape {value.shape}: must be a number for each of one or more modes")
            bad = np.flatnonzero(~((value >= low) & (value <= high)))
            if len(bad):
                raise InputError(f"modes.{name} = {value[bad[0]]:g}{unit}: must be from {low:g} to {high:g}{unit}")
            value.setflags(write=False)
            object.__setattr__(self, name, value)
        direction = np.array(self.direction, dtype=np.float64)
        if direction.shape not in ((len(self), 2), (len(self), 3)):
            raise InputError(
                f"modes.direction of shape {direction.shape}: must be ({len(self)}, 2) or ({len(self)}, 3)"
            )
        size = np.linalg.norm(direction, axis=1)
        if not (np.isfinite(size) & (size > 0.0)).all():
            raise InputError("modes.direction: must be finite and not 0")
        direction /= size[:, None]
        direction.setflags(write=False)
        object.__setattr__(self, "direction", direction)

    def __len__(self) -> int:
        return len(self.frequency)

    @property
    def omega(self) -> Floats:
        """Natural frequencies (M,) [rad/s]."""
        return np.asarray(2.0 * np.pi * self.frequency)

    @property
    def mass(self) -> Floats:
        """Modal masses (M,) [t]."""
        return np.asarray(self.stiffness / self.omega**2)

    @property
    def axial(self) -> bool:
        """Whether a mode moves along z."""
        return self.direction.shape[1] == 3 and bool(self.direction[:, 2].any())

    def in_frames(self, T: ArrayLike, n: ArrayLike, A: ArrayLike | None = None, *, directions: int = 2) -> Floats:
        """Return U (c, 2, M) [1/sqrt(t)] of cuts with T and n as (c, 2) or (c, 3) in axes of the machine.

        Parameters
        ----------
        A : (c, 3), axis of the cutter; None: z
        directions : 3: U (c, 3, M), along T, n and A
        """
        each = [np.asarray(x, dtype=np.float64) for x in (T, n)]
        if directions == 3:
            each.append(np.tile([0.0, 0.0, 1.0], (len(each[0]), 1)) if A is None else np.asarray(A, dtype=np.float64))
        each = [np.pad(x, ((0, 0), (0, 3 - x.shape[1]))) for x in each]
        own = np.pad(self.direction, ((0, 0), (0, 3 - self.direction.shape[1])))
        return np.ascontiguousarray(np.einsum("caj,kj->cak", np.stack(each, axis=1), own) / np.sqrt(self.mass))

    def receptance(self, omega: ArrayLike) -> NDArray[np.complex128]:
        """Return the receptance (.., 2, 2), or (.., 3, 3) with z, at angular frequencies [rad/s], [mm/N]."""
        w = np.asarray(omega, dtype=np.float64)[..., None]
        share = 1.0 / (self.omega**2 - w**2 + 2j * self.damping * self.omega * w)
        shape = self.direction.T / np.sqrt(self.mass)
        return np.asarray(np.einsum("ak,...k,bk->...ab", shape, share, shape))
