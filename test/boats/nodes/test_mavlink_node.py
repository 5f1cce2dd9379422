"""The MAVLink node against an autopilot in plain pymavlink: odometry, the forms of command, and who takes over."""

import math
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from durations import rest_long
from geometry_msgs.msg import TwistStamped, WrenchStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import NavSatFix
from sockets import free_port
from std_msgs.msg import Float64
from std_srvs.srv import SetBool, Trigger
from vessel_hsmc_msgs.msg import ControlState

from vessel_hsmc_ros.boats.parameters import MavlinkParameters
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.messages import conversions as conv

pytest.importorskip("pymavlink", exc_type=ImportError)

from mavlink_autopilot import GUIDED, HOLD, ORIGIN, Autopilot

from vessel_hsmc_ros.boats.mavlink import MavlinkNode
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.base import LAST_COMMANDS

STATE = (30.0, -4.0, 2.5, 1.2, -0.3, 0.1)
PERIOD = 20_000_000
"""Of the messages of the controller, ns."""

CALLBACKS = 6
"""Callbacks that a turn of all may make ready: on a busy machine those that are not served would wait longer in each turn."""

LIMITS = {"surge_force_limit": 200.0, "yaw_moment_limit": 50.0}
THRUSTERS = {
    "vessel__thrusters__names": ["left", "right"],
    "vessel__thrusters__y": [0.5, -0.5],
    "vessel__thrusters__thrust_ahead": [100.0],
    "vessel__thrusters__thrust_astern": [50.0],
}


