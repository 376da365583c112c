"""A session from program to report, driven by the client of the SDK over stdin and stdout."""

from __future__ import annotations

import asyncio
import base64
import json
import os
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

import chipload
from mcp import Client, StdioServerParameters
from slot_job import slot_job

TOOLS = {
    "list_files", "list_materials", "list_machines", "draft_job", "check_job", "simulate_job", "set_feeds",
    "read_result", "explain_limit", "result_picture",
}  # fmt: skip
PNG = b"\x89PNG\r\n\x1a\n"
#: a load is limited, so that feeds can follow from it
LIMIT = "limits.force_n=800.0"


async def session(folder: Path, outside: Path) -> dict:
    """Answers by the name of the step."""
    server = StdioServerParameters(
        command=sys.executable, args=["-m", "chipload", "mcp", str(folder)], env=dict(os.environ)
    )
    out = {}
    async with Client(server, read_timeout_seconds=300.0) as client:
        out["tools"] = {tool.name for tool in (await client.list_tools()).tools}
        seen = []

        async def report(part: float, whole: float | None, text: str | None) -> None:
            seen.append(part)

        async def call(key: str, tool: str, /, **arguments) -> None:
            out[key] = await client.call_tool(tool, arguments, progress_callback=report)

        await call("files", "list_files")
        await call("machines", "list_machines")
        await call("materials", "list_materials")
        await call("draft", "draft_job", file="slot.ngc", folder="draft", machine="vmc")
        await call("first", "simulate_job", job="draft/job.toml", result="first", coarse=True)
        await call("check", "check_job", job="slot/job.toml")
        await call("run", "simulate_job", job="slot/job.toml", result="result", overrides=[LIMIT])
        await call("feeds", "set_feeds", job="slot/job.toml", result="fast", overrides=[LIMIT])
        await call("read", "read_result", result="result")
        await call("explain", "explain_limit", name="torque_nm", result="result")
        await call("picture", "result_picture", result="result", columns=["force_n"])
        # what is refused
        for key, job in {
            "up": "../outside/job.toml", "absolute": str(outside / "job.toml"), "link": "link/job.toml",
            "names": "names/job.toml", "nothing": "nowhere/job.toml",
        }.items():  # fmt: skip
            await call(key, "check_job", job=job)
        await call("override", "check_job", job="slot/job.toml", overrides=["program.file='../../outside/slot.ngc'"])
        await call("out", "simulate_job", job="slot/job.toml", result="../stolen")
        await call("linked", "simulate_job", job="slot/job.toml", result="link/result")
        await call("draft_out", "draft_job", file="slot.ngc", folder=str(outside / "draft"))
        await call("machine", "draft_job", file="slot.ngc", folder="draft2", machine=str(outside / "mine.toml"))
    out["progress"] = seen
    return out


@pytest.fixture(scope="module")
def place(tmp_path_factory) -> Path:
    above = tmp_path_factory.mktemp("mcp").resolve()
    folder, outside = above / "shop", above / "outside"
    folder.mkdir()
    slot_job(folder / "slot")
    slot_job(outside)
    (outside / "mine.toml").write_text("name = 'mine'\n")
    (folder / "slot.ngc").write_text((outside / "slot.ngc").read_text())
    (folder / "link").symlink_to(outside, target_is_directory=True)
    named = slot_job(folder / "names")
    named.write_text(named.read_text().replace('"slot.ngc"', '"../../outside/slot.ngc"'))
    return above


@pytest.fixture(scope="module")
def answers(place) -> dict:
    before = sorted(path.relative_to(place).as_posix() for path in (place / "outside").rglob("*"))
    # a browser of another test has a running loop in this thread
    with ThreadPoolExecutor(1) as pool:
        out = pool.submit(asyncio.run, session(place / "shop", place / "outside")).result()
    out["outside"] = before, sorted(path.relative_to(place).as_posix() for path in (place / "outside").rglob("*"))
    return out


def test_the_session_has_its_tools(answers):
    assert answers["tools"] == TOOLS


def test_files_machines_and_materials_are_listed(answers, place):
    files = answers["files"].structured_content
    assert files["folders"] == [str(place / "shop")]
    assert {"path": str(place / "shop" / "slot" / "job.toml"), "kind": "job"} in files["files"]
    assert not [row for row in files["files"] if "link" in row["path"]]
    assert "vmc" in [row["name"] for row in answers["machines"].structured_content["machines"]]
    assert "al7075-t6" in [row["name"] for row in answers["materials"].structured_content["materials"]]


def test_a_program_without_a_job_is_drafted_and_never_proven(answers, place):
    draft, first = answers["draft"].structured_content, answers["first"].structured_content
    assert draft["job"] == str(place / "shop" / "draft" / "job.toml")
    assert draft["guesses"]
    assert first["verdict"] in ("unproven", "exceeds")
    assert first["reason"]


def test_a_job_is_checked_and_simulated_as_by_the_library(answers, place):
    assert answers["check"].structured_content["runs"] is True
    found = answers["run"].structured_content
    own = chipload.run_job(place / "shop" / "slot" / "job.toml", [LIMIT]).result
    assert (found["verdict"], found["reason"]) == (own.verdict.value, own.message)
    assert [row["worst"] for row in found["limits"]] == [check.worst for check in own.limits]
    assert Path(found["report"]).read_text(encoding="utf-8").startswith("<!doctype html>")
    text, picture = answers["run"].content
    assert json.loads(text.text) == found
    assert picture.mime_type == "image/png"
    assert base64.b64decode(picture.data).startswith(PNG)
    assert answers["read"].structured_content == found
    assert 0.0 <= max(answers["progress"]) <= 1.0


def test_feeds_follow_from_the_limits(answers, place):
    found = answers["feeds"].structured_content
    assert found["verdict"] in ("holds", "unproven")
    programs = [name for track in found["tracks"] for name in track["programs"]]
    assert programs
    before = chipload.load_result(place / "shop" / "result").in_use[0].time_s
    assert found["tracks"][0]["time_s"] < before


def test_a_limit_is_explained(answers):
    found = answers["explain"].structured_content
    assert (found["unit"], found["meaning"]) == ("N m", chipload.COLUMNS["torque_nm"].meaning)
    assert found["checks"][0]["state"] == "holds"
    assert found["checks"][0]["margin"].startswith("margin ")


def test_a_picture_is_a_png(answers):
    (picture,) = answers["picture"].content
    assert base64.b64decode(picture.data).startswith(PNG)


@pytest.mark.parametrize(
    ("step", "message"),
    [
        ("up", "'../outside/job.toml': lies outside the folders of this server: "),
        ("absolute", "job.toml': lies outside the folders of this server: "),
        ("link", "'link/job.toml': lies outside the folders of this server: "),
        ("names", "job.toml: program.file = '../../outside/slot.ngc': lies outside the folders of this server"),
        ("nothing", "'nowhere/job.toml': is not in the folders of this server: list_files shows what is"),
        ("override", "job.toml: program.file = '../../outside/slot.ngc': lies outside the folders of this server"),
        ("out", "'../stolen': lies outside the folders of this server: "),
        ("linked", "'link/result': lies outside the folders of this server: "),
        ("draft_out", "draft': lies outside the folders of this server: "),
        ("machine", "mine.toml': lies outside the folders of this server: "),
    ],
)
def test_what_lies_outside_the_folders_is_refused(answers, step, message):
    assert answers[step].is_error
    assert message in answers[step].content[0].text


def test_nothing_outside_was_touched(answers):
    before, after = answers["outside"]
    assert before == after
