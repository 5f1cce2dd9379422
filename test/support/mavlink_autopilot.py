"""An autopilot of a boat with skid steering in plain pymavlink, without code of the package: its messages, modes and overrides.

It behaves as ArduPilot's surface vehicles do: MANUAL takes MANUAL_CONTROL and overrides of the radio for 3 s, GUIDED takes speed
and turn rate, and it sends only what has been requested. The boat's motion comes from its user.
"""

import math
import os
import time
from typing import Any

os.environ["MAVLINK20"] = "1"

from pymavlink import mavutil
from pymavlink.dialects.v20 import ardupilotmega as mavlink

MANUAL, HOLD, GUIDED = 0, 4, 15
TIMEOUT = 3.0
NEUTRAL, HALF_RANGE = 1500, 400
STEERING, THROTTLE = 1, 3
BOOTED_BEFORE = 100.0
HEALTHY = 831
ORIGIN = (599000000, 107000000)


class Autopilot:
    """Speaks with each of some addresses, such as udpout:127.0.0.1:14550 for a program that listens there.

    Attributes:
        armed, mode, state: As HEARTBEAT has them.
        silent: Whether it sends nothing.
        radio: Pulse widths of the pilot's sticks by channel.
        servos: Pulse widths of the outputs by number.
        parameters: Values by name; a request of another one has no answer.
    """

    def __init__(self, *addresses: str, system: int = 1) -> None:
        opened = mavutil.mavlink_connection
        self.links = [opened(a, source_system=system, source_component=1, dialect="ardupilotmega") for a in addresses]
        self.armed, self.mode, self.state, self.silent = True, MANUAL, mavlink.MAV_STATE_ACTIVE, False
        self.filter = HEALTHY
        self.radio = {STEERING: NEUTRAL, THROTTLE: NEUTRAL}
        self.overrides: dict[int, tuple[float, int]] = {}
        self.guided = (-math.inf, 0.0, 0.0)
        self.servos = {1: NEUTRAL, 3: NEUTRAL}
        self.passed_through: tuple[int, ...] = ()
        self.intervals: dict[int, float] = {mavlink.MAVLINK_MSG_ID_HEARTBEAT: 1.0}
        self.due: dict[int, float] = {}
        self.heard: list[Any] = []
        self.parameters: dict[str, float] = {}
        self.began = time.monotonic() - BOOTED_BEFORE

    @property
    def since_boot(self) -> int:
        return round((time.monotonic() - self.began) * 1e3)

    def send(self, name: str, *values: Any) -> None:
        for link in self.links:
            getattr(link.mav, f"{name}_send")(*values)

    def heartbeat(self) -> None:
        base = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | (mavlink.MAV_MODE_FLAG_SAFETY_ARMED if self.armed else 0)
        self.send("heartbeat", mavlink.MAV_TYPE_SURFACE_BOAT, mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, base, self.mode, self.state)

    def change(self, **values: Any) -> None:
        """Change mode, armed or state, which a heartbeat reports at once."""
        for name, value in values.items():
            setattr(self, name, value)
        self.heartbeat()

    # -- what it takes ------------------------------------------------------------------------------------------------

    def receive(self) -> None:
        for link in self.links:
            while (message := link.recv_msg()) is not None:
                take = getattr(self, f"on_{message.get_type().lower()}", None)
                self.heard.append(message)
                if take:
                    take(message)

    def on_set_mode(self, message: Any) -> None:
        self.change(mode=message.custom_mode)

    def on_command_long(self, message: Any) -> None:
        number, now = message.command, time.monotonic()
        if number == mavlink.MAV_CMD_SET_MESSAGE_INTERVAL:
            self.intervals[int(message.param1)] = message.param2 * 1e-6
            self.due[int(message.param1)] = now
        elif number == mavlink.MAV_CMD_REQUEST_MESSAGE:
            self.due[int(message.param1)] = now
        elif number == mavlink.MAV_CMD_DO_SET_MODE:
            self.change(mode=int(message.param2))
        elif number == mavlink.MAV_CMD_COMPONENT_ARM_DISARM:
            self.change(armed=bool(message.param1))
        self.send("command_ack", number, mavlink.MAV_RESULT_ACCEPTED)

    def on_param_request_read(self, message: Any) -> None:
        if message.param_id in self.parameters:
            value, kind = self.parameters[message.param_id], mavlink.MAV_PARAM_TYPE_REAL32
            self.send("param_value", message.param_id.encode(), value, kind, len(self.parameters), 0xFFFF)

    def on_manual_control(self, message: Any) -> None:
        for channel, axis in ((STEERING, message.y), (THROTTLE, message.z)):
            self.override(channel, round(NEUTRAL + HALF_RANGE * axis / 1000))

    def on_rc_channels_override(self, message: Any) -> None:
        for channel in range(1, 9):
            self.override(channel, getattr(message, f"chan{channel}_raw"))

    def override(self, channel: int, width: int) -> None:
        if width == 0:
            self.overrides.pop(channel, None)
        elif width != 65535:
            self.overrides[channel] = time.monotonic(), width

    def on_set_attitude_target(self, message: Any) -> None:
        if not message.type_mask & 0b100_0100:  # thrust and body yaw rate count
            self.guided = time.monotonic(), message.thrust, message.body_yaw_rate

    # -- what it gives ------------------------------------------------------------------------------------------------

    def channel(self, number: int) -> int:
        """The pulse width of a channel of the radio, as overridden."""
        at, width = self.overrides.get(number, (-math.inf, 0))
        return width if time.monotonic() - at < TIMEOUT else self.radio.get(number, 0)

    def step(self, speed: float, turn_rate: float, cruise: float = 2.0) -> tuple[float, float]:
        """Drive for a speed ahead and a turn rate clockwise; returns the thrust of the left and the right thruster, -1 to 1."""
        throttle = steering = 0.0
        at, share, rate = self.guided
        if not self.armed or self.mode not in (MANUAL, GUIDED):
            pass
        elif self.mode == MANUAL:
            throttle, steering = ((self.channel(c) - NEUTRAL) / HALF_RANGE for c in (THROTTLE, STEERING))
        elif time.monotonic() - at < TIMEOUT:
            demand = share * cruise
            throttle = 0.25 * demand + 3.5 * (demand - speed)
            steering = 1.6 * rate + 8.0 * (rate - turn_rate)
        left, right = (max(-1.0, min(1.0, value)) for value in (throttle + steering, throttle - steering))
        if self.passed_through and self.armed and self.mode == MANUAL:
            left, right = ((self.channel(c) - NEUTRAL) / HALF_RANGE for c in self.passed_through)
        self.servos = {1: round(NEUTRAL + HALF_RANGE * left), 3: round(NEUTRAL + HALF_RANGE * right)}
        return left, right

    def report(self, state: tuple[float, ...]) -> None:
        """Send what is due of a state: x to the east, y to the north, heading from east, speeds ahead, to port, of turn."""
        if self.silent:
            return
        x, y, psi, u, v, r = state
        east, north = u * math.cos(psi) - v * math.sin(psi), u * math.sin(psi) + v * math.cos(psi)
        yaw = math.remainder(0.5 * math.pi - psi, 2.0 * math.pi)
        outputs = [self.servos.get(n, 0) for n in range(1, 17)]
        channels = [self.channel(n) for n in range(1, 19)]
        boot = self.since_boot
        messages: dict[int, tuple[str, tuple[Any, ...]]] = {
            mavlink.MAVLINK_MSG_ID_ATTITUDE: ("attitude", (boot, 0.0, 0.0, yaw, 0.0, 0.0, -r)),
            mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED: ("local_position_ned", (boot, y, x, 0.0, north, east, 0.0)),
            mavlink.MAVLINK_MSG_ID_EKF_STATUS_REPORT: ("ekf_status_report", (self.filter, *[0.1] * 5)),
            mavlink.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW: ("servo_output_raw", (boot * 1000, 0, *outputs)),
            mavlink.MAVLINK_MSG_ID_RC_CHANNELS: ("rc_channels", (boot, 18, *channels, 255)),
            mavlink.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN: ("gps_global_origin", (*ORIGIN, 0)),
        }
        now = time.monotonic()
        for number in [n for n in (*self.due, mavlink.MAVLINK_MSG_ID_HEARTBEAT) if self.due.get(n, now) <= now]:
            self.due.pop(number, None)
            if number == mavlink.MAVLINK_MSG_ID_HEARTBEAT:
                self.heartbeat()
            elif number in messages:
                name, values = messages[number]
                self.send(name, *values)
            if number in self.intervals:
                self.due[number] = now + self.intervals[number]

    def close(self) -> None:
        for link in self.links:
            link.close()
