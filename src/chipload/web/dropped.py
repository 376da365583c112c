"""A file that is dropped on the page: its bytes, the draft of its job, the questions, and the job that they make.

A program, a drawing or a model is read as `chipload init` reads it, by the ending of its name, and never as anything
else. The bytes become a file of the opened folder when the job is written.
"""

from __future__ import annotations

import base64
import binascii
import math
import re
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath
from typing import Any

from chipload.errors import InputError
from chipload.jobs.drafts.draft import Draft, write_draft
from chipload.jobs.drafts.make import drafts_of
from chipload.jobs.drafts.questions import Question, questions_with_keys
from chipload.program.control import CONTROLS
from chipload.program.read import ENDINGS
from chipload.tables import shipped_names
from chipload.web.job_form import FormField, job_errors, job_fields

#: endings of drawings and models
MODELS = (".dxf", ".step", ".stp", ".stl")
#: largest program, and largest drawing or model, that is taken [bytes]
LARGEST, LARGEST_MODEL = 2_000_000, 20_000_000
#: where the value of an answer comes from
ANSWER = "answered on the page"
#: what a name of a file keeps
_NAME = re.compile(r"[^A-Za-z0-9_.\-]+")


class Upload:
    """The parts of one file, in their order."""

    def __init__(self) -> None:
        self.name, self.data = "", bytearray()
        self.next = 0

    def take(self, part: Any) -> tuple[str, bytes] | None:
        """Take a part as the browser sends it; name and bytes of the whole file with the last one.

        Raises
        ------
        InputError
            It is too large, of another kind by its name, or its parts do not follow one another.
        """
        try:
            name, size, number, count = str(part["name"]), int(part["size"]), int(part["part"]), int(part["of"])
            data = base64.b64decode(str(part["data"]), validate=True)
        except (TypeError, KeyError, ValueError, binascii.Error):
            raise InputError("the file did not arrive whole: drop it again") from None
        name = file_name(name)
        model = _is_model(name)
        most = LARGEST_MODEL if model else LARGEST
        if size > most or len(data) > most:
            raise InputError(
                f"{name}: {size} bytes: the page takes {'drawings and models' if model else 'programs'} of at most "
                f"{most}: use chipload init FILE DIR"
            )
        if number == 0:
            self.name, self.data, self.next = name, bytearray(), 0
        if (name, number) != (self.name, self.next) or len(self.data) + len(data) > most:
            raise InputError(f"{name}: did not arrive whole: drop it again")
        self.data += data
        self.next += 1
        if number + 1 < count:
            return None
        if len(self.data) != size:
            raise InputError(f"{name}: did not arrive whole: drop it again")
        return name, bytes(self.data)


def file_name(name: str) -> str:
    """The name of a dropped file, in letters that every system takes.

    Raises
    ------
    InputError
        Its ending is not that of a program, a drawing or a model.

    >>> file_name("../Teil 7.NC")
    'Teil_7.NC'
    """
    last = PurePosixPath(name.replace("\\", "/")).name
    plain = _NAME.sub("_", last).lstrip(".-")[-80:]
    ending = PurePosixPath(plain).suffix.lower()
    if ending not in ENDINGS and ending not in MODELS:
        raise InputError(
            f"{last[:80]}: {ending or 'no ending'} is not the ending of a program ({', '.join(sorted(ENDINGS)[:12])}, "
            f"...), a drawing or a model ({', '.join(MODELS)}): chipload init FILE DIR reads some other files"
        )
    return plain


@dataclass(frozen=True)
class AskedKey:
    """A key that a question asks for: its ``field``, or a place of three numbers where ``field`` is None."""

    path: str
    table: int
    key: str
    value: Any
    field: FormField | None
    choices: tuple[str, ...]


@dataclass(frozen=True)
class AskedQuestion:
    """A question with its keys."""

    text: str
    keys: tuple[AskedKey, ...]


@dataclass(frozen=True)
class DroppedFile:
    """A file that was dropped, the draft of its job, and its questions, at most five."""

    name: str
    data: bytes
    draft: Draft
    questions: tuple[AskedQuestion, ...]

    @property
    def folder(self) -> str:
        """The folder that is proposed for the job."""
        return f"{PurePosixPath(self.name).stem or 'file'}-job"


