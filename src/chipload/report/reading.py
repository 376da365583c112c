"""The result of running a program that exists: what it does on the machine, by line, and to its stock.

The verdict over a program that was only read is never better than `unproven`: the machine's limits may hold, what the
cutter meets is not known.
"""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from html import escape
from pathlib import Path
from typing import IO, Any

import numpy as np
import plotly.graph_objects as go
import pyarrow as pa
import pyarrow.parquet as pq
import trimesh
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.errors import Finding
from chipload.machine.machine import Machine
from chipload.program.apt.writer import write_apt
from chipload.program.motions import is_arc, lengths, radii, spans, straightened
from chipload.program.program import DWELL, RAPID, Program
from chipload.program.read import Reading
from chipload.program.time import program_time
from chipload.report import feeds as fed_feeds
from chipload.report.feeds import Fed
from chipload.report.figures import FONT, GRID, LIMIT, SCALE, SPACE_POINTS, STOCK
from chipload.report.sheet import definitions, figure, framed, heading, items, table
from chipload.report.simulated import Simulated, operation, sections
from chipload.report.simulated import history as steps
from chipload.report.surface import coloured_mesh, span_of
from chipload.units import mm_min_from_mm_s, rpm_from_rad_s

Floats = NDArray[np.float64]

MOTIONS = ("rapid", "line", "arc clockwise", "arc counter-clockwise", "dwell")
#: chords of arcs in pictures leave them by at most this [mm]
CHORD_MM = 0.01
#: stem of the program with new feeds
FEEDS = "0-feeds"
#: findings and lines that the page lists
LISTED, SLOWEST = 300, 12


@dataclass(frozen=True, eq=False)
class Read:
    """A program that was read for a machine.

    Parameters
    ----------
    title : name of the job
    name : of the program's file
    reading : what it does
    lines, seconds : (m,) lines of the source that move, and their times [s]
    machine : that it was read for
    provenance : JSON values: hashes of the inputs, versions
    simulated : what the program does to its stock; None: it was only read
    fed : how it came to its feeds where they are new; None: they are those of the file
    cutters : by tool number; empty: not known
    """

    title: str
    name: str
    reading: Reading
    lines: NDArray[np.int64]
    seconds: Floats
    machine: Machine
    provenance: Mapping[str, Any]
    simulated: Simulated | None = None
    fed: Fed | None = None
    cutters: Mapping[int, Cutter] = field(default_factory=dict)


def verdict(read: Read) -> tuple[bool, str]:
    """Whether everything holds, which an unproven program never does, and one sentence that says it."""
    bad = read.reading.broken
    if bad:
        more = f"; and {len(bad) - 1} more" if len(bad) > 1 else ""
        return False, f"Does not hold: {_said(bad[0])}{more}."
    if read.simulated is not None:
        fails = _fails(read)
        if fails:
            more = f"; and {len(fails) - 1} more" if len(fails) > 1 else ""
            return False, f"Does not hold: {fails[0]}{more}."
        unproven = read.simulated.unproven
        if unproven:
            more = f"; and {len(unproven) - 1} more" if len(unproven) > 1 else ""
            return False, f"Unproven: nothing that is known exceeds a limit; {unproven[0]}{more}."
        held = ", ".join(h.says for h in read.simulated.held)
        return True, f"Every stated limit holds in the simulation: {held}."
    return False, f"Unproven: the limits of machine {read.machine.name} hold; what the cutter meets was not simulated."


def _fails(read: Read) -> tuple[str, ...]:
    """What the simulation found, and what new feeds do not reach."""
    found = read.simulated.fails if read.simulated is not None else ()
    return (*found, *(read.fed.fails if read.fed is not None else ()))


def _status(read: Read) -> str:
    """`failed`, `unproven` or `simulated`."""
    if read.reading.broken or _fails(read):
        return "failed"
    return "unproven" if read.simulated is None or read.simulated.verdict == "unproven" else "simulated"


