"""The actions of the reference ship, by rclpy's client over DDS."""

import math
from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import Any

import pytest
from action_client import RATE_HZ, Sent, Vessel, path, pose
from action_msgs.msg import GoalStatus
from durations import rest_long
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Path
from sensor_msgs.msg import BatteryState, NavSatFix
from std_msgs.msg import Empty
from std_srvs.srv import SetBool, Trigger
from vessel_hsmc_msgs.msg import ControlState, GeoPose

from vessel_hsmc_ros.core.kinematics import Plane
from vessel_hsmc_ros.guidance.tasks import Code
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.reference_ship import ReferenceShipNode

SUCCEEDED, ABORTED, CANCELED = GoalStatus.STATUS_SUCCEEDED, GoalStatus.STATUS_ABORTED, GoalStatus.STATUS_CANCELED
LEGS = path((60.0, 0.0), (60.0, 40.0))


@pytest.fixture
def start(bench: Any) -> Iterator[Callable[..., Vessel]]:
    made: list[Vessel] = []

    def starter(mode: str, **parameters: Any) -> Vessel:
        made.append(Vessel(bench, mode=mode, actions__reach=2.0, **parameters))
        return made[-1]

    yield starter
    for vessel in made:
        vessel.destroy()


def place(latitude: float, longitude: float) -> Any:
    found = GeoPose()
    found.position.latitude, found.position.longitude = latitude, longitude
    return found


def sailing(vessel: Vessel) -> Sent:
    """A path that is sailed, of which there is feedback."""
    sent = vessel.send("follow_path", path=LEGS)
    vessel.until(lambda: sent.feedback and vessel.speed > 0.5)
    return sent


def test_a_path_gives_feedback_until_the_vessel_is_at_its_end(start: Any) -> None:
    vessel = start("path")
    sent = vessel.send("follow_path", path=LEGS)
    vessel.until(lambda: sent.done)
    status, code, text = sent.result()
    assert (status, code) == (SUCCEEDED, Code.REACHED)
    assert text.startswith("reached: the vessel is 0.0")
    assert text.endswith("m from the end, within 2.00 m")
    left = [feedback.distance_to_goal for feedback in sent.feedback]
    assert left == sorted(left, reverse=True)
    assert {feedback.leg for feedback in sent.feedback} == {1, 2}
    assert {feedback.legs for feedback in sent.feedback} == {2}
    assert max(feedback.speed for feedback in sent.feedback) == pytest.approx(1.5, abs=0.1)
    times = [feedback.estimated_time_remaining.sec for feedback in sent.feedback]
    assert times == sorted(times, reverse=True)
    count = len(sent.feedback)
    vessel.advance(20.0)
    assert len(sent.feedback) == count, "no feedback after the result"


@pytest.mark.parametrize("mode", rest_long(["goal", "path"]))
def test_a_pose_is_reached_with_its_heading(start: Any, mode: str) -> None:
    vessel = start(mode)
    sent = vessel.send("navigate_to_pose", pose=pose(30.0, 5.0, 0.5))
    vessel.until(lambda: sent.done)
    assert sent.result()[:2] == (SUCCEEDED, Code.REACHED)
    assert vessel.states[-1][:3] == pytest.approx((30.0, 5.0, 0.5), abs=0.1)
    left = [feedback.distance_remaining for feedback in sent.feedback]
    assert math.hypot(30.0, 5.0) >= left[0] > left[-1]
    assert sent.feedback[-1].current_pose.pose.position.x == pytest.approx(30.0, abs=2.0)


@pytest.mark.long
def test_waypoints_are_sailed_again_as_often_as_they_are_to_be_from_the_index_on(start: Any) -> None:
    vessel = start("path")
    poses = [pose(0.0, 0.0), pose(40.0, 0.0), pose(40.0, 40.0)]
    sent = vessel.send("follow_waypoints", poses=poses, goal_index=1, number_of_loops=1)
    vessel.until(lambda: sent.done)
    assert sent.result()[:2] == (SUCCEEDED, Code.REACHED)
    assert {feedback.current_waypoint for feedback in sent.feedback} <= {0, 1, 2}
    assert sent.feedback[-1].current_waypoint == 2
    near = [math.dist(state[:2], (40.0, 40.0)) < 4.0 for state in vessel.states]
    assert sum(b and not a for a, b in pairwise(near)) == 2, "it came there twice"
    assert vessel.states[-1][:2] == pytest.approx((40.0, 40.0), abs=0.1)


