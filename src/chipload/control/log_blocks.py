"""Means of an aligned log over blocks of equal time, and what a simulation predicts of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from chipload.control.log_alignment import GAP_STEPS, AlignedLog, PredictedTorque
from chipload.control.spindle import first_order

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: blocks of a log at most, samples of one at least, and how often the time constant of the sensor it is long at least
MOST_BLOCKS, LEAST_SAMPLES, BLOCK_LAGS = 240, 3, 4.0
#: least time constant of a sensor that blocks are long against [s], and what of it is not known
SENSOR_LAG_S, LAG_ERROR = 0.1, 0.2


@dataclass(frozen=True, eq=False)
class LogBlocks:
    """Means over blocks of an aligned log, (k,) each.

    Parameters
    ----------
    name : of the log
    time : [s] of its middle, in the log
    signal, speed, cutting, edge : means over the block; the torques in N mm behind the sensor
    edge_time : mean of edge torque times the time for which the tool has cut [N mm s]
    misfit : what the torque of the block would change if the alignment were off by a sample, or by what is not known of
        the lag of the sensor [N mm]
    line, tool : of its middle
    """

    name: str
    time: Floats
    signal: Floats
    speed: Floats
    cutting: Floats
    edge: Floats
    edge_time: Floats
    misfit: Floats
    line: Ints
    tool: Ints


def blocks_of(
    aligned: AlignedLog,
    predicted: PredictedTorque,
    before: Mapping[int, float] = MappingProxyType({}),
) -> LogBlocks:
    """Return the means of a log over blocks of equal time, long against the sensor, and of what the sensor should show.

    Parameters
    ----------
    before : tool -> time for which it has cut before this log [s]; none: it was sharp
    """
    time, inside = aligned.time, aligned.row >= 0
    row = np.maximum(aligned.row, 0)
    start = np.concatenate([[0.0], predicted.time[:-1]])
    load = predicted.cutting + predicted.edge
    cut = np.zeros(len(load))
    for number in np.unique(predicted.tool):
        own = predicted.tool == number
        cut[own] = before.get(int(number), 0.0) + np.cumsum(np.where(load > 0.0, predicted.time - start, 0.0)[own])
    step = float(np.median(np.diff(time))) if len(time) > 1 else 1.0
    lag = max(aligned.sensor_lag, SENSOR_LAG_S)
    # a gap lasts a few steps, however far the clock jumps
    clock = np.concatenate([[0.0], np.cumsum(np.minimum(np.diff(time), GAP_STEPS * step))])
    length = max(clock[-1] / MOST_BLOCKS, LEAST_SAMPLES * step, BLOCK_LAGS * lag)
    place = (clock / length).astype(np.int64)
    n = int(place[-1]) + 1
    # before and after the program the speed of the spindle is not known
    speed = np.where(inside, predicted.speed[row], 0.0)
    kept = speed > 0.0
    cutting, edge, edge_time = (
        first_order(np.where(inside, values[row], 0.0), time, aligned.sensor_lag)
        for values in (predicted.cutting, predicted.edge, predicted.edge * cut)
    )
    torque = cutting + edge
    columns = {
        "signal": aligned.signal, "speed": speed, "cutting": cutting, "edge": edge, "time": time,
        "edge_time": edge_time,
    }  # fmt: skip
    count = np.bincount(place[kept], minlength=n)
    means = {
        key: np.bincount(place[kept], values[kept], minlength=n) / np.maximum(count, 1)
        for key, values in columns.items()
    }
    jumps = np.zeros(n)
    change = np.abs(np.diff(torque, prepend=torque[:1]))
    np.add.at(jumps, place[kept], change[kept])
    late = max(LAG_ERROR * lag, step) / length
    middle = np.array([int(np.median(np.flatnonzero(place == k))) if c else 0 for k, c in enumerate(count)])
    full = (count >= max(LEAST_SAMPLES, int(0.5 * length / step))) & (count > 0)
    whole = {key: values[full] for key, values in means.items()}
    at = row[middle[full]]
    return LogBlocks(
        aligned.name, whole["time"], whole["signal"], whole["speed"], whole["cutting"], whole["edge"],
        whole["edge_time"], (jumps * late)[full], predicted.line[at], predicted.tool[at],
    )  # fmt: skip
