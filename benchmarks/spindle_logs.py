"""Current, power and force of measured cuts that were not used to learn them, and material told from air.

    CHIPLOAD_DATA=... python benchmarks/spindle_logs.py

Prints tables of docs/design/control.md. First a mill in wax (UMich): for each condition (feed, wear of the tool) the
mean current and power in the cut of one run predict those of another run, with the 95 % band of what is predicted (the
scatter of the learned run over a second, and the error of a model that `chipload watch` takes); the error of a mean
over a second, and the share of seconds in the band; and the share of pairs of a second in the cut and one in the air
of which the first is estimated greater, by the idle map of the air of the run that was learned from (50 %: not told
apart). Then an industrial spindle, whose idle current is that of the air before its first passes; the current of each
cutter of NASA, predicted by the mean of the others in its condition (depth, feed, material) with the band of their
scatter; and three slots (Li), whose forces at one feed are predicted from the coefficients fitted at the other two.
`benchmarks/wear_logs.py` has what the same data say of wear.
"""

import csv
import math
import os
import sys
import tempfile
from pathlib import Path

import numpy as np
from scipy.stats import t as student

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "real"))

import test_flat_slotting as slotting

from chipload.control.load_watch import MODEL_ERROR
from chipload.control.logs import read_log
from chipload.control.spindle import estimate, idle_map
from chipload.jobs import load_job
from chipload.jobs.fit.run import run

DATA = Path(os.environ.get("CHIPLOAD_DATA", Path(__file__).parents[2] / "shared" / "data")) / "measured"
NASA = DATA / "nasa_uc_milling" / "mill.csv"
MILL, TRACE = DATA / "umich_smart_cnc", DATA / "nasa_uc_milling" / "tool54_example.csv"
COLUMNS = {
    "sample_s": 0.1,
    "speed": {"column": "S1_ActualVelocity", "unit": "rev/s"},
    "feed": {"column": "M1_CURRENT_FEEDRATE", "unit": "mm/s"},
    "label": {"column": "Machining_Process"},
}
#: column, unit and name of what is predicted
SOURCES = (
    ("current", {"current": {"column": "S1_CurrentFeedback", "unit": "A"}}),
    ("power", {"current": {"column": "S1_OutputPower", "unit": "A"}}),
)
#: feed mm/s, tool, run that is learned from, run that is held out
CONDITIONS = (
    ("3", "unworn", "11", "12"), ("3", "worn", "13", "14"), ("6", "unworn", "01", "03"), ("6", "worn", "01", "06"),
    ("20", "unworn", "02", "05"), ("20", "worn", "07", "16"),
)  # fmt: skip
#: feed of rapid moves in these logs [mm/s], samples of a second, samples of a revolution of the other spindle
RAPID, SECOND, TURN = 50.0, 10, 25
#: standard deviations of a 95 % band
Z95 = 1.96
#: error of a mean that is asked for
GOAL = 0.08


def rows_of(number, source):
    """The log of a run, its rows at speed, and those of them that cut."""
    log, _ = read_log(MILL / f"experiment_{number}.csv", COLUMNS | source)
    on = log.speed > 0.97 * np.quantile(log.speed, 0.99)
    on &= np.convolve(on, np.ones(11), "same") > 10.5
    return log, on, on & np.char.startswith(log.label, "Layer") & (log.feed < RAPID)


def means(values, count):
    """Means over ``count`` samples, those that are whole."""
    whole = len(values) // count * count
    return values[:whole].reshape(-1, count).mean(axis=1)


def correlated(values):
    """How many values in a row tell as much as one: (1 + r) / (1 - r) of a first-order process."""
    rest = values - values.mean()
    r = float(np.clip((rest[1:] * rest[:-1]).sum() / max((rest**2).sum(), 1e-300), 0.0, 0.95))
    return (1.0 + r) / (1.0 - r)


def apart(air, cut):
    """Share of pairs in which the second is greater."""
    return float((cut[:, None] > air).mean() + 0.5 * (cut[:, None] == air).mean())


def predicted(source, learned, held_out):
    """Error of the mean in the cut, its 95 % band, rms error over a second, all of the mean, share of seconds in the
    band, and pairs in order.
    """
    log, on, cutting = rows_of(learned, source)
    other, there, cuts = rows_of(held_out, source)
    guess, seen = float(log.current[cutting].mean()), other.current[cuts]
    seconds, own = means(seen, SECOND), means(log.current[cutting], SECOND)
    rms = within = band = np.nan
    if len(seconds) > 1 and len(own) > 1:
        rms = float(np.sqrt(np.mean((seconds - guess) ** 2)))
        model, scatter = MODEL_ERROR * guess, float(own.std(ddof=1))
        within = float((np.abs(seconds - guess) < Z95 * math.hypot(model, scatter)).mean())
        # seconds follow one another: a few of them tell as much as one
        apart_s = max(1.0, correlated(own))
        band = Z95 * math.hypot(model, scatter * math.sqrt(apart_s * (1.0 / len(own) + 1.0 / len(seconds))))
    size = abs(float(seen.mean()))
    error = guess / seen.mean() - 1.0, band / size, rms / size, within
    air, free = on & ~cutting, there & ~cuts
    if min(air.sum(), free.sum(), cuts.sum()) < 10 * SECOND:
        return *error, np.nan
    spindle = idle_map(log.speed[air], log.current[air], 1.0, 0.0)
    found = [
        estimate(spindle, other.time[rows], other.speed[rows], other.current[rows], average=SECOND + 1).torque[::SECOND]
        for rows in (free, cuts)
    ]
    return *error, apart(*found)


