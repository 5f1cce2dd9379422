"""The thrust-allocation node and the plant's node with thrusters, over DDS."""

import math
from typing import Any

import numpy as np
import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import WrenchStamped
from nav_msgs.msg import Odometry
from rclpy.qos import QoSProfile
from std_msgs.msg import Float64
from std_srvs.srv import Trigger
from thruster_layouts import LAYOUTS, layout

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ParameterError, SimulationError
from vessel_hsmc_ros.core.install_paths import share_directory
from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.controller import ControllerNode
from vessel_hsmc_ros.nodes.reference_ship import ReferenceShipNode
from vessel_hsmc_ros.nodes.thruster_allocation import ThrusterAllocationNode
from vessel_hsmc_ros.simulation.offline import load_scenario, simulate
from vessel_sim_node.node import VesselSimNode

NODES = {
    "vessel_sim": VesselSimNode,
    "reference_ship": ReferenceShipNode,
    "thruster_allocation": ThrusterAllocationNode,
    "controller": ControllerNode,
}
RATES = {f"{node}.rate_hz": 10.0 for node in NODES if node != "thruster_allocation"}
TOPICS_OF_EVERY_NODE = ("/diagnostics", "/parameter_events", "/rosout", "/events")
CASE2 = share_directory() / "config" / "thrusters" / "case2_thrusters.yaml"
RUDDER = {f"vessel.thrusters.{name}": value for name, value in LAYOUTS["rudder_and_bow_thruster"].items()}
STRONG_RUDDER = {
    **RUDDER,
    "vessel.thrusters.x": [-15.0, 12.0],
    "vessel.thrusters.thrust_ahead": [2e5, 1e4],
    "vessel.thrusters.thrust_astern": [1e5, 1e4],
    "vessel.thrusters.lift": [2e4],
    "vessel.thrusters.lift_quadratic": [1e4],
    "vessel.thrusters.slipstream": [1e-4],
    "vessel.thrusters.angle_rate": [0.1],
    "vessel.thrusters.lag": [0.3],
}


def run_nodes(bench: Any, scenario: Any) -> dict[str, list[Any]]:
    """The messages of a run of the nodes by topic, collected by a node that they wait for as their recorder."""
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
    bench.until(lambda: len(taken["/odom"]) == len(taken["/applied_wrench"]) == samples, deadline=40.0)
    return taken


@pytest.mark.parametrize(
    "thrusters",
    [{}, STRONG_RUDDER, {**STRONG_RUDDER, "vessel_sim.sensors.delay": 0.3}],
    ids=["two fixed", "rudder and bow thruster", "rudder and late odometry"],
)
def test_a_run_of_the_nodes_is_bit_identical_with_the_offline_run(bench: Any, thrusters: Any) -> None:
    scenario = load_scenario(CASE2, {"controller.law": "guided", "vessel_sim.duration": 5.0, **RATES, **thrusters})
    taken = run_nodes(bench, scenario)
    offline = simulate(scenario, interpreted=True)
    np.testing.assert_array_equal([conv.read_odometry(message) for message in taken["/odom"]], offline.measured)
    np.testing.assert_array_equal([conv.read_wrench(message) for message in taken["/applied_wrench"]], offline.wrench)
    sideways = max(abs(message.wrench.force.y) for message in taken["/applied_wrench"])
    assert (sideways > 0.0) == bool(thrusters)


def test_a_subscriber_that_knows_nothing_of_this_package_receives_thrusts(bench: Any) -> None:
    """As VRX subscribes: std_msgs/Float64 on thrusters/<name>/thrust, with a queue of its own depth."""
    thrust = {name: bench.collect(Float64, f"thrusters/{name}/thrust", QoSProfile(depth=10)) for name in ("left", "right")}
    bench.start(ThrusterAllocationNode, lockstep=False, **layout("twin"))
    commands = bench.publisher(WrenchStamped, "cmd_wrench", lockstep=False)
    command = conv.new_wrench()

    def answered() -> bool:
        conv.write_wrench(command, bench.probe.get_clock().now().to_msg(), (50.0, 15.8))
        commands.publish(command)
        return bool(thrust["left"] and thrust["right"])

    bench.until(answered)
    assert thrust["left"][0].data == pytest.approx(5.0)
    assert thrust["right"][0].data == pytest.approx(45.0)


