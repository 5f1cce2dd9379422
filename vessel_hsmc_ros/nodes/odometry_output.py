"""The odometry of a node, with its pose as a transform on /tf (REP-105), and its datum."""

from collections.abc import Callable
from importlib import import_module
from typing import Any

from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import NavSatFix

from vessel_hsmc_ros.core.exceptions import InstallationError
from vessel_hsmc_ros.core.kinematics import Motion
from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.messages.topics import DATUM
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.base import VesselNode


def transform_of(odometry: Odometry) -> TransformStamped:
    """The transform from the child frame of odometry to its frame."""
    stamped = TransformStamped(header=odometry.header, child_frame_id=odometry.child_frame_id)
    position, translation = odometry.pose.pose.position, stamped.transform.translation
    translation.x, translation.y, translation.z = position.x, position.y, position.z
    stamped.transform.rotation = odometry.pose.pose.orientation
    return stamped


def transform_publisher(node: VesselNode) -> Callable[[Odometry], None]:
    """A function that publishes the transform of odometry on /tf; without `publish_tf` it does nothing."""
    if not node.parameters.publish_tf:
        return lambda _: None
    try:
        kind = import_module("tf2_msgs.msg").TFMessage
    except ModuleNotFoundError:
        raise InstallationError(
            f"{node.NAME}.publish_tf must be false without tf2_msgs, which comes with a ROS install (got true)"
        ) from None
    publisher = node.create_publisher(kind, "/tf", qos.STREAM)
    return lambda odometry: publisher.publish(kind(transforms=[transform_of(odometry)]))


def datum_publisher(node: Any, frame: str) -> Callable[[float, float], None]:
    """A function that publishes the datum of a node's odometry, latitude and longitude in degrees; the newest one is latched."""
    publisher = node.create_publisher(NavSatFix, DATUM, qos.LATCHED)

    def publish(latitude: float, longitude: float) -> None:
        message = NavSatFix(latitude=latitude, longitude=longitude)
        message.header.stamp = node.get_clock().now().to_msg()
        message.header.frame_id = frame
        publisher.publish(message)

    return publish


class OdometryOutput:
    """The odometry of a node in real time, on `odom`, with its transform; no other node may publish it.

    `rate`: that its deadline is offered for, Hz. `frame`: of the poses, without the prefix.

    Attributes:
        message: What is published; its covariances are those of the last motion.
        published: Number of messages.
    """

    def __init__(self, node: VesselNode, rate: float, frame: str = conversions.WORLD) -> None:
        self._node = node
        self.message = conversions.new_odometry()
        self.message.header.frame_id = frame
        node.framed(self.message)
        self.published = 0
        self._publisher = node.advertise(Odometry, "odom", qos.offered(False, rate))
        node.connections.allow_one_publisher("odom")
        self._publish_transform = transform_publisher(node)

    def publish(self, stamp: int, motion: Motion) -> None:
        """Publish a motion of a time, ns."""
        conversions.write_odometry(self.message, conversions.time_message(stamp), motion)
        self._node.send(self._publisher, self.message)
        self._publish_transform(self.message)
        self.published += 1
