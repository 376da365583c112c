"""Coefficients learned from logs as values; the logs are made by a simulation with other coefficients."""

from __future__ import annotations

import ast
import inspect
import math
import re
from pathlib import Path

import numpy as np
import pytest

import chipload
from chipload.errors import InputError

MILL = chipload.Cutter(
    number=1, diameter_mm=10, flutes=4, helix_deg=30, flute_length_mm=22, overhang_mm=35, modulus_gpa=580, runout_mm=0.0
)
BLOCK = chipload.Stock.block((0.0, 0.0, -20.0), (120.0, 60.0, 0.0))


def program_text() -> str:
    lines = ["G21 G90 G54", "T1 M6", "S8000 M3", "G0 X-20 Y-20 Z20"]
    y = 0.0
    for width, depth, feed in ((2, 6, 900), (6, 4, 700), (0.5, 8, 2000), (9, 2, 500)):
        y += width
        lines += [f"G0 X-10 Y{y - 5}", f"Z-{depth}", f"G1 X130 F{feed}", "G0 Z20"]
    return "\n".join([*lines, "M5", "M30", ""])


@pytest.fixture(scope="module")
def histories(tmp_path_factory):
    file = tmp_path_factory.mktemp("program") / "part.ngc"
    file.write_text(program_text())
    prior = chipload.read_material("al7075-t6")
    true = chipload.Material("true", 950.0, 168.8, 222.0, 22.0, 26.6, 0.7, source="drawn for this test", spread=0.1)
    limits = chipload.Limits(force_n=5000.0)
    runs = [chipload.simulate(file, BLOCK, MILL, m, "vmc", limits, step_mm=2.0) for m in (prior, true)]
    return prior, *runs


def test_learn(histories):
    """Torque that the simulation with Ktc 950, Kte 22 gives: both are found within two standard deviations."""
    prior, result, true = histories
    columns = true.in_use[0].columns
    time = np.arange(0.0, columns["t_s"][-1], 0.05)
    torque = columns["torque_mean_nm"][np.searchsorted(columns["t_s"], time)]
    noise = 0.01 * torque.max() * np.random.default_rng(2).standard_normal(len(time))
    log = chipload.spindle_log(time + 7.0, torque_nm=torque + 0.1 + noise)
    found = chipload.learn({"log": log}, result, prior)
    sd = np.sqrt(np.diagonal(found.material.variances))
    for value, k, name in ((950.0, 0, "Ktc"), (22.0, 3, "Kte")):
        assert abs(getattr(found.material, name) - value) < 2.0 * sd[k]
        assert sd[k] < 0.06 * value


def test_the_page_runs(histories, capsys):
    """docs/how-to/learn.md: its call of simulate can be made so, and the rest runs on the history of another one."""
    page = (Path(__file__).parents[3] / "docs" / "how-to" / "learn.md").read_text(encoding="utf-8")
    first, *rest = ast.parse("".join(re.findall(r"```python\n(.*?)```", page, re.DOTALL))).body
    assert ast.unparse(first.value.func) == "chipload.simulate"
    inspect.signature(chipload.simulate).bind(*first.value.args, **{k.arg: k.value for k in first.value.keywords})
    _, result, true = histories
    columns = true.in_use[0].columns
    time = np.arange(0.0, columns["t_s"][-1], 0.05)
    power = columns["torque_mean_nm"] * 8000.0 * math.tau / 60.0 / 0.85  # S8000
    names = {"chipload": chipload, "history": result, "time_s": time}
    names["power_w"] = power[np.searchsorted(columns["t_s"], time)]
    exec(compile(ast.Module(rest, []), "learn.md", "exec"), names)
    found = names["found"].material
    assert abs(found.Ktc - 950.0) < 2.0 * math.sqrt(found.variances[0, 0])
    assert capsys.readouterr().out.startswith(f"{found.Ktc}")


def test_refusals(histories):
    prior, result, _ = histories
    with pytest.raises(InputError, match="state one of them"):
        chipload.spindle_log([0.0, 1.0])
    with pytest.raises(InputError, match="power_w: must be 2 finite numbers, like time_s"):
        chipload.spindle_log([0.0, 1.0], power_w=[1.0, np.nan])
    with pytest.raises(InputError, match="finite numbers that rise"):
        chipload.spindle_log([0.0, 0.0], power_w=[1.0, 2.0])
    with pytest.raises(InputError, match="logs: none is given"):
        chipload.learn({}, result, prior)
