"""What the controller commands when an input is wrong, and what a person commands; on simulated time, exact to a tick."""

import math
from typing import Any

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from driving import REFERENCE, STATE, STEP, RealTimePlant
from geometry_msgs.msg import PoseStamped, WrenchStamped
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import Log
from rclpy.logging import LoggingSeverity
from sensor_msgs.msg import NavSatFix
from std_srvs.srv import SetBool, Trigger
from vessel_hsmc_msgs.msg import ControlState, Event, ReferenceState

from vessel_hsmc_ros.control.safety.parameters import Reason
from vessel_hsmc_ros.core.exceptions import RefusalError
from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.messages.topics import DATUM
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.base import ERROR
from vessel_hsmc_ros.nodes.controller import ControllerNode

TICK = 2_500_000
TIMEOUT = 0.1
RAMP = 0.2
RATES = np.array([2e5, 3e6]) / RAMP


@pytest.fixture
def sea(bench: Any, simulated_time: Any) -> RealTimePlant:
    return RealTimePlant(bench, simulated_time)


def start(sea: RealTimePlant, **changes: Any) -> Any:
    settings = {"law": "guided", "input_timeout": TIMEOUT, "safety__ramp_time": RAMP}
    return sea.start(ControllerNode, **{**settings, **changes})


def spoil(sea: RealTimePlant, monkeypatch: pytest.MonkeyPatch, **fields: Any) -> None:
    """Publish odometry with other fields than its own from now on."""
    send = sea.odometry.publish

    def publish(message: Any) -> None:
        for name, value in fields.items():
            if name == "late":
                message.header.stamp = conv.time_message(max(0, conv.nanoseconds(message.header.stamp) - value))
            else:
                message.header.frame_id = value
        send(message)

    monkeypatch.setattr(sea.odometry, "publish", publish)


def assert_bounded(sea: RealTimePlant) -> None:
    """Every change of the commands is bounded by the ramp, but for those from one command of the law to the next."""
    count = min(len(sea.commands), len(sea.states))  # the last message of one of them may be on its way
    states = {conv.nanoseconds(state.header.stamp): state for state in sea.states}
    pairs = [(wrench, states[at]) for at, wrench in zip(sea.stamps(), sea.wrenches(), strict=True) if at in states][:count]
    wrenches = np.array([wrench for wrench, _ in pairs])
    own = np.array([state.operation == ControlState.ACTIVE and not state.reason for _, state in pairs])
    changes = np.abs(np.diff(wrenches, axis=0))[~(own[1:] & own[:-1])]
    assert len(changes)
    assert (changes <= RATES * 0.01 * (1.0 + 1e-9)).all()


@pytest.mark.parametrize(
    ("fault", "reason"),
    [
        ({"late": 5_000_000_000}, "ago (got 5 s)"),
        ({"late": -30_000_000_000}, "ahead (got 30 s)"),
        ({"frame": "map"}, "(got 'map' and 'base_link')"),
    ],
)
def test_odometry_of_another_time_or_frame_leads_to_the_safe_action_and_back(
    bench: Any, sea: RealTimePlant, monkeypatch: pytest.MonkeyPatch, fault: dict[str, Any], reason: str
) -> None:
    sea.time.now = 10_000_000_000
    node = start(sea)
    sea.run(0.3)
    assert sea.states[-1].operation == ControlState.ACTIVE
    last = sea.last["odometry"]
    with monkeypatch.context() as spoilt:
        spoil(sea, spoilt, **fault)
        sea.run(0.2)
    assert reason in node.status()[1]
    safe = next(state for state in sea.states if state.operation == ControlState.SAFE)
    overdue = last + round(TIMEOUT * 1e9)
    assert overdue <= conv.nanoseconds(safe.header.stamp) <= overdue + 2 * STEP
    assert math.isnan(safe.yaw_surface)
    sea.run(0.2)
    assert (sea.states[-1].operation, node.inputs.monitor.overdue(node.now(), node.now())) == (ControlState.ACTIVE, None)
    assert_bounded(sea)


