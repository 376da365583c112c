"""Jobs run from the page: to their end, stopped half way, and ended with the page."""

import asyncio
import json
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from chipload.examples import copy_example
from chipload.web.runs import JobRun
from web_served import Served


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


def test_a_job_is_refused_run_shown_and_stopped(window, folder) -> None:
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
    start(page, "contour/job.toml", "contour/result")
    page.wait_for_selector(".cl-run-text", state="visible")
    page.wait_for_function("document.querySelector('.cl-run-text').textContent.includes('%')")
    assert len(workers(job)) == 1
    page.wait_for_selector(".cl-limits", state="visible", timeout=300_000)
    page.wait_for_function("document.querySelector('.cl-word').textContent != ''")
    summary = json.loads((folder / "contour" / "result" / "summary.json").read_text())
    assert page.inner_text(".cl-word") == summary["verdict"]
    assert page.inner_text(".cl-message") == summary["message"]
    first = next(x for x in summary["limits"] if x["name"] == "engagement_deg")
    row = page.locator(".cl-checks tbody tr", has_text="engagement")
    assert f"{first['worst']:.4g}" in row.inner_text()
    page.wait_for_selector(".cl-now")
    assert page.inner_text(".cl-file") == "0-backward.ngc"
    wait(lambda: not workers(job))
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