def test_places_are_sailed_in_the_plane_of_the_datum(start: Any) -> None:
    plane = Plane(63.44, 10.39)
    vessel = start("path", actions__datum=[63.44, 10.39])
    sent = vessel.send(
        "follow_gps_waypoints", gps_poses=[place(*plane.coordinates(x, y)) for x, y in ((40.0, 0.0), (40.0, 30.0))]
    )
    vessel.until(lambda: sent.done)
    assert sent.result()[:2] == (SUCCEEDED, Code.REACHED)
    assert vessel.states[-1][:2] == pytest.approx((40.0, 30.0), abs=0.1)


@pytest.mark.parametrize(("declared", "code"), [([0.0], None), ([63.44, 10.39], None), ([63.44, 10.3901], Code.REFUSED)])
def test_places_are_sailed_by_the_datum_that_the_odometry_states_and_by_no_other(
    bench: Any, start: Any, declared: list[float], code: Code | None
) -> None:
    stated = bench.probe.create_publisher(NavSatFix, "odom/datum", qos.LATCHED)
    stated.publish(NavSatFix(latitude=63.44, longitude=10.39))
    vessel = start("path", lockstep=False, actions__datum=declared)
    bench.until(lambda: vessel.node.actions._sight.datum())
    sent = vessel.send("follow_gps_waypoints", gps_poses=[place(*Plane(63.44, 10.39).coordinates(40.0, 0.0))])
    vessel.until(lambda: sent.done or sent.feedback)
    if code:
        assert sent.result()[1] == code
        assert "datum must be the datum of the odometry, 63.44, 10.39 (got [63.44, 10.3901])" in sent.result()[2]
    else:
        assert 20.0 < sent.feedback[-1].distance_remaining < 41.0


@pytest.mark.parametrize("stated", [(math.nan, math.nan), (90.0, 0.0), (63.44, math.inf)])
@pytest.mark.parametrize("declared", [[0.0], [63.44, 10.39]])
def test_a_message_that_states_no_place_is_no_datum(
    bench: Any, start: Any, stated: tuple[float, float], declared: list[float]
) -> None:
    publisher = bench.probe.create_publisher(NavSatFix, "odom/datum", qos.LATCHED)
    publisher.publish(NavSatFix(latitude=stated[0], longitude=stated[1]))
    vessel = start("path", lockstep=False, actions__datum=declared)
    bench.until(lambda: vessel.node.actions._sight._datum.read())
    sent = vessel.send("follow_gps_waypoints", gps_poses=[place(*Plane(63.44, 10.39).coordinates(40.0, 0.0))])
    vessel.until(lambda: sent.done or sent.feedback)
    assert bool(sent.feedback) == (declared != [0.0])
    assert not vessel.node.actions.tasks.blocked


def test_a_path_in_the_plane_of_another_datum_than_that_of_the_odometry_is_held(bench: Any, start: Any) -> None:
    stated = bench.probe.create_publisher(NavSatFix, "odom/datum", qos.LATCHED)
    stated.publish(NavSatFix(latitude=63.44, longitude=10.39))
    way = {"path__time": 0.0, "path__waypoints": [40.0, 0.0, 40.0, 30.0]}
    vessel = start("path", lockstep=False, actions__datum=[63.44, 10.3901], **way)
    vessel.until(lambda: vessel.node.actions.tasks.blocked)
    assert vessel.node._ship.held
    assert "datum must be the datum of the odometry, 63.44, 10.39 (got [63.44, 10.3901])" in vessel.node.status()[1]
    vessel.node._reset()
    vessel.until(lambda: vessel.node._ship.held)


def test_a_vessel_that_does_not_follow_has_not_reached_the_end(start: Any) -> None:
    vessel = start("path", actions__patience=20.0)
    vessel.offset = 5.0
    sent = vessel.send("follow_waypoints", poses=[pose(20.0, 0.0), pose(40.0, 0.0)])
    vessel.until(lambda: sent.done)
    status, code, text = sent.result()
    assert (status, code) == (ABORTED, Code.NOT_REACHED)
    assert "within 20 s it has not come nearer than 5.00 m" in text


