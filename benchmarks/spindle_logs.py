"""Current and power of measured spindles in runs that were not used to learn them, and material told from air.

    CHIPLOAD_DATA=... python benchmarks/spindle_logs.py

Prints the table of docs/design/control.md. First a mill in wax: for each condition (feed, wear of the tool) the mean
current and power in the cut of one run predict those of another run, with the 95 % band of what is predicted (the
scatter of the learned run over a second, and the error of a model that `chipload watch` takes); the error of a mean
over a second, and the share of seconds in the band; and the share of pairs of a second in the cut and one in the air
of which the first is estimated greater, by the idle map of the air of the run that was learned from (50 %: not told
apart). Then an industrial spindle, whose idle current is that of the air before its first passes. Last, three cutters
that were worn out in 315 cuts each (PHM 2010): the cut at which the test of `chipload watch` states that the force
has grown by 30 %, learned from cuts 11 to 30, and the wear there and at the end; how often it states that in force
without wear, whose noise is that of the same cutters (blocks of ten cuts of the force over its moving median, drawn
at random), and in how many of thirty beginnings of the learned cuts it does so before the end, and how many of cuts
31 to 60 are in the 95 % band of the learned ones. And 16 cutters with one sample of the current a run (NASA): the
share whose sum of rises over the first runs passes, before a wear of 0.3 to 0.6 mm, what 5 % of them pass with their
runs in random order.
"""

import csv
import math
import os
from pathlib import Path

import numpy as np

from chipload.control.load_watch import MODEL_ERROR, SequentialTest, WatchSettings
from chipload.control.logs import read_log
from chipload.control.spindle import estimate, idle_map

DATA = Path(os.environ.get("CHIPLOAD_DATA", Path(__file__).parents[2] / "shared" / "data")) / "measured"
PHM, LEARNED, NEXT = DATA / "nasa_phm_tables" / "phm2010", slice(10, 30), slice(30, 60)
NASA = DATA / "nasa_uc_milling" / "mill.csv"
#: cuts of a moving median and of a block that is drawn, streams that are drawn; first runs of a cutter of NASA
AROUND, BLOCK, STREAMS, SHARP = 31, 10, 300, 3
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


def forces_and_wear(case):
    """Force in the plane [N] and greatest wear of a tooth [um] of each cut."""
    with (PHM / "feature_vector.csv").open() as file:
        rows = [r for r in csv.DictReader(file) if r["case"] == case]
    force = [math.hypot(float(r["force_x__rms"]), float(r["force_y__rms"])) for r in rows]
    with (PHM / "process_info.csv").open() as file:
        wear = [max(float(r[f"VB_flute_{k}"]) for k in (1, 2, 3)) for r in csv.DictReader(file) if r["case"] == case]
    return np.array(force), np.array(wear)


def alarm_after(force, learned):
    """Cut at whose end the test states a growth of 30 %; None: it does not."""
    own = force[learned]
    mean = float(own.mean())
    # a: the end of the interval of the mean, b: 30 % above the mean, or above that end
    high = mean + 3.0 * float(own.std(ddof=1)) / math.sqrt(len(own))
    fault, variance = max(1.3 * mean, 1.1 * high), float(own.var(ddof=1)) + (MODEL_ERROR * mean) ** 2
    test = SequentialTest(WatchSettings().threshold)
    for k in range(learned.stop, len(force)):
        if test.add(((force[k] - high) ** 2 - (force[k] - fault) ** 2) / (2.0 * variance), k):
            return k
    return None


def in_band(force):
    """Share of the next cuts whose force is in the 95 % band of the learned ones."""
    own = force[LEARNED]
    half = Z95 * math.hypot(MODEL_ERROR * own.mean(), own.std(ddof=1) * math.sqrt(1.0 + 1.0 / len(own)))
    return float((np.abs(force[NEXT] - own.mean()) < half).mean())


def without_wear(force, generator):
    """A stream as long, without growth: blocks of the force over its moving median."""
    half = AROUND // 2
    padded = np.pad(force, half, mode="reflect")
    ratio = force / np.array([np.median(padded[k : k + AROUND]) for k in range(len(force))])
    first = generator.integers(0, len(ratio) - BLOCK, size=len(ratio) // BLOCK + 1)
    return np.concatenate([ratio[k : k + BLOCK] for k in first])[: len(ratio)]


def greatest_rise(current, worn, deviation):
    """Greatest sum of the rises of the current above that of the first runs and half a deviation, up to a worn run."""
    total = most = 0.0
    for x in current[SHARP:worn]:
        total = max(total + (x - np.mean(current[:SHARP])) / deviation - 0.5, 0.0)
        most = max(most, total)
    return most


def drift_of_samples(limit_mm):
    """Cutters of NASA that reach a wear, share of them whose current rises before it beyond chance, and correlation of
    current and wear within the cutters.
    """
    with NASA.open() as file:
        # samples below 1 V were not taken in the cut
        rows = [r for r in csv.DictReader(file) if float(r["smcDC"]) > 1.0]
    tools, both = [], []
    for case in range(1, 17):
        own = [r for r in rows if r["case"] == str(case)]
        current = np.array([float(r["smcDC"]) for r in own])
        wear = np.array([float(r["VB"] or "nan") for r in own])
        known = np.isfinite(wear)
        if known.sum() > 2:
            both.append(np.column_stack([current[known] - current[known].mean(), wear[known] - wear[known].mean()]))
        worn = np.flatnonzero(wear >= limit_mm)
        if len(worn) and worn[0] > SHARP:
            tools.append((current, int(worn[0])))
    deviation = float(np.concatenate([c - c.mean() for c, _ in tools]).std())
    g = np.random.default_rng(1)
    chance = [
        greatest_rise(g.permutation(current[:worn]), worn, deviation) for current, worn in tools for _ in range(STREAMS)
    ]
    threshold = float(np.quantile(chance, 0.95))
    found = np.mean([greatest_rise(current, worn, deviation) > threshold for current, worn in tools])
    return len(tools), float(found), float(np.corrcoef(np.concatenate(both).T)[0, 1])


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

    print(
        "\n| cutter of PHM 2010 | wear learned at um | alarm in cut | wear there um | wear at the end um "
        "| alarm without wear % | cuts 31 to 60: mean % | in the band % |"
    )
    print("|---" * 8 + "|")
    seen, g = 0, np.random.default_rng(1)
    for case in ("1", "4", "6"):
        force, wear = forces_and_wear(case)
        cut = alarm_after(force, LEARNED)
        there = "" if cut is None else f"{wear[cut]:.0f}"
        false = np.mean([alarm_after(without_wear(force, g), LEARNED) is not None for _ in range(STREAMS)])
        print(
            f"| {case} | {wear[LEARNED.stop - 1]:.0f} | {cut if cut is None else cut + 1} | {there} | {wear[-1]:.0f} | "
            f"{100 * false:.0f} | {100 * (force[LEARNED].mean() / force[NEXT].mean() - 1.0):+.1f} | "
            f"{100 * in_band(force):.0f} |"
        )
        seen += sum(alarm_after(force, slice(first, first + 20)) is not None for first in range(10, 110, 10))
    print(f"\n{seen} of 30 beginnings of the learned cuts end with an alarm")
    for limit in (0.3, 0.45, 0.6):
        tools, found, correlation = drift_of_samples(limit)
        print(
            f"NASA, one sample of the current a run: of {tools} cutters {100 * found:.0f} % rise before a wear of "
            f"{limit:g} mm beyond what 5 % do by chance; correlation of current and wear {correlation:.2f}"
        )


if __name__ == "__main__":
    main()
