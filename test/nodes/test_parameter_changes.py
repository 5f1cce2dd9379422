"""A changed parameter of any node is in the bag, as ROS reports it and as an event."""

from pathlib import Path
from typing import Any

import pytest

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.nodes.controller import ControllerNode
from vessel_hsmc_ros.nodes.recorder import RecorderNode
from vessel_hsmc_ros.nodes.reference_ship import ReferenceShipNode
from vessel_hsmc_ros.nodes.thruster_allocation import ThrusterAllocationNode
from vessel_sim_node.node import VesselSimNode

TWIN = {
    f"vessel__thrusters__{name}": value
    for name, value in {"names": ["left", "right"], "kinds": ["fixed"], "y": [1.0, -1.0], "thrust_ahead": [100.0]}.items()
}
CHANGES: list[tuple[Any, dict[str, Any], str]] = [
    (VesselSimNode, {}, "disturbance.periodic.surge_force"),
    (ControllerNode, {"law": "guided"}, "guided.position_gain"),
    (ReferenceShipNode, {}, "surge_force"),
    (ThrusterAllocationNode, TWIN, "command_timeout"),
]
TOPICS = {"/events", "/parameter_events"}


@pytest.mark.parametrize("lockstep", [True, False], ids=["lockstep", "real time"])
@pytest.mark.parametrize(("kind", "settings", "name"), CHANGES, ids=[kind.NAME for kind, *_ in CHANGES])
def test_a_changed_parameter_is_in_the_bag_twice(
    bench: Any, tmp_path: Path, kind: Any, settings: dict[str, Any], name: str, lockstep: bool
) -> None:
    recorder = bench.start(RecorderNode, lockstep, directory=str(tmp_path / "bag"), topics=sorted(TOPICS))
    node = bench.start(kind, lockstep, **settings)
    outputs = [publisher for publisher in node.publishers if publisher.topic_name in TOPICS]
    assert {publisher.topic_name for publisher in outputs} == TOPICS
    bench.until(lambda: all(publisher.get_subscription_count() for publisher in outputs))
    recorded = recorder.status()[2]["messages"]
    assert bench.set_parameters(kind.NAME, **{name.replace(".", "__"): 0.75}).successful
    bench.until(lambda: recorder.status()[2]["messages"] >= recorded + 2)
    recorder.close()
    bag = open_bag(tmp_path / "bag")
    (event,) = [message for _, _, message in bag.messages("/events")]
    assert event.text.startswith(f"{kind.NAME}.{name}: ")
    assert event.text.endswith(" -> 0.75")
    reported = [changed for _, _, message in bag.messages("/parameter_events") for changed in message.changed_parameters]
    assert [(changed.name, changed.value.double_value) for changed in reported if changed.name == name] == [(name, 0.75)]
