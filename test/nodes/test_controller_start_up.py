"""What the controller reports and refuses at its start."""

from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from driving import STEP, RealTimePlant
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import Log
from std_srvs.srv import SetBool, Trigger
from vessel_hsmc_msgs.msg import ControlState, ReferenceState

from vessel_hsmc_ros.core.exceptions import SimulationError
from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.controller import ControllerNode


def test_a_node_that_is_not_connected_reports_what_it_waits_for(bench: Any) -> None:
    statuses = bench.collect(DiagnosticArray, "/diagnostics", qos.DIAGNOSTICS)
    bench.start(ControllerNode)
    bench.publisher(ReferenceState, "reference")
    expected = "waiting for a publisher of /odom, a node that reads /cmd_wrench and publishes /odom or /allocated_wrench"
    bench.until(lambda: statuses and statuses[-1].status[0].message == expected)
    assert statuses[-1].status[0].level == DiagnosticStatus.WARN


def test_a_node_announces_what_it_does_and_on_which_topics(bench: Any) -> None:
    logs = bench.collect(Log, "/rosout", qos.CLOCK)
    node = bench.start(ControllerNode, lockstep=False, law="guided")
    bench.until(lambda: node.announce() or any(log.name == "controller" for log in logs))
    assert logs[-1].msg == (
        "law guided at 100 Hz; real time; publishes /cmd_wrench, /controller/state; subscribes to /odom, /reference"
    )


def test_the_hierarchical_law_in_real_time_causes_a_warning(bench: Any) -> None:
    logs = bench.collect(Log, "/rosout", qos.CLOCK)
    node = bench.start(ControllerNode, lockstep=False, law="hierarchical_printed")
    bench.until(lambda: node.connected and logs)
    assert "law hierarchical_printed tolerates no late control steps" in logs[0].msg


def test_a_declared_sway_with_which_the_hierarchical_law_loses_the_vessel_causes_a_warning(bench: Any) -> None:
    logs = bench.collect(Log, "/rosout", qos.CLOCK)
    declared = {"vessel__sway_damping_rate": 0.02, "vessel__coriolis_ratio": 1.2}
    node = bench.start(ControllerNode, lockstep=False, law="hierarchical", **declared)
    bench.until(lambda: node.connected and logs)
    assert "the Routh ratio of the path error must be above 1" in logs[0].msg


def test_a_second_controller_refuses_to_start_in_lockstep(bench: Any, plant: Any) -> None:
    plant.connect(bench.start(ControllerNode))
    second = bench.start(ControllerNode)
    with pytest.raises(SimulationError, match="/cmd_wrench has 2 publishers and may have one"):
        bench.until(lambda: second.connected)


def test_frame_ids_have_the_frame_prefix_of_the_vessel(bench: Any, plant: Any) -> None:
    estimates = bench.collect(Odometry, "controller/estimate")
    plant.connect(bench.start(ControllerNode, frame_prefix="alpha/", observer__enabled=True))
    plant.send_reference(0)
    plant.send_odometry(0)
    bench.until(lambda: plant.commands and plant.states and estimates)
    assert plant.commands[0].header.frame_id == plant.states[0].header.frame_id == "alpha/base_link"
    assert (estimates[0].header.frame_id, estimates[0].child_frame_id) == ("alpha/odom", "alpha/base_link")


@pytest.mark.parametrize("late", ["odometry", "reference"])
def test_the_law_commands_only_after_enough_samples_of_each_input(bench: Any, simulated_time: Any, late: str) -> None:
    """The one input has come for long when the other begins."""
    sea = RealTimePlant(bench, simulated_time)
    given = {"odometry": "state", "reference": "desired"}[late]
    value = getattr(sea, given)
    setattr(sea, given, None)
    sea.start(ControllerNode, law="guided", safety__fresh_samples=10)
    sea.run(0.3)
    began = simulated_time.now
    setattr(sea, given, value)
    sea.run(0.2)
    active = [conv.nanoseconds(state.header.stamp) for state in sea.states if state.operation == ControlState.ACTIVE]
    assert began + 9 * STEP <= active[0] <= began + 13 * STEP


@pytest.mark.parametrize("order", ["stop", "disable"])
def test_a_person_who_was_there_before_the_inputs_has_the_last_word(bench: Any, simulated_time: Any, order: str) -> None:
    sea = RealTimePlant(bench, simulated_time)
    state, sea.state = sea.state, None
    sea.start(ControllerNode, law="guided")
    sea.run(0.1)
    if order == "stop":
        assert bench.call(Trigger, "/controller/stop", Trigger.Request()).success
        assert bench.call(Trigger, "/controller/rearm", Trigger.Request()).success
    else:
        bench.call(SetBool, "/controller/enable", SetBool.Request(data=False))
    sea.state = state
    sea.run(0.3)
    assert {state.operation for state in sea.states} == {ControlState.STANDBY}
    assert bench.call(SetBool, "/controller/enable", SetBool.Request(data=True)).success
