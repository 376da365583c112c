"""The commands that list the machines, materials, cutters and examples that come with chipload."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Annotated

import typer

from chipload.cli.app import Debug, app
from chipload.cli.completion import machine_completions, material_completions
from chipload.terminal import plain, run_guarded, show

if TYPE_CHECKING:
    from chipload.jobs.shipped import Listing

Tabs = Annotated[bool, typer.Option("--tabs", help="a line a row, its cells apart by tabs, for another program")]
#: a table of so few columns is folded into any width
FEW = 3


@app.command()
def machines(
    name: Annotated[str, typer.Argument(help="machine to show in full", autocompletion=machine_completions)] = "",
    tabs: Tabs = False,
    debug: Debug = False,
) -> None:
    """List the machines that come with chipload: axes, travel, feed, spindle, source of the numbers."""
    run_guarded(lambda: _shown_machine(name) if name else _show_entry("machines", tabs), debug)


@app.command()
def materials(
    name: Annotated[
        str,
        typer.Argument(
            help="material to show in full: what each check proves with it", autocompletion=material_completions
        ),
    ] = "",
    tabs: Tabs = False,
    debug: Debug = False,
) -> None:
    """List the materials that come with chipload: coefficients, range, spread, what they prove, source."""
    run_guarded(lambda: _shown_material(name) if name else _show_entry("materials", tabs), debug)


@app.command()
def cutters(tabs: Tabs = False, debug: Debug = False) -> None:
    """List the cutter catalogues that come with chipload; a job states its cutters or names a tool library."""
    run_guarded(lambda: _show_entry("cutters", tabs), debug)


@app.command()
def examples(tabs: Tabs = False, debug: Debug = False) -> None:
    """List the examples. `chipload example NAME DIR` copies one."""
    run_guarded(lambda: _show_entry("examples", tabs), debug)


def _shown_machine(name: str) -> int:
    """Show every number of a machine, a line each, with the whole source."""
    from chipload.jobs.shipped import machines as listing_of
    from chipload.machine.machine import machine_named

    listing, known = listing_of(), machine_named(name)
    row = next(row for row in listing.rows if row[0] == known.name)
    for head, cell in zip(listing.head, row, strict=True):
        label, _, unit = head.partition(" [")
        if cell:
            show(f"{label}: {cell}{f' {unit[:-1]}' if unit else ''}")
    return 0


def _shown_material(name: str) -> int:
    from chipload.cutting.material import material_named
    from chipload.jobs.material_proofs import proofs_text

    show(proofs_text(material_named(name)))
    return 0


def _show_entry(name: str, tabs: bool) -> int:
    from chipload.jobs.shipped import LISTINGS

    listing = LISTINGS[name]()
    if tabs:
        for row in (listing.head, *listing.rows):
            show("\t".join(" ".join(cell.split()) for cell in row))
    else:
        _show_table(listing)
    return 0


def _show_table(listing: Listing) -> None:
    """The table in the width of the terminal, 80 columns in a pipe, or an entry of a few lines for each row where it
    does not fit.
    """
    from rich.console import Console
    from rich.measure import Measurement
    from rich.table import Table

    console, table = Console(), Table(show_edge=False, pad_edge=False)
    for title in listing.head:
        table.add_column(title, overflow="fold")
    for row in listing.rows:
        table.add_row(*(plain(cell) for cell in row))
    wanted = Measurement.get(console, console.options.update(max_width=10_000), table).maximum
    if len(listing.head) <= FEW or wanted <= console.width:
        console.print(table, markup=False)
        return
    for line in entry_lines(listing, console.width, whole=not sys.stdout.isatty()):
        show(plain(line))


def entry_lines(listing: Listing, width: int, *, whole: bool = False) -> list[str]:
    """Lines of at most ``width`` characters: the first cell of each row, below it the others with their units.

    The last cell, the source, has a line of its own, cut off where it is longer; ``whole``: it has all its lines.
    """
    from textwrap import shorten, wrap

    out = []
    for name, *cells, source in listing.rows:
        known = [(head.partition(" ["), cell) for head, cell in zip(listing.head[1:-1], cells, strict=True) if cell]
        texts = [f"{label} {cell}{f' {unit[:-1]}' if unit else ''}" for (label, _, unit), cell in known]
        out += [name, *wrap(", ".join(texts), width, initial_indent="    ", subsequent_indent="    ")]
        text = f"{listing.head[-1]}: {source}"
        if whole:
            out += wrap(text, width, initial_indent="    ", subsequent_indent="      ", break_on_hyphens=False)
        else:
            out.append("    " + shorten(text, width - 4, placeholder=" ..."))
    return out
