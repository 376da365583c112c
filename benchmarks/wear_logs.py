"""Wear of cutters in measured force and spindle current: how it is seen, how often it is stated without wear.

    CHIPLOAD_DATA=... python benchmarks/wear_logs.py

Prints tables of docs/design/control.md. First three cutters that were worn out in 315 cuts each (PHM 2010): the cut at
which the test of `chipload watch` states that the force has grown by 30 %, learned from cuts 11 to 30, and the wear
there and at the end; how often it states that in force without wear, whose noise is that of the same cutters (blocks of
ten cuts of the force over its moving median, drawn at random), and in how many of thirty beginnings of the learned cuts
it does so before the end. The force is the standard deviation over a cut: its mean contains the zero of a
piezoelectric sensor, which drifts and is reset between series of cuts; the same test with the root of the mean square,
which contains it, is printed beside it. Then the force of the next cuts by the twenty before, over all beginnings: the
share in the 95 % band of their mean, and of the line through their logarithms, whose slope may change as that of the
two other cutters did.

Then 16 cutters with one sample of the spindle current a run (NASA): the share whose sum of rises over the first runs
passes, before a wear of 0.3 to 0.6 mm, what 5 % of them pass with their runs in random order; the same for the best
linear test by the change that wear makes to the signals of the other cutters; and the share that such a test could see
at most, if it knew the wear of each run. Last the energy that went through the spindle up to that wear, predicted by
the other cutters (material, depth, feed): the share of cutters whose bound, passed by 85 % of them, is before the wear
limit, and before half of it, which is a false alarm.
"""

import csv
import math
import os
from pathlib import Path

import numpy as np
from scipy.stats import norm
from scipy.stats import t as student

from chipload.control.load_watch import MODEL_ERROR
from chipload.control.sequential_test import SequentialTest, WatchSettings

DATA = Path(os.environ.get("CHIPLOAD_DATA", Path(__file__).parents[2] / "shared" / "data")) / "measured"
PHM, NASA = DATA / "nasa_phm_tables" / "phm2010", DATA / "nasa_uc_milling" / "mill.csv"
#: cuts that are learned, how many, and how many are predicted
LEARNED, BEFORE, AFTER = slice(10, 30), 20, (10, 30)
#: cuts of a moving median and of a block that is drawn, streams that are drawn; first runs of a cutter of NASA
AROUND, BLOCK, STREAMS, SHARP = 31, 10, 300, 3
#: standard deviations of a 95 % band and of a test at 5 %
Z95, Z05 = 1.96, 1.645
#: share of the cutters whose life is longer than the bound that raises an alarm: 1 - this
LIFE_BOUND = 0.85
CURRENT = ("smcDC",)
SIGNALS = ("smcDC", "smcAC", "vib_table", "vib_spindle", "AE_table", "AE_spindle")


def forces_and_wear(case, statistic):
    """Force in the plane [N] by a statistic over a cut, and greatest wear of a tooth [um], of each cut."""
    with (PHM / "feature_vector.csv").open() as file:
        rows = [r for r in csv.DictReader(file) if r["case"] == case]
    force = [math.hypot(*(float(r[f"force_{axis}__{statistic}"]) for axis in "xy")) for r in rows]
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


