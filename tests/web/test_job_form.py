"""The form of a job: its fields by hand, what is wrong in it as `chipload run` says it, a run with a changed value."""

import shutil
import tomllib
from pathlib import Path

import pytest

from chipload.errors import InputError
from chipload.jobs import load_job
from chipload.result import load_result
from chipload.web.job_form import job_errors, job_fields, override_of
from slot_job import slot_job
from square import make_result

EXAMPLES = Path(__file__).parents[2] / "src" / "chipload" / "examples"


@pytest.mark.parametrize("name", ["chips", "contour", "plate", "tube", "impeller"])
def test_every_single_value_of_a_job_is_a_field(name) -> None:
    path = EXAMPLES / name / "job.toml"
    found = {f.path: f.value for f in job_fields(path) if f.value is not None}

    def single(value, at):
        if isinstance(value, dict):
            for key, one in value.items():
                yield from single(one, f"{at}.{key}" if at else key)
        elif isinstance(value, list) and value and all(isinstance(v, dict) for v in value):
            for k, one in enumerate(value):
                yield from single(one, f"{at}.{k}")
        elif not isinstance(value, list):
            yield at, value

    stated = dict(single(tomllib.loads(path.read_text()), ""))
    # a free table, as parameters of a program, and a face by a number or a point have no field
    assert found.items() <= stated.items()
    assert len(found) >= 0.9 * len(stated)


def test_fields_state_unit_range_and_choices() -> None:
    fields = {f.path: f for f in job_fields(EXAMPLES / "chips" / "job.toml")}
    step = fields["operation.0.step_mm"]
    assert (step.kind, step.value, step.unit) == ("number", 0.5, "mm")
    assert step.bounds == "number, above 0, at most 100"
    assert "longest step" in step.meaning
    assert fields["cutter.0.modulus_gpa"].unit == "GPa"
    assert (fields["limits.power_w"].value, fields["limits.power_w"].unit) == (None, "W")
    assert fields["checks.rigid_model"].kind == "switch"
    assert not any(path.startswith("operation.0.feeds") for path in fields)
    feeds = {f.path: f.value for f in job_fields(EXAMPLES / "feeds" / "job.toml")}
    assert feeds["operation.0.feeds.slowest_percent"] == 20.0
    contour = {f.path: f for f in job_fields(EXAMPLES / "contour" / "job.toml")}
    assert set(contour["operation.0.milling"].choices) == {"down", "up"}


def test_a_key_that_takes_a_table_or_a_list_of_others(tmp_path) -> None:
    text = (EXAMPLES / "plate" / "job.toml").read_text()
    walls = '[part]\nfile = "part.step"\n\n[[wall]]\nface = 3\nfoot_mm = 5.0\nallowance_mm = [0.3]\n\n'
    (tmp_path / "job.toml").write_text("# walls\n" + walls + text[text.index("[workpiece]") :])
    fields = {f.path: f for f in job_fields(tmp_path / "job.toml")}
    assert fields["wall.0.foot_mm"].value == 5.0
    meaning = (
        "height above the lower edge of a side up to which the stock stays; required for a side, refused for a floor"
    )
    assert fields["wall.0.foot_mm"].meaning == meaning
    assert fields["wall.0.fit_mm"].value is None
    assert "wall.0.shape" not in fields


def test_what_is_entered_is_checked_as_a_run_does() -> None:
    path = EXAMPLES / "chips" / "job.toml"
    fields = {f.path: f for f in job_fields(path)}
    assert job_errors(path, []) == []
    wrong = override_of(fields["operation.0.step_mm"], "-1")
    assert wrong == "operation.0.step_mm=-1"
    with pytest.raises(InputError) as refused:
        load_job(path, [wrong])
    (text,) = job_errors(path, [wrong])
    assert text in str(refused.value)
    assert text.startswith("operation.0.step_mm = -1: must be above 0")
    assert override_of(fields["operation.0.step_mm"], "0.5") is None
    assert override_of(fields["checks.rigid_model"], True) == "checks.rigid_model=true"
    assert override_of(fields["cutter.0.name"], 'a "b"') == 'cutter.0.name="a \\"b\\""'


def test_a_changed_value_is_run_and_compared_with_the_last_result(browser, served, folder) -> None:
    work = folder / "form"
    job = slot_job(work)
    text = job.read_text()
    make_result(work / "result")
    page = browser.new_page(viewport={"width": 1280, "height": 720})
    page.set_default_timeout(400_000)
    wrong = []
    page.on("pageerror", lambda e: wrong.append(str(e)))
    page.goto(served.address("?show=form/job.toml"))

    field = page.get_by_role("textbox", name="cutter.0.flutes")
    field.wait_for()
    page.get_by_text("right, as in the file").wait_for()
    field.fill("0")
    page.get_by_text("cutter.0.flutes = 0").wait_for()
    assert page.locator(".cl-job button", has_text="Run").is_disabled()
    field.fill("4")
    page.get_by_text("right, 1 value changed: the file stays").wait_for()
    page.locator(".cl-job").get_by_text("Run", exact=True).click()
    page.get_by_text("cutter.0.flutes=4").wait_for()
    page.locator(".cl-dialog:visible").get_by_text("Run", exact=True).last.click()
    page.wait_for_selector(".cl-compared", state="visible")
    assert job.read_text() == text
    made = load_result(work / "result-changed")
    assert made.provenance.overrides == ("cutter.0.flutes=4",)
    heads = page.locator(".cl-compared th").all_inner_texts()
    assert heads[2].strip() == "form/result: program"
    force = page.locator(".cl-compared tbody tr", has_text="greatest force [N]").locator("td").all_inner_texts()
    assert float(force[1]) == pytest.approx(float(made.tracks[0].columns["force_n"].max()), rel=1e-3)
    # the last result is the hand-made one, whose force is 900 N
    assert float(force[2]) == 900.0
    page.close()
    shutil.rmtree(work)
    assert wrong == []