def _said(finding: Finding) -> str:
    return f"line {finding.line}: {finding.text}" if finding.line else finding.text


def numbers(read: Read) -> dict[str, Any]:
    """What the program is, in numbers."""
    program = read.reading.program
    length, rapid = lengths(program), program.motion == RAPID
    cuts = ~rapid & (program.motion != DWELL)
    low, high = program.p_work.min(axis=0), program.p_work.max(axis=0)
    feeds = mm_min_from_mm_s(1.0) * program.feed[cuts & (length > 0.0)]
    return {
        "file": read.name,
        "motions": len(read.reading.commands),
        "path_mm": float(length.sum()),
        "cutting_mm": float(length[cuts].sum()),
        "rapid_mm": float(length[rapid].sum()),
        "time_s": float(read.seconds.sum()),
        "box_mm": {"low": low.tolist(), "high": high.tolist()},
        "feed_mm_min": {"min": float(feeds.min()), "max": float(feeds.max())} if len(feeds) else None,
        "tools": sorted({int(t) for t in program.tool}),
        "tilted": bool((np.abs(program.axis - (0.0, 0.0, 1.0)).max(axis=1) > 1e-9).any()),
    }


def summary_bytes(read: Read) -> bytes:
    """summary.json."""
    holds, says = verdict(read)

    def rows(findings: tuple[Finding, ...]) -> list[dict[str, Any]]:
        return [{"code": f.code, "line": f.line, "text": f.text} for f in findings]

    values = {
        "holds": holds,
        "says": says,
        "job": read.title,
        "program": numbers(read) | {"status": _status(read)},
        "operations": [_operation(read)] if read.simulated is not None else [],
        "machine": read.machine.name,
        "broken": rows(read.reading.broken),
        "findings": rows(read.reading.noticed),
        "provenance": dict(read.provenance),
    }
    return (json.dumps(values, indent=2, ensure_ascii=False, allow_nan=False) + "\n").encode()


def _operation(read: Read) -> dict[str, Any]:
    assert read.simulated is not None
    out = operation(read.simulated, float(read.seconds.sum()))
    if read.fed is None:
        return out
    said = fed_feeds.summary(read.fed, read.simulated, float(read.seconds.sum()), feeds_name(read), verdict(read)[0])
    if read.fed.fails:
        out |= {"holds": False, "verdict": "fails", "fails": list(_fails(read))}
    return out | {"feeds": said}


def feeds_name(read: Read) -> str:
    """Name of the program with new feeds."""
    return f"{FEEDS}{Path(read.name).suffix}"


def history(read: Read) -> dict[str, Any]:
    """A row a motion of the tip, or a chord of an arc, columns by name."""
    program = read.reading.program
    chords = _chords(program)
    row = np.asarray(_chords(replace(program, line=np.arange(len(program)))).line)
    share = 1.0 / np.bincount(row, minlength=len(program))[row]
    names = np.array([label or "program" for label in program.labels], dtype=object)
    axis = {f"axis_{x}": chords.axis[:, k] for k, x in enumerate("xyz")}
    return {
        "pass": names[chords.label],
        "line": chords.line,
        "motion": np.array(MOTIONS, dtype=object)[program.motion[row]],
        **{f"{x}_mm": chords.p_work[:, k] for k, x in enumerate("xyz")},
        **axis,
        "s_mm": np.cumsum(lengths(program)[row] * share),
        "t_s": np.cumsum(row_times(read)[row] * share),
        "feed_mm_min": np.where(program.motion == DWELL, 0.0, mm_min_from_mm_s(1.0) * program.feed)[row],
        "spindle_rpm": rpm_from_rad_s(1.0) * chords.spindle,
        "tool": chords.tool,
    }


