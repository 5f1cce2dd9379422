"""One topic of the relay: its message type, its faults, and the serialised messages that these make."""

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from rclpy.serialization import deserialize_message, serialize_message
from std_msgs.msg import Float64

from vessel_hsmc_ros.core.kinematics import Motion
from vessel_hsmc_ros.faults.fault import FaultScript
from vessel_hsmc_ros.faults.schedule import Delivery, TopicSchedule
from vessel_hsmc_ros.messages import conversions, raw
from vessel_hsmc_ros.messages.edits import edit
from vessel_hsmc_ros.messages.topics import message_type

if TYPE_CHECKING:
    from rclpy.publisher import Publisher

_NAN = (math.nan,) * 6


class RelayedTopic:
    """A topic that passes through the relay.

    Args:
        script: The faults of the run.
        topic: Its name, without the namespace.

    Attributes:
        kind: The message class.
        stamped: Whether its messages have a header.
        schedule: Its faults.
        sent: Number of messages passed on.
    """

    out: "Publisher"

    def __init__(self, script: FaultScript, topic: str) -> None:
        self.topic = topic
        self.kind = raw.message_class(message_type(topic))
        self.stamped = raw.begins_with_stamp(self.kind)
        self.schedule = TopicSchedule(script, topic)
        self.sent = 0

    def stamp(self, data: bytes) -> int:
        """The stamp of a serialised message, ns; 0 where it has none."""
        return raw.stamp(data) if self.stamped else 0

    def altered(self, delivery: Delivery) -> bytes:
        """The serialised message of a delivery; without a fault, that which was received."""
        data: bytes = delivery.message
        if self.stamped and delivery.stamp != raw.stamp(data):
            data = raw.with_stamp(data, delivery.stamp)
        if delivery.edits:
            message = deserialize_message(data, self.kind)
            for change in delivery.edits:
                edit(message, *change)
            data = serialize_message(message)
        return data

    def nothing(self, step: int) -> Any:
        """The announcement that there is nothing of this topic in a step, ns: no frame, and NaN everywhere."""
        if not self.stamped:
            return Float64(data=math.nan)
        message, stamp = self.kind(), conversions.time_message(step)
        if self.topic == "odom":
            conversions.write_odometry(message, stamp, Motion(*_NAN))
        elif self.topic == "reference":
            conversions.write_reference(message, stamp, np.array(_NAN), np.array(_NAN[:3]))
        else:
            conversions.write_wrench(message, stamp, _NAN[:2])
        return message
