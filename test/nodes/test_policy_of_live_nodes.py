"""What real nodes publish, subscribe to and serve, beside what the SROS2 policy allows them."""

from typing import Any
from xml.etree import ElementTree

import pytest

from vessel_hsmc_ros.core.install_paths import share_directory
from vessel_hsmc_ros.nodes.controller import ControllerNode
from vessel_hsmc_ros.nodes.reference_ship import ReferenceShipNode
from vessel_hsmc_ros.nodes.watchdog import WatchdogNode
from vessel_sim_node.node import VesselSimNode

POLICY = ElementTree.parse(share_directory() / "config" / "security" / "policy.xml").getroot()  # noqa: S314 - our own file


def allowed(node: str, rule: str) -> set[str]:
    """The full names that a node may publish, subscribe to or serve."""
    lists = POLICY.iterfind(f".//profile[@node='{node}']/*[@{rule}='ALLOW']")
    names = [entry.text or "" for each in lists for entry in each]
    return {f"/{node}/{name[2:]}" if name.startswith("~/") else "/" + name.lstrip("/") for name in names}


@pytest.mark.parametrize("kind", [ControllerNode, ReferenceShipNode, VesselSimNode, WatchdogNode])
def test_a_live_node_has_only_what_the_policy_allows(bench: Any, kind: Any) -> None:
    node = bench.start(kind, lockstep=False)
    probe, name = bench.probe, kind.NAME
    bench.until(lambda: node.count_publishers("/diagnostics"))
    queries = {
        "publish": probe.get_publisher_names_and_types_by_node,
        "subscribe": probe.get_subscriber_names_and_types_by_node,
        "reply": probe.get_service_names_and_types_by_node,
    }
    for rule, query in queries.items():
        live = {topic for topic, _ in query(name, "/")}
        assert live <= allowed(name, rule), rule
    served = {service for service, _ in queries["reply"](name, "/")}
    assert allowed(name, "reply") - served <= {f"/{name}/get_type_description"}