def test_the_law_begins_to_command_at_a_bounded_rate_after_fresh_samples(sea: RealTimePlant) -> None:
    start(sea, safety__fresh_samples=5)
    sea.run(0.5)
    operations = [state.operation for state in sea.states]
    first = operations.index(ControlState.ACTIVE)
    assert first >= 4
    assert set(operations[first:]) == {ControlState.ACTIVE}
    assert sea.stamps()[0] == conv.nanoseconds(sea.states[first].header.stamp), "in standby nothing was commanded"
    assert any(math.isfinite(state.yaw_surface) for state in sea.states[:first]), "the law was computed"
    assert_bounded(sea)


def test_without_start_enabled_the_node_waits_in_standby_for_enable(bench: Any, sea: RealTimePlant) -> None:
    start(sea, start_enabled=False)
    sea.run(0.2)
    assert not sea.commands
    assert (sea.states[-1].operation, sea.states[-1].reason) == (ControlState.STANDBY, ControlState.IN_STANDBY)
    assert bench.call(SetBool, "/controller/enable", SetBool.Request(data=True)).success
    sea.run(0.2)
    assert any(sea.wrenches()[-1])
    assert_bounded(sea)


def test_enable_is_refused_with_the_reason_while_an_input_is_missing(bench: Any, sea: RealTimePlant) -> None:
    start(sea, start_enabled=False)
    sea.state = None
    sea.run(0.2)
    answer = bench.call(SetBool, "/controller/enable", SetBool.Request(data=True))
    assert (answer.success, answer.message) == (False, "not enabled: odometry on /odom: never received")


def test_a_stop_latches_until_it_is_rearmed_and_enabled(bench: Any, sea: RealTimePlant) -> None:
    events = bench.collect(Event, "events", qos.LOSSLESS)
    start(sea)
    sea.run(0.3)
    sea.state = None  # a stop is answered while inputs are missing, too
    sea.run(0.2)
    assert bench.call(Trigger, "/controller/stop", Trigger.Request()).success
    bench.until(lambda: sea.wrenches()[-1] == (0.0, 0.0))
    sea.state = STATE
    sea.run(0.3)
    assert sea.states[-1].operation == ControlState.STOPPED
    assert not any(sea.wrenches()[-1])
    refused = bench.call(SetBool, "/controller/enable", SetBool.Request(data=True))
    assert (refused.success, refused.message) == (False, "not enabled: stopped until it is rearmed")
    assert bench.call(Trigger, "/controller/rearm", Trigger.Request()).success
    sea.run(0.1)
    count = len(sea.commands)
    sea.run(0.1)
    assert len(sea.commands) == count, "in standby another source may command"
    assert bench.call(SetBool, "/controller/enable", SetBool.Request(data=True)).success
    sea.run(0.2)
    assert any(sea.wrenches()[-1])
    assert not bench.call(Trigger, "/controller/rearm", Trigger.Request()).success
    assert [event.kind for event in events if event.node == "controller"] == ["disable", "stop", "rearm", "enable"]


def test_a_stop_is_commanded_at_once_and_not_in_the_next_period(bench: Any, sea: RealTimePlant) -> None:
    """The simulated clock stands from the request on, so that no period begins."""
    node = start(sea)
    for _ in range(2):  # a second stop is answered like the first
        sea.run(0.4)
        assert any(sea.wrenches()[-1])
        assert bench.call(Trigger, "/controller/stop", Trigger.Request()).success
        bench.until(lambda: sea.wrenches()[-1] == (0.0, 0.0), deadline=10.0)
        assert sea.stamps()[-1] == node.now()
        assert bench.call(Trigger, "/controller/rearm", Trigger.Request()).success
        assert bench.call(SetBool, "/controller/enable", SetBool.Request(data=True)).success