def test_a_cancel_brings_the_reference_to_rest_on_its_way_and_a_new_goal_continues_from_there(start: Any) -> None:
    vessel = start("path")
    sent = sailing(vessel)
    assert sent.cancel() == 1
    assert sent.result() == (CANCELED, Code.CANCELLED, "cancelled: the vessel comes to rest and keeps station")
    assert sent.cancel() == 0
    vessel.advance(60.0)
    assert vessel.speed < 1e-3
    assert math.dist(vessel.states[-1][:2], (60.0, 40.0)) > 2.0
    again = vessel.send("follow_path", path=LEGS)
    vessel.until(lambda: again.done)
    assert again.result()[:2] == (SUCCEEDED, Code.REACHED)
    assert max(math.dist(a[:2], b[:2]) for a, b in pairwise(vessel.states)) < 1.1 * 1.5 / RATE_HZ


def test_a_cancelled_pose_leaves_the_reference_at_rest_ahead(start: Any) -> None:
    vessel = start("goal")
    sent = vessel.send("navigate_to_pose", pose=pose(200.0, 0.0))
    vessel.until(lambda: vessel.speed > 1.0)
    before = float(vessel.states[-1][0])
    assert sent.cancel() == 1
    assert sent.result()[:2] == (CANCELED, Code.CANCELLED)
    vessel.until(lambda: vessel.speed < 1e-3)
    vessel.advance(30.0)
    assert before < float(vessel.states[-1][0]) < before + 30.0
    assert vessel.speed < 1e-3


def test_a_newer_goal_ends_the_older_one(start: Any) -> None:
    vessel = start("path")
    first = sailing(vessel)
    second = vessel.send("navigate_to_pose", pose=pose(80.0, 10.0))
    assert first.result() == (ABORTED, Code.PREEMPTED, "a newer goal took its place")
    vessel.until(lambda: second.done)
    assert second.result()[:2] == (SUCCEEDED, Code.REACHED)
    assert vessel.states[-1][:2] == pytest.approx((80.0, 10.0), abs=0.1)


@pytest.mark.parametrize(("mode", "topic"), [("path", "path"), ("goal", "goal_pose")])
def test_a_message_on_the_topic_takes_the_place_of_a_goal(bench: Any, start: Any, mode: str, topic: str) -> None:
    vessel = start(mode)
    sent = vessel.send("navigate_to_pose", pose=pose(100.0, 0.0))
    vessel.until(lambda: sent.feedback)
    publisher = bench.probe.create_publisher(Path if mode == "path" else PoseStamped, topic, 10)
    bench.until(publisher.get_subscription_count)
    publisher.publish(path((90.0, 5.0)) if mode == "path" else pose(90.0, 5.0))
    status, code, text = sent.result()
    assert (status, code) == (ABORTED, Code.PREEMPTED)
    assert text.endswith(f"{topic} took its place")


REFUSED = [
    ("follow_path", {"path": path()}, "a path must have at least one pose"),
    ("follow_path", {"path": path((1.0, 1.0), frame="map2")}, "(got 'map2')"),
    ("follow_path", {"path": path((1.0, math.nan))}, "pose 0 of the path must be finite numbers (got y = nan)"),
    ("follow_path", {"path": path((570000.0, 7030000.0))}, "pose 0 of the path must be within 100 km of the reference"),
    ("navigate_to_pose", {"pose": pose(1.0, 1.0, frame="earth")}, "(got 'earth')"),
    ("navigate_to_pose", {"pose": pose(math.inf, 1.0)}, "goal must be finite numbers (got x = inf)"),
    ("follow_waypoints", {"poses": []}, "a path must have at least one pose"),
    (
        "follow_waypoints",
        {"poses": [pose(9.0, 0.0)], "goal_index": 1},
        "goal_index must be below the number of poses, 1 (got 1)",
    ),
    (
        "follow_waypoints",
        {"poses": [pose(9.0, 0.0)], "number_of_loops": 2**32 - 1},
        "poses times loops must be at most 20000",
    ),
    ("follow_gps_waypoints", {"gps_poses": []}, "a goal must have at least one pose"),
    ("follow_gps_waypoints", {"gps_poses": [place(math.nan, 10.0)]}, "pose 0 must be a latitude and a longitude"),
    ("follow_gps_waypoints", {"gps_poses": [place(10.39, 63.44)]}, "are latitude and longitude exchanged?"),
]
"""Goals that cannot be followed, and the reason that is given."""


