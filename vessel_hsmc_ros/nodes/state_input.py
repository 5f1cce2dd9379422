"""The measured motion in the forms in which stacks publish it: odometry, or a pose and a twist on two topics."""

from collections.abc import Callable
from typing import Any

from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, TwistStamped
from nav_msgs.msg import Odometry
from rclpy.qos import QoSProfile

from vessel_hsmc_ros.core.timing import NANOSECONDS
from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.nodes.base import VesselNode
from vessel_hsmc_ros.nodes.controller_inputs import Measured, read_odometry

POSES = {"pose_twist": PoseStamped, "pose_covariance_twist": PoseWithCovarianceStamped}


def listen_to_state(node: VesselNode, take: Callable[[Measured], None], profile: QoSProfile) -> "PoseAndTwist | None":
    """Subscribe to the measured motion in the form of the parameter `odometry.form`.

    Args:
        node: The controller.
        take: Called with each measurement.
        profile: Of the subscriptions.

    Returns:
        What joins two topics; None with odometry, which is whole.
    """
    p = node.parameters.odometry
    if p.form == "odometry":
        node.listen(Odometry, "odom", lambda message: take(read_odometry(message, p.twist_frame)), profile)
        return None
    joined = PoseAndTwist(node, take)
    node.listen(POSES[p.form], "pose", joined.take_pose, profile)
    node.listen(TwistStamped, "twist", joined.take_twist, profile)
    return joined


class PoseAndTwist:
    """Joins a pose and a twist: those of one stamp, where the publisher stamps them alike, else each pose and the last twist.

    Args:
        node: The controller.
        take: Called with each measurement.
    """

    def __init__(self, node: VesselNode, take: Callable[[Measured], None]) -> None:
        self._node, self._take = node, take
        self._twist: Any = None
        self._waiting: Any = None
        self._last_pose = -1
        self._alike = False

    def take_twist(self, message: TwistStamped) -> None:
        """Take a twist; a pose that waits for it goes on."""
        self._twist = message
        self._alike = conversions.nanoseconds(message.header.stamp) == self._last_pose
        if self._waiting is not None:
            self._join(self._waiting)

    def take_pose(self, message: Any) -> None:
        """Take a pose, and wait for its twist if that comes after it."""
        if self._waiting is not None:  # its twist was lost
            self._join(self._waiting)
        self._last_pose = stamp = conversions.nanoseconds(message.header.stamp)
        if self._alike and self._twist_stamp() < stamp:
            self._waiting = message
        else:
            self._join(message)

    def _twist_stamp(self) -> int:
        return conversions.nanoseconds(self._twist.header.stamp) if self._twist is not None else -1

    def _join(self, pose: Any) -> None:
        self._waiting = None
        timeout = self._node.parameters.input_timeout
        topic = self._node.resolve_topic_name("twist")
        apart = abs(conversions.nanoseconds(pose.header.stamp) - self._twist_stamp())
        if self._twist is None or apart > timeout * NANOSECONDS:
            text = f"pose without a twist of its time on {topic}, within {timeout:g} s, is ignored"
            self._node.get_logger().error(text, throttle_duration_sec=1.0)
            return
        message = Odometry(header=pose.header)
        with_covariance = hasattr(pose.pose, "covariance")
        message.pose.pose = pose.pose.pose if with_covariance else pose.pose
        if with_covariance:
            message.pose.covariance = pose.pose.covariance
        message.twist.twist = self._twist.twist
        self._take(read_odometry(message, self._node.parameters.odometry.twist_frame))
