import itertools
import math
from typing import Any

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from driving import ACCELERATION, REFERENCE, STATE, STEP
from message_reading import read_control_state
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import ParameterType
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from rosgraph_msgs.msg import Clock
from std_srvs.srv import Trigger

from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.control.interface.law import diagnosed
from vessel_hsmc_ros.control.laws import make_controller
from vessel_hsmc_ros.control.loop.observer import Observer
from vessel_hsmc_ros.control.loop.observer_model import ObserverParameters
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ControlError, ParameterError
from vessel_hsmc_ros.core.kinematics import as_published
from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes import controller_steps, qos
from vessel_hsmc_ros.nodes.controller import ControllerNode
from vessel_hsmc_ros.scenario.parameters import ControllerParameters


def test_each_odometry_is_answered_with_its_stamp_once_the_reference_is_there(bench: Any, plant: Any) -> None:
    plant.connect(bench.start(ControllerNode))
    plant.send_odometry(0)
    bench.spin(0.2)
    assert plant.stamps() == []
    plant.send_reference(0)
    bench.until(lambda: plant.stamps() == [0])
    plant.send_reference(STEP)
    plant.send_odometry(STEP)
    bench.until(lambda: plant.stamps() == [0, STEP])


def test_late_odometry_is_answered_with_the_stamp_of_its_step(bench: Any, plant: Any) -> None:
    """The plant repeats its first measurement until it is as old as the delay."""
    clock = bench.probe.create_publisher(Clock, "/clock", qos.CLOCK)
    plant.connect(bench.start(ControllerNode, law="pd"))
    for step, measured_at in enumerate((0, 0, 0, STEP, 2 * STEP)):
        plant.send_odometry(measured_at)
        plant.send_reference(step * STEP)
        if step == 2:
            bench.spin(0.2)
            assert plant.stamps() == [0, STEP], "the tick of the step before does not answer it"
        clock.publish(Clock(clock=conv.time_message(step * STEP)))
        bench.until(lambda step=step: plant.stamps() == [k * STEP for k in range(step + 1)])


def test_with_an_observer_the_law_takes_its_estimate_which_is_published(bench: Any, plant: Any) -> None:
    estimates = bench.collect(Odometry, "controller/estimate")
    plant.connect(bench.start(ControllerNode, observer__enabled=True))
    for k in range(3):
        plant.send_reference(k * STEP)
        plant.send_odometry(k * STEP, [*STATE[:3] + 0.1 * k, 99.0, 99.0, 9.0])
        bench.until(lambda k=k: len(plant.states) == len(estimates) == k + 1)
    observer = Observer(ObserverParameters(), KnownVessel())
    wrench = (0.0, 0.0)
    for k in range(3):
        odometry = conv.new_odometry()
        conv.write_odometry(odometry, conv.time_message(0), np.array([*STATE[:3] + 0.1 * k, 0.0, 0.0, 0.0]))
        expected = observer.update(k * STEP, conv.read_odometry(odometry), wrench)
        np.testing.assert_array_equal(conv.read_odometry(estimates[k]), as_published(expected))
        wrench = conv.read_wrench(plant.commands[k])
    assert bench.call(Trigger, "/controller/reset", Trigger.Request()).success
    plant.send_reference(3 * STEP)
    plant.send_odometry(3 * STEP)
    bench.until(lambda: len(estimates) == 4)
    np.testing.assert_allclose(conv.read_odometry(estimates[3]), [*STATE[:3], 0.0, 0.0, 0.0])


def test_without_an_observer_nothing_is_estimated(bench: Any, plant: Any) -> None:
    plant.connect(bench.start(ControllerNode))
    assert not bench.probe.count_publishers("/controller/estimate")


