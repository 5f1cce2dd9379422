"""Goals and paths of other programs: what of them counts, and which are refused."""

import math
from typing import Any

import pytest
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Path

from vessel_hsmc_ros.core.exceptions import GoalError
from vessel_hsmc_ros.messages.conversions import path_event, read_goal, read_path

BOTH = ("odom", "map")


def pose(x: float, y: float, frame: str = "", z: float = 0.0, w: float = 1.0) -> Any:
    message = PoseStamped()
    message.header.frame_id = frame
    message.pose.position.x, message.pose.position.y = x, y
    message.pose.orientation.z, message.pose.orientation.w = z, w
    return message


def path(frame: str, *poses: Any) -> Any:
    message = Path(poses=poses)
    message.header.frame_id = frame
    return message


def test_poses_of_a_path_are_in_its_frame_or_name_none() -> None:
    assert read_path(path("map", pose(1.0, 2.0), pose(3.0, 4.0, "map")), BOTH) == [(1.0, 2.0), (3.0, 4.0)]
    with pytest.raises(GoalError, match=r"pose 1 of the path must be in frame map \(got 'odom'\)"):
        read_path(path("map", pose(1.0, 2.0), pose(3.0, 4.0, "odom")), BOTH)
    with pytest.raises(GoalError, match=r"path must be in frame odom or map \(got 'base_link'\)"):
        read_path(path("base_link", pose(1.0, 2.0)), BOTH)


def test_the_length_of_a_quaternion_does_not_matter_unless_it_has_none() -> None:
    for size in (1.0, 0.01, 30.0):
        goal = pose(5.0, -6.0, "map", size * math.sin(0.35), size * math.cos(0.35))
        x, y, heading, stamp = read_goal(goal, BOTH)
        assert (x, y, stamp) == (5.0, -6.0, None)
        assert heading == pytest.approx(0.7)
    with pytest.raises(GoalError, match=r"quaternion of length 1 \(got length 0\)"):
        read_goal(pose(5.0, -6.0, "map", 0.0, 0.0), BOTH)


def test_a_stamp_of_zero_is_none_and_another_is_in_seconds() -> None:
    goal = pose(5.0, -6.0, "odom")
    goal.header.stamp.sec, goal.header.stamp.nanosec = 7, 250_000_000
    assert read_goal(goal)[3] == pytest.approx(7.25)


@pytest.mark.parametrize("here", [(0.0, 0.0), (597e3, 6640e3), (-3e4, 8e4)])
@pytest.mark.parametrize(
    ("x", "y", "text"),
    [
        (1.0, 1.01e5, "101 km"),
        (-8e4, 8e4, "113.137 km"),
        (166e3, 1e-3, "166 km"),
        (1.0, math.nan, "y = nan"),
        (math.inf, 1.0, "x = inf"),
    ],
)
def test_a_place_that_is_far_from_the_reference_is_refused_with_its_distance(here: Any, x: float, y: float, text: str) -> None:
    x, y = here[0] + x, here[1] + y
    for read, message in ((read_goal, pose(x, y, "odom")), (read_path, path("odom", pose(*here), pose(x, y)))):
        with pytest.raises(GoalError, match=text):
            read(message, here=here)  # type: ignore[operator]
        near = (here[0] + 6e4, here[1] - 7e4)
        assert read_goal(pose(*near, "odom"), here=here)[:2] == near


def test_the_event_of_a_path_has_its_length_and_its_end() -> None:
    assert path_event([(1.0, 2.0), (3.0, 4.5)]) == "2 waypoints, the last at x = 3, y = 4.5"
