"""A client of the actions of a running vessel: sends a goal, shows its progress, cancels it at Ctrl-C, returns its result."""

from collections.abc import Callable, Sequence
from importlib import import_module
from typing import Any, NamedTuple

from action_msgs.msg import GoalStatus
from nav_msgs.msg import Path
from rclpy.action import ActionClient, get_action_names_and_types

from vessel_hsmc_ros.core.exceptions import RunError
from vessel_hsmc_ros.core.node_list import REFERENCE
from vessel_hsmc_ros.nodes.remote import (
    ANSWER_LIMIT,
    DISCOVERY_LIMIT,
    REPEAT_AFTER,
    Pose,
    Remote,
    bearing,
    frame_of,
    pose_message,
)

LOOK = 0.5  # time after which it is looked at whether the server is still there, s
GONE = 5.0  # time after which a server that is not there has ended, s


class Progress(NamedTuple):
    """How far a goal has come; legs and time are 0 where the type of the action has none."""

    distance: float  # m
    speed: float  # m/s
    leg: int
    legs: int
    time_left: float  # s


class Result(NamedTuple):
    """How a goal has ended."""

    reached: bool
    text: str


Show = Callable[[Progress], None]


def sail_to(remote: Remote, x: float, y: float, heading: float | None, show: Show) -> Result:
    """Sail to a pose, and wait for the end.

    `heading`: None for the bearing of the goal from where the reference is now.
    """
    frame = frame_of(remote, "goal", "path")
    pose = pose_message((x, y, bearing(remote, x, y) if heading is None else heading), frame)
    return _sail(remote, "navigate_to_pose", {"pose": pose}, show)


def sail_along(remote: Remote, poses: Sequence[Pose], show: Show) -> Result:
    """Sail along waypoints, and wait for the end; raises as `sail_to`."""
    path = Path()
    path.header.frame_id = frame_of(remote, "path")
    path.poses = [pose_message(pose, path.header.frame_id) for pose in poses]
    return _sail(remote, "follow_path", {"path": path}, show)


def _sail(remote: Remote, name: str, fields: dict[str, Any], show: Show) -> Result:
    kind = _type(remote, name)
    client = ActionClient(remote.node, kind, remote.name(name))
    if not remote.until(client.server_is_ready, DISCOVERY_LIMIT):
        raise RunError(f"no action {remote.name(name)} within {DISCOVERY_LIMIT:g} s")
    sending: Any = None
    try:
        for _ in range(int(ANSWER_LIMIT / REPEAT_AFTER)):  # a response is lost if the server has not discovered the client yet
            sending = client.send_goal_async(kind.Goal(**fields), lambda message: show(_progress(message.feedback)))
            if remote.until(sending.done, REPEAT_AFTER):
                break
        if not sending.done() or not sending.result().accepted:
            raise RunError(f"{remote.name(REFERENCE)} has not accepted the goal within {ANSWER_LIMIT:g} s")
        return _result(_awaited(remote, client, sending.result()))
    except KeyboardInterrupt:
        _cancel(remote, sending)
        raise
    finally:
        client.destroy()


def _type(remote: Remote, name: str) -> Any:
    """The type that the server has: that of nav2_msgs, or of this package."""
    full = remote.name(name)

    def kinds() -> list[str]:
        return list(dict(get_action_names_and_types(remote.node)).get(full, []))

    if not remote.until(kinds, DISCOVERY_LIMIT):
        raise RunError(f"{remote.name(REFERENCE)} has no action {full}: is it of an older version?")
    package, _, kind = kinds()[0].split("/")
    try:
        return getattr(import_module(f"{package}.action"), kind)
    except (ImportError, AttributeError):
        raise RunError(f"{package}/action/{kind}, the type of {full}, is not installed here") from None


def _awaited(remote: Remote, client: ActionClient, handle: Any) -> Any:
    """Wait for the result. Raises RunError if the server has ended without one."""
    result, absent = handle.get_result_async(), 0.0
    while not remote.until(result.done, LOOK):
        absent = 0.0 if client.server_is_ready() else absent + LOOK
        if absent > GONE:
            raise RunError(f"{remote.name(REFERENCE)} has ended before the goal")
    return result.result()


def _cancel(remote: Remote, sending: Any) -> None:
    """Cancel the goal, also one that has not been accepted yet."""
    if sending is not None and remote.until(sending.done, REPEAT_AFTER) and sending.result().accepted:
        remote.until(sending.result().cancel_goal_async().done, ANSWER_LIMIT)


def _result(response: Any) -> Result:
    reached, result = response.status == GoalStatus.STATUS_SUCCEEDED, response.result
    text = getattr(result, "error_msg", "") or ("reached" if reached else f"ended with code {result.error_code}")
    return Result(reached, str(text))


def _progress(feedback: Any) -> Progress:
    left = getattr(feedback, "distance_remaining", getattr(feedback, "distance_to_goal", 0.0))
    time = getattr(feedback, "estimated_time_remaining", None)
    legs = int(getattr(feedback, "leg", 0)), int(getattr(feedback, "legs", 0))
    return Progress(float(left), float(getattr(feedback, "speed", 0.0)), *legs, float(time.sec) if time else 0.0)
