"""The inputs of the controller by themselves: frames after a reset, and a pose and a twist that come apart."""

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest
from controller_without_ros import ControllerWithoutRos
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, TwistStamped
from hypothesis import given
from hypothesis import strategies as st
from safety_sequences import FRESH_SAMPLES, Machine

from vessel_hsmc_ros.control.safety.parameters import Reason
from vessel_hsmc_ros.control.safety.samples import Sample
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion
from vessel_hsmc_ros.core.timing import NANOSECONDS
from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes.base import LAST_COMMANDS, VesselNode
from vessel_hsmc_ros.nodes.controller_inputs import Desired, Measured, PoseAndTwist, came_back_elsewhere, read_odometry
from vessel_hsmc_ros.nodes.controller_timing import STANDING, STANDSTILL, WAITING, Lockstep

START, PERIOD = 1_000_000_000_000, 10_000_000
AT_REST = Motion(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def test_after_a_reset_too_the_reference_must_be_in_the_frame_of_the_odometry() -> None:
    inputs = ControllerWithoutRos(False, True, {}).inputs

    def waits_for_the_reference(now: int, frame: str) -> bool:
        inputs.take_odometry(Measured(Sample(now, "odom", "base_link", AT_REST), AT_REST), now, now)
        desired = Desired(Sample(now, frame, "", AT_REST), AT_REST, Acceleration(0.0, 0.0, 0.0))
        inputs.take_reference(desired, now, now)
        return inputs.monitor.overdue(now, now) is not None

    assert waits_for_the_reference(START, "map")
    inputs.reset(Reason.CLOCK_AHEAD)
    assert waits_for_the_reference(2 * START, "map")
    assert not waits_for_the_reference(2 * START + PERIOD, "odom")


@given(
    silent=st.floats(0.0, 100.0),
    speeds=st.tuples(*[st.floats(0.0, 20.0)] * 2),
    course=st.floats(-4.0, 4.0),
    share=st.floats(0.0, 3.0),
    length=st.floats(0.5, 300.0),
)
def test_a_reference_is_elsewhere_where_it_cannot_have_gone_while_it_was_silent(
    silent: float, speeds: tuple[float, float], course: float, share: float, length: float
) -> None:
    reach = 2.0 * length + silent * max(speeds)
    moved = share * reach
    stamps, places = (
        (START, START + round(silent * 1e9)),
        ((5.0, -3.0), (5.0 + moved * math.cos(course), -3.0 + moved * math.sin(course))),
    )
    before, after = (
        Desired(Sample(stamp, "odom", "", ()), Motion(*place, 0.0, u, 0.0, 0.0), Acceleration(0.0, 0.0, 0.0))
        for stamp, place, u in zip(stamps, places, speeds, strict=True)
    )
    if abs(share - 1.0) > 1e-6 and abs(silent - 0.5) > 1e-6:
        found = came_back_elsewhere(before, after, 0.5, length)
        assert bool(found) == (silent > 0.5 and share > 1.0)
        assert not found or f"is now {moved:.1f} m away" in found


class Joined:
    """A pose and a twist, sent by their times in control periods; `taken` has those of both in each measurement."""

    def __init__(self) -> None:
        self.taken: list[tuple[int, int]] = []
        self._joined = PoseAndTwist(ControllerWithoutRos(False, True, {"odometry.form": "pose_twist"}), self._take)

    def _take(self, measured: Measured) -> None:
        self.taken.append(((measured.sample.stamp - START) // PERIOD, round(measured.motion.u)))

    def send(self, *messages: tuple[str, int]) -> list[tuple[int, int]]:
        for kind, period in messages:
            message: Any = PoseStamped() if kind == "pose" else TwistStamped()
            message.header.stamp = conv.time_message(START + period * PERIOD)
            if kind == "pose":
                message.pose.orientation.w = 1.0
                self._joined.take_pose(message)
            else:
                message.twist.linear.x = float(period)
                self._joined.take_twist(message)
        return self.taken


def test_a_pose_waits_for_the_twist_of_its_time_only_while_the_publisher_stamps_them_alike() -> None:
    joined = Joined()
    assert joined.send(("pose", 0), ("twist", 0), ("pose", 4)) == []
    assert joined.send(("twist", 4)) == [(4, 4)]
    assert joined.send(("pose", 8), ("twist", 9), ("pose", 12)) == [(4, 4), (8, 9), (12, 9)]


def test_a_pose_whose_twist_is_lost_goes_on_with_the_twist_before() -> None:
    joined = Joined()
    joined.send(("pose", 0), ("twist", 0), ("pose", 4), ("pose", 8), ("twist", 8), ("pose", 12), ("twist", 12))
    assert joined.taken == [(4, 0), (8, 8), (12, 12)]


@pytest.mark.parametrize(("pose", "twist", "taken"), [(0, 40, True), (0, 60, False), (40, 0, True), (60, 0, False)])
def test_a_pose_and_a_twist_are_apart_by_the_time_out_at_most(pose: int, twist: int, taken: bool) -> None:
    assert bool(Joined().send(("twist", twist), ("pose", pose))) is taken


def test_the_variance_of_a_pose_is_that_of_the_measurement() -> None:
    taken: list[Measured] = []
    joined = PoseAndTwist(ControllerWithoutRos(False, True, {"odometry.form": "pose_covariance_twist"}), taken.append)
    for twist, pose in ((TwistStamped(), PoseWithCovarianceStamped()), (TwistStamped(), PoseWithCovarianceStamped())):
        twist.header.stamp = pose.header.stamp = conv.time_message(START + len(taken) * PERIOD)
        pose.pose.pose.orientation.w = 1.0
        pose.pose.covariance[7] = 3.0 + len(taken)
        joined.take_twist(twist)
        joined.take_pose(pose)
    assert [measured.sample.covariance for measured in taken] == [3.0, 4.0]


@pytest.mark.parametrize("interruption", [("none", 4), ("frame", 1), ("nan", 1), ("uncertain", 1), ("old", 1)])
def test_after_a_time_out_or_a_refused_sample_the_law_may_command_only_after_enough_new_ones(
    interruption: tuple[str, int],
) -> None:
    machine = Machine(0)
    with machine.node.on_its_clock():
        machine.begin(active=False)
        for kind, periods in (("good", 5), interruption, ("good", 1)):
            for _ in range(periods):
                machine.step(kind, "good", "slow")
        assert machine.node.timer.ready() is Reason.NOT_READY
        for _ in range(FRESH_SAMPLES - 1):
            machine.step("good", "good", "slow")
        assert machine.node.timer.ready() is Reason.NONE


def test_a_controller_that_is_disabled_before_its_start_does_not_begin_by_itself() -> None:
    machine = Machine(0)
    machine.node.parameters = replace(machine.node.parameters, start_enabled=True)
    begun: list[bool] = []
    setattr(machine.node, "activate_quietly", lambda: begun.append(True))  # noqa: B010 - of another type
    with machine.node.on_its_clock():
        machine.begin(active=False)
        machine.node._begun = False
        machine.order("standby")
        for _ in range(2 * FRESH_SAMPLES):
            machine.step("good", "good", "slow")
        assert not begun
        machine.node._begun = False
        machine.step("good", "good", "slow")
        assert begun


@pytest.mark.parametrize("periods", range(5))
def test_at_its_end_after_it_was_disabled_it_leaves_zero_unless_it_has_done_so(
    periods: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(VesselNode, "close", lambda _: None)
    machine = Machine(0)
    with machine.node.on_its_clock():
        machine.begin(active=True)
        machine.order("standby")
        for _ in range(periods):
            machine.step("good", "good", "slow")
        machine.node.take_sent()
        machine.node.close()
    wrenches = [wrench for _, wrench in machine.node.take_sent()]
    assert wrenches == [(0.0, 0.0)] * (LAST_COMMANDS if periods < LAST_COMMANDS else 0)


def test_each_standstill_of_a_simulated_clock_is_named_after_its_time_until_the_clock_goes_on() -> None:
    node = ControllerWithoutRos(True, True, {})
    with node.on_its_clock():
        node.timer._check()
        assert node.clock_problem == WAITING
        for begun in (5, 60):
            node.ros_time = begun * NANOSECONDS
            node.timer._check()
            for steady, problem in ((STANDSTILL - 0.1, ""), (0.2, STANDING), (100.0, STANDING)):
                node.steady.now += round(steady * NANOSECONDS)
                node.timer._check()
                assert node.clock_problem == problem


class Timers(ControllerWithoutRos):
    """A controller that notes its control periods, and those of its timers that run."""

    def __init__(self, simulated: bool) -> None:
        self.served: list[int] = []
        self.running: list[Any] = []
        super().__init__(simulated, True, {"rate_hz": 10.0})

    def create_timer(self, period: float, callback: Any, **_: Any) -> Any:
        self.running.append((period, callback.__name__, self.ros_time))
        return self.running[-1]

    def destroy_timer(self, timer: Any) -> bool:
        self.running.remove(timer)
        return True

    def publish_period(self, stamp: int, _terms: Any, _began: int) -> None:
        self.served.append(stamp)


@pytest.mark.parametrize("simulated", [False, True])
def test_after_each_step_of_the_clock_every_period_is_served_once_in_spite_of_small_delays(simulated: bool) -> None:
    node, period = Timers(simulated), NANOSECONDS // 10
    node.ros_time = 1000 * NANOSECONDS
    with node.on_its_clock():
        node.timer.start()
        for step in (0.0, 7.0995, -3.0005, 0.9999, -5.0501, 60.0495):
            node.ros_time += round(step * NANOSECONDS)
            node.timer._on_timer()
            begin, expected = node.ros_time, node.ros_time
            node.served.clear()
            for number in range(1, 25):
                expected = begin + number * period + (number % 3) * 400_000
                node.steady.now += expected - node.ros_time
                node.ros_time = expected
                node.timer._on_timer()
            assert len(node.served) == 24, step
        assert node.loop.missed_periods == 0


@pytest.mark.parametrize("step", [-7200.0, -1.0, 1.0, 7200.0])
def test_after_each_step_of_the_system_clock_the_period_has_a_new_timer_which_waits_on_no_former_time(step: float) -> None:
    node = Timers(False)
    node.ros_time = 10_000 * NANOSECONDS
    with node.on_its_clock():
        node.timer.start()
        for _ in range(2):
            node.timer._check()
            node.ros_time += round(step * NANOSECONDS)
            node.steady.now += NANOSECONDS // 100
            node.timer._check()  # by the wall timer, which waits on no clock
            periods = [made for made in node.running if made[1] == "_on_timer"]
            assert periods == [(0.1, "_on_timer", node.ros_time)]


@pytest.mark.parametrize("order", ["step ahead", "step back"])
def test_the_step_of_the_clock_is_the_reason_until_there_are_new_inputs_and_of_no_later_outage(order: str) -> None:
    machine = Machine(0)

    def reason() -> Reason:
        return machine.node.loop.supervision.reason

    with machine.node.on_its_clock():
        machine.begin(active=True)
        for _ in range(2):
            machine.order(order)
            machine.step("none", "none", "slow")
            machine.step("none", "none", "slow")
            assert reason() is (Reason.CLOCK_AHEAD if order == "step ahead" else Reason.CLOCK_BACKWARD)
            for _ in range(2 * FRESH_SAMPLES + 4):
                machine.step("good", "good", "slow")
            for _ in range(4):
                machine.step("none", "good", "slow")
            assert reason() is Reason.OVERDUE
            for _ in range(2 * FRESH_SAMPLES + 4):
                machine.step("good", "good", "slow")


@pytest.mark.parametrize("x", [0.0, 4.0, math.nan])
@pytest.mark.parametrize("y", [0.0, 9.0, math.nan])
def test_the_variance_of_odometry_is_the_larger_one_in_the_plane_and_no_number_where_one_of_them_is_none(
    x: float, y: float
) -> None:
    message = conv.new_odometry()
    message.pose.pose.orientation.w = 1.0
    message.pose.covariance[:] = [1e9] * 36
    message.pose.covariance[0], message.pose.covariance[7] = x, y
    found = read_odometry(message).sample.covariance
    assert found == max(x, y) if math.isfinite(x + y) else math.isnan(found)


def test_in_lockstep_the_pending_odometry_is_the_first_one_since_each_command() -> None:
    """As of a plant that does not wait: the check of the inputs compares the pending one with that of the check before."""
    served: list[int] = []
    loop = SimpleNamespace(due=lambda _: True, step=lambda stamp, *_: served.append(stamp))
    node: Any = SimpleNamespace(
        connected=True,
        stamp=-1,
        loop=loop,
        publish_period=lambda *_: None,
        inputs=SimpleNamespace(monitor=SimpleNamespace(receive=lambda *_: None)),
    )
    steps = Lockstep(node)
    assert steps.pending is None
    for first in (10, 20):
        for stamp in range(first, first + 5):
            steps.take_odometry(Measured(Sample(stamp, "odom", "base_link", AT_REST), AT_REST))
            assert steps.pending == first
        steps.take_reference(Desired(Sample(first + 4, "odom", "", AT_REST), AT_REST, Acceleration(0.0, 0.0, 0.0)))
        assert served[-1] == first + 4
        assert steps.pending is None
