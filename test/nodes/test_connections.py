"""The start-up handshake of a node, on a simulated ROS graph."""

from types import SimpleNamespace
from typing import Any

import pytest

from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.connections import Awaited, Connections


def endpoint(name: str, profile: Any = qos.LOSSLESS) -> SimpleNamespace:
    return SimpleNamespace(node_namespace="/", node_name=name, qos_profile=profile)


class Graph:
    """A node that sees given readers of /odom and given publishers of /cmd_wrench."""

    def __init__(self, readers: list[Any], writers: list[Any]) -> None:
        self._readers, self._writers = readers, writers

    def get_subscriptions_info_by_topic(self, _topic: str) -> list[Any]:
        return self._readers

    def get_publishers_info_by_topic(self, _topic: str) -> list[Any]:
        return self._writers


def missing(readers: list[Any], connected: int, partner: str = "/cmd_wrench", recorded: bool = False) -> str:
    connections: Any = Connections(Graph(readers, [endpoint("controller")]), recorded)  # type: ignore[arg-type]
    publisher = SimpleNamespace(topic_name="/odom", qos_profile=qos.LOSSLESS, get_subscription_count=lambda: connected)
    return connections.missing_reader(publisher, *([partner] if partner else []))


def test_publishing_starts_only_when_every_discovered_reader_is_connected() -> None:
    readers = [endpoint("controller"), endpoint("recorder")]
    assert missing(readers, connected=1) == "a connection with all 2 readers of /odom"
    assert missing(readers, connected=2) == ""


def test_a_reader_that_does_not_publish_the_partner_topic_is_not_enough() -> None:
    assert missing([endpoint("onlooker")], connected=1) == "a node that reads /odom and publishes /cmd_wrench"


def test_a_reader_of_incompatible_quality_of_service_is_not_waited_for() -> None:
    latched = endpoint("latecomer", qos.CLOCK)  # it requests transient local durability, which the publisher does not offer
    assert missing([endpoint("controller"), latched], connected=1) == ""


@pytest.mark.parametrize(("profile", "found"), [(qos.LOSSLESS, ""), (qos.LATEST, "the recorder")])
def test_a_recorded_topic_waits_for_the_reliable_reader_of_the_recorder(profile: Any, found: str) -> None:
    readers = [endpoint("recorder", profile)]
    assert missing(readers, connected=1, partner="", recorded=True) == found


def test_without_partner_and_recorder_nothing_is_waited_for() -> None:
    assert missing([endpoint("onlooker")], connected=0, partner="") == ""


def test_a_condition_counts_only_once_everything_else_is_there() -> None:
    found: list[str] = []
    calls: list[str] = []

    def silence() -> str:
        calls.append("called")
        return "silence"

    node: Any = SimpleNamespace(
        count_publishers=lambda _topic: len(found), resolve_topic_name=str, create_subscription=lambda *_, **__: None
    )
    connections = Connections(node, recorded=False)
    connections.add_condition(silence)
    connections.add_subscription(Awaited(None, "/odom", lambda _: None, qos.LOSSLESS))
    assert connections.missing() == ["a publisher of /odom"]
    assert not calls
    found.append("a publisher")
    assert connections.missing() == ["silence"]
    assert calls == ["called"]
