"""Goals and paths for the reference of a running vessel."""

from collections.abc import Sequence

from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Path

from vessel_hsmc_ros.core.exceptions import RunError
from vessel_hsmc_ros.core.kinematics import Motion
from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.nodes.remote import CONFIRMATION_LIMIT, Remote
from vessel_hsmc_ros.nodes.remote_parameters import get_parameters

REFERENCE = "reference_ship"

Pose = tuple[float, float, float]
"""x, y, heading."""


def send_goal(remote: Remote, pose: Pose) -> str:
    """Send a goal; returns a line that confirms it.

    Raises:
        RunError: there is no reference node, or it takes no goals.
    """
    message = _pose(pose, _frame(remote, "goal"))
    return _confirmed("goal", remote.publish(message, "goal_pose", REFERENCE))


def send_path(remote: Remote, poses: Sequence[Pose]) -> str:
    """Send a path of waypoints; returns a line that confirms it.

    Raises:
        RunError: there is no reference node, or it takes no paths.
    """
    message = Path()
    message.header.frame_id = _frame(remote, "path")
    message.poses = [_pose(pose, message.header.frame_id) for pose in poses]
    return _confirmed("path", remote.publish(message, "path", REFERENCE))


def _frame(remote: Remote, mode: str) -> str:
    """The frame in which the reference node takes goals or paths.

    Raises:
        RunError: it is in another mode.
    """
    values = get_parameters(remote, REFERENCE, ("mode", "frame_prefix", "frames"))
    if values["mode"] != mode:
        raise RunError(
            f"{remote.name(REFERENCE)} takes no {mode}: its mode is {values['mode']};"
            f" start the run with --set reference_ship.mode={mode}"
        )
    return str(values["frame_prefix"]) + str([*values["frames"], conversions.WORLD][0])


def _pose(pose: Pose, frame: str) -> PoseStamped:
    """A pose without a stamp, so that its time is that of its receipt, in lockstep too."""
    message = conversions.new_pose()
    message.header.frame_id = frame
    conversions.write_pose(message.pose, Motion(*pose, 0.0, 0.0, 0.0))
    return message


def _confirmed(kind: str, text: str) -> str:
    return f"{kind}: {text}" if text else f"{kind} sent; {REFERENCE} reported no new {kind} within {CONFIRMATION_LIMIT:g} s"