class Manager:
    """What a lifecycle manager requests of the controller."""

    def __init__(self, bench: Any) -> None:
        self.bench = bench

    def change(self, transition: int) -> bool:
        request = ChangeState.Request(transition=Transition(id=transition))
        return bool(self.bench.call(ChangeState, "/controller/change_state", request).success)

    def label(self) -> str:
        return str(self.bench.call(GetState, "/controller/get_state", GetState.Request()).current_state.label)


def test_without_autostart_a_manager_configures_and_activates(bench: Any, sea: RealTimePlant) -> None:
    start(sea, autostart=False, start_enabled=True)
    manager = Manager(bench)
    sea.run(0.3)
    assert (manager.label(), sea.states[-1].operation) == ("unconfigured", ControlState.STANDBY)
    assert not sea.commands
    assert manager.change(Transition.TRANSITION_CONFIGURE)
    sea.run(0.3)
    assert (manager.label(), sea.states[-1].operation) == ("inactive", ControlState.STANDBY)
    assert not sea.commands
    assert manager.change(Transition.TRANSITION_ACTIVATE)
    sea.run(0.1)
    assert (manager.label(), sea.states[-1].operation) == ("active", ControlState.ACTIVE)


def test_a_configured_node_has_the_parameters_that_were_set_before(bench: Any, sea: RealTimePlant) -> None:
    node = start(sea, start_enabled=False)
    manager = Manager(bench)
    sea.run(0.2)
    assert not bench.set_parameters("controller", law="pd").successful, "it computes: its law is fixed"
    assert manager.change(Transition.TRANSITION_CLEANUP)
    assert not bench.set_parameters("controller", rate_hz=20.0).successful, "its timers are made of it"
    assert not bench.set_parameters("controller", law="nothing").successful
    assert bench.set_parameters("controller", law="pd", input_timeout=0.2).successful
    assert manager.change(Transition.TRANSITION_CONFIGURE)
    assert type(node.loop.law).name == "pd"
    assert not bench.set_parameters("controller", law="guided").successful
    sea.run(0.3)
    assert manager.change(Transition.TRANSITION_ACTIVATE)
    sea.run(0.3)
    assert (sea.states[-1].operation, sea.states[-1].reason) == (ControlState.ACTIVE, ControlState.NONE)
    assert any(sea.wrenches()[-1])


def test_a_stop_stays_latched_while_a_node_is_configured_anew(bench: Any, sea: RealTimePlant) -> None:
    start(sea)
    manager = Manager(bench)
    sea.run(0.3)
    assert bench.call(Trigger, "/controller/stop", Trigger.Request()).success
    assert manager.change(Transition.TRANSITION_CLEANUP)
    assert bench.set_parameters("controller", law="pd").successful
    assert manager.change(Transition.TRANSITION_CONFIGURE)
    sea.run(0.3)
    assert sea.states[-1].operation == ControlState.STOPPED
    assert not manager.change(Transition.TRANSITION_ACTIVATE)
    assert bench.call(Trigger, "/controller/rearm", Trigger.Request()).success
    assert manager.change(Transition.TRANSITION_ACTIVATE)


def test_the_lifecycle_services_activate_and_deactivate(bench: Any, sea: RealTimePlant) -> None:
    start(sea, start_enabled=False)
    sea.run(0.2)
    change, label = Manager(bench).change, Manager(bench).label
    assert label() == "inactive"
    assert change(Transition.TRANSITION_ACTIVATE)
    sea.run(0.1)
    assert (label(), sea.states[-1].operation) == ("active", ControlState.ACTIVE)
    assert change(Transition.TRANSITION_DEACTIVATE)
    assert change(Transition.TRANSITION_CLEANUP)
    sea.run(0.05)
    assert (label(), sea.states[-1].operation) == ("unconfigured", ControlState.STANDBY)
    assert math.isnan(sea.states[-1].yaw_surface)
    refused = bench.call(SetBool, "/controller/enable", SetBool.Request(data=True))
    assert "unconfigured" in refused.message
    assert change(Transition.TRANSITION_CONFIGURE)
    assert change(Transition.TRANSITION_INACTIVE_SHUTDOWN)
    assert label() == "finalized"


