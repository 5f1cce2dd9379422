"""PX4 of a boat with two thrusters as its DDS bridge shows it, in plain rclpy, without code of the package.

It behaves as PX4's differential rovers do: setpoints have an effect in Offboard, where the last ones hold, and Offboard ends when
OffboardControlMode does not come for a second.
"""

import math
import time
from collections.abc import Sequence
from typing import Any

from definitions import module
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

MANUAL, OFFBOARD = 0, 14
NED, BODY = 1, 3
LOST_AFTER = 1.0
SENT = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT, durability=DurabilityPolicy.TRANSIENT_LOCAL)
TAKEN = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)


class Autopilot:
    """Speaks the topics of PX4 1.17 by a node.

    Attributes:
        armed, mode, failsafe: As VehicleStatus has them.
        silent: Whether it sends nothing.
        setpoints: All pairs of throttle and steering that it has received, with the mode at that time.
        velocity_frame: That of VehicleOdometry.
    """

    def __init__(self, node: Node, status_topic: str = "fmu/out/vehicle_status") -> None:
        self.msg = module("px4_msgs.msg")
        self.armed, self.mode, self.failsafe, self.silent = True, MANUAL, False, False
        self.throttle = self.steering = 0.0
        self.setpoints: list[tuple[float, float, int]] = []
        self.control: Any = None
        self.controls = 0
        self.controlled_at = -math.inf
        self.velocity_frame = NED
        self.began = time.monotonic() - 100.0
        self.status_due = 0.0
        self.odometry_out = node.create_publisher(self.msg.VehicleOdometry, "fmu/out/vehicle_odometry", SENT)
        self.status_out = node.create_publisher(self.msg.VehicleStatus, status_topic, SENT)
        for kind, topic, take in (
            (self.msg.OffboardControlMode, "offboard_control_mode", self._on_control),
            (self.msg.RoverThrottleSetpoint, "rover_throttle_setpoint", self._on_throttle),
            (self.msg.RoverSteeringSetpoint, "rover_steering_setpoint", self._on_steering),
        ):
            node.create_subscription(kind, f"fmu/in/{topic}", take, TAKEN)

    def _on_control(self, message: Any) -> None:
        self.control, self.controlled_at = message, time.monotonic()
        self.controls += 1

    def _on_throttle(self, message: Any) -> None:
        self.throttle = message.throttle_body_x

    def _on_steering(self, message: Any) -> None:
        self.steering = message.normalized_steering_setpoint
        self.setpoints.append((self.throttle, self.steering, self.mode))

    def change(self, **values: Any) -> None:
        """Change the status, which is sent at once."""
        for name, value in values.items():
            setattr(self, name, value)
        self.status_due = 0.0

    def select_offboard(self) -> bool:
        """Select Offboard; whether it was accepted."""
        recent = time.monotonic() - self.controlled_at < LOST_AFTER
        if recent and self.control.thrust_and_torque:
            self.change(mode=OFFBOARD)
        return self.mode == OFFBOARD

    def thrusts(self) -> tuple[float, float]:
        """The shares of the left and the right thruster: steering to starboard goes before throttle."""
        if self.mode == OFFBOARD and time.monotonic() - self.controlled_at > LOST_AFTER:
            self.change(mode=MANUAL, failsafe=True)
        if not self.armed or self.mode != OFFBOARD:
            return 0.0, 0.0
        room = 1.0 - abs(self.steering)
        throttle = max(-room, min(room, self.throttle))
        return throttle + self.steering, throttle - self.steering

    def report(self, state: Sequence[float]) -> None:
        """Send the motion x, y, psi, u, v, r (east, north, counter-clockwise), and the status twice a second."""
        if self.silent:
            return
        since_boot = round((time.monotonic() - self.began) * 1e6)
        x, y, psi, u, v, r = state
        yaw = 0.5 * math.pi - psi
        message = self.msg.VehicleOdometry(timestamp=since_boot, timestamp_sample=since_boot, pose_frame=NED)
        message.position, message.q = [y, x, 0.0], [math.cos(0.5 * yaw), 0.0, 0.0, math.sin(0.5 * yaw)]
        message.velocity_frame = self.velocity_frame
        north, east = u * math.cos(yaw) + v * math.sin(yaw), u * math.sin(yaw) - v * math.cos(yaw)
        message.velocity = [u, -v, 0.0] if self.velocity_frame == BODY else [north, east, 0.0]
        message.angular_velocity = [0.0, 0.0, -r]
        self.odometry_out.publish(message)
        if time.monotonic() >= self.status_due:
            self.status_due = time.monotonic() + 0.5
            status = self.msg.VehicleStatus(timestamp=since_boot, nav_state=self.mode, failsafe=self.failsafe)
            status.arming_state = 2 if self.armed else 1
            self.status_out.publish(status)
