"""The PX4 node: makes odometry of VehicleOdometry, and passes commands on as throttle and steering in the mode Offboard."""

import math
import time
from typing import Any

from px4_msgs.msg import OffboardControlMode, RoverSteeringSetpoint, RoverThrottleSetpoint, VehicleOdometry, VehicleStatus

from vessel_hsmc_ros.boats import autopilot as px4
from vessel_hsmc_ros.boats.autopilot import FAILSAFE
from vessel_hsmc_ros.boats.parameters import Px4Parameters
from vessel_hsmc_ros.boats.takeover import AutopilotNode
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.base import LAST_COMMANDS
from vessel_hsmc_ros.nodes.commands import finite

RATE = 50.0  # rate of VehicleOdometry that the deadline of the odometry is offered for, Hz
MICROSECOND = 1000  # in nanoseconds, the unit of time here; PX4 counts in microseconds
MODE_PREFIX = "NAVIGATION_STATE_"

STEERING = ("normalized_steering_setpoint", "normalized_speed_diff")
"""The fields of RoverSteeringSetpoint, of which each version of PX4 has one: 1.17 and later, 1.16."""


class Px4Node(AutopilotNode):
    """Publishes odometry from PX4's estimate, and passes commands on while PX4 is ready for them.

    OffboardControlMode is streamed from the start, because PX4 needs it before Offboard can be selected, and its end is what PX4
    notices when this computer dies. Setpoints are sent in Offboard only, and there always: PX4 would keep the last one. They are
    zero unless the controller is not in standby and its commands are fresh. When PX4 is disarmed, leaves Offboard, reports a
    failsafe or falls silent, the controller is put into standby: only a person enables it again. The node neither arms nor
    changes modes.
    """

    NAME = "px4"
    REAL_TIME = "an autopilot works"
    INTERFACE = """
        subscribes to  fmu/out/vehicle_odometry, fmu/out/vehicle_status, cmd_wrench, controller/state
        publishes      odom, events, fmu/in/offboard_control_mode, fmu/in/rover_throttle_setpoint, fmu/in/rover_steering_setpoint
        services       ~/stop, ~/rearm
        calls          controller/enable
    """
    PARAMETERS = Px4Parameters

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        p = self.parameters
        modes = {getattr(VehicleStatus, n): n.removeprefix(MODE_PREFIX) for n in dir(VehicleStatus) if n.startswith(MODE_PREFIX)}
        self._mode, self._heard, self._resets, self._received = -1, -math.inf, -1, 0
        self._command = (0.0, 0.0)
        self._input = self.take_wrench()
        self.connect(px4.OFFBOARD, modes, RATE)
        self._create_topics()
        self.create_timer(1.0 / p.rate_hz, self._on_timer, clock=self.wall)

    def _create_topics(self) -> None:
        stream = qos.data(False)
        self._mode_out = self.advertise(OffboardControlMode, "fmu/in/offboard_control_mode", stream)
        self._throttle_out = self.advertise(RoverThrottleSetpoint, "fmu/in/rover_throttle_setpoint", stream)
        self._steering_out = self.advertise(RoverSteeringSetpoint, "fmu/in/rover_steering_setpoint", stream)
        self._steering = next(name for name in STEERING if hasattr(RoverSteeringSetpoint, name))
        self.listen(VehicleOdometry, "fmu/out/vehicle_odometry", self._on_odometry, qos.NEWEST)
        self.listen(VehicleStatus, "fmu/out/vehicle_status", self._on_status, qos.NEWEST)

    def describe(self) -> str:
        """The limits and the times."""
        p = self.parameters
        limits = f"1 is {p.surge_force_limit:g} N and {p.yaw_moment_limit:g} N·m"
        return f"throttle and steering in Offboard, {limits}, time-out {p.command_timeout:g} s, ramp {p.ramp_time:g} s"

    def _on_status(self, message: Any) -> None:
        self._mode, self._heard = message.nav_state, time.monotonic()
        armed = message.arming_state == px4.ARMED
        self._handover.heartbeat(self._heard, armed, message.nav_state, FAILSAFE[0] if message.failsafe else 0)
        self._takeover.act()

    def _on_odometry(self, message: Any) -> None:
        """Publish the motion, with the time of this computer: PX4's may count from its start, or by another clock."""
        self._received += 1
        stamp = self.sampled((message.timestamp_sample or message.timestamp) * 1e-6)
        if problem := px4.problem(message):
            self.refuse(f"no odometry: VehicleOdometry: {problem}")
            return
        if message.reset_counter != self._resets:
            if self._resets >= 0:
                self.get_logger().warning("the estimator of PX4 has been reset: position or heading may have jumped")
            self._resets = message.reset_counter
        self._odometry.publish(stamp, px4.motion_of(message))

    def _on_timer(self) -> None:
        now, p = time.monotonic(), self.parameters
        self._handover.check(now)
        self._takeover.act()
        self.send(self._mode_out, OffboardControlMode(timestamp=self._timestamp(), thrust_and_torque=True))
        allowed = self._handover.passes(now)
        wrench = self._input.present() if allowed and not self._latch.stopped else None
        if wrench is not None:
            self._command = p.shares(wrench)
        share = self._latch.update(wrench is not None, allowed)
        self._send(share * self._command[0], share * self._command[1])

    def end(self) -> None:
        """Send zero."""
        self._send(0.0, 0.0)

    def _send(self, throttle: float, to_port: float) -> None:
        """Send shares of force and moment in Offboard; in other modes they would compete with PX4's own setpoints."""
        if self._mode != px4.OFFBOARD:
            return
        throttle, to_port = finite((throttle, to_port), self.refuse)
        at = self._timestamp()
        # The other direction is that of boats with thrusters to the side.
        self.send(self._throttle_out, RoverThrottleSetpoint(timestamp=at, throttle_body_x=throttle, throttle_body_y=math.nan))
        self.send(self._steering_out, RoverSteeringSetpoint(timestamp=at, **{self._steering: -to_port}))

    def _timestamp(self) -> int:
        """The time of PX4, µs, by its own stamps: that of this computer may be stepped; before the first one, the latter."""
        at = self._boot.stamp(time.monotonic())
        return self.now() // MICROSECOND if at is None else round(at * 1e6)

    def close(self) -> None:
        """Leave the autopilot with zero, several times; it ends Offboard by its own time-out."""
        if self.connected:
            for _ in range(LAST_COMMANDS):
                self.end()
        super().close()

    def values(self) -> dict[str, Any]:
        """The number of odometry messages."""
        return {"odometry": self._odometry.published}

    def awaited(self) -> str:
        """The topic of PX4 on which nothing has come."""
        for topic, awaited in (("vehicle_status", self._heard == -math.inf), ("vehicle_odometry", not self._received)):
            if awaited:
                return f"waiting for {self.resolve_topic_name('fmu/out/' + topic)}"
        return ""