class Boat:
    """An autopilot, a controller's topics and its service, beside the node under test."""

    def __init__(self, bench: Any, **parameters: Any) -> None:
        port = free_port()
        self.bench = bench
        given = {"ramp_time": 0.0, "command_timeout": 0.3, **LIMITS, **parameters}
        self.odometry = bench.collect(Odometry, "odom")
        self.applied = bench.collect(WrenchStamped, "applied_wrench")
        self.states = bench.publisher(ControlState, "controller/state", lockstep=False)
        self.wrenches = bench.publisher(WrenchStamped, "cmd_wrench", lockstep=False)
        self.twists = bench.publisher(TwistStamped, "cmd_vel", lockstep=False)
        self.thrusts = [bench.publisher(Float64, f"thrusters/{side}/thrust", lockstep=False) for side in ("left", "right")]
        self.operation, self.obeys, self.published = ControlState.STANDBY, True, 0
        bench.probe.create_service(SetBool, "controller/enable", self.enable)
        self.node = bench.start(MavlinkNode, lockstep=False, connection=f"udpin:127.0.0.1:{port}", **given)
        self.autopilot = Autopilot(f"udpout:127.0.0.1:{port}")
        bench.until(lambda: self.node.connected and self.states.get_subscription_count())

    def enable(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        if self.obeys:
            self.operation = ControlState.ACTIVE if request.data else ControlState.STANDBY
        return response

    def step(self, command: Callable[[], None] | None = None) -> None:
        """A turn of all: the autopilot, the controller with a command while it is enabled, and the node."""
        self.autopilot.receive()
        self.autopilot.step(STATE[3], -STATE[5])
        self.autopilot.report(STATE)
        if self.node.now() - self.published > PERIOD:
            self.published = self.node.now()
            state = conv.new_control_state()
            state.operation = self.operation
            self.states.publish(state)
            if command and self.operation == ControlState.ACTIVE:
                command()
        self.bench.serve(wait=0.005)
        self.bench.serve(CALLBACKS)

    def until(self, condition: Callable[[], Any], command: Callable[[], None] | None = None) -> None:
        def there() -> Any:
            self.step(command)
            return condition()

        self.bench.until(there, 20.0)

    def wrench(self, force: float = 100.0, moment: float = -10.0) -> None:
        message = conv.new_wrench()
        conv.write_wrench(message, self.bench.probe.get_clock().now().to_msg(), (force, moment))
        self.wrenches.publish(message)

    def velocity(self) -> None:
        message = TwistStamped()
        message.twist.linear.x, message.twist.angular.z = 1.0, 0.2
        self.twists.publish(message)

    def thrust(self) -> None:
        for side, value in zip(self.thrusts, (50.0, -50.0), strict=True):
            side.publish(Float64(data=value))

    def all(self, kind: str) -> list[Any]:
        return [m for m in self.autopilot.heard if m.get_type() == kind]

    def diagnostic_task(self, name: str) -> Any:
        return next(c for c in self.node.diagnostic_tasks() if c.name == name)

    def driven(self) -> "Boat":
        """The same once it carries out a wrench."""
        self.until(lambda: self.odometry and self.diagnostic_task("autopilot").message == "ready")
        self.operation = ControlState.ACTIVE
        self.until(lambda: self.autopilot.servos == {1: 1780, 3: 1620}, self.wrench)
        return self


@pytest.fixture
def boat(bench: Any) -> Iterator[Callable[..., Boat]]:
    made: list[Boat] = []

    def make(**parameters: Any) -> Boat:
        made.append(Boat(bench, **parameters))
        return made[-1]

    yield make
    for each in made:
        each.autopilot.close()


def test_position_and_attitude_become_odometry_and_outputs_the_applied_wrench(boat: Any) -> None:
    made = boat()
    made.autopilot.radio |= {1: 1600, 3: 1700}  # the pilot drives
    made.until(lambda: len(made.odometry) > 3 and made.applied and "origin_latitude" in made.node.status()[2])
    found = conv.read_odometry(made.odometry[-1])
    assert found == pytest.approx(STATE, abs=0.02), "the heading is extrapolated to the time of the position"
    assert (found.x, found.y, found.r) == pytest.approx((30.0, -4.0, 0.1))
    assert (made.odometry[-1].header.frame_id, made.odometry[-1].child_frame_id) == ("odom", "base_link")
    assert made.node.status()[2]["origin_latitude"] == pytest.approx(ORIGIN[0] * 1e-7)
    stated = made.bench.collect(NavSatFix, "odom/datum", qos.LATCHED)
    made.until(lambda: stated)
    assert (stated[0].latitude, stated[0].longitude) == pytest.approx((ORIGIN[0] * 1e-7, ORIGIN[1] * 1e-7))
    made.until(lambda: conv.read_wrench(made.applied[-1]) == pytest.approx((100.0, -12.5)))
    assert not made.all("MANUAL_CONTROL"), "in standby nothing is sent"
    made.autopilot.filter = 0
    made.until(lambda: "no odometry: the filter has no attitude" in made.node.status()[1])


@pytest.mark.parametrize(
    ("form", "parameters", "servos"),
    [("manual", {}, {1: 1780, 3: 1620}), ("channels", THRUSTERS, {1: 1700, 3: 1100})],
)
def test_a_command_reaches_the_thrusters_and_its_time_out_gives_the_channels_back(
    boat: Any, form: str, parameters: dict[str, Any], servos: dict[int, int]
) -> None:
    made = boat(form=form, **parameters)
    made.autopilot.passed_through = (1, 3) if form == "channels" else ()
    made.until(lambda: made.diagnostic_task("autopilot").message == "ready")
    made.operation = ControlState.ACTIVE
    made.until(lambda: made.autopilot.servos == servos, made.wrench if form == "manual" else made.thrust)
    made.until(lambda: not made.autopilot.overrides)  # without further commands
    made.until(lambda: made.autopilot.servos == {1: 1500, 3: 1500})


def test_guided_takes_speed_and_yaw_rate(boat: Any) -> None:
    made = boat(form="guided", cruise_speed=4.0)
    made.autopilot.mode = GUIDED
    made.until(lambda: made.diagnostic_task("autopilot").message == "ready")
    made.operation = ControlState.ACTIVE
    made.until(lambda: made.autopilot.guided[1:] == pytest.approx((0.25, -0.2)), made.velocity)
    made.autopilot.change(mode=HOLD)
    made.until(lambda: made.operation == ControlState.STANDBY, made.velocity)
    made.step(made.velocity)  # in which the autopilot receives what was sent before
    assert made.autopilot.guided[1:] == (0.0, 0.0)


TAKEOVERS: dict[str, tuple[Callable[[Autopilot], Any], str]] = {
    "mode": (lambda a: a.change(mode=HOLD), "mode HOLD, commands need MANUAL"),
    "disarmed": (lambda a: a.change(armed=False), "the autopilot is disarmed"),
    "silence": (lambda a: setattr(a, "silent", True), "no heartbeat of the autopilot for 0.5 s"),
    "overrides off": (lambda a: setattr(a, "override", lambda *_: a.overrides.clear()), "channel 3 of the radio is at 1500 µs"),
    "restart": (lambda a: setattr(a, "began", a.began + 90.0), "the autopilot has been restarted"),
}


@pytest.mark.parametrize("kind", rest_long(TAKEOVERS, 2))
def test_a_takeover_ends_the_commands_for_good(boat: Any, kind: str) -> None:
    act, text = TAKEOVERS[kind]
    # In place of heartbeats of 1 Hz, so that silence is noticed soon.
    made = boat(heartbeat_timeout=0.5)
    made.autopilot.intervals[0] = 0.1
    made.driven()
    made.obeys = False  # a controller that does not go to standby
    act(made.autopilot)
    made.until(lambda: text in made.diagnostic_task("autopilot").message, made.wrench)
    made.until(lambda: len(made.all("RC_CHANNELS_OVERRIDE")) == LAST_COMMANDS, made.wrench)  # a packet may be lost
    assert all((m.chan1_raw, m.chan3_raw) == (0, 0) for m in made.all("RC_CHANNELS_OVERRIDE"))
    made.autopilot.heard.clear()
    made.autopilot.silent = False
    made.autopilot.change(mode=0, armed=True)
    end = made.node.now() + 300_000_000
    made.until(lambda: made.node.now() > end, made.wrench)
    assert not made.all("MANUAL_CONTROL"), "it does not come back by itself, and sends nothing"
    made.obeys = True
    made.until(lambda: made.operation == ControlState.STANDBY, made.wrench)


def test_after_standby_a_person_enables_it_again(boat: Any) -> None:
    made = boat().driven()
    made.autopilot.change(mode=HOLD)
    made.until(lambda: made.operation == ControlState.STANDBY, made.wrench)
    made.autopilot.change(mode=0)
    made.driven()


def test_a_stick_takes_over_in_guided(boat: Any) -> None:
    made = boat(form="guided")
    made.autopilot.mode = GUIDED
    made.until(lambda: made.diagnostic_task("autopilot").message == "ready")
    made.operation = ControlState.ACTIVE
    made.until(lambda: made.autopilot.guided[1], made.velocity)
    count = made.node.status()[2].get("rc_channels", 0)
    made.until(lambda: made.node.status()[2].get("rc_channels", 0) > count + 1, made.velocity)
    made.autopilot.radio[3] = 1650
    made.until(lambda: "channel 3 of the radio is at 1650 µs" in made.diagnostic_task("autopilot").message, made.velocity)


def test_a_stop_is_zero_until_it_is_rearmed_and_the_end_gives_the_channels_back(boat: Any, bench: Any) -> None:
    made = boat().driven()
    assert bench.call(Trigger, "/mavlink/stop", Trigger.Request()).success
    made.until(lambda: not made.autopilot.overrides, made.wrench)
    assert made.node.status()[1].startswith("stopped")
    assert bench.call(Trigger, "/mavlink/rearm", Trigger.Request()).success
    made.driven()
    made.node.close()
    made.until(lambda: not made.autopilot.overrides)


def test_what_is_awaited_is_named(bench: Any) -> None:
    address = f"udpin:127.0.0.1:{free_port()}"
    node = bench.start(MavlinkNode, lockstep=False, connection=address)
    bench.until(lambda: node.connected)
    assert node.status()[1] == f"waiting for a HEARTBEAT of an autopilot on {address}"
    assert node.diagnostic_tasks()[1].message == "no autopilot heard"


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({"form": "channels"}, "mavlink.form = channels needs vessel.thrusters"),
        ({"servos": (1.0, 2.0, 3.0)}, "must be 2 numbers"),
        ({"pulses": (1500.0, 1500.0, 1900.0)}, "increasing"),
    ],
)
def test_parameters_that_do_not_fit_are_an_error(values: dict[str, Any], text: str) -> None:
    with pytest.raises(ParameterError, match=text):
        MavlinkParameters(**values)


def test_the_applied_wrench_of_a_layout_is_that_of_its_thrusters() -> None:
    from vessel_hsmc_ros.core import schema

    given = {name.replace("__", "."): value for name, value in THRUSTERS.items()}
    built = schema.build(MavlinkParameters, given, "mavlink")
    assert built.applied_wrench((1.0, -0.5)) == pytest.approx((75.0, -62.5))
    assert not math.isnan(built.applied_wrench((0.0, 0.0))[0])