def row_times(read: Read) -> Floats:
    """(n,) time of each row of the tip [s]; the rows of a line share what its axes need beyond the path's own time."""
    program = read.reading.program
    own, at = program_time(program, read.machine), np.searchsorted(read.lines, program.line)
    whole, count = np.zeros(len(read.lines)), np.zeros(len(read.lines))
    np.add.at(whole, at, own)
    np.add.at(count, at, 1.0)
    more = (read.seconds - whole)[at]
    share = np.where(whole[at] > 0.0, own / np.where(whole[at] > 0.0, whole[at], 1.0), 1.0 / count[at])
    return np.asarray(own + more * share)


def history_writer(read: Read) -> Callable[[IO[bytes]], None]:
    """What writes history.parquet; of a simulated program some ten thousand rows at a time are in memory."""

    def write(file: IO[bytes]) -> None:
        tables = map(_table, _rows(read))
        first = next(tables)
        with pq.ParquetWriter(file, first.schema, compression="zstd") as writer:
            for table in itertools.chain([first], tables):
                writer.write_table(table)

    return write


def _rows(read: Read) -> Iterator[Mapping[str, Any]]:
    """The columns of history.parquet, some rows at a time."""
    if read.simulated is None:
        yield history(read)
        return
    fed = fed_feeds.columns(read.fed, read.simulated) if read.fed is not None else {}
    at = 0
    for some in steps(read.simulated):
        count = len(some["pass"])
        yield {**some, **{name: values[at : at + count] for name, values in fed.items()}}
        at += count


def _table(columns: Mapping[str, Any]) -> pa.Table:
    n = len(columns["pass"])
    data = {"operation": pa.array(np.zeros(n, dtype=np.int32)), "strategy": pa.array(["program"] * n)}
    data |= {k: pa.array(v.tolist() if v.dtype == object else np.ascontiguousarray(v)) for k, v in columns.items()}
    return pa.table(data)


def scene_bytes(read: Read) -> bytes:
    """scene.glb: rapids and cutting motions as lines, what is left of the stock; lengths are mm, Z is up."""
    points, rapid = _drawn(read.reading.program)
    scene = trimesh.Scene()
    for name, chosen, colour in (("rapids", rapid, (179, 38, 30, 255)), ("path", ~rapid, (34, 120, 132, 255))):
        entities = [
            trimesh.path.entities.Line(np.arange(a - 1, b), color=np.array(colour, dtype=np.uint8))
            for a, b in _runs(chosen)
        ]
        if entities:
            path = trimesh.path.Path3D(entities=entities, vertices=points, process=False)
            scene.add_geometry(path, node_name=name, geom_name=name)
    if read.simulated is not None:
        stock = read.simulated.stock.mesh()
        stock.visual.face_colors = (168, 122, 58, 255)
        scene.add_geometry(stock, node_name="stock", geom_name="stock")
        left, columns = read.simulated.left, read.simulated.removal.columns
        if left is not None:
            scene.add_geometry(coloured_mesh(left, span_of(left, columns)), node_name="part", geom_name="part")
    glb: bytes = scene.export(file_type="glb", extension_webp=False)
    return glb


def program_files(read: Read) -> dict[str, bytes]:
    """CL data of the program, the stock that it leaves, and its own text where feeds are new."""
    program = read.reading.program
    tools = set(np.unique(program.tool).tolist())
    known = read.cutters if tools - {0} <= set(read.cutters) else None
    text = write_apt(program, known, title=f"{read.title}, {read.name}", verified=False)
    files = {"0-program.apt": text.encode("ascii")}
    if read.fed is not None:
        holds, says = verdict(read)
        own = fed_feeds.program_text(read.fed, None if holds else says.removeprefix("Does not hold: "))
        files[feeds_name(read)] = own.encode("utf-8", "surrogateescape")
    return files if read.simulated is None else files | {"stock.npz": read.simulated.stock.to_bytes()}