def test_a_changed_gain_and_a_reset_move_the_command_at_a_bounded_rate(bench: Any, sea: RealTimePlant) -> None:
    node = start(sea)
    sea.run(0.6)
    for request in (
        lambda: bench.set_parameters("controller", guided__position_gain=0.9).successful,
        lambda: bench.call(Trigger, "/controller/reset", Trigger.Request()).success,
    ):
        assert sea.states[-1].reason == ControlState.NONE
        before = np.array(sea.wrenches()[-1])
        assert request()
        sea.run(0.03)
        bound = np.array([2e5, 3e6]) / RAMP * 0.05
        assert (np.abs(np.array(sea.wrenches()[-1]) - before) <= bound).all()
        sea.run(0.45)
    assert node.loop.enabled


def test_a_second_publisher_is_an_error_and_leads_to_the_safe_action(bench: Any, sea: RealTimePlant) -> None:
    node = start(sea)
    logs = bench.collect(Log, "/rosout", qos.CLOCK)
    sea.run(0.3)
    other = bench.probe.create_publisher(WrenchStamped, "cmd_wrench", qos.data(False))

    def operates(operation: int) -> bool:
        sea.run(0.02)
        return bool(sea.states[-1].operation == operation)

    bench.until(lambda: node.second_publisher() and operates(ControlState.SAFE))
    assert sea.states[-1].reason == ControlState.SECOND_PUBLISHER
    assert node.status()[:2] == (DiagnosticStatus.ERROR, "safe: another node publishes as well")
    named = f"another node publishes as well, on /cmd_wrench: {bench.probe.get_fully_qualified_name()}"
    bench.until(lambda: named in [log.msg for log in logs if log.level == LoggingSeverity.ERROR])
    bench.probe.destroy_publisher(other)
    bench.until(lambda: operates(ControlState.ACTIVE))


def test_a_second_reference_is_refused_and_leads_to_the_safe_action(bench: Any, sea: RealTimePlant) -> None:
    node = start(sea)
    sea.run(0.3)
    other = bench.probe.create_publisher(ReferenceState, "reference", qos.data(False))

    def operates(operation: int) -> bool:
        sea.run(0.02)
        return bool(sea.states[-1].operation == operation)

    bench.until(lambda: operates(ControlState.SAFE))
    assert sea.states[-1].reason == ControlState.SECOND_PUBLISHER
    named = "/reference has 2 publishers and may have one"
    assert node.status()[0] == DiagnosticStatus.ERROR
    assert node.status()[1].startswith(named)
    node.pause()
    with pytest.raises(RefusalError, match=named):
        node.begin()
    bench.probe.destroy_publisher(other)
    bench.until(lambda: not node.second_publisher())
    node.begin()
    bench.until(lambda: operates(ControlState.ACTIVE))


def test_a_second_publisher_of_odometry_refuses_enabling_and_only_warns_under_way(bench: Any, sea: RealTimePlant) -> None:
    node = start(sea)
    diagnostics = bench.collect(DiagnosticArray, "/diagnostics", qos.DIAGNOSTICS)
    sea.run(0.3)
    other = bench.probe.create_publisher(Odometry, "odom", qos.data(False))
    named = "/odom has 2 publishers and may have one"
    bench.until(lambda: named in node.second_source())
    sea.run(0.3)
    assert operations(sea) == {ControlState.ACTIVE}
    bench.until(lambda: any(named in status.message for status in diagnostics[-1].status))
    node.pause()
    sea.run(0.2)
    with pytest.raises(RefusalError, match=named):
        node.begin()
    bench.probe.destroy_publisher(other)
    bench.until(lambda: not node.second_source())
    node.begin()