def without_wear(force, generator):
    """A stream as long, without growth: blocks of the force over its moving median."""
    half = AROUND // 2
    padded = np.pad(force, half, mode="reflect")
    ratio = force / np.array([np.median(padded[k : k + AROUND]) for k in range(len(force))])
    first = generator.integers(0, len(ratio) - BLOCK, size=len(ratio) // BLOCK + 1)
    return np.concatenate([ratio[k : k + BLOCK] for k in first])[: len(ratio)]


def false_alarms(force):
    """Share of streams without wear in which an alarm is raised."""
    g = np.random.default_rng(1)
    return float(np.mean([alarm_after(without_wear(force, g), LEARNED) is not None for _ in range(STREAMS)]))


def forecasts(force, count):
    """The logarithm of the force of the next cuts less its mean before, (m, count), less its line before, and the
    variances of both.
    """
    log, x = np.log(force), np.arange(BEFORE) - 0.5 * (BEFORE - 1)
    ahead = np.arange(BEFORE, BEFORE + count) - 0.5 * (BEFORE - 1)
    by_mean, by_line, variances = [], [], []
    for k in range(LEARNED.start, len(log) - BEFORE - count):
        own, following = log[k : k + BEFORE], log[k + BEFORE : k + BEFORE + count]
        slope = float(x @ own / (x @ x))
        rest = own - own.mean() - slope * x
        by_mean.append(following - own.mean())
        by_line.append(following - own.mean() - slope * ahead)
        variances.append((own.var(ddof=1) * (1.0 + 1.0 / BEFORE) + 0.0 * ahead,
                          rest @ rest / (BEFORE - 2) * (1.0 + 1.0 / BEFORE + ahead**2 / (x @ x))))  # fmt: skip
    return np.array(by_mean), np.array(by_line), *np.array(variances).swapaxes(0, 1)


def bands(forces, count):
    """For each cutter the share of its next cuts in the band of the mean, and in that of the line whose slope changes
    as those of the others.
    """
    all_of = [forecasts(force, count) for force in forces]
    ahead = np.arange(1, count + 1)
    # change of the slope from the cuts before to the cuts after, a cut: root of the mean square
    change = [float(np.mean((line.mean(axis=1) / ahead.mean()) ** 2)) for _, line, *_ in all_of]
    for k, (mean, line, v_mean, v_line) in enumerate(all_of):
        other = np.mean([c for j, c in enumerate(change) if j != k])
        v_line = v_line + other * ahead**2
        yield tuple(
            float((np.abs(x) < Z95 * np.sqrt(v + MODEL_ERROR**2)).mean()) for x, v in ((mean, v_mean), (line, v_line))
        )


def cutters_of_nasa():
    """Rows of each cutter of NASA; samples below 1 V were not taken in the cut."""
    with NASA.open() as file:
        rows = [r for r in csv.DictReader(file) if float(r["smcDC"]) > 1.0]
    return [[r for r in rows if r["case"] == str(case)] for case in range(1, 17)]


def column(rows, name):
    """A column as numbers; NaN where there is none."""
    return np.array([float(r[name] or "nan") for r in rows])


def greatest_rise(current, worn, deviation):
    """Greatest sum of the rises of the current above that of the first runs and half a deviation, up to a worn run."""
    total = most = 0.0
    for x in current[SHARP:worn]:
        total = max(total + (x - np.mean(current[:SHARP])) / deviation - 0.5, 0.0)
        most = max(most, total)
    return most


def drift_of_samples(limit_mm):
    """Cutters that reach a wear, and the share of them whose current rises before it beyond chance."""
    tools = []
    for own in cutters_of_nasa():
        worn = np.flatnonzero(column(own, "VB") >= limit_mm)
        if len(worn) and worn[0] > SHARP:
            tools.append((column(own, "smcDC"), int(worn[0])))
    deviation = float(np.concatenate([c - c.mean() for c, _ in tools]).std())
    g = np.random.default_rng(1)
    chance = [
        greatest_rise(g.permutation(current[:worn]), worn, deviation) for current, worn in tools for _ in range(STREAMS)
    ]
    threshold = float(np.quantile(chance, 0.95))
    found = np.mean([greatest_rise(current, worn, deviation) > threshold for current, worn in tools])
    return len(tools), float(found)


def change_by_wear(signals, wears):
    """Change of the signals by wear [1/mm], and their covariance about it, within the cutters."""
    x = np.concatenate([s - s.mean(axis=0) for s in signals])
    v = np.concatenate([w - w.mean() for w in wears])
    slope = v @ x / (v @ v)
    rest = x - np.outer(v, slope)
    return slope, rest.T @ rest / (len(rest) - len(signals) - 1)


def best_test(names, limit_mm):
    """Share of cutters that the best linear test sees at 5 %, learned from the others; the greatest share that is
    possible if the wear of each run were known.
    """
    signals, wears, times = [], [], []
    for own in cutters_of_nasa():
        wear, time = column(own, "VB"), column(own, "time")
        known = np.isfinite(wear)
        if known.sum() < 3:
            continue
        wear = np.interp(time, time[known], wear[known])
        worn = np.flatnonzero(wear >= limit_mm)
        if len(worn) and worn[0] > SHARP:
            until = slice(0, int(worn[0]))
            signals.append(np.column_stack([column(own, name) for name in names])[until])
            wears.append(wear[until])
            times.append(time[until])
    slope, scatter = change_by_wear(signals, wears)
    size = float(slope @ np.linalg.solve(scatter, slope))
    most = np.mean([norm.cdf(math.sqrt(size * ((w - w.mean()) ** 2).sum()) - Z05) for w in wears])
    g, seen = np.random.default_rng(1), []
    for k, (signal, time) in enumerate(zip(signals, times, strict=True)):
        others = [j for j in range(len(signals)) if j != k]
        slope, scatter = change_by_wear([signals[j] for j in others], [wears[j] for j in others])
        sums = signal @ np.linalg.solve(scatter, slope)
        ramp = time - time.mean()
        chance = [g.permutation(sums) @ ramp for _ in range(STREAMS)]
        seen.append(sums @ ramp > np.quantile(chance, 0.95))
    return float(np.mean(seen)), float(most)


def energy_at(energy, wear, limit_mm):
    """Energy at which a wear is reached, between two runs; 0: in the first run."""
    k = int(np.flatnonzero(wear >= limit_mm)[0])
    return 0.0 if k == 0 else float(np.interp(limit_mm, wear[k - 1 : k + 1], energy[k - 1 : k + 1]))


def life_by_energy(limit_mm):
    """Cutters, share whose bound is before the wear limit, and before half of it, and the error of a life (factor)."""
    lives, halves, conditions = [], [], []
    for own in cutters_of_nasa():
        if not own:
            continue
        wear, energy = column(own, "VB"), np.cumsum(column(own, "smcDC") * np.diff(column(own, "time"), prepend=0.0))
        known = np.isfinite(wear)
        if known.sum() < 3 or np.nanmax(wear) < limit_mm:
            continue
        life, half = (energy_at(energy[known], wear[known], w) for w in (limit_mm, 0.5 * limit_mm))
        if half > 0.0:
            lives.append(math.log(life))
            halves.append(math.log(half))
            first = own[0]
            conditions.append(
                [1.0, float(first["material"] == "2"), math.log(float(first["DOC"])), math.log(float(first["feed"]))]
            )
    life, half, x = np.array(lives), np.array(halves), np.array(conditions)
    bound, error = np.zeros(len(life)), np.zeros(len(life))
    for k in range(len(life)):
        other = np.arange(len(life)) != k
        fitted, *_ = np.linalg.lstsq(x[other], life[other], rcond=None)
        rest, free = life[other] - x[other] @ fitted, int(other.sum()) - x.shape[1]
        spread = math.sqrt(rest @ rest / free * (1.0 + x[k] @ np.linalg.pinv(x[other].T @ x[other]) @ x[k]))
        bound[k] = x[k] @ fitted - student.ppf(LIFE_BOUND, free) * spread
        error[k] = life[k] - x[k] @ fitted
    return len(life), float((bound < life).mean()), float((bound < half).mean()), math.exp(np.sqrt(np.mean(error**2)))


def print_worn_out():
    """Print the cutters of PHM."""
    print(
        "| cutter of PHM 2010 | wear learned at um | alarm in cut | wear there um | wear at the end um "
        "| alarm without wear % | the same with the zero of the sensor % |"
    )
    print("|---" * 7 + "|")
    forces, begun = [], 0
    for case in ("1", "4", "6"):
        force, wear = forces_and_wear(case, "std")
        forces.append(force)
        cut = alarm_after(force, LEARNED)
        there, number = ("", "") if cut is None else (f"{wear[cut]:.0f}", cut + 1)
        print(
            f"| {case} | {wear[LEARNED.stop - 1]:.0f} | {number} | {there} | {wear[-1]:.0f} | "
            f"{100 * false_alarms(force):.0f} | {100 * false_alarms(forces_and_wear(case, 'rms')[0]):.0f} |"
        )
        begun += sum(alarm_after(force, slice(first, first + BEFORE)) is not None for first in range(10, 110, 10))
    print(f"\n{begun} of 30 beginnings of the learned cuts end with an alarm")
    for count in AFTER:
        shares = [" and ".join(f"{100 * x:.0f}" for x in pair) for pair in bands(forces, count)]
        print(f"next {count} cuts in the 95 % band of the mean and of the line before, of each cutter: "
              f"{', '.join(shares)} %")  # fmt: skip


def main():
    print_worn_out()
    print(
        "\n| wear limit mm | cutters of NASA | rise of the current % | best test of the current %, at most "
        "| best of six signals %, at most | by energy: before the limit % | before half of it % | error of a life |"
    )
    print("|---" * 8 + "|")
    for limit in (0.3, 0.45, 0.6):
        tools, found = drift_of_samples(limit)
        tests = " | ".join(
            f"{100 * a:.0f}, {100 * b:.0f}" for a, b in (best_test(n, limit) for n in (CURRENT, SIGNALS))
        )
        count, before, early, error = life_by_energy(limit)
        print(f"| {limit:g} | {tools}; {count} by energy | {100 * found:.0f} | {tests} | {100 * before:.0f} | "
              f"{100 * early:.0f} | {error:.2f} times |")  # fmt: skip


if __name__ == "__main__":
    main()
