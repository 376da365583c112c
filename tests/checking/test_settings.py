"""Defaults and ranges of values are those of the tables of the job file; tables become values by name."""

from __future__ import annotations

from dataclasses import MISSING, fields
from typing import get_args

import pytest
from annotated_types import Ge, Gt, Le, Lt

from chipload.checking.clamped import Workpiece, WorkpieceClamp
from chipload.checking.dynamics import Mode, Vibration
from chipload.checking.settings import CheckSettings, Limits, SimulationSettings
from chipload.checking.stiffness import MachineStiffness
from chipload.checking.workpiece import FinishedPart
from chipload.errors import InputError
from chipload.jobs.simulation.dynamics_tables import DynamicsTable, ModeTable
from chipload.jobs.simulation.tables import (
    ClampTable,
    ProgramLimitsTable,
    SimulateTable,
    StiffnessTable,
    TargetTable,
    WorkpieceTable,
)
from chipload.jobs.tables import StockChecksTable, Table, value_of

PAIRS = [
    (SimulationSettings, SimulateTable, {"kind", "speeds"}),
    (Limits, ProgramLimitsTable, set()),
    (CheckSettings, StockChecksTable, set()),
    (MachineStiffness, StiffnessTable, set()),
    (Workpiece, WorkpieceTable, {"clamp"}),
    (WorkpieceClamp, ClampTable, set()),
    (Mode, ModeTable, set()),
    (Vibration, DynamicsTable, {"file", "mode"}),
]
#: fields that hold values of other tables, or have another name there
OTHER = {"clamps", "modes", "process_damping", "file", "mesh"}


def limits_of(field) -> set[tuple[str, float]]:
    """Limits that pydantic checks, of the field and of its types."""
    found, waiting = set(), [field.annotation, *field.metadata]
    while waiting:
        one = waiting.pop()
        for kind, name in ((Gt, "gt"), (Ge, "ge"), (Lt, "lt"), (Le, "le")):
            if isinstance(one, kind):
                found.add((name, float(getattr(one, name))))
        waiting += [*get_args(one), *getattr(one, "__metadata__", ()), *getattr(one, "metadata", ())]
    return found


@pytest.mark.core
@pytest.mark.parametrize(("value", "table", "only_table"), PAIRS, ids=lambda x: getattr(x, "__name__", ""))
def test_a_value_has_the_fields_and_defaults_of_its_table(value, table: type[Table], only_table):
    own = {f.name: f for f in fields(value) if f.name not in OTHER or (value is Workpiece and f.name == "modes")}
    assert own.keys() == table.model_fields.keys() - only_table - OTHER | (own.keys() & {"modes"})
    for name, field in own.items():
        stated = table.model_fields[name]
        assert (field.default is MISSING) == stated.is_required(), name
        if field.default is not MISSING:
            assert stated.default == field.default, name


@pytest.mark.core
@pytest.mark.parametrize(("value", "table", "only_table"), PAIRS, ids=lambda x: getattr(x, "__name__", ""))
def test_a_value_refuses_what_its_table_refuses(value, table: type[Table], only_table):
    for field in fields(value):
        limits = field.metadata.get("range")
        if limits is None:
            continue
        words = {"gt": limits.above, "ge": limits.least, "lt": limits.below, "le": limits.most}
        own = {(name, float(limit)) for name, limit in words.items() if limit is not None}
        # a whole number of the file is at most 1000 in any table
        assert own >= limits_of(table.model_fields[field.name]) - {("ge", 1.0), ("le", 1000.0)}, field.name


def test_a_table_becomes_a_value_by_the_names_of_its_keys():
    table = SimulateTable.model_validate(
        {"kind": "simulate", "step_mm": 0.5, "corner_slices": 7, "interpolation": "lerp"}
    )
    assert value_of(SimulationSettings, table) == SimulationSettings(0.5, corner_slices=7, interpolation="lerp")
    assert value_of(SimulationSettings, table, step_mm=2.0).step_mm == 2.0
    assert FinishedPart.excess_range_mm == TargetTable.model_fields["excess_range_mm"].default == 1.0


def test_every_value_out_of_range_is_named_at_once():
    with pytest.raises(InputError) as caught:
        Limits(force_n=-1.0, torque_nm=float("nan"), stability_margin=4.0)
    assert str(caught.value).splitlines() == [
        "limits.force_n = -1: must be above 0",
        "limits.torque_nm = nan: must be a finite number",
        "limits.stability_margin = 4: must be at most 3",
    ]
