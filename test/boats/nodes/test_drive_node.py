"""The forms of command: values and limits, the time-out with its ramp, the stop, and zero at the end."""

import math
from collections.abc import Mapping
from typing import Any

import pytest
from durations import rest_long
from geometry_msgs.msg import Twist, TwistStamped, WrenchStamped
from rclpy.qos import qos_profile_sensor_data
from std_msgs.msg import Float64, UInt16
from std_srvs.srv import Trigger
from vessel_hsmc_msgs.msg import ControlState

from vessel_hsmc_ros.boats.drive import DriveNode
from vessel_hsmc_ros.messages import conversions as conv

LIMITS = {"surge_force_limit": 200.0, "yaw_moment_limit": 50.0}
RAMP, RATE = 0.2, 100.0


class Stack:
    """Commands the drive node in place of a controller, and reads its output, best effort, in place of a stack."""

    def __init__(self, bench: Any, form: str, **parameters: Any) -> None:
        self.bench, self.form = bench, form
        given = {"ramp_time": RAMP, "rate_hz": RATE, "command_timeout": 0.3, **LIMITS, **parameters}
        twist = Twist if parameters.get("stamped") is False else TwistStamped
        kinds = {
            "normalised": {"normalised_wrench": WrenchStamped},
            "cmd_vel": {"cmd_vel": twist},
            "helm": {"throttle": Float64, "steering": Float64},
        }[form]
        self.received = {name: bench.collect(kind, name, qos_profile_sensor_data) for name, kind in kinds.items()}
        self.commands = bench.publisher(WrenchStamped, "cmd_wrench", lockstep=False)
        self.states = bench.publisher(ControlState, "controller/state", lockstep=False)
        self.node = bench.start(DriveNode, lockstep=False, form=form, **given)
        bench.until(lambda: self.node.connected and self.commands.get_subscription_count())
        bench.until(lambda: form != "cmd_vel" or self.states.get_subscription_count())
        bench.until(lambda: all(bench.probe.count_publishers(name) for name in kinds))

    def send(self, force: float, moment: float, **state: float) -> None:
        stamp = self.bench.probe.get_clock().now().to_msg()
        message = conv.new_control_state()
        message.header.stamp = stamp
        for name, value in state.items():
            setattr(message, name, value)
        self.states.publish(message)
        wrench = conv.new_wrench()
        conv.write_wrench(wrench, stamp, (force, moment))
        self.commands.publish(wrench)

    def values(self) -> list[tuple[float, float]]:
        """The output so far, as pairs."""
        if self.form == "helm":
            return [(a.data, b.data) for a, b in zip(*self.received.values(), strict=False)]
        (messages,) = self.received.values()
        if self.form == "normalised":
            return [conv.read_wrench(m) for m in messages]
        return [(t.linear.x, t.angular.z) for t in (getattr(m, "twist", m) for m in messages)]

    def until(self, pair: tuple[float, float], *command: float, **state: float) -> None:
        """Repeat a command until the output has some values."""

        def there() -> bool:
            self.send(*command, **state)
            return self.values()[-1:] == [pytest.approx(pair)]

        self.bench.until(there)


GUIDANCE = {"commanded_surge_velocity": 1.5, "commanded_yaw_rate": -0.2, "surge_surface": 0.0, "yaw_surface": -0.01}
"""Of a ship at 1.5 m/s and -0.21 rad/s."""


@pytest.mark.parametrize(
    ("form", "parameters", "command", "expected"),
    [
        ("normalised", {}, (100.0, -25.0), (0.5, -0.5)),
        ("normalised", {}, (1e4, -1e4), (1.0, -1.0)),
        ("normalised", {"steering_sign": -1.0}, (100.0, -25.0), (0.5, 0.5)),
        ("helm", {"steering_sign": -1.0}, (-50.0, 10.0), (-0.25, -0.2)),
        ("cmd_vel", {}, (1.0, 1.0), (1.5, -0.2)),
        ("cmd_vel", {"response_time": 0.5, "surge_inertia": 100.0, "yaw_inertia": 50.0}, (100.0, 10.0), (2.0, -0.11)),
        ("cmd_vel", {"stamped": False, "surge_speed_limit": 1.0, "yaw_rate_limit": 0.1}, (1.0, 1.0), (1.0, -0.1)),
    ],
)
def test_a_command_arrives_in_the_units_and_within_the_limits_of_its_form(
    bench: Any, form: str, parameters: dict[str, Any], command: tuple[float, float], expected: tuple[float, float]
) -> None:
    stack = Stack(bench, form, **parameters)
    stack.until(expected, *command, operation=ControlState.ACTIVE, **GUIDANCE)
    changes = [abs(b[0] - a[0]) for a, b in zip(stack.values(), stack.values()[1:], strict=False)]
    assert max(changes) < abs(expected[0]), "the output begins with a ramp"


@pytest.mark.parametrize("form", rest_long(["normalised", "helm", "cmd_vel"], 2))
def test_without_commands_the_output_ramps_to_zero_and_then_ends(bench: Any, form: str) -> None:
    stack = Stack(bench, form)
    full = (1.5, -0.2) if form == "cmd_vel" else (1.0, 1.0)
    stack.until(full, 200.0, 50.0, operation=ControlState.ACTIVE, **GUIDANCE)
    begun = len(stack.values())
    bench.until(lambda: stack.values()[-3:] == [(0.0, 0.0)] * 3)
    ramp = [abs(value[0]) for value in stack.values()[begun:]]
    assert ramp == sorted(ramp, reverse=True)
    assert any(0.0 < value < abs(full[0]) for value in ramp)
    bench.spin(0.1)
    count = len(stack.values())
    bench.spin(0.1)
    assert len(stack.values()) == count, "the topic is left to others"


