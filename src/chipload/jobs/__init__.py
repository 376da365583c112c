"""Jobs: one folder for each capability, from the job file to its result.

Each folder holds ``tables`` (the keys of its job file), ``job`` (the tables checked against one another), ``run`` (from
the job to its outcome, and the check of all that it names), ``result`` (the outcome as a :class:`Result`) and
``figures`` (its part of the report). A new capability is one folder and one line in :data:`CAPABILITIES`.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from importlib import import_module
from pathlib import Path, PurePath
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import BaseModel, ValidationError

from chipload.errors import InputError, InputErrors
from chipload.files import read_regular, require_utf8
from chipload.jobs.confirm import guesses_of, take_confirm
from chipload.jobs.messages import Errors, left_missing, renamed_tables, table_errors
from chipload.jobs.override import override
from chipload.jobs.sources import cutter_errors, entries_of, named_errors, source_errors
from chipload.progress import Progress, silent
from chipload.tables import LARGEST_FILE, parse_toml, require_sound
from chipload.workers import Workers

if TYPE_CHECKING:
    from chipload.report.presentation import Presentation
    from chipload.result import Result
    from chipload.simulation.checkpoint import Checkpoint


@dataclass(frozen=True)
class Capability:
    """A capability.

    Parameters
    ----------
    name : of its folder and in results
    key : the table that only its job files have
    table : name of the table of the whole file, in ``tables``
    resumes : whether a stopped run continues from its checkpoint
    inner : the table of an operation that only its job files have; empty: ``key`` alone identifies them
    spreads : whether parts of a run can be computed by other processes
    threads : whether threads of this process share its simulation
    """

    name: str
    key: str
    table: str
    resumes: bool = False
    inner: str = ""
    spreads: bool = False
    threads: bool = False

    def module(self, part: str) -> ModuleType:
        """A file of its folder, imported when it is needed."""
        return import_module(f"chipload.jobs.{self.name}.{part}")

    @property
    def root(self) -> Any:
        """The pydantic model of its job file."""
        return getattr(self.module("tables"), self.table)


#: every capability; a job file belongs to the first whose table it has
CAPABILITIES = (
    Capability("torque", "torque_control", "TorqueJobTable"),
    Capability("feeds", "program", "FeedsJobTable", resumes=True, inner="feeds", threads=True),
    Capability("program", "program", "ProgramJobTable", resumes=True, threads=True),
    Capability("impeller", "impeller", "ImpellerJobTable", resumes=True, spreads=True),
    Capability("thinwall", "wall", "ThinWallJobTable", resumes=True),
    Capability("fit", "measurement", "FitJobTable"),
    Capability("distortion", "residual_stress", "DistortionJobTable"),
    Capability("contour", "part", "ContourJobTable"),
)


@dataclass(frozen=True, eq=False)
class LoadedJob:
    """A job that was read and whose tables agree.

    Parameters
    ----------
    capability : that it belongs to
    job : of the capability's own type
    source : name and hash of its file, or of the values that it was made of
    guesses : of a draft that its user has not confirmed, a line each
    """

    capability: Capability
    job: Any
    source: str
    guesses: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class FinishedJob:
    """What a run gives: the result, how it is presented, and the outcome in the capability's own type."""

    result: Result
    presentation: Presentation
    outcome: Any

    def __repr__(self) -> str:
        return f"FinishedJob({self.result.title}: {self.result.message})"

    def save(self, out: str | Path) -> Path:
        """Write the folder that ``chipload run`` writes and return it.

        Raises
        ------
        InputError
            The folder holds something other than an older result.
        OutputError
            The folder cannot be written.
        """
        from chipload.report.folder import write_result

        return write_result(self.result, self.presentation, out)


