"""The profiles as data: every control reads the same part, and its table is what the manuals state."""

import re
from pathlib import Path

import pytest

import chipload
from chipload.errors import InputError
from chipload.program.control import CONTROLS, FOLDER, ControlSettings, control_named, is_cl_data

SOURCE = Path(chipload.__file__).parent


@pytest.mark.parametrize("name", CONTROLS)
def test_a_profile_is_whole(name):
    control = control_named(name)
    assert control.name == name
    assert control.source
    assert control.language in CONTROLS
    assert control.numbers.point in ("increment", "whole")
    assert control.cycles.starts_spindle in ("none", "tapping", "all")
    assert control.feed.rotary in ("linear first", "sum", "diameter")
    assert control.offsets.offset_holds in ("diameter", "unknown")
    for value in control.ask:
        record = control
        for part in value.split("."):
            record = getattr(record, part)


def test_each_file_is_a_control():
    assert sorted(path.stem for path in FOLDER.glob("*.toml")) == sorted(CONTROLS)


@pytest.mark.parametrize(
    ("name", "g80", "packed", "repeats", "starts"),
    [
        ("fanuc", True, True, "k", "tapping"),
        ("haas", True, False, "l", "all"),
        ("linuxcnc", False, False, "l", "none"),
        ("grbl", False, False, "l", "none"),
        ("mitsubishi", True, False, "k", "tapping"),
    ],
)
def test_rules_of_the_manuals(name, g80, packed, repeats, starts):
    control = control_named(name)
    rules = control.modal.cycle_group, control.macros.packed_calls, control.cycles.repeat_letter
    assert (*rules, control.cycles.starts_spindle) == (g80, packed, repeats, starts)


def test_tool_offsets_of_fanuc_and_haas_lie_elsewhere():
    assert dict(control_named("fanuc").macros.tool_variables)[13001] == "radius"
    assert dict(control_named("haas").macros.tool_variables)[2401] == "diameter"


def test_what_is_refused():
    with pytest.raises(InputError, match=r"control = 'fagor': must be one of linuxcnc, fanuc, haas"):
        control_named("fagor")
    with pytest.raises(InputError, match=r"program.settings.point = 'half': must be increment or whole"):
        control_named("haas").with_settings(ControlSettings(point="half"))


def test_code_asks_a_profile_and_no_name():
    """Which control it is decides by its profile: no comparison with the name of a control or of a language."""
    names = "|".join((*CONTROLS, "apt"))
    compared = re.compile(rf'(?:==|!=|\bin) *[(\[{{]?"(?:{names})"|"(?:{names})" *(?:==|!=|\bin\b)')
    found = [
        f"{path.name}: {line.strip()}"
        for path in sorted(SOURCE.rglob("*.py"))
        if "examples" not in path.parts
        for line in path.read_text(encoding="utf-8").splitlines()
        if compared.search(line) and not line.strip().startswith((">>>", "for "))
    ]
    assert found == []


@pytest.mark.parametrize(
    ("name", "form", "comment", "override"),
    [
        ("linuxcnc", "blocks", ("(", ")"), "M52 P1"),
        ("grbl", "blocks", ("(", ")"), ""),
        ("haas", "blocks", ("(", ")"), ""),
        ("sinumerik", "blocks", ("; ", ""), ""),
        ("heidenhain", "conversational", ("; ", ""), ""),
    ],
)
def test_form_of_the_lines(name, form, comment, override):
    lines = control_named(name).lines
    assert (lines.form, lines.comment, lines.override_on) == (form, comment, override)
    assert is_cl_data("apt")
    assert not is_cl_data(name)