def test_a_second_publisher_of_a_pose_is_found_too(bench: Any) -> None:
    node = bench.start(ControllerNode, lockstep=False, odometry__form="pose_twist")
    publishers = [bench.probe.create_publisher(PoseStamped, "pose", qos.data(False)) for _ in range(2)]
    bench.until(lambda: node.second_source().startswith("/pose has 2 publishers and may have one"))
    bench.probe.destroy_publisher(publishers[0])
    bench.until(lambda: not node.second_source())


def operations(sea: RealTimePlant) -> set[int]:
    return {state.operation for state in sea.states[-5:]}


@pytest.mark.parametrize(("away", "operation"), [(60.0, ControlState.ACTIVE), (70.0, ControlState.STANDBY)])
def test_a_reference_that_was_started_again_elsewhere_waits_for_a_person(
    bench: Any, sea: RealTimePlant, away: float, operation: int
) -> None:
    node = start(sea)
    sea.run(0.4)
    sea.desired = None
    sea.run(0.3)
    assert operations(sea) == {ControlState.SAFE}
    sea.desired = REFERENCE + np.array([away, 0.0, 0.0, 0.0, 0.0, 0.0])
    sea.run(0.3)
    assert operations(sea) == {operation}
    if operation == ControlState.STANDBY:
        assert "the reference was silent for 0.3" in node.status()[1]
        assert "m away" in node.status()[1]
    assert bench.call(SetBool, "/controller/enable", SetBool.Request(data=True)).success
    sea.run(0.2)
    assert operations(sea) == {ControlState.ACTIVE}