def page_bytes(read: Read) -> bytes:
    """report.html."""
    holds, says = verdict(read)
    bad = read.reading.broken
    word = "Holds" if holds else "Unproven" if _status(read) == "unproven" else "Does not hold"
    figures: dict[str, go.Figure] = {}
    what = numbers(read)
    minutes = what["time_s"] / 60.0
    low, high = what["box_mm"]["low"], what["box_mm"]["high"]
    box = ", ".join(f"{x} {a:.4g} to {b:.4g}" for x, a, b in zip("XYZ", low, high, strict=True))
    body = [*heading(read.title, holds, word, _sentence(says.removeprefix(f"{word}: ")))]
    body += _findings("What does not hold", bad)
    if _fails(read):
        body += ["<h3>What the simulation found</h3>", items(_fails(read)[:LISTED])]
    if read.simulated is not None and read.simulated.unproven:
        body += ["<h3>What is not proved</h3>", items(read.simulated.unproven[:LISTED])]
    if read.fed is not None and read.simulated is not None:
        name = feeds_name(read)
        body += fed_feeds.section(read.fed, read.simulated, float(read.seconds.sum()), name, holds, figures)
    body += [
        f"<h2>{escape(read.name)} on {escape(read.machine.name)}</h2>",
        f"<p>{what['motions']} motions, {what['cutting_mm']:.5g} mm at feed and {what['rapid_mm']:.5g} mm of rapids, "
        f"{minutes:.4g} min; {box} mm; tools {escape(', '.join(map(str, what['tools'])))}.</p>",
        "<h3>In space</h3>",
        '<p class="note">The path of the tip in the work frame, coloured by feed; rapids in red.</p>',
        figure("space", space(read.reading.program), figures),
        "<h3>Feed along the time</h3>",
        figure("feed", feed_figure(read), figures),
        "<h3>Lines that take longest</h3>",
        _slowest(read),
        *_findings("What the reader noticed", read.reading.noticed),
        *(sections(read.simulated, what["time_s"], figures) if read.simulated is not None else ()),
        "<h2>What was not checked</h2>",
        f"<p>{_unchecked(read)}</p>",
        "<h2>Where the numbers come from</h2>",
        definitions(read.provenance),
    ]
    return framed(read.title, word.lower(), body, figures)


