"""The PX4 node against an autopilot in plain rclpy: odometry, setpoints, and who takes over."""

import math
import time
from collections.abc import Callable
from typing import Any

import pytest
from definitions import module
from durations import rest_long
from geometry_msgs.msg import WrenchStamped
from nav_msgs.msg import Odometry
from std_srvs.srv import SetBool, Trigger
from vessel_hsmc_msgs.msg import ControlState

from vessel_hsmc_ros.messages import conversions as conv

if module("px4_msgs.msg") is None:
    pytest.skip("px4_msgs is not installed, and nothing is there to compile it", allow_module_level=True)

from px4_autopilot import BODY, MANUAL, OFFBOARD, Autopilot

from vessel_hsmc_ros.boats.px4 import Px4Node

STATE = (30.0, -4.0, 2.5, 1.2, -0.3, 0.1)
LIMITS = {"surge_force_limit": 200.0, "yaw_moment_limit": 50.0}
DRIVEN = pytest.approx((0.5, 0.2, OFFBOARD))
ZERO = (0.0, 0.0, OFFBOARD)
PERIOD = 20_000_000
"""Of the messages of the controller, ns."""


class Boat:
    """An autopilot, a controller's topics and its service, beside the node under test."""

    def __init__(self, bench: Any, **parameters: Any) -> None:
        self.bench = bench
        self.odometry = bench.collect(Odometry, "odom")
        self.states = bench.publisher(ControlState, "controller/state", lockstep=False)
        self.wrenches = bench.publisher(WrenchStamped, "cmd_wrench", lockstep=False)
        self.operation, self.obeys, self.published = ControlState.STANDBY, True, 0
        bench.probe.create_service(SetBool, "controller/enable", self.enable)
        self.autopilot = Autopilot(bench.probe)
        given = {"ramp_time": 0.0, "command_timeout": 0.3, "rate_hz": 50.0, **LIMITS, **parameters}
        self.node = bench.start(Px4Node, lockstep=False, **given)
        bench.until(lambda: self.node.connected and self.states.get_subscription_count())

    def enable(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        if self.obeys:
            self.operation = ControlState.ACTIVE if request.data else ControlState.STANDBY
        return response

    def until(self, condition: Callable[[], Any], force: float | None = None) -> None:
        """Let all of them work until a condition holds; with a force the controller commands it and -10 N·m."""

        def there() -> Any:
            self.autopilot.report(STATE)
            self.autopilot.thrusts()
            if self.node.now() - self.published > PERIOD:
                self.published = self.node.now()
                state = conv.new_control_state()
                state.operation = self.operation
                self.states.publish(state)
                if force is not None and self.operation == ControlState.ACTIVE:
                    message = conv.new_wrench()
                    conv.write_wrench(message, self.bench.probe.get_clock().now().to_msg(), (force, -10.0))
                    self.wrenches.publish(message)
            return condition()

        self.bench.until(there, 20.0)

    @property
    def latest(self) -> Any:
        return self.autopilot.setpoints[-1] if self.autopilot.setpoints else None

    @property
    def waits(self) -> str:
        return str(next(c for c in self.node.diagnostic_tasks() if c.name == "autopilot").message)

    def driven(self) -> "Boat":
        """The same once it carries out a wrench."""
        self.until(lambda: self.autopilot.select_offboard() and self.waits == "ready")
        self.operation = ControlState.ACTIVE
        self.until(lambda: self.latest == DRIVEN, 100.0)
        return self


@pytest.mark.parametrize("frame", [1, BODY])
def test_the_estimate_becomes_odometry_with_the_time_of_this_computer(bench: Any, frame: int) -> None:
    made = Boat(bench)
    made.autopilot.velocity_frame = frame
    made.until(lambda: len(made.odometry) > 3)
    assert conv.read_odometry(made.odometry[-1]) == pytest.approx(STATE, abs=1e-5)
    assert (made.odometry[-1].header.frame_id, made.odometry[-1].child_frame_id) == ("odom", "base_link")
    age = made.node.now() - conv.nanoseconds(made.odometry[-1].header.stamp)
    assert abs(age) < 2e9, "the autopilot counts from its start"


def test_offboard_is_prepared_and_gets_setpoints_for_as_long_as_it_lasts(bench: Any) -> None:
    made = Boat(bench)
    made.until(lambda: made.autopilot.controls > 5)
    flags = {"position", "velocity", "acceleration", "attitude", "body_rate", "thrust_and_torque", "direct_actuator"}
    assert {name for name in flags if getattr(made.autopilot.control, name)} == {"thrust_and_torque"}
    assert not made.autopilot.setpoints, "they would compete with those of other modes"
    made.until(made.autopilot.select_offboard)
    made.until(lambda: made.latest == ZERO)
    made.driven()
    made.until(lambda: made.latest == ZERO)  # without further commands
    count = len(made.autopilot.setpoints)
    made.until(lambda: len(made.autopilot.setpoints) > count + 3)
    assert set(made.autopilot.setpoints[count:]) == {ZERO}, "PX4 would keep the last one"


TAKEOVERS: dict[str, tuple[Callable[[Autopilot], Any], str]] = {
    "mode": (lambda a: a.change(mode=MANUAL), "mode MANUAL, commands need OFFBOARD"),
    "disarmed": (lambda a: a.change(armed=False), "the autopilot is disarmed"),
    "failsafe": (lambda a: a.change(failsafe=True), "the autopilot reports a failsafe"),
    "silence": (lambda a: setattr(a, "silent", True), "no heartbeat of the autopilot for 3 s"),
    "restart": (lambda a: setattr(a, "began", a.began + 90.0), "the autopilot has been restarted"),
}


@pytest.mark.parametrize("kind", rest_long(TAKEOVERS, 3))
def test_a_takeover_is_zero_for_good(bench: Any, kind: str) -> None:
    act, text = TAKEOVERS[kind]
    made = Boat(bench).driven()
    made.obeys = False  # a controller that does not go to standby
    act(made.autopilot)
    made.until(lambda: text in made.waits, 100.0)
    made.autopilot.silent = False
    made.autopilot.change(mode=OFFBOARD, armed=True, failsafe=False)
    made.until(lambda: made.latest == ZERO, 100.0)
    count = len(made.autopilot.setpoints)
    made.until(lambda: len(made.autopilot.setpoints) > count + 10, 100.0)
    assert set(made.autopilot.setpoints[count:]) == {ZERO}, "it does not come back by itself"
    made.obeys = True
    made.until(lambda: made.operation == ControlState.STANDBY, 100.0)
    made.driven()  # a person enables it again


def test_a_stop_is_zero_until_it_is_rearmed_and_so_is_the_end(bench: Any) -> None:
    made = Boat(bench).driven()
    assert bench.call(Trigger, "/px4/stop", Trigger.Request()).success
    made.until(lambda: made.latest == ZERO, 100.0)
    assert made.node.status()[1].startswith("stopped")
    assert bench.call(Trigger, "/px4/rearm", Trigger.Request()).success
    made.operation = ControlState.STANDBY
    made.until(lambda: made.latest == ZERO)
    made.driven()
    made.node.close()
    made.until(lambda: made.latest == ZERO)


def test_a_process_that_dies_ends_offboard(bench: Any) -> None:
    made = Boat(bench).driven()
    bench.stop(made.node)
    end = time.monotonic() + 20.0
    while made.autopilot.mode == OFFBOARD and time.monotonic() < end:
        bench.serve(wait=0.05)
        made.autopilot.thrusts()
    assert made.autopilot.mode == MANUAL


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"position": [math.nan, 0.0, 0.0]}, "position not finite"),
        ({"q": [0.0] * 4}, "q is not filled in"),
        ({"pose_frame": 0}, "frames must be 1 or 2 (pose), and the same or 3 (velocity) (got 0 and 1)"),
        ({"velocity_frame": 2}, "frames must be 1 or 2 (pose), and the same or 3 (velocity) (got 1 and 2)"),
    ],
)
def test_an_estimate_without_a_motion_is_named_and_not_published(bench: Any, changes: dict[str, Any], text: str) -> None:
    made = Boat(bench)
    message = made.autopilot.msg.VehicleOdometry(pose_frame=1, velocity_frame=1, q=[1.0, 0.0, 0.0, 0.0])
    for name, value in changes.items():
        setattr(message, name, value)

    def named() -> bool:
        made.autopilot.odometry_out.publish(message)
        return f"no odometry: VehicleOdometry: {text}" in made.node.status()[1]

    bench.until(named, 20.0)
    assert not made.odometry


def test_what_is_awaited_is_named(bench: Any) -> None:
    node = bench.start(Px4Node, lockstep=False)
    assert node.status()[1] == "waiting for /fmu/out/vehicle_status"
    assert node.diagnostic_tasks()[1].message == "no autopilot heard"
