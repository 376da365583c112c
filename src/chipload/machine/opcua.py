"""A log of the spindle from an OPC UA server: nodes that the user names are subscribed to and written as columns."""

from __future__ import annotations

import asyncio
import math
import os
import time
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any
from urllib.parse import urlsplit

from chipload.errors import Finding, InputError
from chipload.machine.spindle_samples import Sample, log_text
from chipload.progress import Progress, silent

#: columns that a node may fill, in the order of the log
COLUMNS = (
    "speed_rpm", "speed_rad_s", "speed_rev_s", "current_a", "power_w", "torque_nm", "feed_mm_min", "feed_mm_s", "line",
    "override", "override_percent",
)  # fmt: skip
#: [s] longest wait for an answer of the server
WAIT_S = 10.0
#: values that the server keeps for a node between two answers
QUEUE = 1000
#: [s] between two looks at the clock
TICK_S = 0.1
#: environment variable with the password of ``user``
PASSWORD = "CHIPLOAD_OPCUA_PASSWORD"


@dataclass(frozen=True)
class OpcUaSource:
    """A server and the nodes of a spindle.

    Parameters
    ----------
    address : ``opc.tcp://HOST:PORT``
    nodes : column -> node id, as ``ns=2;s=Spindle.Power``
    interval_s : [s] at which the server samples the nodes, above 0
    user : name of a user; its password is in the environment variable ``CHIPLOAD_OPCUA_PASSWORD``
    security : ``POLICY,MODE,CERTIFICATE,KEY``, as ``Basic256Sha256,SignAndEncrypt,me.der,me.pem``; None: none

    Raises
    ------
    InputError
        The address, a column or the interval is wrong, or no node is a load.
    """

    address: str
    nodes: Mapping[str, str]
    interval_s: float = 0.05
    user: str | None = None
    security: str | None = None

    def __post_init__(self) -> None:
        parts = urlsplit(self.address)
        if parts.scheme != "opc.tcp" or not parts.hostname:
            raise InputError(f"{self.address}: must have the form opc.tcp://HOST:PORT")
        for column in self.nodes:
            if column not in COLUMNS:
                raise InputError(f"--node {column}: not a column: must be one of {', '.join(COLUMNS)}")
        if not {"current_a", "power_w", "torque_nm"} & set(self.nodes):
            raise InputError("--node: none is a load: state the node of current_a, power_w or torque_nm")
        if not 0.0 < self.interval_s < 1e4:
            raise InputError(f"--interval-s = {self.interval_s:g}: must be above 0")
        if self.user is not None and PASSWORD not in os.environ:
            raise InputError(f"--user {self.user}: set the environment variable {PASSWORD} to the password")


def record_spindle(source: OpcUaSource, duration_s: float, progress: Progress = silent) -> tuple[str, list[Finding]]:
    """Return the log (CSV) that a server reports, as :func:`chipload.control.logs.read_log` reads it.

    Times are those of the source of each value, where the server states them. Ctrl-C ends the recording early; what was
    reported until then is returned.

    Parameters
    ----------
    source : server and nodes
    duration_s : [s] of the recording, above 0

    Raises
    ------
    InputError
        The server does not answer or refuses, a node is not there or is no number, or no load is reported.
    """
    if not 0.0 < duration_s < math.inf:
        raise InputError(f"--duration-s = {duration_s:g}: must be above 0")
    samples: list[Sample] = []

    def record() -> None:
        asyncio.run(_record(source, duration_s, samples, progress))

    try:
        if _loop_runs():
            # a notebook: an event loop starts no other one in its own thread
            with ThreadPoolExecutor(1) as pool:
                pool.submit(record).result()
        else:
            record()
    except KeyboardInterrupt:
        if not samples:
            raise
    log, omitted = log_text(samples, COLUMNS, f"OPC UA {source.address}")
    text = f"{omitted} samples are left out: a column is not yet known or its status is bad, or time does not rise"
    return log, [Finding("opcua-unavailable", 0, text)] if omitted else []


def _loop_runs() -> bool:
    try:
        asyncio.get_running_loop()
    except RuntimeError:
        return False
    return True


async def _record(source: OpcUaSource, duration_s: float, samples: list[Sample], progress: Progress) -> None:
    from asyncua.client.client import Client
    from asyncua.ua.uaerrors import UaError

    class Receiver:
        """Appends each value that the server reports."""

        def datachange_notification(self, node: Any, val: Any, data: Any) -> None:
            found = data.monitored_item.Value
            at = found.SourceTimestamp or found.ServerTimestamp
            good = (found.StatusCode is None or found.StatusCode.is_good()) and _is_number(val)
            seconds = at.timestamp() if at is not None else time.time()
            samples.append((seconds, len(samples), columns[node], float(val) if good else None))

    client = Client(source.address, timeout=WAIT_S)
    try:
        if source.user is not None:
            client.set_user(source.user)
            client.set_password(os.environ[PASSWORD])
        if source.security is not None:
            await client.set_security_string(source.security)
        async with client:
            columns = {}
            for column, node_id in source.nodes.items():
                node = client.get_node(node_id)
                value = await node.read_value()
                if not _is_number(value):
                    raise InputError(f"--node {column}={node_id}: its value is {value!r}: must be a number")
                columns[node] = column
            wanted: Any = 1e3 * source.interval_s
            subscription = await client.create_subscription(wanted, Receiver())
            await subscription.subscribe_data_change(list(columns), queuesize=QUEUE, sampling_interval=wanted)
            begin = time.monotonic()
            while (passed := time.monotonic() - begin) < duration_s:
                progress(passed / duration_s, "record")
                await asyncio.sleep(min(TICK_S, duration_s - passed))
            await subscription.delete()
    except InputError:
        raise
    except (UaError, OSError, TimeoutError, ValueError, AttributeError) as err:
        why = str(err) or type(err).__name__
        raise InputError(f"OPC UA {source.address}: {why}: check the address, the nodes and the user") from None


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