@pytest.mark.long
def test_goals_that_cannot_be_followed_are_refused_with_the_reason_and_the_present_one_goes_on(start: Any) -> None:
    vessel = start("path", actions__datum=[63.44, 10.39])
    sent = sailing(vessel)
    for name, fields, reason in REFUSED:
        status, code, text = vessel.send(name, **fields).result()
        assert (status, code) == (ABORTED, Code.REFUSED), reason
        assert reason in text
        count = len(sent.feedback)
        vessel.until(lambda count=count: len(sent.feedback) > count)
        assert not sent.done


def test_places_without_a_datum_and_paths_with_corners_that_have_no_room_are_refused(start: Any) -> None:
    vessel = start("path", motion__current=1.4)
    _, code, text = vessel.send("follow_gps_waypoints", gps_poses=[place(63.44, 10.39)]).result()
    assert (code, "reference_ship.actions.datum must be given" in text) == (Code.REFUSED, True)
    narrow = path((100.0, 0.0), (200.0, 0.0), (200.0, 20.0), (300.0, 20.0))
    _, code, text = vessel.send("follow_path", path=narrow).result()
    assert (code, "corner" in text) == (Code.REFUSED, True)


def test_a_controller_in_standby_refuses_goals_and_ends_the_present_one_with_its_reason(start: Any) -> None:
    vessel = start("path")
    sent = sailing(vessel)
    vessel.state_of(ControlState.STANDBY, ControlState.IN_STANDBY)
    text = "controller in standby: IN_STANDBY, not activated"
    assert sent.result() == (ABORTED, Code.CONTROLLER, f"{text}: the vessel comes to rest and keeps station")
    assert vessel.send("follow_path", path=LEGS).result() == (ABORTED, Code.REFUSED, text)
    vessel.advance(60.0)
    assert vessel.speed < 1e-3
    vessel.state_of(ControlState.ACTIVE)
    again = vessel.send("follow_path", path=LEGS)
    vessel.until(lambda: again.done)
    assert again.result()[:2] == (SUCCEEDED, Code.REACHED)


def test_a_safe_action_ends_a_goal_once_it_lasts(start: Any) -> None:
    vessel = start("path")
    sent = sailing(vessel)
    for _ in range(2):
        vessel.state_of(ControlState.SAFE, ControlState.OVERDUE)
        count = len(sent.feedback)
        vessel.bench.until(lambda count=count: len(sent.feedback) > count)
        vessel.state_of(ControlState.ACTIVE)
    assert not sent.done
    vessel.state_of(ControlState.SAFE, ControlState.NOT_MOVING)
    vessel.until(lambda: sent.done, 100.0)
    status, code, text = sent.result()
    assert (status, code) == (ABORTED, Code.CONTROLLER)
    assert text.startswith("controller in its safe action for more than 5 s: NOT_MOVING, the ship is driven and does not move")


def test_a_reset_ends_a_goal(bench: Any, start: Any) -> None:
    vessel = start("path")
    sent = sailing(vessel)
    assert bench.call(Trigger, "reference_ship/reset", Trigger.Request()).success
    assert sent.result() == (ABORTED, Code.RESET, "the reference was reset")


