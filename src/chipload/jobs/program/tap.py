"""Identification of modes from hammer tests, and the file of modes that ``[dynamics]`` of a job names."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from chipload.errors import InputError
from chipload.structure.modal_fit import ModalFit, fit_modes
from chipload.structure.receptance_files import read_receptance


@dataclass(frozen=True, eq=False)
class TappedModes:
    """The modes identified from one file, with its direction."""

    name: str
    direction: str
    fit: ModalFit


def tap(
    files: Sequence[Path],
    directions: Sequence[str] = (),
    unit: str | None = None,
    band: tuple[float | None, float | None] = (None, None),
) -> tuple[TappedModes, ...]:
    """Identify modes from hammer tests, with one file for each direction.

    Parameters
    ----------
    directions : x or y for each file; empty: those that the files state
    unit : of files that do not state it
    band : lowest and highest frequency [Hz] of the fit; None: that of the file

    Raises
    ------
    InputError
        A file cannot be read or does not fit; the message names it.
    """
    if directions and len(directions) != len(files):
        raise InputError(f"--direction: {len(directions)} for {len(files)} files: give one for each")
    out = []
    for k, path in enumerate(files):
        measured = read_receptance(path, unit)
        direction = directions[k] if directions else measured.direction
        if direction not in ("x", "y"):
            raise InputError(
                f"{path.name}: direction {direction or 'not stated'}: give --direction x or y for each file"
            )
        f = measured.receptance.frequency
        low, high = (own if own is not None else float(f[i]) for own, i in zip(band, (0, -1), strict=True))
        try:
            fit = fit_modes(measured.receptance, (low, high), measured.coherence)
        except InputError as err:
            raise InputError(f"{path.name}: {err}") from None
        out.append(TappedModes(path.name, direction, fit))
    return tuple(out)


def modes_text(tapped: Sequence[TappedModes], tool: int | None = None) -> str:
    """Return the file of the modes (TOML)."""
    names = ", ".join(t.name for t in tapped)
    lines = [f'source = "hammer test: {names}"']
    for one in tapped:
        fit = one.fit
        for k in range(len(fit.frequency)):
            lines += ["", "[[mode]]", *([f"tool = {tool}"] if tool is not None else [])]
            lines += [
                f"frequency_hz = {fit.frequency[k]:.6g}",
                f"damping_ratio = {fit.damping[k]:.4g}",
                f"stiffness_n_um = {1e-3 * fit.stiffness[k]:.5g}",
                f'direction = "{one.direction}"',
                f"residual_percent = {100.0 * fit.left:.3g}",
            ]
            if fit.coherence is not None:
                lines.append(f"coherence = {fit.coherence[k]:.4f}")
    return "\n".join(lines) + "\n"
