"""What the reference ship sees of its vessel: odometry, the state of the controller, battery and operator."""

import math
import time
from typing import Any

from nav_msgs.msg import Odometry
from rclpy.qos import QoSProfile
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import BatteryState, NavSatFix
from std_msgs.msg import Empty
from vessel_hsmc_msgs.msg import ControlState

from vessel_hsmc_ros.control.safety.reasons import Operation, Reason
from vessel_hsmc_ros.core.kinematics import Motion
from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.messages.topics import DATUM
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.scenario.action_parameters import ActionParameters

OLD = 1.0  # age from which on odometry does not count, s
REASONS = {int(reason): reason for reason in Reason}
SILENT = 3.0  # silence after which a controller counts as gone, s


class Latest:
    """The newest message of a topic, read when it is asked for: most come for nothing."""

    def __init__(self, node: Any, kind: Any, topic: str, profile: QoSProfile = qos.LATEST) -> None:
        self._kind, self._data, self.at = kind, b"", -math.inf
        node.create_subscription(kind, topic, self._take, profile, raw=True)

    def _take(self, data: bytes) -> None:
        self._data, self.at = data, time.monotonic()

    @property
    def age(self) -> float:
        """Time since the newest message was received, s."""
        return time.monotonic() - self.at

    def read(self) -> Any:
        """The newest message; None without one, or of one that cannot be read."""
        try:
            return deserialize_message(self._data, self._kind) if self._data else None
        except RuntimeError:  # of the middleware
            return None


class VesselSight:
    """Subscribes to what is declared, and states it in words."""

    def __init__(self, node: Any, p: ActionParameters) -> None:
        self._p, self._lockstep, self._begun = p, node.parameters.lockstep, time.monotonic()
        self._odometry = Latest(node, Odometry, "odom")
        self._controller = Latest(node, ControlState, "controller/state")
        self._datum = None if self._lockstep else Latest(node, NavSatFix, DATUM, qos.LATCHED)
        self._battery = Latest(node, BatteryState, "battery_state") if p.battery else None
        self._operator = Latest(node, Empty, "operator_heartbeat") if p.operator_timeout else None

    def motion(self) -> Motion | None:
        """The motion of the vessel; None where it is not known, or old."""
        if self._odometry.age > OLD and not self._lockstep:
            return None
        message = self._odometry.read()
        motion = None if message is None else conversions.read_odometry(message)
        return motion if motion is not None and all(map(math.isfinite, motion)) else None

    def datum(self) -> tuple[float, float] | None:
        """Latitude and longitude of the origin of the odometry, degrees; None where no node states them."""
        message = self._datum.read() if self._datum else None
        return (message.latitude, message.longitude) if message is not None else None

    def operation(self) -> Operation | None:
        """What the controller does; None where it has never been heard of."""
        message = self._controller.read()
        return Operation(message.operation) if message is not None and message.operation in set(Operation) else None

    def controller(self) -> tuple[str, str]:
        """Why the controller does not command, and the reason of its safe action; empty where neither is so.

        One that was never heard of may be another program, and is not judged.
        """
        message = self._controller.read()
        if message is None:
            return "", ""
        if self._controller.age > SILENT and not self._lockstep:
            return f"controller silent for more than {SILENT:g} s", ""
        reason = REASONS.get(message.reason)
        text = f"{reason.name}, {reason.text}" if reason else f"reason {message.reason}"
        for standing in (Operation.STANDBY, Operation.STOPPED):
            if message.operation == standing:
                return f"controller in {standing.name.lower()}: {text}", ""
        return "", text if message.operation == Operation.SAFE else ""

    def battery(self) -> str:
        """That the battery is low; empty if it is not, or not known."""
        message = self._battery.read() if self._battery else None
        if message is None or not message.percentage < self._p.battery:  # NaN is unknown
            return ""
        return f"battery at {100.0 * message.percentage:.0f} %, below {100.0 * self._p.battery:.0f} %"

    def operator(self) -> str:
        """That the operator is lost; empty if not."""
        if self._operator is None:
            return ""
        silence = min(self._operator.age, time.monotonic() - self._begun)
        return f"no operator_heartbeat for {self._p.operator_timeout:g} s" if silence > self._p.operator_timeout else ""

    def problem(self) -> str:
        """What is declared and not known: the charge of the battery."""
        if self._battery is None:
            return ""
        message = self._battery.read()
        if message is None:
            return "no battery_state has been received"
        return "battery_state has no percentage" if math.isnan(message.percentage) else ""