def read_dropped(name: str, data: bytes) -> DroppedFile:
    """Draft the job of a file, in a folder that is gone when it returns.

    Raises
    ------
    InputError
        It cannot be read, or nothing in it can be planned.
    """
    with tempfile.TemporaryDirectory(prefix="chipload-") as above:
        folder = Path(above) / "job"
        folder.mkdir()
        (folder / name).write_bytes(data)
        try:
            drafts = drafts_of(folder / name, folder)
        except InputError as err:
            raise InputError(str(err).replace(f"{folder}/", "")) from None
        draft = next(iter(drafts.values()))
        if len(drafts) > 1:
            more = (
                f"thin walls: chipload init {name} DIR writes {len(drafts)} jobs that check them too; this is the first"
            )
            draft = replace(draft, notes=(more, *draft.notes))
        fields = {f.path: f for f in job_fields(write_draft(draft, folder))}
    asked = tuple(_question_of(draft, q, fields) for q in questions_with_keys(draft.tables))
    return DroppedFile(name, data, draft, asked)


def draft_with_answers(dropped: DroppedFile, answers: Mapping[tuple[int, str], Any]) -> Draft:
    """The draft with answers in the place of its guesses, and the file beside the job.

    Parameters
    ----------
    answers : by table and key: a value, or a text as it was entered; keys that are not in it stay guesses

    Raises
    ------
    InputError
        An answer is not a value of its key.
    """
    keys = {(one.table, one.key): one for q in dropped.questions for one in q.keys}
    tables = []
    for number, table in enumerate(dropped.draft.tables):
        entries = [
            replace(e, value=_value(keys[number, e.key], answers[number, e.key]), note=ANSWER, guess=False, example="")
            if (number, e.key) in answers and (number, e.key) in keys
            else e
            for e in table.entries
        ]
        tables.append(replace(table, entries=tuple(entries)))
    return replace(dropped.draft, tables=tuple(tables), files={**dropped.draft.files, dropped.name: dropped.data})


def write_answers(dropped: DroppedFile, answers: Mapping[tuple[int, str], Any], folder: Path) -> Path:
    """Write the job of a file with its answers into a new folder, whole or not at all; return the job file.

    Raises
    ------
    InputError
        An answer is wrong, as the job reads it, or the folder is there already.
    OutputError
        The folder cannot be written.
    """
    draft = draft_with_answers(dropped, answers)
    with tempfile.TemporaryDirectory(prefix="chipload-") as above:
        errors = job_errors(write_draft(draft, Path(above) / "job"), ())
    if errors:
        raise InputError("; ".join(errors))
    return write_draft(draft, folder)


# -- parts ------------------------------------------------------------------------------------------------------
def _is_model(name: str) -> bool:
    return PurePosixPath(name).suffix.lower() in MODELS


def _question_of(draft: Draft, question: Question, fields: Mapping[str, FormField]) -> AskedQuestion:
    out = []
    for number, key in question.keys:
        table = draft.tables[number]
        before = sum(t.name == table.name for t in draft.tables[:number])
        path = f"{table.name}.{before}.{key}" if table.repeated else f"{table.name}.{key}"
        value = next(e.value for e in table.entries if e.key == key)
        field = fields.get(path)
        out.append(AskedKey(path, number, key, value, field, _choices(table.name, key, field)))
    return AskedQuestion(question.text, tuple(k for k in out if k.field is not None or isinstance(k.value, list)))


def _choices(table: str, key: str, field: FormField | None) -> tuple[str, ...]:
    """The words that a key may be; empty: any value."""
    if key == "name" and table in ("machine", "material"):
        return tuple(shipped_names(table))
    if key == "control":
        return CONTROLS
    return () if field is None else field.choices


def _value(asked: AskedKey, entered: Any) -> Any:
    """The value of an answer, of the kind of its key."""
    if not isinstance(entered, str) or asked.choices or (asked.field is not None and asked.field.kind == "word"):
        return entered
    if isinstance(asked.value, list):
        parts = re.split(r"[,;\s]+", entered.strip().strip("[]"))
        if asked.value and all(isinstance(one, str) for one in asked.value):
            return [part.strip('"') for part in re.split(r"\s*,\s*", entered.strip().strip("[]")) if part]
        numbers = [_number(asked, part) for part in parts]
        if len(numbers) != len(asked.value):
            raise InputError(f"{asked.path} = {entered[:40]}: must be {len(asked.value)} numbers")
        return numbers
    number = _number(asked, entered)
    return int(number) if asked.field is not None and asked.field.kind == "count" and number.is_integer() else number


def _number(asked: AskedKey, text: str) -> float:
    try:
        number = float(text.replace(",", "."))
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise InputError(f"{asked.path} = {text[:40]}: must be a number")
    return number