def industrial():
    """Pairs in order over five revolutions, and shares of cut and air that are trusted."""
    log, _ = read_log(TRACE, {"sample_s": 1.0, "current": {"column": "current_sub", "unit": "count"},
                              "label": {"column": "cut_signal"}})  # fmt: skip
    speed, learned = np.full(len(log.time), 1.0), np.zeros(len(log.time), dtype=bool)
    learned[3650:3850] = learned[5900:6050] = True
    spindle = idle_map(speed[learned], log.current[learned], 1.0, 0.0)
    rest = slice(6100, 19_504)
    found = estimate(spindle, log.time[rest], speed[rest], log.current[rest], average=5 * TURN)
    cut = log.label[rest] == "1"
    return apart(found.torque[~cut][::TURN], found.torque[cut][::TURN]), found.trusted[cut], found.trusted[~cut]


def currents_of_cutters():
    """Error of the mean current of each cutter of NASA, by the others in its condition, and whether each of its runs is
    in their band.
    """
    with NASA.open() as file:
        # samples below 1 V were not taken in the cut
        rows = [r for r in csv.DictReader(file) if float(r["smcDC"]) > 1.0]
    errors, inside = [], []
    for case in sorted({r["case"] for r in rows}, key=int):
        own = [r for r in rows if r["case"] == case]
        condition = [own[0][key] for key in ("DOC", "feed", "material")]
        others = np.array(
            [
                float(r["smcDC"])
                for r in rows
                if r["case"] != case and [r[key] for key in ("DOC", "feed", "material")] == condition
            ]
        )
        if len(others) < 3:
            continue
        seen, n = np.array([float(r["smcDC"]) for r in own]), len(others)
        half = student.ppf(0.975, n - 1) * others.std(ddof=1) * math.sqrt(1.0 + 1.0 / n)
        errors.append(others.mean() / seen.mean() - 1.0)
        inside.append(np.abs(seen - others.mean()) < half)
    return np.array(errors), np.concatenate(inside)


def slots():
    """Feed [mm/min], error of the mean force along the feed, across it and along the axis, half of its band at 95 %
    over the force, and the share of turns whose mean is in the band of a turn.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = slotting.job(Path(folder)).path
        text = path.read_text().replace('use = "predict"', 'use = "fit"')
        for feed in (300, 900, 1500):
            head, tail = text.split(f"f{feed}ap3ae25.csv", 1)
            held_out = tail.replace('use = "fit"', 'use = "predict"', 1)
            path.write_text(f"{head}f{feed}ap3ae25.csv{held_out}")
            done = run(load_job(path).job)
            (third,) = [c for c in done.comparisons if c.use == "predict"]
            mean, half = third.predicted.mean, third.predicted.half[0]
            turn = np.hypot(half, Z95 * np.nanstd(third.turns.mean, axis=0, ddof=1))
            share = (np.abs(third.turns.mean - mean) < turn).mean(axis=0)
            yield feed, mean / third.forces.mean - 1.0, half / np.abs(third.forces.mean), share


def main():
    names = [name for name, _ in SOURCES]
    head = [
        f"{x}: mean % | band % | over a second rms % | seconds in the band % | material from air, pairs %"
        for x in names
    ]
    print(f"| feed mm/s | tool | learned from, held out | {' | '.join(head)} |")
    print("|---" * (3 + 5 * len(names)) + "|")
    inside = []
    for feed, tool, learned, held_out in CONDITIONS:
        cells = []
        for _, source in SOURCES:
            mean, band, rms, within, told = predicted(source, learned, held_out)
            cells.append(f"{100 * mean:+.1f}")
            cells += [
                "" if np.isnan(x) else f"{100 * x:.{n}f}" for x, n in ((band, 1), (rms, 1), (within, 0), (told, 0))
            ]
            inside.append((abs(mean) <= band, np.isnan(band), abs(mean) <= GOAL))
        print(f"| {feed} | {tool} | {learned}, {held_out} | {' | '.join(cells)} |")
    held, unknown, near = np.array(inside).T
    print(
        f"\n{held.sum()} of {(~unknown).sum()} means in their band; {near.sum()} of {len(near)} within {100 * GOAL:g} %"
    )
    told, cut, air = industrial()
    print(
        f"\nindustrial spindle: {100 * told:.0f} % of pairs in order; trusted {100 * cut.mean():.0f} % of the rows in "
        f"the cut, {100 * air.mean():.1f} % of those in the air"
    )

    errors, inside = currents_of_cutters()
    print(
        f"\nNASA, one sample of the current a run: the means of {len(errors)} cutters by others in their condition "
        f"within {100 * np.abs(errors).max():.1f} %; {100 * inside.mean():.0f} % of {len(inside)} samples in the 95 % "
        "band"
    )
    print("\n| feed of the slot mm/min | mean force along, across, axis % | band % | turns in the band % |")
    print("|---" * 4 + "|")
    held, near = [], []
    for feed, error, half, share in slots():
        texts = [
            ", ".join(f"{100 * x:{form}}" for x in v) for v, form in ((error, "+.1f"), (half, ".1f"), (share, ".0f"))
        ]
        print(f"| {feed} | {' | '.join(texts)} |")
        held += list(np.abs(error) <= half)
        near += list(np.abs(error) <= GOAL)
    print(f"\n{sum(held)} of {len(held)} means in their band; {sum(near)} within {100 * GOAL:g} %")


if __name__ == "__main__":
    main()
