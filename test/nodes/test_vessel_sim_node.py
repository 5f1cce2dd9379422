import math
from typing import Any

import numpy as np
import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from driving import Helm
from geometry_msgs.msg import AccelStamped, WrenchStamped
from message_reading import read_acceleration, read_disturbance
from nav_msgs.msg import Odometry
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from std_srvs.srv import SetBool, Trigger

from vessel_hsmc_ros.core.exceptions import ParameterError, SimulationError
from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.commands import nothing
from vessel_hsmc_ros.plant.dynamics import unforced_acceleration
from vessel_hsmc_ros.plant.hull_parameters import VesselParameters
from vessel_sim_node.node import VesselSimNode

STEP = 10_000_000


@pytest.fixture
def helm(bench: Any) -> Any:
    return Helm(bench)


def test_a_reader_that_is_no_controller_does_not_start_the_run(bench: Any) -> None:
    onlooker = bench.collect(Odometry, "odom", QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT))
    helm = rclpy.create_node("helm", context=bench.context)
    bench.nodes.append(helm)
    helm.create_publisher(WrenchStamped, "cmd_wrench", qos.LOSSLESS)
    node = bench.start(VesselSimNode)
    bench.spin(0.3)
    assert not node.connected
    helm.create_subscription(Odometry, "odom", lambda _: None, qos.LOSSLESS)
    bench.until(lambda: node.connected and onlooker)


def test_a_step_waits_for_the_command_of_its_own_stamp(bench: Any, helm: Any) -> None:
    clocks = bench.collect(Clock, "/clock", qos.CLOCK)
    bench.start(VesselSimNode)
    bench.until(lambda: helm.stamps() == [0])
    helm.command(STEP)  # of another step
    helm.command(0, force=1e5)
    bench.until(lambda: helm.stamps() == [0, STEP])
    bench.spin(0.2)
    assert helm.stamps() == [0, STEP]
    assert [conv.nanoseconds(c.clock) for c in clocks] == [0, STEP]
    assert helm.odometry[1].twist.twist.linear.x == pytest.approx(0.01 * (1e5 + 1100) / 120e3, rel=1e-2)
    assert conv.read_wrench(helm.applied[0]) == (1e5, 0.0)
    assert read_disturbance(helm.disturbance[0]) == (1100.0, 2600.0, 95000.0)


def test_late_odometry_has_the_stamp_of_its_measurement_and_a_step_takes_the_command_of_its_own(bench: Any, helm: Any) -> None:
    clocks = bench.collect(Clock, "/clock", qos.CLOCK)
    bench.start(VesselSimNode, sensors__delay=0.02)
    for step in range(5):
        bench.until(lambda step=step: len(helm.odometry) == len(clocks) == step + 1)
        helm.command(step * STEP, force=1e5)
    bench.until(lambda: len(clocks) == 6)
    assert [conv.nanoseconds(c.clock) for c in clocks] == [k * STEP for k in range(6)]
    assert helm.stamps() == [0, 0, 0, STEP, 2 * STEP, 3 * STEP]
    assert conv.nanoseconds(helm.applied[4].header.stamp) == 4 * STEP


def test_odometry_is_in_the_frames_of_rep_103(bench: Any, helm: Any) -> None:
    bench.start(VesselSimNode)
    first = bench.until(lambda: helm.odometry and helm.odometry[0])
    assert (first.header.frame_id, first.child_frame_id) == ("odom", "base_link")
    np.testing.assert_allclose(conv.read_odometry(first), [5.0, 1.0, math.pi / 4, 0.0, 0.0, 0.0])


def test_nothing_is_published_before_a_controller_is_there(bench: Any) -> None:
    odometry = bench.collect(Odometry, "odom")
    bench.start(VesselSimNode)
    bench.spin(0.3)
    assert odometry == []


def test_nothing_is_published_before_an_awaited_recorder_is_there(bench: Any, helm: Any) -> None:
    bench.start(VesselSimNode, recorded=True)
    bench.spin(0.3)
    assert helm.odometry == []


@pytest.mark.parametrize(("duration", "steps"), [(0.05, 5), (0.29, 29)])  # 0.29 / 0.01 is a little less than 29
def test_the_run_ends_after_its_duration_with_one_message_more_than_steps(
    bench: Any, helm: Any, duration: float, steps: int
) -> None:
    node = bench.start(VesselSimNode, duration=duration)
    for k in range(steps + 1):
        bench.until(lambda k=k: len(helm.odometry) == k + 1)
        assert not node.finished
        helm.command(k * STEP)
    bench.until(lambda: node.finished)
    bench.until(lambda: len(helm.applied) == steps + 1)
    assert helm.stamps() == [k * STEP for k in range(steps + 1)]


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_a_command_that_is_not_finite_ends_a_lockstep_run_and_is_named(bench: Any, helm: Any, bad: Any) -> None:
    bench.start(VesselSimNode)
    bench.until(lambda: helm.odometry)
    helm.command(0, force=bad)
    with pytest.raises(SimulationError, match=rf"commanded wrench must be finite numbers \(got {bad} N, 0\.0 N·m\)"):
        bench.spin(2.0)


