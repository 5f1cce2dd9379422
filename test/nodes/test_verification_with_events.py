"""A lockstep run whose controller was changed, disabled and reset, or whose path was, on the way is verified bit by bit."""

from pathlib import Path
from typing import Any

import nav_msgs.msg
import numpy as np
import pytest
from geometry_msgs.msg import PoseStamped
from rclpy.duration import Duration
from std_srvs.srv import SetBool, Trigger

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.guidance.factory import make_reference
from vessel_hsmc_ros.guidance.timetable import follow
from vessel_hsmc_ros.messages.conversions import read_reference
from vessel_hsmc_ros.nodes.controller import ControllerNode
from vessel_hsmc_ros.nodes.recorder import RecorderNode
from vessel_hsmc_ros.nodes.reference_ship import ReferenceShipNode
from vessel_hsmc_ros.scenario.scenario import dump_scenario, load_scenario
from vessel_hsmc_ros.simulation.compilation import compiled
from vessel_hsmc_ros.studies.verification import verify
from vessel_sim_node.node import VesselSimNode

NODES = (RecorderNode, ReferenceShipNode, ControllerNode, VesselSimNode)
RATES = {f"{node.NAME}.rate_hz": 10.0 for node in NODES[1:]}


POINT = {"vessel.sway_yaw_inertia": 6e5}  # the filter of the centre of percussion is a state of the controller too


def start_all(bench: Any, folder: Path, name: str, given: dict[str, Any]) -> dict[str, Any]:
    """The nodes of a lockstep run with a recorder."""
    changes = {"controller.law": "guided", **given, **{f"{node.NAME}.recorded": True for node in NODES}, **RATES}
    (folder / "params.yaml").write_text("", encoding="utf-8")
    scenario = load_scenario(name, changes).with_bag(folder / "bag", folder / "params.yaml")
    (folder / "params.yaml").write_text(dump_scenario(scenario), encoding="utf-8")
    started = {}
    for node_class in NODES:
        values = schema.flatten(getattr(scenario, node_class.NAME)).items()
        parameters = {name: list(value) if isinstance(value, tuple) else value for name, value in values}
        started[node_class.NAME] = bench.start(node_class, **parameters)
    return started


def go_on(bench: Any, nodes: dict[str, Any], steps: int) -> None:
    """Let the run go on for some steps."""
    plant = nodes["vessel_sim"]
    end = plant.status()[2]["steps"] + steps
    bench.until(lambda: plant.status()[2]["steps"] >= end)


def test_a_run_with_events_is_verified_with_them(bench: Any, tmp_path: Path) -> None:
    nodes = start_all(bench, tmp_path, "case2_tracking", POINT)
    assert bench.set_parameters("controller", guided__integral_gain=0.01).successful  # before the first step

    def advance(steps: int) -> None:
        go_on(bench, nodes, steps)

    advance(5)
    assert bench.set_parameters("controller", guided__position_gain=0.5, guided__approach_speed=0.4).successful
    advance(20)
    assert bench.call(SetBool, "/controller/enable", SetBool.Request(data=False)).success
    advance(5)
    assert bench.call(SetBool, "/controller/enable", SetBool.Request(data=True)).success
    advance(20)
    assert bench.call(Trigger, "/controller/reset", Trigger.Request()).success
    advance(20)
    assert bench.call(SetBool, "/vessel_sim/pause", SetBool.Request(data=True)).success
    bench.spin(0.3)
    nodes["recorder"].close()

    bag = open_bag(tmp_path / "bag")
    kinds = [event.kind for event in bag.events()]
    assert kinds == ["parameter", "parameter", "parameter", "disable", "enable", "reset", "pause"]
    found = verify(bag, bag.scenario())
    assert found.largest == (0.0, 0.0)
    assert len(found.differing) == 0
    assert not found.recorded.any(axis=1).all(), "the wrench was zero while the controller was disabled"
    assert bag.events()[0].time < 0.0
    assert bag.scenario(at=0.0).controller.guided.integral_gain == 0.01
    assert bag.scenario(at=0.0).controller.guided.position_gain == 1.5
    assert bag.scenario(at=found.time[-1]).controller.guided.position_gain == 0.5


@pytest.mark.long
def test_a_path_that_is_changed_under_way_is_the_same_in_bag_offline_reference_compiled_one_and_replay(
    bench: Any, tmp_path: Path
) -> None:
    paths = bench.probe.create_publisher(nav_msgs.msg.Path, "path", 10)
    nodes = start_all(bench, tmp_path, "waypoints", {"reference_ship.path.time": 0.5})
    bench.until(lambda: paths.get_subscription_count())
    points = ([(30.0, 20.0), (80.0, 20.0)], [(-40.0, 10.0)])
    for route in points:
        go_on(bench, nodes, 60)
        message = nav_msgs.msg.Path(poses=[PoseStamped() for _ in route])
        message.header.frame_id = "odom"
        for pose, (x, y) in zip(message.poses, route, strict=True):
            pose.pose.position.x, pose.pose.position.y = x, y
        paths.publish(message)
        assert paths.wait_for_all_acked(Duration(seconds=20.0))
    go_on(bench, nodes, 60)
    nodes["recorder"].close()

    bag = open_bag(tmp_path / "bag")
    scenario = bag.scenario()
    found = verify(bag, scenario)
    assert found.largest == (0.0, 0.0)
    recorded = np.array([np.concatenate(read_reference(message)) for _, _, message in bag.messages("/reference")])
    reference: Any = make_reference(scenario.reference_ship, 1.0 / scenario.reference_ship.rate_hz)
    begin = 0
    for event, route in zip([e for e in bag.events() if e.kind == "path"], points, strict=True):
        end = round(10.0 * event.time)
        assert_steps(reference, recorded[begin : end + 1])
        assert recorded[end, 3] > 0.1, "under way"
        reference.set_path(route)
        reference.advance()
        begin = end + 1
    rows = np.empty((len(recorded) - begin, 9))
    compiled(follow, **reference.kernels)(reference.memory, reference.constants, rows)
    np.testing.assert_array_equal(recorded[begin:], rows)
    assert_steps(reference, recorded[begin:])


def assert_steps(reference: Any, recorded: Any) -> None:
    """From the first of some recorded steps on, the reference is in each what was recorded."""
    for k, row in enumerate(recorded):
        if k:
            reference.advance()
        np.testing.assert_array_equal(row, [*reference.state, *reference.acceleration()])