def space(program: Program) -> go.Figure:
    """The path of the tip, coloured by feed."""
    points, rapid = _drawn(program)
    feeds = _drawn_feeds(program)
    step = -(-len(points) // SPACE_POINTS)
    keep = np.unique(np.concatenate([np.arange(0, len(points), step), [len(points) - 1]]))
    p, fast, feed = points[keep].astype(np.float32), rapid[keep], feeds[keep].astype(np.float32)
    out = go.Figure()
    lines = {"color": feed, "colorscale": SCALE, "width": 3}
    lines |= {"colorbar": {"title": {"text": "feed [mm/min]", "side": "right"}, "thickness": 12}, "showscale": True}
    cut = np.where(fast[:, None], np.nan, p)
    for k in np.flatnonzero(~fast[1:] & fast[:-1]):
        cut[k] = p[k]
    out.add_trace(go.Scatter3d(x=cut[:, 0], y=cut[:, 1], z=cut[:, 2], mode="lines", line=lines, name="feed"))
    away = np.where(fast[:, None], p, np.nan)
    for k in np.flatnonzero(fast[1:] & ~fast[:-1]):
        away[k] = p[k]
    red = {"color": LIMIT, "width": 1}
    out.add_trace(go.Scatter3d(x=away[:, 0], y=away[:, 1], z=away[:, 2], mode="lines", line=red, name="rapid"))
    camera = {"eye": {"x": 1.6, "y": -1.6, "z": 1.2}}
    axes = {f"{x}axis": {"title": f"{x.upper()} [mm]", "gridcolor": GRID} for x in "xyz"}
    scene = {"aspectmode": "data", "camera": camera, **axes}
    out.update_layout(
        template="none",
        height=520,
        font=FONT,
        scene=scene,
        margin={"l": 0, "r": 0, "t": 10, "b": 0},
        showlegend=True,
        legend={"x": 0.0, "y": 1.0},
    )
    return out


def feed_figure(read: Read) -> go.Figure:
    """Programmed feed against time, motion after motion."""
    columns = history(read)
    t, feed = np.asarray(columns["t_s"]) / 60.0, np.asarray(columns["feed_mm_min"])
    step = -(-len(t) // SPACE_POINTS)
    out = go.Figure(
        go.Scatter(
            x=t[::step].astype(np.float32), y=feed[::step].astype(np.float32), mode="lines", line_shape="vh",
            line={"color": STOCK, "width": 1.2},
            customdata=columns["line"][::step], hovertemplate="line %{customdata}: %{y:.5g} mm/min<extra></extra>",
        )
    )  # fmt: skip
    out.update_layout(template="none", height=260, font=FONT, margin={"l": 70, "r": 20, "t": 10, "b": 50})
    out.update_xaxes(title="time [min]", gridcolor=GRID)
    out.update_yaxes(title="feed [mm/min]", gridcolor=GRID, rangemode="tozero")
    return out


# -- parts ------------------------------------------------------------------------------------------------------
def _drawn(program: Program) -> tuple[Floats, NDArray[np.bool_]]:
    """Points with arcs as chords, and whether a rapid leads to each."""
    chords = _chords(program)
    return np.asarray(chords.p_work), np.asarray(chords.motion == RAPID)


def _drawn_feeds(program: Program) -> Floats:
    chords = _chords(program)
    moving = (chords.motion != RAPID) & (chords.motion != DWELL) & (spans(chords) > 0.0)
    return np.where(moving, mm_min_from_mm_s(1.0) * chords.feed, 0.0)


def _chords(program: Program) -> Program:
    r = radii(program)
    turn = 2.0 * np.arccos(1.0 - np.minimum(CHORD_MM / np.where(r > 0.0, r, np.inf), 1.0))
    return straightened(program, np.where(is_arc(program) & (r > 0.0), np.maximum(turn, 0.02), np.inf))


def _runs(chosen: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """(first, past the last) of each run of chosen rows that has a row before it."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], chosen, [False]]).astype(np.int8)))
    return [(max(int(a), 1), int(b)) for a, b in edges.reshape(-1, 2) if b > 1]


def _slowest(read: Read) -> str:
    order = np.argsort(-read.seconds, kind="stable")[:SLOWEST]
    whole = max(float(read.seconds.sum()), 1e-300)
    rows = [
        [str(int(read.lines[k])), f"{read.seconds[k]:.4g}", f"{100.0 * read.seconds[k] / whole:.3g}"]
        for k in order
        if read.seconds[k] > 0.0
    ]
    return table(["line", "time [s]", "of all [%]"], rows, numbers=(1, 2))


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:]


def _unchecked(read: Read) -> str:
    if read.simulated is None:
        return "Removal, engagement, force, collision: the program was only held against the limits of the machine."
    done = read.simulated
    out = ["whether the part comes out right: no part is stated"] if done.left is None else []
    if "stock" not in done.held_against:
        out.append("whether shank and holder run into the stock: stock_points_mm is not stated")
    if not any(name.startswith("fixture") for name in done.held_against):
        out.append("fixtures: none is stated")
    if done.no_holder:
        out.append(f"holders of tools {', '.join(map(str, done.no_holder))}: not stated")
    if done.rigid:
        out.append(f"what gives way and is not stated: {', '.join(done.rigid)}")
    if done.unchecked:
        out.append(f"limits that are not stated: {', '.join(done.unchecked)}")
    return escape(_sentence("; ".join(out)) + "." if out else "Everything that chipload can check of a program was.")


def _findings(title: str, findings: tuple[Finding, ...]) -> list[str]:
    if not findings:
        return []
    rows = [[str(f.line or ""), escape(f.text), escape(f.code)] for f in findings[:LISTED]]
    more = [f'<p class="note">{len(findings) - LISTED} more in summary.json.</p>'] if len(findings) > LISTED else []
    return [f"<h3>{title}</h3>", table(["line", "what", "code"], rows), *more]