def load_job(path: str | Path, overrides: Sequence[str] = ()) -> LoadedJob:
    """Read a job file and apply ``key.path=value`` overrides; all that is wrong in it is refused at once.

    Raises
    ------
    InputError
        The file cannot be read, a key is unknown or missing, a value is out of range: one line that names it.
    """
    path = Path(path).absolute()
    require_utf8(path)
    data = read_regular(path, str(path), LARGEST_FILE, "not a job")
    raw = parse_toml(path.name, data)
    return _load_tables(capability_of(raw, overrides), path, raw, overrides, data)


def job_of(
    values: Mapping[str, Any], folder: str | Path = ".", overrides: Sequence[str] = (), capability: str | None = None
) -> LoadedJob:
    """A job of values, those of a job file by the same keys: no file is read but those that they name.

    Parameters
    ----------
    values : tables and lists of tables; a cutter may be a :class:`chipload.Cutter`, a file name a ``Path``
    folder : that the file names in ``values`` are relative to
    capability : name of the capability; None: by the tables

    Raises
    ------
    InputError
        As :func:`load_job`.
    """
    raw = plain(values)
    own = next((c for c in CAPABILITIES if c.name == capability), None) or capability_of(raw, overrides)
    data = json.dumps(raw, sort_keys=True).encode()
    return _load_tables(own, Path(folder).absolute() / own.name, raw, overrides, data)


def capability_of(raw: Mapping[str, Any], overrides: Sequence[str] = ()) -> Capability:
    """The first capability whose tables a job has, in its file or by its overrides."""
    inner = {key for _, entry in entries_of(raw, "operation") for key in entry}
    for text in overrides:
        table, _, rest = text.strip().partition(".")
        if table == "operation":
            inner.add(rest.partition(".")[2].partition(".")[0])
    return next((c for c in CAPABILITIES if c.key in raw and (not c.inner or c.inner in inner)), CAPABILITIES[-1])


def plain(value: Any) -> Any:
    """Values as a TOML file holds them: models as tables, tuples and arrays as lists, paths as text."""
    if isinstance(value, BaseModel):
        return plain(value.model_dump(exclude_none=True))
    if isinstance(value, Mapping):
        return {str(key): plain(v) for key, v in value.items() if v is not None}
    if isinstance(value, (list, tuple, np.ndarray)):
        return [plain(v) for v in value]
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, PurePath):
        return str(value)
    if isinstance(value, (str, bool, int, float)):
        return value
    raise InputError(
        f"{type(value).__name__}: is not a value that a job can hold: give numbers, texts, lists and tables"
    )


def _load_tables(
    capability: Capability, path: Path, raw: dict[str, Any], overrides: Sequence[str], data: bytes
) -> LoadedJob:
    """The job of a table that was read.

    Parameters
    ----------
    path : of the file; of values the folder that they are relative to, and the name of the capability
    data : what was read, for its hash
    """
    label, root = path.name, capability.root
    tables = take_confirm(raw)
    stated = [text.partition("=")[0].strip() for text in overrides]
    guesses = guesses_of(tables, data.decode("utf-8", "replace"), stated) if tables else ()
    for text in overrides:
        override(raw, text, root)
    require_sound(label, raw)
    errors, module = Errors(), capability.module("job")
    errors.texts += renamed_tables(raw)
    errors.refuse(f"{label}: ")
    try:
        with errors.collect():
            job = module.load(path, root.model_validate(raw), tuple(overrides))
            return LoadedJob(capability, job, f"{label} sha256 {sha256(data).hexdigest()}", guesses)
    except ValidationError as err:
        others = [c.root for c in CAPABILITIES if c is not capability]
        errors.texts += table_errors(err, root, others)
        # tables that are valid in themselves are checked against one another
        misspelt = left_missing(err, root)
        for text in (*module.missing_keys(raw), *source_errors(raw, root), *cutter_errors(raw, path.parent)):
            if text.split(": ")[0] not in misspelt:
                errors.add(text)
        for text in named_errors(raw, path.parent):
            errors.add(text)
    except OverflowError:
        errors.add("a number is too large: write it below 1e300")
    errors.refuse(f"{label}: ")
    raise AssertionError("a job is loaded or refused")