def test_a_publisher_that_knows_nothing_of_this_package_drives_the_plant(bench: Any) -> None:
    odometry = bench.collect(Odometry, "odom", qos.STREAM)
    applied = bench.collect(WrenchStamped, "applied_wrench", qos.STREAM)
    values = {f"vessel__thrusters__{key}": value for key, value in LAYOUTS["twin"].items()}
    bench.start(VesselSimNode, lockstep=False, actuators__kind="thrusters", command_timeout=0.4, **values)
    publishers = [bench.probe.create_publisher(Float64, f"thrusters/{name}/thrust", 10) for name in ("left", "right")]

    def applies(force: float, moment: float) -> bool:
        publishers[0].publish(Float64(data=10.0))
        publishers[1].publish(Float64(data=30.0))
        latest = applied[-1].wrench if applied else None
        return latest is not None and (latest.force.x, latest.torque.z) == (pytest.approx(force), pytest.approx(moment))

    bench.until(lambda: applies(40.0, 20.0 * 0.395))
    assert odometry
    publishers[0].publish(Float64(data=math.nan))
    # A thruster whose demands cease gives no thrust; the other one goes on.
    bench.until(lambda: publishers[1].publish(Float64(data=30.0)) or applied[-1].wrench.force.x == 30.0)
    bench.until(lambda: applied[-1].wrench.force.x == 0.0)


def test_in_lockstep_a_publisher_of_thrusts_answers_each_step(bench: Any) -> None:
    odometry = bench.collect(Odometry, "odom")
    applied = bench.collect(WrenchStamped, "applied_wrench")
    publishers = [bench.publisher(Float64, f"thrusters/{name}/thrust") for name in ("left", "right")]
    values = {f"vessel__thrusters__{key}": value for key, value in LAYOUTS["twin"].items()}
    bench.start(VesselSimNode, actuators__kind="thrusters", **values)
    for step in range(3):
        bench.until(lambda step=step: len(odometry) == step + 1)
        publishers[0].publish(Float64(data=10.0 * step))
        bench.spin(0.1)
        assert len(odometry) == step + 1  # it waits for the other one
        publishers[1].publish(Float64(data=20.0))
    bench.until(lambda: len(odometry) == 4 and len(applied) == 3)
    assert [message.wrench.force.x for message in applied] == [20.0, 30.0, 40.0]


class Allocator:
    """The node in real time, with a publisher of commands and what it publishes."""

    def __init__(self, bench: Any, command_timeout: float = 60.0, **parameters: Any) -> None:
        self.bench = bench
        parameters["command_timeout"] = command_timeout
        self.thrust = bench.collect(Float64, "thrusters/left/thrust", qos.STREAM)
        self.wrench = bench.collect(WrenchStamped, "allocated_wrench", qos.STREAM)
        self.status = bench.collect(DiagnosticArray, "/diagnostics", qos.DIAGNOSTICS)
        self.node = bench.start(ThrusterAllocationNode, lockstep=False, **layout("twin"), **parameters)
        self.commands = bench.publisher(WrenchStamped, "cmd_wrench", lockstep=False)
        bench.until(lambda: self.commands.get_subscription_count() and self.node.connected)
        bench.until(lambda: all(out.get_subscription_count() for out, *_ in self.node._demands_out[:1]))
        self.stamp = self.node.now() - round(0.5 * command_timeout * 1e9)

    def command(self, force: float, moment: float = 0.0) -> None:
        """Command a wrench 0.1 s after the last one by its stamp."""
        self.stamp += 10**8
        message = conv.new_wrench()
        conv.write_wrench(message, conv.time_message(self.stamp), (force, moment))
        self.commands.publish(message)

    def value(self, key: str) -> str:
        latest = self.status[-1].status[0] if self.status else None
        return next((pair.value for pair in latest.values if pair.key == key), "") if latest else ""


