"""The nodes in lockstep against the golden runs and the offline loop: the first second of every scenario."""

from typing import Any

import numpy as np
import pytest
from durations import rest_long
from golden.record import deviations, load, rows
from rclpy.serialization import deserialize_message

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes.controller import ControllerNode
from vessel_hsmc_ros.nodes.reference_ship import ReferenceShipNode
from vessel_hsmc_ros.scenario.scenario import scenario_names
from vessel_hsmc_ros.simulation.offline import load_scenario, simulate
from vessel_sim_node.node import VesselSimNode

CHANGES = {"vessel_sim.duration": 1.0, "vessel_sim.command_timeout": 60.0}  # the path takes time to plan on a busy machine
TAPPED = {
    "/odom": conv.read_odometry,
    "/applied_wrench": conv.read_wrench,
    "/reference": lambda message: conv.read_reference(message)[0],
}


def tap(node: Any, found: Any) -> Any:
    """Collect what a node publishes, without a subscription, which would take part in the start-up handshake."""
    send = node.send

    def noting(publisher: Any, message: Any) -> Any:
        if publisher.topic_name in TAPPED:
            found[publisher.topic_name].append(TAPPED[publisher.topic_name](deserialize_message(message, publisher.msg_type)))
        send(publisher, message)

    node.send = noting


BRIEF = ("case2_tracking", "case1_pd_disturbed", "goal", "waypoints")
"""Scenarios of which each has another law or another kind of reference; test_lockstep.py has more of them."""


@pytest.mark.parametrize("name", rest_long(sorted(scenario_names(), key=lambda name: name not in BRIEF), len(BRIEF)))
def test_the_nodes_reproduce_the_golden_run(bench: Any, name: str) -> None:
    scenario = load_scenario(name, CHANGES)
    offline = simulate(scenario)
    found: dict[str, list[Any]] = {topic: [] for topic in TAPPED}
    for node_class in (VesselSimNode, ReferenceShipNode, ControllerNode):
        values = schema.flatten(getattr(scenario, node_class.NAME))
        tap(bench.start(node_class, **{k: list(v) if isinstance(v, tuple) else v for k, v in values.items()}), found)
    steps = len(offline.time)
    bench.until(lambda: len(found["/applied_wrench"]) == steps and len(found["/reference"]) >= steps)

    for topic, expected in (("/odom", offline.measured), ("/reference", offline.reference), ("/applied_wrench", offline.wrench)):
        np.testing.assert_array_equal(np.array(found[topic][:steps]), expected, err_msg=topic)
    # bit-identical, so the offline rows stand for the nodes'
    assert np.max(deviations(load(name)["rows"], rows(offline))) <= 1.0
