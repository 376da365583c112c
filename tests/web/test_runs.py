"""Jobs run from the page: to their end, stopped half way, and ended with the page."""

import asyncio
import json
import re
import shutil
import time
import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from chipload.examples import copy_example
from chipload.web import worker
from chipload.web.dropped import read_dropped, write_answers
from chipload.web.runs import JobRun
from web_lists import serious_problems
from web_served import Served

#: a slot of one cut; tool, stock, machine and material are not stated
SLOT = "G21 G90\nT1 M6\nS3000 M3\nG0 X-10 Y10 Z5\nG0 Z-1\nG1 X20 F240\nG0 Z5\nM2\n"


def workers(job: Path) -> list[str]:
    """Processes that run a job."""
    out = []
    for entry in Path("/proc").iterdir():
        try:
            words = (entry / "cmdline").read_bytes().decode("utf-8", "replace").split("\0")
        except OSError:
            continue
        if "chipload.web.worker" in words and str(job) in words:
            out.append(entry.name)
    return out


def start(page, job: str, out: str) -> None:
    """Run a job of the list into a folder."""
    page.wait_for_selector(".cl-entry", state="visible")
    page.locator(".cl-home .cl-entry", has_text=job).get_by_text("Run").click()
    page.locator(".cl-out input").fill(out)
    page.locator(".cl-dialog:visible").get_by_text("Run", exact=True).last.click()


def wait(check, seconds=60.0):
    """Until something is so."""
    until = time.monotonic() + seconds
    while not check() and time.monotonic() < until:
        time.sleep(0.1)
    assert check()


#: keeps what the bar of the run says
WATCH = """() => { window.texts = []; const bar = document.querySelector('.cl-run-text');
    const seen = {childList: true, subtree: true, characterData: true};
    new MutationObserver(() => texts.push(bar.textContent)).observe(bar, seen); }"""


@pytest.fixture
def chips(folder):
    """A job of the opened folder that takes a few seconds."""
    growing = folder / "growing"
    job = copy_example("chips", growing) / "job.toml"
    (growing / "blade.toml").unlink()
    yield job
    shutil.rmtree(growing)


def test_a_job_is_refused_run_shown_and_stopped(window, folder, chips) -> None:
    """Run to its end, it states what is known of the limits, which rises, at most to the value of the verdict."""
    page = window("")
    job = folder / "contour" / "job.toml"
    # where its result may not go
    for out, message in (
        ("../elsewhere", "must be the name of a folder in the opened one"),
        ("/elsewhere", "must be the name of a folder in the opened one"),
        ("leaves/r", "must be the name of a folder in the opened one"),
        ("contour", "holds files that are not a result of chipload"),
    ):
        start(page, "contour/job.toml", out)
        page.locator(".cl-dialog .cl-no").get_by_text(message).wait_for()
        page.keyboard.press("Escape")
        page.wait_for_selector(".cl-dialog", state="hidden")
    assert workers(job) == []
    # to its end
    page.evaluate(WATCH)
    start(page, "growing/job.toml", "growing/result")
    page.wait_for_selector(".cl-run-text", state="visible")
    page.wait_for_function("document.querySelector('.cl-run-text').textContent.includes('%')")
    assert len(workers(chips)) == 1
    page.wait_for_selector(".cl-limits", state="visible", timeout=300_000)
    page.wait_for_function("document.querySelector('.cl-word').textContent != ''")
    summary = json.loads((chips.parent / "result" / "summary.json").read_text())
    assert page.inner_text(".cl-word") == summary["verdict"]
    assert page.inner_text(".cl-message") == summary["message"]
    force = next(x for x in summary["limits"] if x["name"] == "force_n")
    assert f"{force['worst']:.3g}" in page.locator(".cl-checks tbody tr", has_text="force").first.inner_text()
    page.wait_for_selector(".cl-now")
    assert page.inner_text(".cl-file") == tomllib.loads(chips.read_text())["program"]["file"]
    found = [re.search(r"so far .*?force (\S+) of (\S+) N in line (\d+)", text) for text in page.evaluate("texts")]
    values = [float(one[1]) for one in found if one]
    assert values
    assert values == sorted(values)
    assert {float(one[2]) for one in found if one} == {force["limit"]}
    # what is said has three digits
    assert values[-1] <= force["worst"] * (1.0 + 5e-3)
    wait(lambda: not workers(chips))
    # half way, with steps so short that it cannot have ended
    text = job.read_text()
    job.write_text(text.replace("step_mm = 0.5", "step_mm = 0.005"))
    try:
        page = window("")
        start(page, "contour/job.toml", "contour/again")
        page.wait_for_function("document.querySelector('.cl-run-text').textContent.includes('%')")
        page.get_by_text("Stop", exact=True).click()
        page.wait_for_function(
            "document.querySelector('.cl-run-text').textContent.includes('stopped, nothing was written')"
        )
        wait(lambda: not workers(job))
    finally:
        job.write_text(text)
    assert not (folder / "contour" / "again").exists()
    assert not list((folder / "contour").glob(".chipload-*"))


