"""What comes with chipload: machines, materials, cutters and examples, with their numbers and sources."""

from __future__ import annotations

import math
from dataclasses import dataclass

from chipload.cutter.catalogue import catalogue_named
from chipload.cutting.material import Material, material_named
from chipload.examples import example_titles
from chipload.jobs.material_proofs import proved_shares
from chipload.machine.machine import Machine, machine_named
from chipload.tables import shipped_names
from chipload.units import mm_min_from_mm_s, rpm_from_rad_s


@dataclass(frozen=True)
class Listing:
    """A table of texts: the heads of its columns, units in them, and its rows."""

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def machines() -> Listing:
    """Axes, travel, feed, spindle and dialect of each machine, and where its numbers come from."""
    head = ("name", "axes", "travel x y z [mm]", "feed [mm/min]", "spindle [rpm]", "power [W]", "torque [N m]")
    rows = [_machine(machine_named(name)) for name in shipped_names("machine")]
    return Listing((*head, "dialect", "source"), tuple(rows))


def _machine(m: Machine) -> tuple[str, ...]:
    travel = " ".join(
        f"{a.low:g}..{a.high:g}" if math.isfinite(a.low) else "endless" for a in m.chain.axes if a.letter in "XYZ"
    )
    speed = f"{rpm_from_rad_s(m.spindle_min):.0f}..{rpm_from_rad_s(m.spindle_max):.0f}"
    return (
        m.name, "".join(a.letter for a in m.chain.axes), travel, f"{mm_min_from_mm_s(m.feed_max):.0f}",
        speed if math.isfinite(m.spindle_max) else "not known", "" if m.power_w is None else f"{m.power_w:g}",
        "" if m.torque is None else f"{m.torque / 1000.0:g}", m.dialect, m.note or "typical values, no maker's machine",
    )  # fmt: skip


def materials() -> Listing:
    """Coefficients, range, spread and source of each material, and up to which share of a limit its coefficients prove
    it at 95 %.
    """
    head = ("name", "workpiece", "Ktc Krc Kac [MPa]", "Kte Kre Kae [N/mm]", "exponent", "chip [mm]", "spread [%]")
    rows = [_material(material_named(name)) for name in shipped_names("material")]
    return Listing((*head, "proves at 95 % [of limit]", "source"), tuple(rows))


def _material(m: Material) -> tuple[str, ...]:
    cutting = f"{m.Ktc:g}" if m.tangential else f"{m.Ktc:g} {m.Krc:g} {m.Kac:g}"
    edge = f"{m.Kte:g}" if m.tangential else f"{m.Kte:g} {m.Kre:g} {m.Kae:g}"
    torque, force = proved_shares(m)
    holds = f"torque, power to {torque:.2f}" + ("" if m.tangential else f", force to {force:.2f}")
    spreads = () if m.spread is None else (m.spread, *(m.spread_directions or ()))
    return (
        m.name, m.workpiece, cutting, edge, f"{m.exponents[0]:g}" if m.exponents[0] else "",
        "" if m.chip is None else f"{m.chip[0]:g}..{m.chip[1]:g}", " ".join(f"{100 * x:g}" for x in spreads),
        holds, f"{m.source}; {m.conditions}",
    )  # fmt: skip


def cutters() -> Listing:
    """The sizes of each catalogue by corner radius, and where they come from."""
    rows = []
    for name in shipped_names("catalogue"):
        catalogue = catalogue_named(name)
        for radius in catalogue.families:
            sizes = [c.diameter for c in catalogue.family(radius)]
            own = f"{min(sizes):g}..{max(sizes):g}" if len(sizes) > 1 else f"{sizes[0]:g}"
            rows.append((catalogue.name, own, f"{radius:g}", str(len(sizes)), catalogue.note))
    return Listing(("catalogue", "diameter [mm]", "corner radius [mm]", "cutters", "source"), tuple(rows))


def examples() -> Listing:
    """Name and heading of each example."""
    return Listing(("name", "what it shows"), tuple(example_titles().items()))


#: listings by the command that shows them
LISTINGS = {"machines": machines, "materials": materials, "cutters": cutters, "examples": examples}
