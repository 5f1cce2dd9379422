"""The thrust allocation and a plant with thrusters in lockstep, where commands are missing and the run goes on."""

import math
from typing import Any

import numpy as np
import pytest
from geometry_msgs.msg import WrenchStamped
from nav_msgs.msg import Odometry
from std_msgs.msg import Float64
from thruster_layouts import layout

from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes.commands import nothing
from vessel_hsmc_ros.nodes.thruster_allocation import ThrusterAllocationNode
from vessel_sim_node.node import VesselSimNode


class Steps:
    """The node in lockstep, which rides through missing commands, and the demands that it publishes."""

    def __init__(self, bench: Any, **parameters: Any) -> None:
        self.bench = bench
        self.thrust = bench.collect(Float64, "thrusters/left/thrust")
        bench.collect(Float64, "thrusters/right/thrust")
        self.commands = bench.publisher(WrenchStamped, "cmd_wrench")
        bench.publisher(Odometry, "odom")  # the node waits for a plant
        node = bench.start(ThrusterAllocationNode, ride_through=True, command_timeout=0.3, **layout("twin"), **parameters)
        bench.until(lambda: node.connected and self.commands.get_subscription_count())

    def answer(self, step: int, force: float | None) -> float:
        """The demand that answers a step of 0.1 s: to a command, or to the message that there is none."""
        stamp, count = step * 10**8, len(self.thrust)
        self.publish(stamp, force)
        self.bench.until(lambda: len(self.thrust) == count + 1)
        return float(self.thrust[-1].data)

    def publish(self, stamp: int, force: float | None) -> None:
        message = nothing(stamp) if force is None else conv.new_wrench()
        if force is not None:
            conv.write_wrench(message, conv.time_message(stamp), (force, 0.0))
        self.commands.publish(message)


def test_in_lockstep_a_missing_command_is_passed_on_until_the_timeout_then_the_thrust_is_zero(bench: Any) -> None:
    steps = Steps(bench)
    assert steps.answer(0, 50.0) == pytest.approx(25.0)
    answers = [steps.answer(step, None) for step in range(1, 6)]
    assert [math.isnan(answer) for answer in answers] == [True, True, True, False, False]
    assert answers[3:] == [0.0, 0.0]
    assert steps.answer(6, 40.0) == pytest.approx(20.0)


def test_in_lockstep_the_thrust_rises_from_zero_after_a_time_out_and_again(bench: Any) -> None:
    steps = Steps(bench, vessel__thrusters__thrust_rate=[50.0])
    for begin in (0, 20):
        rise = [steps.answer(begin + step, 200.0) for step in range(4)]
        assert rise[1:] == pytest.approx([rise[0] + 5.0, rise[0] + 10.0, rise[0] + 15.0])
        assert [steps.answer(begin + step, None) for step in range(4, 9)][3:] == [0.0, 0.0]
        assert steps.answer(begin + 9, 200.0) == pytest.approx(30.0), "of the 0.6 s since the last command"
        assert [steps.answer(begin + step, None) for step in range(10, 15)][3:] == [0.0, 0.0]


def test_in_lockstep_a_delayed_command_is_allocated_in_the_step_in_which_it_comes(bench: Any) -> None:
    steps = Steps(bench)
    steps.answer(0, 50.0)
    assert math.isnan(steps.answer(1, None))
    steps.publish(10**8, 30.0)
    steps.publish(40 * 10**8, 70.0)  # far ahead by its stamp: refused
    assert steps.answer(2, None) == pytest.approx(15.0)


def test_in_lockstep_the_plant_holds_demands_that_are_missing_until_the_timeout(bench: Any) -> None:
    odometry = bench.collect(Odometry, "odom")
    applied = bench.collect(WrenchStamped, "applied_wrench")
    publishers = [bench.publisher(Float64, f"thrusters/{name}/thrust") for name in ("left", "right")]
    values = {"rate_hz": 10.0, "command_timeout": 0.3, "ride_through": True, **layout("twin")}
    bench.start(VesselSimNode, actuators__kind="thrusters", **values)
    for step in range(6):
        bench.until(lambda step=step: len(odometry) == step + 1)
        publishers[0].publish(Float64(data=math.nan if step else 10.0))
        publishers[1].publish(Float64(data=20.0))
    bench.until(lambda: len(applied) == 6)
    assert [message.wrench.force.x for message in applied] == [30.0, 30.0, 30.0, 30.0, 20.0, 20.0]


def test_in_lockstep_a_rudder_is_turned_for_the_last_speed_while_odometry_is_missing(bench: Any) -> None:
    """The rudder of a ship at speed needs a small angle; for a ship at rest it would be turned to its limit."""
    angles = bench.collect(Float64, "thrusters/screw/angle")
    bench.collect(Float64, "thrusters/screw/thrust")
    commands, odometry = bench.publisher(WrenchStamped, "cmd_wrench"), bench.publisher(Odometry, "odom")
    node = bench.start(ThrusterAllocationNode, ride_through=True, command_timeout=0.3, **layout("rudder"))
    bench.until(lambda: node.connected and commands.get_subscription_count() and odometry.get_subscription_count())
    command, ship = conv.new_wrench(), conv.new_odometry()
    for step, speed in enumerate([5.0, math.nan, 5.0, math.nan, math.nan]):
        stamp = conv.time_message(step * 10**8)
        conv.write_wrench(command, stamp, (0.0, 400.0))
        conv.write_odometry(ship, stamp, np.array([0.0, 0.0, 0.0, speed, 0.0, 0.0]))
        odometry.publish(ship)
        commands.publish(command)
        bench.until(lambda step=step: len(angles) == step + 1)
    assert [message.data for message in angles] == [angles[0].data] * 5
    assert 0.0 < abs(angles[0].data) < 0.5


def test_in_lockstep_angles_hold_while_commands_are_missing_also_after_the_timeout(bench: Any) -> None:
    thrusts, angles = (bench.collect(Float64, f"thrusters/screw/{part}") for part in ("thrust", "angle"))
    commands, odometry = bench.publisher(WrenchStamped, "cmd_wrench"), bench.publisher(Odometry, "odom")
    node = bench.start(ThrusterAllocationNode, ride_through=True, command_timeout=0.3, **layout("rudder"))
    bench.until(lambda: node.connected and commands.get_subscription_count() and odometry.get_subscription_count())
    command, ship = conv.new_wrench(), conv.new_odometry()
    conv.write_wrench(command, conv.time_message(0), (100.0, 400.0))
    for step in range(6):
        conv.write_odometry(ship, conv.time_message(step * 10**8), np.array([0.0, 0.0, 0.0, 5.0, 0.0, 0.0]))
        odometry.publish(ship)
        commands.publish(nothing(step * 10**8) if step else command)
        bench.until(lambda step=step: len(angles) == len(thrusts) == step + 1)
    assert [math.isnan(message.data) for message in angles] == [False, *[True] * 5]
    assert [message.data for message in thrusts[4:]] == [0.0, 0.0]