def test_without_a_command_for_the_time_out_the_thrust_is_zero(bench: Any) -> None:
    allocator = Allocator(bench, command_timeout=0.2)
    allocator.command(50.0)
    bench.until(lambda: len(allocator.thrust) == 1)
    bench.until(lambda: len(allocator.thrust) == 2)
    assert [message.data for message in allocator.thrust] == [pytest.approx(25.0), 0.0]
    bench.until(
        lambda: any("no recent command on /cmd_wrench: the thrust is zero" in each.status[0].message for each in allocator.status)
    )


def test_each_time_that_commands_cease_the_thrust_becomes_zero(bench: Any) -> None:
    allocator = Allocator(bench, command_timeout=0.2)
    for number in (1, 2, 3):
        allocator.stamp = allocator.node.now() - 10**8
        allocator.command(50.0)
        bench.until(lambda number=number: len(allocator.thrust) == 2 * number)
    assert [message.data for message in allocator.thrust] == [pytest.approx(25.0), 0.0] * 3


def test_a_command_that_is_not_finite_is_ignored_and_counted(bench: Any) -> None:
    allocator = Allocator(bench)
    allocator.command(math.nan)
    allocator.command(50.0)
    bench.until(lambda: len(allocator.thrust) == 1)
    assert allocator.thrust[0].data == pytest.approx(25.0)
    bench.until(lambda: allocator.value("ignored_commands") == "1")


def test_a_speed_that_is_not_finite_leaves_the_rudder_with_the_last_one(bench: Any) -> None:
    wrench = bench.collect(WrenchStamped, "allocated_wrench", qos.STREAM)
    node = bench.start(ThrusterAllocationNode, lockstep=False, command_timeout=60.0, **STRONG_RUDDER)
    commands = bench.publisher(WrenchStamped, "cmd_wrench", lockstep=False)
    odom = bench.publisher(Odometry, "odom", lockstep=False)
    bench.until(lambda: commands.get_subscription_count() and odom.get_subscription_count() and node.connected)
    stamp = node.now() - 30 * 10**9

    def send(speed: float, force: float) -> None:
        nonlocal stamp
        stamp += 10**8
        measured, command, count = Odometry(), conv.new_wrench(), len(wrench)
        measured.twist.twist.linear.x = speed
        odom.publish(measured)
        conv.write_wrench(command, conv.time_message(stamp), (force, 2e4))
        commands.publish(command)
        bench.until(lambda: len(wrench) > count)

    for speed in (2.0, math.nan, math.nan, math.inf, math.nan):
        send(speed, 5e4)
    assert all(math.isfinite(each.wrench.torque.z) for each in wrench)


def test_commands_of_two_publishers_are_not_mixed_and_the_thrust_is_zero(bench: Any) -> None:
    allocator = Allocator(bench)
    allocator.command(50.0)
    bench.until(lambda: len(allocator.thrust) == 1)
    other = bench.publisher(WrenchStamped, "cmd_wrench", lockstep=False)
    bench.until(lambda: len(allocator.thrust) == 2)
    assert allocator.thrust[1].data == 0.0
    allocator.command(50.0)
    bench.until(lambda: allocator.value("ignored_commands") == "1")
    assert allocator.status[-1].status[0].level == DiagnosticStatus.ERROR
    bench.probe.destroy_publisher(other)
    bench.until(lambda: bench.probe.count_publishers("cmd_wrench") == 1)
    allocator.command(30.0)
    bench.until(lambda: len(allocator.thrust) == 3)
    assert allocator.thrust[-1].data == pytest.approx(15.0)


