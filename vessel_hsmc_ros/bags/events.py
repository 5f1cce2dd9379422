"""What the nodes reported during a recording: events (services called, parameters changed, goals accepted) and diagnostics."""

from collections.abc import Iterable
from typing import Any, NamedTuple

import yaml

from vessel_hsmc_ros.core.exceptions import BagError
from vessel_hsmc_ros.core.timing import seconds
from vessel_hsmc_ros.messages.conversions import nanoseconds, read_status
from vessel_hsmc_ros.scenario.bounded_text import read_yaml


class Event(NamedTuple):
    """Something that happened to a node.

    Attributes:
        time: Since the first odometry message, as in `Run.time`, s. In lockstep, of the step after which it took effect.
        node: Name of the node, without its namespace.
        kind: `pause`, `resume`, `reset`, `enable`, `disable`, `parameter`, `goal`, `path` or `fault`.
        text: Details; of a parameter its full name, old and new value: `controller.guided.position_gain: 0.3 -> 0.5`.
    """

    time: float
    node: str
    kind: str
    text: str


def read_events(messages: Iterable[Any], start: int) -> list[Event]:
    """The events in messages of the topic `events`, in the order of their times.

    Args:
        messages: Of one vessel.
        start: The time of its first odometry, ns.
    """
    events = [Event(seconds(nanoseconds(m.header.stamp) - start), m.node, m.kind, m.text) for m in messages]
    return sorted(events, key=lambda event: event.time)


def changed_parameters(events: Iterable[Event]) -> dict[str, object]:
    """The new values of the parameters that events changed, by `node.parameter`."""
    changes: dict[str, object] = {}
    for event in events:
        if event.kind == "parameter":
            name, _, values = event.text.partition(": ")
            try:
                changes[name] = read_yaml(values.partition(" -> ")[2])
            except yaml.YAMLError as error:
                raise BagError(f"event {event.text} cannot be read: {error}") from None
    return changes


def last_diagnostics(messages: Iterable[Any], prefix: str) -> dict[str, dict[str, str]]:
    """The last diagnostics of each node of one vessel: values by name, `message` among them.

    Args:
        messages: Of the topic `/diagnostics`.
        prefix: The vessel's namespace, with its slashes.
    """
    status: dict[str, dict[str, str]] = {}
    for message in messages:
        status.update(read_status(message, prefix[1:]))
    return status