def test_a_run_that_is_stopped_before_its_process_is_there_ends(tmp_path) -> None:
    job = copy_example("contour", tmp_path / "contour") / "job.toml"

    async def stopped_at_once() -> JobRun:
        run = JobRun("contour/job.toml", "result")
        work = asyncio.create_task(run.work(job, tmp_path / "result"))
        await asyncio.sleep(0)
        await run.stop()
        assert run.state == "stopping"
        await asyncio.wait_for(work, 60.0)
        return run

    # the thread of the browser has a loop of its own
    with ThreadPoolExecutor(1) as pool:
        run = pool.submit(asyncio.run, stopped_at_once()).result()
    assert (run.state, run.message) == ("stopped", "stopped: nothing was written")
    assert not (tmp_path / "result").exists()


def test_a_wrong_job_says_why(window, folder) -> None:
    (folder / "wrong.toml").write_text('[program]\nfile = "none.ngc"\n[machine]\nname = "vmc"\n')
    try:
        page = window("")
        start(page, "wrong.toml", "wrong")
        page.get_by_text("wrong.toml: none.ngc").wait_for()
        assert not (folder / "wrong").exists()
    finally:
        (folder / "wrong.toml").unlink()


def test_ctrl_c_ends_the_page_and_its_run(browser, folder) -> None:
    served = Served(folder / "contour" / "job.toml")
    page = browser.new_page()
    page.goto(served.address())
    job = folder / "contour" / "job.toml"
    page.get_by_text("plans, checks and writes a result").wait_for()
    assert "radial_depth_mm" in page.inner_text(".cl-job")
    page.locator(".cl-home .cl-entry").first.get_by_text("Run").click()
    page.locator(".cl-out input").fill("later")
    page.locator(".cl-dialog:visible").get_by_text("Run", exact=True).last.click()
    wait(lambda: len(workers(job)) == 1)
    assert served.end() == 0
    wait(lambda: not workers(job))
    page.close()
    assert not (folder / "contour" / "later").exists()
    assert not list((folder / "contour").glob(".chipload-*"))