def run_job(
    loaded: LoadedJob,
    progress: Progress = silent,
    checkpoint: Checkpoint | None = None,
    *,
    accept: bool = False,
    workers: Workers | None = None,
) -> FinishedJob:
    """Run a job; nothing is written.

    Parameters
    ----------
    checkpoint : keeps finished work, so that a stopped run continues; used by the capabilities that can resume
    accept : run a job with guesses of a draft, which is refused else; nothing holds or exceeds by them
    workers : processes or a cluster that compute parts of the run, of a simulation of a program threads of this
        process; None: this process alone, a simulation on its cores. What is found is the same

    Raises
    ------
    InputError
        A file that it names cannot be used, or its values together; it has guesses that are not confirmed; it has no
        parts that other processes can compute.
    Cancelled
        By ``progress``.
    """
    capability = loaded.capability
    if loaded.guesses and not accept:
        raise InputErrors(*loaded.guesses, unconfirmed_text(loaded))
    more: dict[str, Any] = {"checkpoint": checkpoint} if capability.resumes else {}
    if workers is not None and workers.dask is None and capability.threads:
        more["workers"] = workers.processes
    elif workers is not None and not workers.alone:
        if not capability.spreads:
            raise InputError(
                f"--workers, --dask: {_article(capability.name)} job has no parts that other processes can compute: "
                "leave them out; chipload sweep runs many jobs"
            )
        more["workers"] = workers
    outcome = capability.module("run").run(loaded.job, progress, **more)
    result: Result = capability.module("result").result_of(outcome)
    inputs = {"job": loaded.source, **result.provenance.inputs}
    result = replace(result, provenance=replace(result.provenance, inputs=inputs))
    if loaded.guesses:
        from chipload.jobs.guesses import with_guesses

        result = with_guesses(result, loaded.guesses, plan=capability.key != "program")
    return FinishedJob(result, capability.module("figures").presentation_of(outcome), outcome)


def resume_note(loaded: LoadedJob) -> str:
    """The parts of a job that are not kept, so that it starts again if it is stopped; empty: all is kept."""
    capability = loaded.capability
    if not capability.resumes:
        return f"{_article(capability.name)} job does not resume: if it is stopped, it starts again"
    return str(capability.module("job").resume_note(loaded.job))


def _article(name: str) -> str:
    return f"{'an' if name[0] in 'aeiou' else 'a'} {name}"


def unconfirmed_text(loaded: LoadedJob) -> str:
    """What is said of a job with guesses."""
    count = len(loaded.guesses)
    return (
        f"{count} guess{'es are' if count > 1 else ' is'} not confirmed: correct what is wrong, then delete "
        "`confirm = true` of the table, or run with --accept"
    )


def check_job(loaded: LoadedJob) -> tuple[list[str], bool]:
    """Read all that a job names without running it: a line for each thing that was found, and whether it holds.

    Raises
    ------
    InputError
        As :func:`run_job`: a line for each file and name that cannot be used.
    """
    try:
        lines, holds = loaded.capability.module("run").check(loaded.job)
    except InputError as err:
        # the first that cannot be read ends the reading: the others are named too
        errors = Errors()
        for text in named_errors(loaded.job.table.model_dump(), loaded.job.path.parent):
            errors.add(text)
        first = [str(text) for text in err.args]
        keys = {text.partition(" = ")[0] for text in errors.texts}
        known = any("cannot be read" in text or text.partition(" = ")[0] in keys for text in first)
        errors.texts = errors.texts if known else [*first, *errors.texts]
        if len(errors.texts) > 1:
            errors.refuse(f"{loaded.source.partition(' sha256 ')[0]}: ")
        raise
    if loaded.guesses:
        lines, holds = [*(f"guess: {text}" for text in loaded.guesses), *lines, unconfirmed_text(loaded)], False
    return lines, holds