@pytest.mark.parametrize("mode", rest_long(["goal", "path"]))
def test_a_goal_that_is_held_goes_on_from_where_it_was(bench: Any, start: Any, mode: str) -> None:
    vessel = start(mode)

    def hold(wanted: bool) -> Any:
        return bench.call(SetBool, "reference_ship/hold", SetBool.Request(data=wanted))

    assert hold(False).message == "nothing is held"
    sent = vessel.send("navigate_to_pose", pose=pose(60.0, 0.0))
    vessel.until(lambda: vessel.speed > 1.0)
    assert hold(True).success
    assert hold(True).success
    vessel.advance(60.0)
    x = float(vessel.states[-1][0])
    assert vessel.speed < 1e-3
    assert 1.0 < x < 50.0
    assert not sent.done
    other = vessel.send("navigate_to_pose", pose=pose(0.0, 0.0))
    assert other.result() == (ABORTED, Code.REFUSED, "the vessel is held, until ~/hold is called with false")
    assert hold(False).success
    vessel.until(lambda: sent.done)
    assert sent.result()[:2] == (SUCCEEDED, Code.REACHED)
    assert vessel.states[-1][0] == pytest.approx(60.0, abs=0.1)


def test_a_goal_that_is_cancelled_while_it_is_held_stays_cancelled(bench: Any, start: Any) -> None:
    vessel = start("path")
    sent = sailing(vessel)
    bench.call(SetBool, "reference_ship/hold", SetBool.Request(data=True))
    assert sent.cancel() == 1
    bench.call(SetBool, "reference_ship/hold", SetBool.Request(data=False))
    vessel.advance(60.0)
    assert vessel.speed < 1e-3


def test_a_low_battery_ends_the_goal_and_the_vessel_returns(bench: Any, start: Any) -> None:
    vessel = start("path", actions__battery=0.2, actions__at_end="return", actions__home=[10.0, 0.0])
    battery = bench.probe.create_publisher(BatteryState, "battery_state", 10)
    bench.until(battery.get_subscription_count)
    battery.publish(BatteryState(percentage=0.5))
    sent = sailing(vessel)
    for unknown in (math.nan, 15.0, -0.01):  # in percent, and as some drivers show that they do not know it
        battery.publish(BatteryState(percentage=unknown))
        text = f"percentage of battery_state must be from 0 to 1 (got {unknown:g})"
        bench.until(lambda text=text: text in vessel.node.status()[1])
    battery.publish(BatteryState(percentage=0.15))
    assert sent.result() == (ABORTED, Code.ENDED, "battery at 15 %, below 20 %: the vessel returns")
    assert vessel.send("follow_path", path=LEGS).result() == (ABORTED, Code.REFUSED, "battery at 15 %, below 20 %")
    vessel.advance(150.0)
    assert vessel.states[-1][:2] == pytest.approx((10.0, 0.0), abs=0.1)


def test_a_battery_that_falls_silent_is_named(bench: Any) -> None:
    node = bench.start(ReferenceShipNode, lockstep=False, mode="path", actions__battery=0.2)
    battery = bench.probe.create_publisher(BatteryState, "battery_state", 10)
    bench.until(lambda: node.actions.remark == "no battery_state has been received" and battery.get_subscription_count())
    battery.publish(BatteryState(percentage=0.5))
    bench.until(lambda: not node.actions.remark)
    node.actions._sight._battery.at -= 61.0
    assert node.actions.remark.startswith("no battery_state for 61 s")


@pytest.mark.long
def test_a_lost_operator_ends_the_goal_and_one_who_is_back_may_send_the_next(bench: Any, start: Any) -> None:
    vessel = start("path", actions__operator_timeout=3.0)
    heartbeat = bench.probe.create_publisher(Empty, "operator_heartbeat", 10)
    beating = bench.probe.create_timer(0.1, lambda: heartbeat.publish(Empty()))
    bench.until(heartbeat.get_subscription_count)
    sent = sailing(vessel)
    beating.cancel()
    lost = "no operator_heartbeat for 3 s"
    assert sent.result() == (ABORTED, Code.ENDED, f"{lost}: the vessel comes to rest and keeps station")
    vessel.advance(60.0)
    assert vessel.speed < 1e-3
    beating.reset()
    bench.until(lambda: not vessel.node.actions.remark)
    assert sailing(vessel).feedback


def test_without_odometry_a_goal_ends_with_the_reason(start: Any) -> None:
    vessel = start("path")
    vessel.lost = True
    sent = vessel.send("follow_path", path=LEGS)
    vessel.until(lambda: sent.done, 200.0)
    assert sent.result()[1:] == (Code.CONTROLLER, "no odometry for more than 5 s: the vessel comes to rest and keeps station")