def test_a_reference_that_is_out_of_reach_under_way_leads_to_the_safe_action_until_it_is_near(sea: RealTimePlant) -> None:
    node = start(sea, safety__enable_distance=100.0)
    sea.run(0.4)
    sea.state = STATE + np.array([300.0, 0.0, 0.0, 0.0, 0.0, 0.0])  # as from the new datum of a receiver
    sea.run(0.4)
    assert operations(sea) == {ControlState.SAFE}
    assert sea.states[-1].reason == ControlState.JUMP
    assert (
        "and must be within safety.enable_distance = 100 m: are both in one frame? the safe action is commanded"
        in node.status()[1]
    )
    sea.desired = REFERENCE + np.array([290.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    sea.run(0.4)
    assert operations(sea) == {ControlState.ACTIVE}
    assert_bounded(sea)


def test_odometry_with_another_datum_waits_for_a_person(bench: Any, sea: RealTimePlant) -> None:
    node = start(sea)
    datum = bench.probe.create_publisher(NavSatFix, DATUM, qos.LATCHED)
    bench.until(datum.get_subscription_count)
    sea.run(0.4)
    for latitude, operation in ((59.9, ControlState.ACTIVE), (59.9, ControlState.ACTIVE), (59.9001, ControlState.STANDBY)):
        datum.publish(NavSatFix(latitude=latitude, longitude=10.7))
        bench.until(lambda latitude=latitude: node.datum == (latitude, 10.7))
        sea.run(0.1)
        assert operations(sea) == {operation}
    assert "the odometry has the datum (59.9001, 10.7), before (59.9, 10.7)" in node.status()[1]
    for latitude, longitude in ((math.nan, 10.7), (59.9, math.inf), (90.0, 10.7)):
        datum.publish(NavSatFix(latitude=latitude, longitude=longitude))
        text = f"/odom/datum must state a place in degrees (got {latitude}, {longitude}); ignored"
        bench.until(lambda text=text: node.problem.current == (ERROR, text))
    assert node.datum == (59.9001, 10.7)
    assert bench.call(SetBool, "/controller/enable", SetBool.Request(data=True)).success


def test_a_command_that_the_output_guard_refuses_is_an_error_on_the_log(bench: Any, sea: RealTimePlant) -> None:
    start(sea, safety__surge_force_limit=1e-3)
    logs = bench.collect(Log, "/rosout", qos.CLOCK)
    sea.run(0.5)
    assert sea.states[-1].operation == ControlState.SAFE
    expected = "the law's command is above its limit: the safe action is commanded"
    bench.until(lambda: expected in [log.msg for log in logs if log.level == LoggingSeverity.ERROR])


def test_a_jump_is_held_out_and_then_taken_without_a_bump(sea: RealTimePlant) -> None:
    node = start(sea)
    sea.run(0.5)
    sea.state = STATE + np.array([300.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    sea.run(0.03)
    assert "jumped" in node.status()[1]
    assert abs(sea.states[-1].surge_error) < 50.0
    sea.run(0.2)
    assert abs(sea.states[-1].surge_error) > 200.0
    taken = next(k for k, state in enumerate(sea.states) if abs(state.surge_error) > 200.0)
    assert sea.states[taken].reason == ControlState.HANDOVER
    at = sea.stamps().index(conv.nanoseconds(sea.states[taken].header.stamp))
    changes = np.abs(np.diff(np.array(sea.wrenches()[at - 1 : at + 10]), axis=0))
    assert (changes <= RATES * 0.01 * (1.0 + 1e-9)).all()
    assert changes[0].any(), "the law wants another wrench there"


def test_a_clock_that_is_set_back_resets_law_and_inputs(sea: RealTimePlant, simulated_time: Any) -> None:
    sea.time.now = 10_000_000_000
    node = start(sea)
    sea.run(0.3)
    simulated_time.jump(-5_000_000_000)
    sea.run(0.05)
    assert "the clock was set back by" in node.status()[1]
    sea.run(0.3)
    assert sea.states[-1].operation == ControlState.ACTIVE
    assert sea.states[-1].missed_periods == 0
    assert_bounded(sea)


def test_a_node_without_its_clock_reports_that_it_waits_for_it(bench: Any) -> None:
    node = bench.start(ControllerNode, lockstep=False, use_sim_time=True)
    bench.until(lambda: node.status()[1].startswith("waiting for /clock"))


@pytest.mark.parametrize("operation", ["ACTIVE", "SAFE"])
def test_the_last_command_is_zero(bench: Any, sea: RealTimePlant, operation: str) -> None:
    node = start(sea, safety__ramp_time=1.0)
    sea.run(0.3)
    if operation == "SAFE":
        sea.state = None
        sea.run(0.15)
    assert sea.states[-1].operation == getattr(ControlState, operation)
    assert any(sea.wrenches()[-1]), "on the way to zero"
    node.close()
    bench.until(lambda: sea.wrenches()[-1] == (0.0, 0.0))
    assert sea.first_zero_after(node.now() - 1) == node.now()


def test_a_fallback_law_steers_where_the_chosen_one_is_undefined(sea: RealTimePlant) -> None:
    """The hierarchical law is singular at z1 = b/a, here 10 m."""
    sea.desired, sea.state = np.zeros(6), np.array([50.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    settings = {"hierarchical_printed__sway_weight": 10.0, "safety__action": "fallback", "safety__fallback_law": "los_pid"}
    start(sea, law="hierarchical_printed", **settings)
    sea.run(0.2)
    sea.state = np.array([9.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    sea.run(0.5)
    assert sea.states[-1].operation == ControlState.SAFE
    assert sea.states[-1].reason == ControlState.LAW_UNDEFINED
    assert any(sea.wrenches()[-1]), "a ramp would have ended"


def test_each_time_that_a_monitor_begins_to_warn_it_is_logged(bench: Any, sea: RealTimePlant) -> None:
    lines = bench.collect(Log, "/rosout", qos.CLOCK)
    sea.start(ControllerNode, law="guided", safety__monitors__saturation_warning=0.1, safety__ramp_time=0.1)
    far = REFERENCE + np.array([500.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    for desired in (far, STATE, far, STATE):
        sea.desired = desired
        sea.run(0.4)

    def warned() -> list[str]:
        return [line.msg for line in lines if line.msg.startswith(Reason.SATURATED.text)]

    bench.until(lambda: len(warned()) == 2)