def test_the_command_and_the_control_state_are_those_of_the_law(bench: Any, plant: Any) -> None:
    plant.connect(bench.start(ControllerNode, law="hierarchical_printed"))
    plant.send_reference(0)
    plant.send_odometry(0)
    bench.until(lambda: plant.commands and plant.states)
    law = make_controller("hierarchical_printed", 0.01)
    odometry, reference = conv.new_odometry(), conv.new_reference()
    conv.write_odometry(odometry, conv.time_message(0), STATE)
    conv.write_reference(reference, conv.time_message(0), REFERENCE, ACCELERATION)
    wrench, terms = law.update(0.0, conv.read_odometry(odometry), *conv.read_reference(reference))
    assert conv.read_wrench(plant.commands[0]) == tuple(wrench)
    expected = read_control_state(plant.states[0])
    for name, value in diagnosed(terms, None, 0.01)._asdict().items():
        np.testing.assert_array_equal(expected[name], value)
    assert 0.0 < expected["compute_time"] < 1.0


def test_a_law_slower_than_the_odometry_holds_its_wrench_in_between(bench: Any, plant: Any) -> None:
    gains = {"hierarchical_printed__yaw_reaching_gain": 20.0, "hierarchical_printed__surge_reaching_gain": 20.0}
    plant.connect(bench.start(ControllerNode, rate_hz=50.0, **gains))
    for k in range(4):
        plant.send_reference(k * STEP)
        plant.send_odometry(k * STEP, STATE + k * 0.01)
        bench.until(lambda k=k: len(plant.commands) == k + 1)
    bench.until(lambda: len(plant.states) == 2)
    wrenches = [conv.read_wrench(m) for m in plant.commands]
    assert plant.stamps() == [0, STEP, 2 * STEP, 3 * STEP]
    assert wrenches[0] == wrenches[1] != wrenches[2] == wrenches[3]


@pytest.mark.parametrize(("place", "named"), [(0, "x = nan"), (2, "heading = nan"), (5, "yaw velocity = nan")])
def test_odometry_that_is_not_finite_ends_a_lockstep_run_and_is_named(bench: Any, plant: Any, place: Any, named: Any) -> None:
    plant.connect(bench.start(ControllerNode))
    state = STATE.copy()
    state[place] = math.nan
    plant.send_odometry(0, state)
    with pytest.raises(ControlError, match=rf"odometry must be finite numbers \(got {named}\)"):
        bench.spin(2.0)


def test_a_reference_that_is_not_finite_ends_a_lockstep_run_and_is_named(bench: Any, plant: Any) -> None:
    plant.connect(bench.start(ControllerNode))
    plant.send_reference(0, acceleration=[0.0, math.inf, 0.0])
    with pytest.raises(ControlError, match=r"reference must be finite numbers \(got sway acceleration = inf\)"):
        bench.spin(2.0)


def weights(plant: Any) -> Any:
    return np.array(plant.states[-1].yaw_weights)


def learn(bench: Any, plant: Any, steps: Any) -> Any:
    for _ in range(steps):
        count = len(plant.commands)
        plant.send_reference(count * STEP)
        plant.send_odometry(count * STEP)
        bench.until(lambda count=count: len(plant.commands) == len(plant.states) == count + 1)


def test_a_changed_gain_acts_and_the_weights_stay(bench: Any, plant: Any) -> None:
    plant.connect(bench.start(ControllerNode, law="hierarchical_printed"))
    learn(bench, plant, 5)
    before, surface = weights(plant), plant.states[-1].heading_surface
    client = AsyncParameterClient(bench.probe, "controller")
    bench.until(client.services_are_ready)
    future = client.set_parameters([Parameter("hierarchical_printed.heading_surface_slope", value=0.6)])
    assert bench.until(lambda: future.done() and future.result()).results[0].successful
    learn(bench, plant, 1)
    assert plant.states[-1].heading_surface != pytest.approx(surface)
    assert np.all(np.abs(weights(plant)) >= np.abs(before))
    assert weights(plant).any()


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        ("hierarchical_printed.yaw_reaching_gain", 250.0, "must be below 2"),
        ("hierarchical_printed.sway_weight", -1.0, ""),
        ("rate_hz", 50.0, "read-only"),
        ("law", "pd", "read-only"),
    ],
)
def test_a_change_that_is_not_allowed_is_refused(bench: Any, plant: Any, name: str, value: Any, expected: str) -> None:
    node = plant.connect(bench.start(ControllerNode, law="hierarchical_printed"))
    client = AsyncParameterClient(bench.probe, "controller")
    bench.until(client.services_are_ready)
    future = client.set_parameters([Parameter(name, value=value)])
    result = bench.until(lambda: future.done() and future.result()).results[0]
    assert not result.successful
    assert expected in result.reason
    assert node.parameters == ControllerParameters(lockstep=True, law="hierarchical_printed")


