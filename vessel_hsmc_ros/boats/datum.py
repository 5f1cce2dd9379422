"""The datum of an odometry on a topic, where everything that has latitude and longitude reads it."""

from collections.abc import Callable
from typing import Any

from sensor_msgs.msg import NavSatFix

from vessel_hsmc_ros.messages.topics import DATUM
from vessel_hsmc_ros.nodes import qos


def datum_publisher(node: Any, frame: str) -> Callable[[float, float], None]:
    """A function that publishes the datum of a node's odometry, latitude and longitude in degrees; the newest one is latched."""
    publisher = node.create_publisher(NavSatFix, DATUM, qos.LATCHED)

    def publish(latitude: float, longitude: float) -> None:
        message = NavSatFix(latitude=latitude, longitude=longitude)
        message.header.stamp = node.get_clock().now().to_msg()
        message.header.frame_id = frame
        publisher.publish(message)

    return publish