def test_at_the_end_of_a_mission_the_controller_is_stopped_where_that_is_declared(bench: Any, start: Any) -> None:
    vessel = start("path", actions__at_end="stop")
    called: list[Any] = []

    def stop(_request: Any, response: Any) -> Any:
        called.append(response)
        return response

    bench.probe.create_service(Trigger, "controller/stop", stop)
    sent = vessel.send("follow_path", path=path((20.0, 0.0)))
    vessel.until(lambda: sent.done)
    assert sent.result()[:2] == (SUCCEEDED, Code.REACHED)
    bench.until(lambda: called)
    vessel.state_of(ControlState.STOPPED, ControlState.IN_STOP)
    vessel.node.actions.tick()
    assert not vessel.node.actions._stopping


@pytest.mark.long
def test_in_real_time_a_path_that_cannot_be_sailed_is_refused_while_the_present_one_goes_on(start: Any) -> None:
    vessel = start("path", lockstep=False, motion__current=1.4)
    sent = vessel.send("follow_path", path=path((200.0, 0.0)))
    vessel.until(lambda: sent.feedback and vessel.speed > 0.3)
    narrow = vessel.send("follow_path", path=path((100.0, 0.0), (200.0, 0.0), (200.0, 20.0), (300.0, 20.0)))
    status, code, text = narrow.result()
    assert (status, code, "corner" in text) == (ABORTED, Code.REFUSED, True)
    count = len(sent.feedback)
    vessel.until(lambda: len(sent.feedback) > count)
    assert not sent.done


@pytest.mark.long
def test_in_real_time_a_cancel_stops_the_reference_at_once_and_the_next_goal_is_sailed_from_there(start: Any) -> None:
    vessel = start("path", lockstep=False, motion__acceleration=0.4)
    sent = vessel.send("follow_path", path=path((100.0, 0.0)))
    vessel.until(lambda: sent.feedback and vessel.speed > 0.5)
    assert sent.cancel() == 1
    assert sent.result()[:2] == (CANCELED, Code.CANCELLED)
    vessel.until(lambda: vessel.speed < 0.01)
    x = float(vessel.states[-1][0])
    again = vessel.send("follow_path", path=path((100.0, 0.0)))
    vessel.until(lambda: again.feedback and vessel.speed > 0.3)
    assert 0.0 < x < float(vessel.states[-1][0]) < 90.0
    steps = [math.dist(a[:2], b[:2]) for a, b in pairwise(vessel.states)]
    assert max(steps) < 1.1 * 1.5 / RATE_HZ


def test_in_real_time_of_goals_that_follow_each_other_quickly_the_last_one_is_sailed(start: Any) -> None:
    vessel = start("path", lockstep=False)
    goals = [vessel.send("follow_path", path=path((30.0 + k, 0.0))) for k in range(4)]
    last = goals.pop()
    assert {goal.result() for goal in goals} == {(ABORTED, Code.PREEMPTED, "a newer goal took its place")}
    vessel.until(lambda: last.feedback)
    cancelled = vessel.send("follow_path", path=path((50.0, 0.0)))
    assert cancelled.cancel() == 1
    assert cancelled.result()[:2] == (CANCELED, Code.CANCELLED)


@pytest.mark.long
def test_in_real_time_a_hold_discards_the_path_of_a_message_that_is_being_planned(bench: Any, start: Any) -> None:
    vessel = start("path", lockstep=False, motion__acceleration=0.4)
    publisher = bench.probe.create_publisher(Path, "path", 10)
    bench.until(publisher.get_subscription_count)
    publisher.publish(path((100.0, 0.0)))
    vessel.until(lambda: vessel.speed > 0.5)
    publisher.publish(path((100.0, 50.0)))
    assert bench.call(SetBool, "reference_ship/hold", SetBool.Request(data=True)).success
    vessel.until(lambda: vessel.speed < 0.01)
    publisher.publish(path((100.0, 50.0)))
    bench.until(lambda: "the vessel is held" in vessel.node.status()[1])
    assert bench.call(SetBool, "reference_ship/hold", SetBool.Request(data=False)).success
    vessel.until(lambda: vessel.speed > 0.3)