def test_reset_sets_the_weights_to_zero(bench: Any, plant: Any) -> None:
    plant.connect(bench.start(ControllerNode))
    learn(bench, plant, 3)
    assert weights(plant).any()
    assert bench.call(Trigger, "/controller/reset", Trigger.Request()).success
    learn(bench, plant, 1)
    assert not weights(plant).any()


def test_every_parameter_is_described_with_unit_and_range(bench: Any, plant: Any) -> None:
    node = plant.connect(bench.start(ControllerNode))
    client = AsyncParameterClient(bench.probe, "controller")
    bench.until(client.services_are_ready)
    declared = {name: entry for name, entry in schema.entries(ControllerParameters).items() if node.has_parameter(name)}
    future = client.describe_parameters(list(declared))
    described = bench.until(lambda: future.done() and future.result()).descriptors
    for entry, expected in zip(declared.values(), described, strict=True):
        assert expected.description.startswith(entry.description)
        assert f"[{entry.unit}]" in expected.description or not entry.unit
        assert entry.allowed in expected.additional_constraints
        if entry.type is float:
            assert expected.type == ParameterType.PARAMETER_DOUBLE
            assert (expected.floating_point_range[0].from_value, expected.floating_point_range[0].to_value) == (
                entry.low,
                entry.high,
            )
        assert expected.read_only is not entry.tunable


def test_an_unstable_gain_is_refused_at_the_start(bench: Any) -> None:
    with pytest.raises(ParameterError, match=r"is unstable at controller\.rate_hz = 50 Hz"):
        bench.start(ControllerNode, rate_hz=50.0, law="hierarchical_printed")


def test_odometry_without_a_reference_of_its_stamp_is_reported_with_both_stamps(bench: Any, plant: Any) -> None:
    statuses = bench.collect(DiagnosticArray, "/diagnostics", qos.DIAGNOSTICS)
    plant.connect(bench.start(ControllerNode))
    plant.send_odometry(STEP)
    plant.send_reference(STEP + 1)
    found = "no command: in lockstep it needs inputs of one stamp, the latest are"
    bench.until(lambda: statuses and statuses[-1].status[0].message.startswith(found))
    assert statuses[-1].status[0].level == DiagnosticStatus.WARN
    assert statuses[-1].status[0].message.endswith("odometry of 0.010000000 s and reference of 0.010000001 s")
    assert plant.commands == []
    plant.send_reference(STEP)
    bench.until(lambda: plant.stamps() == [STEP])
    bench.until(lambda: statuses[-1].status[0].message == "running")


def test_odometry_that_goes_on_without_a_reference_of_its_stamps_is_reported_while_it_lasts(bench: Any, plant: Any) -> None:
    node = plant.connect(bench.start(ControllerNode))
    steps = itertools.count(1)

    def reported() -> bool:
        step = next(steps) * STEP
        plant.send_reference(step + 1)
        plant.send_odometry(step)
        return "in lockstep it needs inputs of one stamp" in node.status()[1]

    bench.until(reported)
    assert plant.commands == []


def test_references_without_matching_odometry_are_limited_in_number(
    bench: Any, plant: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(controller_steps, "REFERENCES_KEPT", 50)
    node = plant.connect(bench.start(ControllerNode))
    for k in range(60):
        plant.send_reference(k)
    plant.send_odometry(59)
    bench.until(lambda: plant.stamps() == [59])
    plant.send_odometry(10 * STEP)
    for k in range(60):
        plant.send_reference(STEP + k)
    bench.until(lambda: STEP + 59 in node._steps._references)
    assert node.status()[2]["references_waiting"] == 50
