"""A manoeuvre over the nodes in lockstep: the scenario that the command writes, with the numbers of its page."""

from pathlib import Path
from typing import Any

import numpy as np
from rclpy.serialization import deserialize_message

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes.controller import ControllerNode
from vessel_hsmc_ros.nodes.reference_ship import ReferenceShipNode
from vessel_hsmc_ros.scenario.scenario import dump_scenario, load_scenario
from vessel_hsmc_ros.simulation.offline import simulate
from vessel_hsmc_ros.studies.manoeuvres.run import scenario_of, ship_named
from vessel_sim_node.node import VesselSimNode


def test_the_nodes_turn_as_the_offline_loop_does(bench: Any, tmp_path: Path) -> None:
    planned = scenario_of(ship_named("heron"), "zigzag_20")
    # The end of the approach and the first two executes.
    short = planned.changed({"controller.manoeuvre.approach_time": 0.5, "vessel_sim.duration": 2.0})
    (tmp_path / "zigzag.yaml").write_text(dump_scenario(short))
    scenario = load_scenario(tmp_path / "zigzag.yaml")
    offline = simulate(scenario)
    assert len({round(moment, 9) for moment in offline.control["commanded"][:, 1]}) == 3
    found: list[Any] = []
    for node_class in (VesselSimNode, ReferenceShipNode, ControllerNode):
        values = schema.flatten(getattr(scenario, node_class.NAME))
        node = bench.start(node_class, **{k: list(v) if isinstance(v, tuple) else v for k, v in values.items()})
        if node_class is VesselSimNode:
            _tap(node, found)
    bench.until(lambda: len(found) == len(offline.time))
    np.testing.assert_array_equal(np.array(found), offline.measured)


def _tap(node: Any, found: list[Any]) -> None:
    """Collect the odometry that a node publishes, without a subscription, which would take part in the start-up handshake."""
    send = node.send

    def noting(publisher: Any, message: Any) -> None:
        if publisher.topic_name == "/odom":
            found.append(conv.read_odometry(deserialize_message(message, publisher.msg_type)))
        send(publisher, message)

    node.send = noting