def test_a_program_that_is_dropped_is_asked_about_run_and_shown(window, folder) -> None:
    page = window("")
    page.wait_for_selector(".cl-drop")
    files = [{"name": "slot.nc", "mimeType": "text/plain", "buffer": SLOT.encode()}]
    page.set_input_files(".cl-drop input", [{**files[0], "name": "slot.ply"}])
    page.locator(".cl-drop [role=status]").get_by_text("not the ending of a program").wait_for()
    page.set_input_files(".cl-drop input", [{**files[0], "name": "slot.step"}])
    page.locator(".cl-drop [role=status]").get_by_text("slot.step: ").wait_for()
    page.set_input_files(".cl-drop input", files)
    page.wait_for_selector(".cl-question", state="visible")
    assert 1 <= page.locator(".cl-question").count() <= 5
    assert serious_problems(page) == []
    # a list with search, and two numbers
    material = page.get_by_role("combobox", name="material.name")
    material.click()
    material.fill("titanium")
    page.get_by_role("option", name="titanium-6al4v-from-group-37").click()
    page.get_by_role("textbox", name="cutter.0.diameter_mm").fill("8")
    page.get_by_role("textbox", name="stock.low_mm").fill("-6, -6, -12")
    page.get_by_role("checkbox", name="question 3: it is so").click()
    page.locator(".cl-dialog:visible").get_by_text("Run", exact=True).last.click()
    job = folder / "slot-job" / "job.toml"
    wait(job.exists)
    raw = tomllib.loads(job.read_text())
    assert raw["cutter"][0]["diameter_mm"] == 8.0
    assert raw["stock"]["low_mm"] == [-6.0, -6.0, -12.0]
    assert raw["material"]["name"] == "titanium-6al4v-from-group-37"
    assert (folder / "slot-job" / "slot.nc").read_bytes() == SLOT.encode()
    # the verdict of the coarse run comes while the whole run works, then its result is shown
    page.wait_for_selector(".cl-limits", state="visible", timeout=300_000)
    summary = json.loads((folder / "slot-job" / "result" / "summary.json").read_text())
    assert summary["verdict"] == "unproven"
    page.wait_for_function("document.querySelector('.cl-word').textContent == 'unproven'")
    assert any("guess" in f["text"] for f in summary["findings"])


def test_a_drawing_that_is_dropped_becomes_a_job(window, folder) -> None:
    page = window("")
    page.wait_for_selector(".cl-drop")
    # by the mouse: the browser hands the file over as a drop
    data = page.evaluate_handle(
        """(text) => { const data = new DataTransfer();
        data.items.add(new File([text], "housing.dxf")); return data; }""",
        (copy_example("pocket", folder / "pocket") / "housing.dxf").read_text(),
    )
    try:
        page.dispatch_event(".cl-drop", "drop", {"dataTransfer": data})
        page.wait_for_selector(".cl-question", state="visible")
        assert serious_problems(page) == []
        page.get_by_role("textbox", name="cutter.0.diameter_mm").fill("6")
        page.get_by_text("Save the job only").click()
        job = folder / "housing-job" / "job.toml"
        wait(job.exists)
        raw = tomllib.loads(job.read_text())
        assert (raw["part"]["file"], raw["cutter"][0]["diameter_mm"]) == ("housing.dxf", 6.0)
        # the job is shown, with a button that runs it
        page.locator(".cl-home").get_by_text("plans, checks and writes a result").wait_for()
    finally:
        shutil.rmtree(folder / "pocket")
        shutil.rmtree(folder / "housing-job", ignore_errors=True)


def test_the_first_look_of_a_draft_comes_before_its_result(tmp_path) -> None:
    dropped = read_dropped("slot.nc", SLOT.encode())
    job = write_answers(dropped, {}, tmp_path / "slot-job")
    written = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(worker, "_write", written.append)
        end = worker.work(str(job), str(tmp_path / "out"), worker.DRAFT)
    assert end["code"] == 3
    places = [k for k, line in enumerate(written) if "first" in line]
    assert len(places) == 1
    # a limit with its margin and its line, as in the bar of a result
    assert re.fullmatch(r"Unproven: .* of .*, margin .* %, in line 6 at \(.*\)", written[places[0]]["first"])
    assert all(line["done"] <= worker.FIRST for line in written[: places[0]])
    assert all(line["done"] >= worker.FIRST for line in written[places[0] + 1 :])
    # without the word for a draft its guesses are refused, as by the command
    assert worker.work(str(job), str(tmp_path / "other"))["code"] == 2
