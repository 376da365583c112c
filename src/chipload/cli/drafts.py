"""The commands ``chipload init`` and ``chipload simulate``, which take a file without a job."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from chipload.cli.app import Debug, MachineName, Sets, Tools, app
from chipload.cli.completion import machine_completions
from chipload.cli.inputs import show_verdict
from chipload.errors import InputError
from chipload.terminal import bar, run_guarded, show

File = Annotated[
    Path,
    typer.Argument(
        metavar="FILE",
        help="NC program, CL data, CAMotics project, DXF, STEP, STL, FreeCAD document, BladeGen.inf, or blade sections",
    ),
]
Looked = Annotated[Path, typer.Argument(metavar="FILE", help="a file that init accepts, or the job.toml that it wrote")]


MachineOf = Annotated[
    str | None,
    typer.Option(
        "--on",
        metavar="MACHINE",
        help="a shipped machine, or a file (.toml); default: a guess",
        autocompletion=machine_completions,
    ),
]


@app.command()
def init(
    file: File,
    folder: Annotated[
        Path | None, typer.Argument(metavar="DIR", help="folder for job.toml or for a template (without FILE)")
    ] = None,
    for_machine: MachineOf = None,
    tools: Tools = None,
    job: Annotated[
        str | None, typer.Option("--job", metavar="NAME", help="CAM job of a FreeCAD document; default: the first")
    ] = None,
    material: Annotated[bool, typer.Option("--material", help="write a material template into DIR")] = False,
    machine: Annotated[bool, typer.Option("--machine", help="write a machine template into DIR")] = False,
    catalogue: Annotated[bool, typer.Option("--catalogue", help="write a cutter catalogue template into DIR")] = False,
    controller: Annotated[
        bool, typer.Option("--controller", help="write a torque controller template into DIR")
    ] = False,
    fixture: Annotated[bool, typer.Option("--fixture", help="write a block as a fixture (STL) into DIR")] = False,
    debug: Debug = False,
) -> None:
    """Write a job for a file. Values that the file does not state are guesses for you to confirm.

    A model with thin walls gives a folder of jobs, which `chipload run DIR` runs in their order. The command does not
    overwrite an existing job. `chipload init --material DIR` writes a commented material template; --machine,
    --catalogue, --controller and --fixture do the same for other files.
    """

    def work() -> int:
        templates = (material, machine, catalogue, controller, fixture)
        names = ("material", "machine", "catalogue", "controller", "fixture")
        kinds = [name for name, wanted in zip(names, templates, strict=True) if wanted]
        if kinds:
            if folder is not None:
                raise InputError(f"{file}: a template takes no file: use chipload init --{kinds[0]} DIR")
            return _templates(kinds, file)
        if folder is None:
            raise InputError(f"{file}: the folder is missing: use chipload init FILE DIR")
        from chipload.jobs.drafts.draft import write_drafts
        from chipload.jobs.drafts.folder import RESULTS
        from chipload.jobs.drafts.make import drafts_of
        from chipload.jobs.drafts.questions import questions_of

        if (folder / "job.toml").exists():
            raise InputError(f"{folder / 'job.toml'}: already exists: name another folder")
        drafts = drafts_of(file, folder, machine=for_machine, tools=tools, job=job)
        written = write_drafts(drafts, folder)
        first, *_ = drafts.values()
        show(first.title)
        for draft in drafts.values():
            for note in draft.notes:
                show(f"found: {note}")
        for question in questions_of(drafts.values()):
            show(f"question: {question}")
        guesses = sum(len(draft.guesses) for draft in drafts.values())
        if len(drafts) == 1:
            show(f"written: {written[0]}: {guesses} guesses to confirm; then chipload run {written[0]} --out result")
            return 0
        for path, draft in zip(written, drafts.values(), strict=True):
            show(f"written: {path}: {draft.title}")
        pictures = [str(folder / name) for draft in drafts.values() for name in draft.files]
        show(f"picture: {', '.join(pictures)}")
        show(f"{guesses} guesses to confirm; then chipload run {folder} --out {folder / RESULTS}")
        return 0

    run_guarded(work, debug)


def _templates(kinds: list[str], folder: Path) -> int:
    """Write templates and show how a job names them."""
    from chipload.jobs.drafts.templates import write_template

    tables = {
        "fixture": '[[fixture]] file = "{}", units = "mm", spacing_mm = 2.0',
        "controller": '[torque_control] file = "{}"',
    }
    for kind in kinds:
        path = write_template(kind, folder)
        named = tables.get(kind, f'[{kind}] file = "{{}}"').format(path.name)
        show(f"written: {path}; in the job: {named}")
    return 0


@app.command()
def simulate(
    file: Looked,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="the result folder; default: only show the verdict")
    ] = None,
    machine: MachineName = None,
    tools: Tools = None,
    sets: Sets = None,
    debug: Debug = False,
) -> None:
    """Simulate a file without a job. It uses the guesses of `init`, so the verdict is never better than unproven."""

    def work() -> int:
        from tempfile import TemporaryDirectory

        from chipload.jobs import load_job, run_job
        from chipload.jobs.drafts.draft import write_draft
        from chipload.jobs.drafts.make import draft_of
        from chipload.report.folder import check_target, write_finished

        if out is not None:
            check_target(out)
        written = file.suffix.lower() == ".toml"
        for option, value in (("machine", machine), ("tools", tools)):
            if written and value is not None:
                raise InputError(f"--{option}: {file.name} is a job: state it there, or with --set")
        with TemporaryDirectory(prefix="chipload-") as above:
            job = file
            if not written:
                folder = Path(above) / (file.stem or "draft")
                draft = draft_of(file, folder, machine=machine, tools=tools)
                job = write_draft(draft, folder)
                show(draft.title)
                for question in draft.questions:
                    show(f"question: {question}")
            loaded = load_job(job, sets or ())
            if written:
                for guess in loaded.guesses:
                    show(f"guess: {guess.rpartition(' (line')[0]}")
            with bar() as progress:
                done = run_job(loaded, progress, accept=True)
                target = write_finished(done.result, done.presentation, out) if out is not None else None
        show_verdict(done.result, worst=True)
        more = "" if written else f"; chipload init {file} DIR writes the job and marks {len(loaded.guesses)} guesses"
        show(f"{done.result.verdict.value}: a first result{more}")
        if target is not None:
            show(f"report: {target / 'report.html'}")
        return done.result.verdict.exit_code

    run_guarded(work, debug)