def test_a_wrench_out_of_reach_is_answered_by_the_nearest_and_reported(bench: Any) -> None:
    allocator = Allocator(bench)
    allocator.command(1e5, 20.0)
    bench.until(lambda: len(allocator.wrench) == 1)
    assert allocator.wrench[0].wrench.torque.z == pytest.approx(20.0)
    assert conv.nanoseconds(allocator.wrench[0].header.stamp) == allocator.stamp
    bench.until(lambda: allocator.value("saturated") == "True")
    assert allocator.status[-1].status[0].level == DiagnosticStatus.OK


def test_reset_sets_the_limits_of_rates_back_to_no_thrust(bench: Any) -> None:
    allocator = Allocator(bench, vessel__thrusters__thrust_rate=[100.0])
    for _ in range(3):
        allocator.command(100.0)
    bench.until(lambda: len(allocator.thrust) == 3)
    assert [message.data for message in allocator.thrust] == pytest.approx([0.0, 10.0, 20.0])
    bench.call(Trigger, "/thruster_allocation/reset", Trigger.Request())
    allocator.command(100.0)
    bench.until(lambda: len(allocator.thrust) == 4)
    assert allocator.thrust[-1].data == 0.0


def test_without_thrusters_the_node_does_not_start(bench: Any) -> None:
    with pytest.raises(ParameterError, match="name at least one thruster"):
        bench.start(ThrusterAllocationNode)


def test_in_lockstep_a_command_that_is_not_finite_ends_the_node(bench: Any) -> None:
    node = bench.start(ThrusterAllocationNode, **layout("twin"))
    message = conv.new_wrench()
    conv.write_wrench(message, conv.time_message(0), (math.inf, 0.0))
    with pytest.raises(SimulationError, match="commanded wrench"):
        node._on_command(message)


def test_shaft_speeds_are_published_where_the_thrust_coefficients_are_given(bench: Any) -> None:
    speeds = bench.collect(Float64, "thrusters/left/shaft_speed", qos.STREAM)
    coefficients: dict[str, Any] = {f"vessel__thrusters__thrust_coefficient_{way}": [0.01] for way in ("ahead", "astern")}
    allocator = Allocator(bench, **coefficients)
    allocator.command(50.0)
    bench.until(lambda: len(speeds) == 1)
    assert speeds[0].data == pytest.approx(50.0)


class Clocked(Allocator):
    """The same on simulated time, which begins at 10 s."""

    def __init__(self, bench: Any, time: Any, **parameters: Any) -> None:
        time.now = 10**10
        super().__init__(bench, use_sim_time=True, **parameters)
        self.time = time
        time.run(0.01)

    def answer(self, force: float) -> float:
        """The thrust of one of two propellers for a force that is commanded now."""
        self.stamp = self.time.now - 10**8
        self.command(force)
        # By the stamp: a time-out that the timer finds meanwhile publishes a thrust of zero, too.
        self.bench.until(lambda: self.wrench and conv.nanoseconds(self.wrench[-1].header.stamp) == self.stamp, deadline=10.0)
        return 0.5 * float(self.wrench[-1].wrench.force.x)


def test_after_a_time_out_the_rate_limit_counts_from_no_thrust(bench: Any, simulated_time: Any) -> None:
    allocator = Clocked(bench, simulated_time, command_timeout=0.2, vessel__thrusters__thrust_rate=[100.0])
    thrusts = []
    for _ in range(3):
        thrusts.append(allocator.answer(100.0))
        simulated_time.jump(10**8)
    simulated_time.jump(15 * 10**7)
    bench.until(lambda: len(allocator.thrust) == 4)
    thrusts += [allocator.thrust[-1].data, allocator.answer(100.0)]
    assert thrusts == pytest.approx([0.0, 10.0, 20.0, 0.0, 25.0]), "0.25 s after the command before, at 100 N/s"


def test_commands_of_a_clock_that_was_set_back_are_carried_out(bench: Any, simulated_time: Any) -> None:
    allocator = Clocked(bench, simulated_time, command_timeout=0.2)
    assert allocator.answer(30.0) == pytest.approx(15.0)
    simulated_time.jump(-5 * 10**9)
    assert allocator.answer(50.0) == pytest.approx(25.0)