def test_the_message_that_there_is_no_command_ends_a_lockstep_run_and_names_the_remedy(bench: Any, helm: Any) -> None:
    bench.start(VesselSimNode)
    bench.until(lambda: helm.odometry)
    helm.commands.publish(nothing(0))
    with pytest.raises(SimulationError, match=r"no command came for t = 0 s: vessel_sim.ride_through=true goes on without it"):
        bench.spin(2.0)


def test_an_overdue_command_ends_a_lockstep_run_and_names_the_time(bench: Any, helm: Any) -> None:
    bench.start(VesselSimNode, command_timeout=0.3)
    bench.until(lambda: helm.odometry)
    with pytest.raises(SimulationError, match=r"no command came for t = 0 s within 0\.3 s"):
        bench.spin(2.0)


def test_a_plant_refuses_to_start_beside_another_which_goes_on(bench: Any, helm: Any) -> None:
    first = bench.start(VesselSimNode)
    bench.until(lambda: helm.odometry)
    second = bench.start(VesselSimNode)
    with pytest.raises(SimulationError, match="/odom has 2 publishers and may have one: does another run use this ROS domain"):
        bench.until(lambda: second.connected)
    assert not second.connected
    bench.stop(second)
    helm.command(0)
    bench.until(lambda: helm.stamps() == [0, STEP])
    assert first.connected


