"""What the reference ship sees of its vessel: odometry, the state of the controller, battery and operator.

For its actions, and for a reference that follows the vessel.
"""

import math
import time
from collections import deque
from collections.abc import Sequence
from typing import Any

from nav_msgs.msg import Odometry
from rclpy.qos import QoSProfile
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import BatteryState, NavSatFix
from std_msgs.msg import Empty
from vessel_hsmc_msgs.msg import ControlState

from vessel_hsmc_ros.control.safety.parameters import Operation, Reason
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.kinematics import Motion, Plane, same
from vessel_hsmc_ros.core.timing import NANOSECONDS
from vessel_hsmc_ros.guidance.waypoints import NONE
from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.messages.topics import DATUM
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.scenario.parameter_groups import OWNER, ActionParameters

OLD = 1.0  # age from which on odometry does not count, s
REASONS = {int(reason): reason for reason in Reason}
FULL = 1.1  # largest charge that a battery may state: some count above 1, and those in percent far above
BATTERY_SILENT = 60.0  # silence of a battery after which its charge is not known, s
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


def read_datum(message: NavSatFix) -> tuple[float, float] | None:
    """Latitude and longitude of a message on `odom/datum`, degrees; None of one that states no place."""
    try:
        plane = Plane(message.latitude, message.longitude)
    except ParameterError:
        return None
    return plane.latitude, plane.longitude


def other_datum(declared: Sequence[float], stated: Sequence[float] | None) -> str:
    """That a datum which is declared is not the one that is stated; empty if it is, or one of them is not known."""
    if stated is None or tuple(declared) == NONE or same(declared, stated):
        return ""
    return f"{OWNER}.datum must be the datum of the odometry, {stated[0]}, {stated[1]} (got {list(declared)})"


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
        return None if message is None else read_datum(message)

    def other_datum(self) -> str:
        """That the odometry states another datum than the declared one; empty if it states that one or none."""
        return other_datum(self._p.datum, self.datum())

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
        if message is None or not 0.0 <= message.percentage < self._p.battery:  # NaN is unknown, and below 0 for some drivers
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
        if self._battery.age > BATTERY_SILENT and not self._lockstep:
            return f"no battery_state for {self._battery.age:.0f} s: the charge is not known"
        if not 0.0 <= message.percentage <= FULL:
            return f"percentage of battery_state must be from 0 to 1 (got {message.percentage:g}): the charge is not known"
        return ""


class ObservedVessel:
    """Shows odometry to a reference that follows the vessel.

    In lockstep the reference takes, at each tick of the clock, the odometry of the tick before, and none at the first two: a run
    does not depend on the order in which messages come. It publishes its first state only after the first tick. The clock is
    subscribed to after the odometry, so that the plant, whose ticks come, then knows the reader of its odometry too.
    `reference`: the reference, a `FollowingReference`. `ticks`: stamps of the clock that the reference has not taken, ns.
    """

    def __init__(self, node: Any, reference: Any) -> None:
        self._node, self._reference, self._lockstep = node, reference, node.parameters.lockstep
        self.ticks: deque[int] = deque()
        self._last_tick, self._any_tick = 0, False
        self._positions: dict[int, tuple[float, float]] = {}
        self._newest: int | None = None
        self._received = 0
        # Not by `listen`, which would subscribe to the clock first where it finds that earlier.
        reader = node.create_subscription(Odometry, "odom", self._on_odometry, qos.newest(self._lockstep))
        if self._lockstep:
            node.direct_subscriptions.append(reader)
            node.connections.add_condition(lambda: "" if self.ticks else "the first tick of /clock")

    def _on_odometry(self, message: Any) -> None:
        stamp, motion = conversions.nanoseconds(message.header.stamp), conversions.read_odometry(message)
        if not self._lockstep:
            self._positions.clear()
        self._positions[stamp] = (motion.x, motion.y)
        self._newest, self._received = stamp, self._node.now()
        if self._lockstep:
            self._node.take_ticks()

    @property
    def ready(self) -> bool:
        """Whether the reference can take the next tick."""
        return bool(self.ticks) and (self._last_tick == 0 or self._last_tick in self._positions)

    def take(self) -> int:
        """Show the odometry of the tick before; returns the stamp of the tick, ns."""
        before, self._last_tick = self._last_tick, self.ticks.popleft()
        self._reference.observe(self._positions.get(before) if before else None)
        for stamp in [stamp for stamp in self._positions if stamp <= before]:
            del self._positions[stamp]
        return self._last_tick

    def show(self) -> None:
        """Real time: show the newest odometry; none where it is old."""
        self._reference.observe(None if self.problem else next(iter(self._positions.values())))

    @property
    def problem(self) -> str:
        """That there is no odometry, or that it is old; empty if neither is so, and in lockstep."""
        if self._lockstep:
            return ""
        if self._newest is None:
            return "the reference stands: no odometry on odom"
        now = self._node.now()
        # A stamp ahead of the clock is by another clock and shows no age.
        age = max(now - self._received, abs(now - self._newest))
        return f"the reference stands: odometry is {1e-9 * age:.1f} s old" if age > OLD * NANOSECONDS else ""
