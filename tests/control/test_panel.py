"""The panel for LinuxCNC: its XML, the lines of HAL that connect it, the command that writes both."""

import xml.etree.ElementTree as ET
from dataclasses import replace

import pytest
from typer.testing import CliRunner

from chipload.cli import app
from chipload.control.hal_file import write_hal
from chipload.control.linuxcnc.hal_client import PINS, HalPins
from chipload.control.linuxcnc.panel import REASONS, panel_hal, panel_xml
from chipload.control.linuxcnc.path import write_path
from chipload.control.override import STATUS, STOPS
from simulated_machine import JOB, PATH, RULES


def test_every_widget_has_its_signal():
    """Each pin of the XML is connected once, to a pin that the component really has, of the same type."""
    root = ET.fromstring(panel_xml(JOB))
    kinds = {"number": "float", "bar": "float", "rectled": "bit"}
    widgets = {
        element.findtext("halpin").strip('"'): kinds[element.tag]
        for element in root.iter()
        if element.find("halpin") is not None
    }
    component = {name: kind for name, kind, _ in PINS}
    connected = {}
    for line in panel_hal("torque", "panel").splitlines()[1:]:
        net, signal, arrow, pin = line.split()
        assert (net, arrow) == ("net", "=>")
        assert pin.startswith("panel.")
        assert signal.startswith("torque-")
        connected[pin.removeprefix("panel.")] = component[signal.removeprefix("torque-")]
    assert connected == widgets
    assert {f"why-{status}" for status in STATUS} <= set(widgets)


def test_every_status_has_words():
    """In the order of their codes; those that are final say so."""
    assert tuple(REASONS) == STATUS
    assert {status for status, text in REASONS.items() if text.startswith("STOPPED")} == STOPS
    assert len(set(REASONS.values())) == len(STATUS)


@pytest.mark.parametrize(("overload", "end"), [(1.05, 150), (2.0, 220), (4.0, 420)])
def test_the_bar_ends_beyond_the_overload(overload, end):
    """In percent of the torque that is held: at least 150, at least 20 above the overload."""
    job = replace(JOB, override=replace(RULES, overload=overload * RULES.torque_ref))
    bar = ET.fromstring(panel_xml(job)).find(".//bar")
    assert float(bar.findtext("max_")) == end
    assert bar.findtext("range3").startswith(f"({100 * overload:.0f},")


def test_what_the_pins_are_told(monkeypatch):
    """The load is the torque over the limit, and of the lamps exactly that of the status is on."""
    lines = []
    pins = HalPins.__new__(HalPins)
    pins._follows_override, pins._spindle_override = True, 1.0
    monkeypatch.setattr(HalPins, "_line", lambda self, text: lines.append(text) or "1 2 3 4 5 6 7 8 9 0.9 12")
    pins.exchange(0.5, True, 0.15, STATUS.index("overload"), 3.0, 0.2)
    pins.exchange(0.5, True, 0.15, 0, 3.0, 0.0)
    names = [name for name, _, way in PINS if way == "out"]
    first, second = (dict(zip(names, map(float, line.split()), strict=True)) for line in lines)
    assert first["load"] == pytest.approx(75.0)
    # 1 until the pin of the spindle override has been read
    assert (first["spindle-override"], second["spindle-override"]) == (1.0, 0.9)
    assert (first["torque"], first["limit"], first["feed"]) == (0.15, 0.2, 0.5)
    assert [name for name in names if name.startswith("why-") and first[name]] == ["why-overload"]
    assert second["load"] == 0.0


def test_the_command(tmp_path):
    """The panel and its lines of HAL for the name that is asked; neither a run nor LinuxCNC is needed."""
    (tmp_path / "path.csv").write_text(write_path(PATH))
    hal = tmp_path / "hal.toml"
    hal.write_text(write_hal(JOB, "path.csv"))
    words = ["hal", str(hal), "--name", "torque", "--panel", str(tmp_path / "panel.xml")]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 0, done.stderr
    assert (tmp_path / "panel.xml").read_text() == panel_xml(JOB)
    assert "net torque-load => pyvcp.load" in (tmp_path / "panel.hal").read_text()
    assert "PYVCP = panel.xml" in done.stdout
    done = CliRunner().invoke(app, [*words, "--out", "log.csv"])
    assert done.exit_code == 2
    assert "--panel only writes the panel" in done.stderr
    done = CliRunner().invoke(app, [*words[:-1], str(tmp_path / "panel.txt")])
    assert done.exit_code == 2
    assert "must end with .xml" in done.stderr