def test_a_plant_does_not_begin_where_commands_answer_another_that_the_graph_does_not_show_yet(
    bench: Any, helm: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench.start(VesselSimNode, command_timeout=60.0)
    bench.until(lambda: helm.odometry)
    monkeypatch.setattr("vessel_sim_node.drives.LISTENING", 60.0)  # however late a busy machine connects the commands
    second = bench.start(VesselSimNode)
    monkeypatch.setattr(second.connections, "conflict", lambda: "")
    statuses = bench.collect(DiagnosticArray, "/diagnostics", qos.DIAGNOSTICS)
    waiting = "waiting for the end of another run, whose commands come on cmd_wrench"

    def shown() -> bool:
        helm.command(1)  # no step of either plant: nothing moves
        return any(each.status[0].message == waiting for each in statuses)

    bench.until(shown)
    assert not second.connected
    assert helm.stamps() == [0]
    monkeypatch.undo()
    with pytest.raises(SimulationError, match="/odom has 2 publishers and may have one"):
        bench.until(lambda: second.connected)


def test_a_second_publisher_of_commands_is_reported_and_the_lockstep_run_goes_on(bench: Any, helm: Any) -> None:
    statuses = bench.collect(DiagnosticArray, "/diagnostics", qos.DIAGNOSTICS)
    bench.start(VesselSimNode, command_timeout=60.0)
    bench.until(lambda: helm.odometry)
    other = bench.publisher(WrenchStamped, "cmd_wrench")
    found = "/cmd_wrench has 2 publishers and may have one"
    bench.until(lambda: statuses and statuses[-1].status[0].message.startswith(found))
    assert statuses[-1].status[0].level == DiagnosticStatus.WARN
    bench.probe.destroy_publisher(other)
    helm.command(0)
    bench.until(lambda: helm.stamps() == [0, STEP])


def test_pause_suspends_the_step_and_the_command_timeout(bench: Any, helm: Any) -> None:
    bench.start(VesselSimNode, command_timeout=1.0)
    bench.until(lambda: helm.odometry)
    assert bench.call(SetBool, "/vessel_sim/pause", SetBool.Request(data=True)).message == "paused"
    helm.command(0)
    bench.spin(1.5)
    assert helm.stamps() == [0]
    assert bench.call(SetBool, "/vessel_sim/pause", SetBool.Request(data=False)).message == "running"
    bench.until(lambda: helm.stamps() == [0, STEP])


def test_reset_returns_the_ship_to_its_start_without_resetting_time(bench: Any, helm: Any) -> None:
    bench.start(VesselSimNode)
    for k in range(20):
        bench.until(lambda k=k: len(helm.odometry) == k + 1)
        helm.command(k * STEP, force=1e6)
    bench.until(lambda: len(helm.odometry) == 21)
    assert helm.odometry[-1].twist.twist.linear.x > 1.0
    assert bench.call(Trigger, "/vessel_sim/reset", Trigger.Request()).success
    helm.command(20 * STEP)
    bench.until(lambda: len(helm.odometry) == 22)
    assert helm.stamps()[-1] == 21 * STEP
    assert abs(helm.odometry[-1].twist.twist.linear.x) < 0.01


def test_the_unforced_acceleration_is_published_every_step(bench: Any, helm: Any) -> None:
    truth = bench.collect(AccelStamped, "dynamics/truth")
    bench.start(VesselSimNode, initial_velocity=[2.0, 0.5, 0.1])
    bench.until(lambda: helm.odometry)
    helm.command(0)
    bench.until(lambda: len(truth) == 2)
    assert [conv.nanoseconds(m.header.stamp) for m in truth] == [0, STEP]
    assert truth[0].header.frame_id == "base_link"
    expected = unforced_acceleration(2.0, 0.5, 0.1, VesselParameters().coefficients())
    assert read_acceleration(truth[0]) == pytest.approx(expected, rel=1e-12)
    assert not bench.probe.count_publishers("/odom/truth")


def test_with_sensor_noise_the_true_state_is_published_on_its_own_topic(bench: Any, helm: Any) -> None:
    truth = bench.collect(Odometry, "odom/truth")
    bench.start(VesselSimNode, sensors__position_noise=1.0, sensors__heading_bias=0.1)
    bench.until(lambda: helm.odometry)
    helm.command(0)
    bench.until(lambda: len(truth) == 2)
    assert [conv.nanoseconds(m.header.stamp) for m in truth] == [0, STEP]
    np.testing.assert_allclose(conv.read_odometry(truth[0]), [5.0, 1.0, math.pi / 4, 0.0, 0.0, 0.0])
    measured = conv.read_odometry(helm.odometry[0])
    assert measured[2] == pytest.approx(math.pi / 4 + 0.1)
    assert 0.0 < abs(measured[0] - 5.0) < 5.0


def test_a_frequency_that_is_changed_later_goes_on_from_the_present_phase_each_time(bench: Any, helm: Any) -> None:
    bench.start(VesselSimNode, rate_hz=10.0, disturbance__periodic__frequency=1.0)
    phase = 0.0
    for step in range(1, 7):
        bench.until(lambda step=step: len(helm.disturbance) == step)
        assert read_disturbance(helm.disturbance[-1])[0] == pytest.approx(1100.0 * (1.0 + math.sin(phase)))
        frequency = (1.0, 1.0, 3.0, 3.0, 0.5, 0.5)[step - 1]
        assert bench.set_parameters("vessel_sim", disturbance__periodic__frequency=frequency).successful
        helm.command((step - 1) * 10**8)
        phase += 0.1 * frequency


def test_a_changed_disturbance_acts_from_the_next_step_on(bench: Any, helm: Any) -> None:
    bench.start(VesselSimNode)
    bench.until(lambda: len(helm.disturbance) == 1)
    changes = {"disturbance__periodic__surge_force": 5e3, "disturbance__periodic__frequency": 0.5}
    assert bench.set_parameters("vessel_sim", **changes).successful
    helm.command(0)
    bench.until(lambda: len(helm.disturbance) == 2)
    loads = [read_disturbance(m) for m in helm.disturbance]
    assert loads[0] == (1100.0, 2600.0, 95000.0)
    assert loads[1] == pytest.approx((5e3 * (1 + 0.5 * 0.01), 2600.0 * (1 + 0.5 * 0.01), 95e3 * (1 + 0.5 * 0.01)), rel=1e-4)


def test_changes_that_are_not_allowed_change_nothing(bench: Any, helm: Any) -> None:
    node = bench.start(VesselSimNode)
    changes = {"disturbance__periodic__surge_force": 5e3, "disturbance__current__east": 99.0}
    result = bench.set_parameters("vessel_sim", **changes)
    assert not result.successful
    assert "disturbance.current.east" in result.reason
    assert node.parameters.disturbance.periodic.surge_force == 1100.0
    assert not bench.set_parameters("vessel_sim", disturbance__waves__significant_height=2.0).successful


def test_frame_ids_of_the_plant_have_the_frame_prefix_of_the_vessel(bench: Any, helm: Any) -> None:
    bench.start(VesselSimNode, frame_prefix="alpha/")
    first = bench.until(lambda: helm.odometry and helm.odometry[0])
    assert (first.header.frame_id, first.child_frame_id) == ("alpha/odom", "alpha/base_link")


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        ("rate_hz", 0.0, r"vessel_sim\.rate_hz must be a finite number from 1 to 1000 Hz.*got 0\.0"),
        ("initial_pose", [1.0, math.nan, 0.0], r"initial_pose must be .*got \[1\.0, nan, 0\.0\]"),
        ("vessel__surge_inertia", -5.0, r"vessel\.surge_inertia must be .* kg \(got -5\.0\)"),
        ("ratehz", 3.0, "did you mean rate_hz"),
    ],
)
def test_bad_parameters_are_refused_at_the_start(bench: Any, name: str, value: Any, expected: str) -> None:
    with pytest.raises(ParameterError, match=expected):
        bench.start(VesselSimNode, **{name: value})
