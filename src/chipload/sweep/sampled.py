"""Files with the samples of a sweep: the material and the modes of vibration of each combination of values.

Force coefficients are drawn from the spread or the covariance of the material; frequencies, damping ratios and
stiffnesses of modes from the standard deviations that ``[dynamics]`` states. Both come from one Sobol sequence.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from chipload.cutting.material import Material, material_named, material_text, read_material
from chipload.errors import InputError
from chipload.files import hash_of, write_whole
from chipload.jobs import LoadedJob, load_job
from chipload.jobs.simulation.dynamics_tables import DynamicsTable, ModeTable
from chipload.jobs.simulation.modes_file import read_modes
from chipload.lazy import scipy
from chipload.stability.probability import LEAST, MOST_DAMPED
from chipload.sweep.cases import Case, Samples

#: folders of the sampled materials and modes in the folder of a sweep
MATERIALS, MODES = "materials", "modes"
#: numbers that are drawn for a material and for a mode
COEFFICIENTS, OF_MODE = 6, 3


@dataclass(frozen=True)
class SampleFiles:
    """The files of one sample of one combination.

    Parameters
    ----------
    material : file of its coefficients; None: the job has no material that is drawn
    modes : file of its modes; None: the job states no deviations of modes
    """

    material: Path | None
    modes: Path | None

    @property
    def overrides(self) -> tuple[str, ...]:
        """Keys of the job that name the files, as ``--set`` takes them."""
        return (
            *((f'material.file="{self.material}"',) if self.material else ()),
            *((f'dynamics={{file="{self.modes}"}}',) if self.modes else ()),
        )

    @property
    def hashes(self) -> Mapping[str, str]:
        """Hashes of the files by what they hold."""
        named = {"sample": self.material, "sample of modes": self.modes}
        return {name: hash_of(file) for name, file in named.items() if file is not None}


def sample_files(job: Path, cases: Sequence[Case], samples: Samples, out: Path) -> dict[int, list[SampleFiles]]:
    """Write the samples of each combination and return them by its number; equal files are shared.

    Parameters
    ----------
    job : the job file
    out : folder of the sweep

    Raises
    ------
    InputError
        There is nothing to draw, or a limit needs a probability that the samples themselves give.
    """
    written: dict[str, list[Path]] = {}
    found: dict[int, list[SampleFiles]] = {}
    for case in cases if samples.count else ():
        if case.combination not in found:
            loaded = load_job(job, case.overrides)
            found[case.combination] = _files(loaded, job.parent, samples, out, written)
    return found


def _files(
    loaded: LoadedJob, folder: Path, samples: Samples, out: Path, written: dict[str, list[Path]]
) -> list[SampleFiles]:
    material, modes = _material(loaded), _modes(loaded, folder)
    table = getattr(loaded.job.table, "dynamics", None)
    normal = scipy.special.ndtri(np.clip(samples.points(COEFFICIENTS + OF_MODE * len(modes)), 1e-9, 1.0 - 1e-9))
    drawn = samples.of(material, normal[:, :COEFFICIENTS])
    materials = _write_files(out / MATERIALS, [material_text(one) for one in drawn], written)
    if table is None or not modes:
        return [SampleFiles(file, None) for file in materials]
    files = _write_files(out / MODES, modes_texts(modes, table, normal[:, COEFFICIENTS:]), written)
    return [SampleFiles(*pair) for pair in zip(materials, files, strict=True)]


def _material(loaded: LoadedJob) -> Material:
    source = getattr(loaded.job, "material", None)
    if source is None:
        raise InputError(
            f"--samples: a {loaded.capability.name} job without a material has nothing to draw: leave it out"
        )
    return read_material(source) if isinstance(source, Path) else material_named(source)


def _modes(loaded: LoadedJob, folder: Path) -> list[ModeTable]:
    """The modes of a job whose deviations are stated."""
    table = getattr(loaded.job.table, "dynamics", None)
    if table is None or table.frequency_percent is None:
        return []
    if getattr(loaded.job.table.limits, "stable_probability", None) is not None:
        raise InputError(
            "--samples: the samples give the probability: state limits.stability_margin in place of "
            "limits.stable_probability"
        )
    return [*table.mode, *(read_modes(folder / table.file) if table.file is not None else ())]


def modes_texts(modes: Sequence[ModeTable], table: DynamicsTable, normal: NDArray[np.float64]) -> list[str]:
    """Files of modes, one for each row of ``normal``.

    Each frequency, damping ratio and stiffness is its value times 1 + s n, with s its relative standard deviation
    and n normal, at least a tenth of the value.

    Parameters
    ----------
    normal : (samples, 3 modes) float, standard normal numbers
    """
    deviation = 0.01 * np.array(
        [[getattr(table, f"{name}_percent") or 0.0 for name in ("frequency", "damping", "stiffness")]]
    )
    factors = np.maximum(1.0 + deviation * normal.reshape(len(normal), len(modes), OF_MODE), LEAST)
    return ["\n".join(map(_mode_text, modes, own.tolist())) for own in factors]


def _mode_text(mode: ModeTable, factors: Sequence[float]) -> str:
    """A ``[[mode]]`` with its values times the factors of frequency, damping ratio and stiffness."""
    frequency, damping, stiffness = factors
    values: dict[str, float | None] = {
        "frequency_hz": mode.frequency_hz * frequency,
        "damping_ratio": None if mode.damping_ratio is None else min(mode.damping_ratio * damping, MOST_DAMPED),
        "stiffness_n_um": None if mode.stiffness_n_um is None else mode.stiffness_n_um * stiffness,
        # k = m (2 pi f)^2: the mass that gives the drawn stiffness at the drawn frequency
        "mass_kg": None if mode.mass_kg is None else mode.mass_kg * stiffness / frequency**2,
    }
    direction = f'"{mode.direction}"' if isinstance(mode.direction, str) else str(list(mode.direction))
    lines = ["[[mode]]", *((f"tool = {mode.tool}",) if mode.tool is not None else ()), f'of = "{mode.of}"']
    lines += [f"{name} = {value!r}" for name, value in values.items() if value is not None]
    return "\n".join([*lines, f"direction = {direction}", ""])


def _write_files(folder: Path, texts: Sequence[str], written: dict[str, list[Path]]) -> list[Path]:
    """Files with the texts in a folder of their own, or those that hold the same texts already."""
    key = f"{folder.name}\n" + "\n".join(texts)
    if key not in written:
        number = 1 + sum(k.partition("\n")[0] == folder.name for k in written)
        own = folder / f"{number:03d}"
        own.mkdir(parents=True, exist_ok=True)
        written[key] = [own / f"sample-{k:06d}.toml" for k in range(1, len(texts) + 1)]
        for file, text in zip(written[key], texts, strict=True):
            write_whole(file, text.encode())
    return written[key]
