"""Samples of a spindle from an MTConnect agent while the machine runs.

The agent is asked again and again for what is new. Where it does not answer it is asked on, at growing intervals; what
it measured meanwhile is read from its buffer. An agent that was started again, or whose buffer has lost the next
sample, is followed from its current values.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from chipload.errors import InputError
from chipload.machine.mtconnect import COUNT, Element, document, events_of, header_of
from chipload.machine.spindle_samples import Sample

#: seconds between two requests, and at most where the agent does not answer
POLL_S, LONGEST_S = 0.5, 10.0


@dataclass(frozen=True)
class AgentSource:
    """A spindle of an agent.

    Parameters
    ----------
    address : as ``http://127.0.0.1:5000``
    device, component : as :func:`chipload.machine.mtconnect.samples`
    """

    address: str
    device: str | None = None
    component: str | None = None


def follow_agent(
    source: AgentSource,
    *,
    notice: Callable[[str], None],
) -> Iterator[list[Sample]]:
    """Yield the samples of each answer of an agent in their order, those of the first answer its current values; none
    where nothing is new.

    Parameters
    ----------
    notice : is told that the agent does not answer, answers again, or has lost samples

    Raises
    ------
    InputError
        The first request has no answer, or there are several spindles and the source names none.
    """
    spindles: set[str] = set()
    root, silent_s, pause = document(source.address, "current"), 0.0, POLL_S
    instance, following = header_of(root)
    yield _in_order(source, root, spindles)
    while True:
        time.sleep(pause)
        try:
            root = document(source.address, "sample", f"?from={following}&count={COUNT}")
            own, after = header_of(root)
            if own != instance:
                raise InputError("the agent was started again")
        except InputError as err:
            try:
                root = document(source.address, "current")
            except InputError:
                if silent_s == 0.0:
                    notice(f"{err}; it is asked again until it answers")
                silent_s += pause
                pause = min(2.0 * pause, LONGEST_S)
                yield []
                continue
            # it answers, but not from the next sample on
            notice(f"samples are lost: {err}")
            own, after = header_of(root)
        if silent_s > 0.0:
            notice("the agent answers again")
        silent_s, pause, instance, following = 0.0, POLL_S, own, after
        yield _in_order(source, root, spindles)


def _in_order(source: AgentSource, root: Element, spindles: set[str]) -> list[Sample]:
    found = events_of(root, source.address, source.device, source.component, spindles)
    # of one number the line first: it is that of the load
    return sorted(found, key=lambda one: (one[0], one[1], one[2] != "line"))