def test_with_cmd_vel_the_output_is_zero_while_the_law_does_not_command(bench: Any) -> None:
    stack = Stack(bench, "cmd_vel", command_timeout=10.0)  # commands stay fresh on a busy machine too
    stack.until((1.5, -0.2), 1.0, 1.0, operation=ControlState.ACTIVE, **GUIDANCE)
    stack.until((0.0, 0.0), 1.0, 1.0, operation=ControlState.SAFE, **GUIDANCE)


def test_a_law_without_commanded_velocities_is_named(bench: Any) -> None:
    stack = Stack(bench, "cmd_vel")

    def named() -> bool:
        stack.send(1.0, 1.0, operation=ControlState.ACTIVE, commanded_surge_velocity=math.nan, commanded_yaw_rate=0.0)
        return "use one that does, such as guided" in stack.node.status()[1]

    bench.until(named)
    assert all(value == (0.0, 0.0) for value in stack.values())


def test_a_stop_is_zero_at_once_until_it_is_rearmed(bench: Any) -> None:
    stack = Stack(bench, "helm")
    stack.until((1.0, 1.0), 200.0, 50.0)
    assert bench.call(Trigger, "/drive/stop", Trigger.Request()).success
    bench.until(lambda: stack.values()[-1] == (0.0, 0.0))
    stopped = len(stack.values())
    for _ in range(10):
        stack.send(200.0, 50.0)
        bench.spin(0.02)
    assert set(stack.values()[stopped:]) == {(0.0, 0.0)}
    assert bench.call(Trigger, "/drive/rearm", Trigger.Request()).success
    stack.until((1.0, 1.0), 200.0, 50.0)


class Pulses:
    """Commands thrusts in place of the allocation, and reads pulse widths in place of speed controllers."""

    NAMES = ("port", "starboard")

    def __init__(self, bench: Any, remaps: Mapping[str, str] | None = None, /, **pwm: Any) -> None:
        self.bench = bench
        topics = [f"thrusters/{name}" for name in self.NAMES]
        self.received = [bench.collect(UInt16, f"{topic}/pwm", qos_profile_sensor_data) for topic in topics]
        self.thrusts = [(remaps or {}).get(f"{topic}/thrust", f"{topic}/thrust") for topic in topics]
        self.commands = [bench.publisher(Float64, topic, lockstep=False) for topic in self.thrusts]
        given = {"ramp_time": RAMP, "rate_hz": RATE, "command_timeout": 0.3, **{f"pwm.{name}": v for name, v in pwm.items()}}
        self.node = bench.start(DriveNode, lockstep=False, remaps=remaps, form="pwm", **given)
        bench.until(lambda: self.node.connected and all(each.get_subscription_count() for each in self.commands))

    def values(self) -> list[tuple[int, int]]:
        return [(a.data, b.data) for a, b in zip(*self.received, strict=False)]

    def until(self, pulses: tuple[int, int], thrusts: tuple[float, float]) -> None:
        def there() -> bool:
            for publisher, thrust in zip(self.commands, thrusts, strict=True):
                publisher.publish(Float64(data=thrust))
            return self.values()[-1:] == [pulses]

        self.bench.until(there)


def test_thrusts_become_pulse_widths_by_the_measured_curve_and_end_at_neutral(bench: Any) -> None:
    curve = {"curve_pulses": [1100.0, 1300.0, 1700.0, 1900.0], "curve_thrusts": [-40.0, -10.0, 12.0, 50.0]}
    stack = Pulses(bench, deadband=30.0, reversed=[1.0, -1.0], **curve)
    stack.until((1800, 1700), (31.0, -10.0))
    stack.until((1900, 1100), (1e6, 1e6))
    begun = len(stack.values())
    bench.until(lambda: stack.values()[-3:] == [(1500, 1500)] * 3)
    ramp = [port for port, _ in stack.values()[begun:]]
    assert ramp == sorted(ramp, reverse=True)
    assert any(1530 < port < 1900 for port in ramp)
    assert not any(1500 < port < 1530 for port in ramp), "within the deadband"


def test_pulse_widths_are_neutral_after_a_stop_and_without_the_thrust_of_one_thruster(bench: Any) -> None:
    stack = Pulses(bench)
    stack.until((1900, 1900), (50.0, 50.0))
    assert bench.call(Trigger, "/drive/stop", Trigger.Request()).success
    bench.until(lambda: stack.values()[-1] == (1500, 1500))
    assert bench.call(Trigger, "/drive/rearm", Trigger.Request()).success
    stack.until((1900, 1900), (50.0, 50.0))

    def one_alone() -> bool:
        stack.commands[0].publish(Float64(data=50.0))
        stack.commands[1].publish(Float64(data=math.nan))
        return stack.values()[-1] == (1500, 1500)

    bench.until(one_alone)
    assert stack.node.diagnostic_tasks()[1].values["refused"] > 0


@pytest.mark.parametrize("remaps", [{}, {"thrusters/port/thrust": "wamv/left/thrust"}])
def test_thrusts_of_two_publishers_are_not_mixed_also_under_another_name(bench: Any, remaps: dict[str, str]) -> None:
    stack = Pulses(bench, remaps)
    stack.until((1900, 1900), (50.0, 50.0))
    bench.publisher(Float64, stack.thrusts[0], lockstep=False)
    stack.until((1500, 1500), (50.0, 50.0))
    assert f"/{stack.thrusts[0]} has 2 publishers" in stack.node.diagnostic_tasks()[1].message


def test_the_last_command_at_the_end_is_zero(bench: Any) -> None:
    stack = Stack(bench, "normalised")
    stack.until((1.0, 1.0), 200.0, 50.0)
    stack.node.close()
    bench.until(lambda: stack.values()[-1] == (0.0, 0.0))
