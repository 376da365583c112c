"""A panel of the controller for LinuxCNC: the XML that PyVCP draws, and the lines of HAL that connect it.

It shows the torque, in N m and in percent of the limit that is held at the place, the feed override that is sent and
the one in effect, the spindle override that an answer to chatter has set (1: none), and why: a lamp next to each status
of the controller, in words. The panel reads pins only.
"""

from __future__ import annotations

from collections.abc import Mapping
from xml.sax.saxutils import escape

from chipload.control.hal import HalJob
from chipload.control.override import STATUS, STOPS, Status

#: what each status means, on the panel
REASONS: Mapping[Status, str] = {
    Status.RUN: "holds the torque at its limit",
    Status.SETTLING: "after a start: nothing rises yet",
    Status.AIR: "air: nothing is cut",
    Status.UNKNOWN: "torque not trusted: nothing rises",
    Status.LOST: "no reading of the torque: slow",
    Status.OVERLOAD: "STOPPED: overload",
    Status.NO_READING: "STOPPED: no reading of the torque",
    Status.LOW_READING: "STOPPED: torque too low for this cut",
    Status.OFF_PATH: "STOPPED: torque off the path",
    Status.MACHINE_DATA: "STOPPED: no position or time",
}
#: name that PyVCP's component has under AXIS
PANEL = "pyvcp"
#: pin of the panel and the pin of the controller whose signal it shows
SHOWN: tuple[tuple[str, str], ...] = (
    ("torque", "torque"),
    ("limit", "limit"),
    ("load", "load"),
    ("sent", "feed"),
    ("in-force", "feed-in"),
    ("spindle-override", "spindle-override"),
    *((f"why-{status}", f"why-{status}") for status in STATUS),
)
#: greatest load of the bar [%], at least
LOAD_MOST = 150


def panel_xml(job: HalJob) -> str:
    """The panel of a controller: its bar ends beyond the overload."""
    overload = 100.0 * job.override.overload / job.override.torque_ref
    most = max(LOAD_MOST, int(overload) + 20)
    torque = ("torque N m", "torque", "6.3f"), ("torque limit here N m", "limit", "6.3f")
    override = ("override sent", "sent", "5.2f"), ("override in effect", "in-force", "5.2f")
    lines = [
        "<?xml version='1.0' encoding='UTF-8'?>",
        "<pyvcp>",
        '<labelframe text="Torque">',
        *_numbers(torque),
        '<label><text>"torque in percent of that limit"</text></label>',
        '<bar><halpin>"load"</halpin><min_>0</min_>',
        f"<max_>{most}</max_>",
        '<bgcolor>"grey"</bgcolor>',
        f'<range1>(0,100,"green")</range1><range2>(100,{overload:.0f},"orange")</range2>',
        f'<range3>({overload:.0f},{10 * most},"red")</range3>',
        "<canvas_width>280</canvas_width><canvas_height>50</canvas_height>",
        "<bar_height>30</bar_height><bar_width>240</bar_width></bar>",
        "</labelframe>",
        '<labelframe text="Feed override">',
        *_numbers(override),
        "</labelframe>",
        '<labelframe text="Spindle override">',
        *_numbers((("against chatter", "spindle-override", "5.3f"),)),
        "</labelframe>",
        '<labelframe text="Why">',
        "<table>",
    ]
    for status in STATUS:
        colour = "red" if status in STOPS else "green" if status is Status.RUN else "orange"
        lines.append(
            f'<tablerow/><rectled><halpin>"why-{status}"</halpin><height>16</height><width>24</width>'
            f'<on_color>"{colour}"</on_color><off_color>"grey"</off_color></rectled>'
            f'<tablesticky sticky="w"/><label><text>"{escape(REASONS[status])}"</text></label>'
        )
    return "\n".join([*lines, "</table>", "</labelframe>", "</pyvcp>"]) + "\n"


def panel_hal(name: str = "chipload", panel: str = PANEL) -> str:
    """The lines of HAL that connect a panel with the controller; ``name``, ``panel``: of their components."""
    lines = [f"net {name}-{pin} => {panel}.{shown}" for shown, pin in SHOWN]
    return "\n".join(["# after the panel is loaded: [HAL] POSTGUI_HALFILE under AXIS", *lines]) + "\n"


def _numbers(rows: tuple[tuple[str, str, str], ...]) -> list[str]:
    out = ["<table>"]
    for text, pin, form in rows:
        out.append(
            f'<tablerow/><tablesticky sticky="w"/><label><text>"{text}"</text><width>18</width><anchor>"w"</anchor>'
            f'</label><number><halpin>"{pin}"</halpin><format>"{form}"</format></number>'
        )
    return [*out, "</table>"]
