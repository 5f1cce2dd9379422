"""Plant, reference and controller nodes in one process, in lockstep: bit-identical with the offline loop."""

from typing import Any

import numpy as np
import pytest
import rclpy
from durations import rest_long

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.controller import ControllerNode
from vessel_hsmc_ros.nodes.reference_ship import ReferenceShipNode
from vessel_hsmc_ros.simulation.offline import load_scenario, simulate
from vessel_sim_node.node import VesselSimNode

NODES = {"vessel_sim": VesselSimNode, "reference_ship": ReferenceShipNode, "controller": ControllerNode}
TOPICS_OF_EVERY_NODE = ("/diagnostics", "/parameter_events", "/rosout")
RATES = {f"{node}.rate_hz": 10.0 for node in NODES} | {"vessel_sim.command_timeout": 60.0}
"""With time for a reference to plan its path on a busy machine, while the plant waits for a command."""


def run_nodes(bench: Any, scenario: Any) -> Any:
    """Odometry (n, 6) and wrench (n, 2) of a run of the nodes, collected by a node that they wait for as their recorder."""
    taken: dict[str, list[Any]] = {}
    recorder = rclpy.create_node("recorder", context=bench.context)
    bench.nodes.append(recorder)
    bench.executor.add_node(recorder)
    for name, node_class in NODES.items():
        values = schema.flatten(getattr(scenario, name)) | {"recorded": True}
        node = bench.start(node_class, **{k: list(v) if isinstance(v, tuple) else v for k, v in values.items()})
        for publisher in node.publishers:
            if publisher.topic_name not in TOPICS_OF_EVERY_NODE:
                messages = taken.setdefault(publisher.topic_name, [])
                recorder.create_subscription(publisher.msg_type, publisher.topic_name, messages.append, qos.LOSSLESS)
    samples = round(scenario.vessel_sim.duration * scenario.vessel_sim.rate_hz) + 1
    bench.until(lambda: len(taken["/odom"]) == len(taken["/applied_wrench"]) == samples)
    state = np.array([conv.read_odometry(message) for message in taken["/odom"]])
    return state, np.array([conv.read_wrench(message) for message in taken["/applied_wrench"]])


@pytest.mark.parametrize("law", ["los_pid", "hand_position", "nmpc"])
def test_a_run_of_the_nodes_is_bit_identical_with_the_offline_run(bench: Any, law: Any) -> None:
    if law == "nmpc":
        pytest.importorskip("casadi")
    scenario = load_scenario("case2_tracking", {"controller.law": law, "vessel_sim.duration": 5.0, **RATES})
    state, wrench = run_nodes(bench, scenario)
    offline = simulate(scenario)
    np.testing.assert_array_equal(state, offline.state)
    np.testing.assert_array_equal(wrench, offline.wrench)


def test_a_run_of_the_nodes_at_the_pivot_is_bit_identical_with_the_offline_run(bench: Any) -> None:
    changes = {"controller.law": "guided", "vessel.sway_yaw_inertia": 6e5, "vessel_sim.duration": 5.0, **RATES}
    state, wrench = run_nodes(bench, scenario := load_scenario("case2_tracking", changes))
    offline = simulate(scenario)
    assert scenario.controller.vessel.controlled > 3.0
    np.testing.assert_array_equal(state, offline.state)
    np.testing.assert_array_equal(wrench, offline.wrench)


@pytest.mark.parametrize("scenario", ["goal", "waypoints"])
def test_a_run_with_goals_or_waypoints_of_a_file_is_bit_identical_with_the_offline_run(bench: Any, scenario: Any) -> None:
    soon = {"reference_ship.goal.times": [0.5, 2.0], "reference_ship.path.time": 0.5, "vessel_sim.duration": 5.0}
    loaded = load_scenario(scenario, {**soon, "controller.law": "los_pid", **RATES})
    state, wrench = run_nodes(bench, loaded)
    offline = simulate(loaded)
    assert np.abs(offline.reference[-1] - offline.reference[0]).max() > 0.1
    np.testing.assert_array_equal(state, offline.state)
    np.testing.assert_array_equal(wrench, offline.wrench)


@pytest.mark.parametrize("mode", rest_long(["circle", "lawnmower", "straight", "figure_eight", "square"], 2))
def test_a_run_along_a_curve_is_bit_identical_with_the_offline_run(bench: Any, mode: str) -> None:
    changes = {"reference_ship.mode": mode, "vessel_sim.duration": 5.0, "controller.law": "guided", **RATES}
    scenario = load_scenario("waypoints", changes)
    state, wrench = run_nodes(bench, scenario)
    offline = simulate(scenario)
    np.testing.assert_array_equal(state, offline.state)
    np.testing.assert_array_equal(wrench, offline.wrench)


def test_a_run_with_dead_time_and_late_odometry_is_bit_identical_with_the_offline_run(bench: Any) -> None:
    late = {
        "vessel_sim.sensors.delay": 0.3,
        "vessel_sim.actuators.surge_dead_time": 0.2,
        "vessel_sim.actuators.yaw_dead_time": 0.5,
    }
    observer = {"controller.observer.enabled": True, "vessel_sim.sensors.position_noise": 0.1}
    changes = {"controller.law": "los_pid", "vessel_sim.duration": 3.0, **late, **observer, **RATES}
    measured, wrench = run_nodes(bench, scenario := load_scenario("case2_tracking", changes))
    offline = simulate(scenario, interpreted=True)
    np.testing.assert_array_equal(measured, offline.measured)
    np.testing.assert_array_equal(wrench, offline.wrench)
    assert not wrench[:5, 1].any()
    assert wrench[5:, 1].all()


@pytest.mark.parametrize("mode", rest_long(["path", "lawnmower", "circle"]))
def test_a_run_with_a_reference_that_waits_is_bit_identical_with_the_offline_run(bench: Any, mode: str) -> None:
    """The odometry rate is twice that of the reference, and the vessel begins far behind."""
    changes = {
        **RATES,
        "vessel_sim.rate_hz": 20.0,
        "reference_ship.mode": mode,
        "reference_ship.follow": "vessel",
        "reference_ship.initial_pose": [0.0, 0.0, 0.0],
        "vessel_sim.initial_pose": [-45.0, 0.0, 0.0],
        "vessel_sim.duration": 12.0,
        "controller.law": "guided",
    }
    scenario = load_scenario("waypoints", changes)
    state, wrench = run_nodes(bench, scenario)
    offline = simulate(scenario)
    assert np.ptp(offline.reference[:, 3]) > 0.01
    np.testing.assert_array_equal(state, offline.state)
    np.testing.assert_array_equal(wrench, offline.wrench)
