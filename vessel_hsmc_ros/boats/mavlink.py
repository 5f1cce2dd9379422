"""The MAVLink node: makes odometry of the messages of an autopilot, and passes commands on to it."""

import math
import time
from collections.abc import Callable
from typing import Any, ClassVar

from geometry_msgs.msg import WrenchStamped
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from vessel_hsmc_ros.boats.autopilot import (
    MODE_NAMES,
    Attitude,
    Position,
    Pulses,
    Sticks,
    fields,
    filter_problem,
    motion,
)
from vessel_hsmc_ros.boats.failsafes import ParameterReader
from vessel_hsmc_ros.boats.mavlink_link import Commands, Link
from vessel_hsmc_ros.boats.parameters import MavlinkParameters
from vessel_hsmc_ros.boats.takeover import AutopilotNode
from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.base import LAST_COMMANDS, OK, DiagnosticTask
from vessel_hsmc_ros.nodes.odometry_output import datum_publisher

POLL_PERIOD = 0.01  # time between two looks at the connection, s: well below the 0.1 s within which a takeover has its effect
REPEAT = 2.0  # time after which a message that does not come is requested again, s
STREAMS = ("ATTITUDE", "LOCAL_POSITION_NED", "EKF_STATUS_REPORT", "SERVO_OUTPUT_RAW", "RC_CHANNELS")
NEEDED = ("HEARTBEAT", "LOCAL_POSITION_NED", "ATTITUDE")
SLOW_STREAM_RATE = 5.0  # rate at which the messages are requested that are no part of the motion, Hz


class MavlinkNode(AutopilotNode):
    """Publishes odometry from an autopilot's position and attitude, and passes commands on while it is ready for them.

    It takes commands of a controller that is not in standby, while the autopilot is armed, in the mode of the form, without a
    failsafe, and heard. When that ends, or a pilot moves a stick, commands end at once, the channels are given back to the radio,
    and the controller is put into standby: only a person enables it again. The node neither arms nor changes modes.
    """

    NAME = "mavlink"
    REAL_TIME = "an autopilot works"
    INTERFACE = """
        subscribes to  cmd_wrench, thrusters/<name>/thrust, cmd_vel (by its form), controller/state
        publishes      odom, odom/datum, applied_wrench, events
        services       ~/stop, ~/rearm
        calls          controller/enable
    """
    PARAMETERS = MavlinkParameters

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        p = self.parameters
        self._link = Link(p.connection, p.baud, p.system_id, p.target_system)
        self._sticks = Sticks([int(c) for c in p.stick_channels], p.stick_threshold)
        self._pulses = Pulses(*p.pulses)
        self._failsafes = ParameterReader()
        self._attitude: Attitude | None = None
        self._last: dict[str, float] = {}
        self._received: dict[str, int] = {}
        self._requested = -math.inf
        self._origin: tuple[float, float] | None = None
        self._filter = ""
        self._command: tuple[float, ...] = ()
        self._zeros, self._releases = LAST_COMMANDS, 0
        self.connect(p.mode_number, MODE_NAMES, p.stream_rate or SLOW_STREAM_RATE)
        self._create_topics()
        self.create_timer(POLL_PERIOD, self._poll, clock=self.wall)
        self.create_timer(1.0 / p.rate_hz, self._on_timer, clock=self.wall)
        self.create_timer(1.0, self._every_second, clock=self.wall)

    def _create_topics(self) -> None:
        p = self.parameters
        self._state_datum = datum_publisher(self, self._odometry.message.header.frame_id)
        self._applied = self.framed(conversions.new_wrench())
        self._applied_out = self.advertise(WrenchStamped, "applied_wrench", qos.data(False)) if p.servos else None
        self._commands = Commands(self, self._link, self._sticks)
        self._input = self._commands.input

    def describe(self) -> str:
        """The connection, the form and its mode."""
        p = self.parameters
        mode = MODE_NAMES[p.mode_number]
        return f"{p.connection}, form {p.form} in mode {mode}, time-out {p.command_timeout:g} s, ramp {p.ramp_time:g} s"

    # -- messages of the autopilot ------------------------------------------------------------------------------------

    def _poll(self) -> None:
        for message in self._link.receive():
            name, now = message.get_type(), time.monotonic()
            self._last[name] = now
            self._received[name] = self._received.get(name, 0) + 1
            if take := self._takers.get(name):
                take(self, message, now)
        self._handover.check(time.monotonic())
        self._takeover.act()

    def _on_heartbeat(self, message: Any, now: float) -> None:
        self._failsafes.heard(message.autopilot)
        armed = bool(message.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED)
        if self._received["HEARTBEAT"] == 1:
            self.get_logger().info(f"autopilot: system {self._link.target}")
            self._request(now)
        self._handover.heartbeat(now, armed, message.custom_mode, message.system_status)

    def _on_attitude(self, m: Any, _: float) -> None:
        values = (m.roll, m.pitch, m.yaw, m.rollspeed, m.pitchspeed, m.yawspeed)
        if all(map(math.isfinite, values)):
            self._attitude = Attitude(m.time_boot_ms * 1e-3, *values)

    def _on_position(self, m: Any, _: float) -> None:
        position = Position(m.time_boot_ms * 1e-3, m.x, m.y, m.vx, m.vy)
        stamp = self.sampled(position.time)
        if reason := self._unusable(position):
            self.refuse(f"no odometry: {reason}")
            return
        self._odometry.publish(stamp, motion(position, self._attitude))  # type: ignore[arg-type] # there is one: else unusable

    def restarted(self) -> None:
        """Forget the attitude, which was of another time."""
        self._attitude = None

    def _unusable(self, position: Position) -> str:
        """Why a position makes no odometry; empty if it does."""
        timeout = self.parameters.state_timeout
        if not all(map(math.isfinite, position)):
            return "LOCAL_POSITION_NED has numbers that are not finite"
        if self._attitude is None or abs(position.time - self._attitude.time) > timeout:
            return f"no ATTITUDE within {timeout:g} s of LOCAL_POSITION_NED"
        return self._filter

    def _on_filter(self, message: Any, _: float) -> None:
        self._filter = filter_problem(message.flags)

    def _on_origin(self, message: Any, _: float) -> None:
        origin = message.latitude * 1e-7, message.longitude * 1e-7
        if origin != self._origin:
            text = f"origin of the odometry: {origin[0]:.7f}, {origin[1]:.7f}"
            self.get_logger().info(text)
            if self._origin is not None:
                self._handover.take_over(f"the autopilot has moved its origin; {text}")
            self._origin = origin
            self._state_datum(*origin)

    def _on_radio(self, message: Any, now: float) -> None:
        if moved := self._sticks.moved(now, fields(message, "chan{}_raw", 18)):
            self._handover.take_over(f"a pilot has taken over: {moved}")

    def _on_servos(self, message: Any, _: float) -> None:
        if self._applied_out is None or message.port:
            return
        p, widths = self.parameters, fields(message, "servo{}_raw", 16)
        shares = [self._pulses.share(widths[int(number) - 1]) for number in p.servos]
        stamp = self.get_clock().now().to_msg()
        conversions.write_wrench(self._applied, stamp, p.applied_wrench(shares))
        self.send(self._applied_out, self._applied)

    def _on_parameter(self, message: Any, _: float) -> None:
        self._failsafes.take(message.param_id, message.param_value, message.param_type)

    def _on_answer(self, message: Any, _: float) -> None:
        if message.result not in (mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_IN_PROGRESS):
            self.get_logger().warning(
                f"the autopilot refuses command {message.command} with result {message.result}", throttle_duration_sec=10.0
            )

    def _on_text(self, message: Any, _: float) -> None:
        text = "".join(c if c.isprintable() else "?" for c in message.text)  # others could command a terminal
        self.get_logger().info(f"autopilot: {text}")

    _takers: ClassVar[dict[str, Callable[["MavlinkNode", Any, float], None]]] = {
        "HEARTBEAT": _on_heartbeat,
        "ATTITUDE": _on_attitude,
        "LOCAL_POSITION_NED": _on_position,
        "EKF_STATUS_REPORT": _on_filter,
        "GPS_GLOBAL_ORIGIN": _on_origin,
        "RC_CHANNELS": _on_radio,
        "SERVO_OUTPUT_RAW": _on_servos,
        "COMMAND_ACK": _on_answer,
        "PARAM_VALUE": _on_parameter,
        "STATUSTEXT": _on_text,
    }

    def _every_second(self) -> None:
        if self._link.broken:
            self.refuse(f"{self.parameters.connection} is broken: {self._link.broken}")
            self._link.reopen()
        self._link.heartbeat()
        if missing := self.awaited():
            self.get_logger().warning(missing, throttle_duration_sec=5.0)
        self._request(time.monotonic())
        self._read_failsafes(time.monotonic())

    def _read_failsafes(self, now: float) -> None:
        """Request some parameters of the failsafes; a silent autopilot shows none."""
        if now - self._last.get("HEARTBEAT", -math.inf) > self.parameters.heartbeat_timeout:
            self._failsafes.forget()
        for name in self._failsafes.due() if self.parameters.stream_rate else ():
            self._link.request_parameter(name)

    def _request(self, now: float) -> None:
        """Request the messages that do not come."""
        rate = self.parameters.stream_rate
        if not (rate and self._link.target) or now - self._requested < REPEAT:
            return
        self._requested = now
        for name in STREAMS:
            if now - self._last.get(name, -math.inf) > REPEAT:
                self._link.request(name, rate if name in NEEDED or name == "SERVO_OUTPUT_RAW" else SLOW_STREAM_RATE)
        if self._origin is None:
            self._link.request("GPS_GLOBAL_ORIGIN", 0.0)

    def awaited(self) -> str:
        """Which messages are awaited; empty if all come."""
        now, p = time.monotonic(), self.parameters
        if not self._link.target:
            return f"waiting for a HEARTBEAT of an autopilot on {p.connection}"
        names = [name for name in NEEDED if now - self._last.get(name, -math.inf) > p.heartbeat_timeout]
        return f"waiting for {', '.join(names)} of system {self._link.target}" if names else ""

    # -- takeover -----------------------------------------------------------------------------------------------------

    def rest(self) -> None:
        """Forget the positions of the sticks."""
        self._sticks.rest()

    def end(self) -> None:
        """Send zero and give the channels back to the radio; `_on_timer` sends the end again, as a packet may be lost."""
        self._latch.share, self._zeros, self._releases = 0.0, LAST_COMMANDS, LAST_COMMANDS - 1
        self._commands.send(self._commands.nothing)
        self._commands.give_back()

    # -- commands -----------------------------------------------------------------------------------------------------

    def _on_timer(self) -> None:
        allowed = self._handover.passes(time.monotonic()) and not self._latch.stopped
        wanted = self._commands.present() if allowed else None
        share = self._latch.update(wanted is not None, allowed)
        if wanted is not None:
            self._command, self._zeros = wanted, 0
        if share and self._command:
            self._releases = 0
            self._commands.send(tuple(share * value for value in self._command))
        elif self._zeros < LAST_COMMANDS:
            self._zeros += 1
            self._commands.send(self._commands.nothing)
            if self._zeros == LAST_COMMANDS:
                self.end()
        elif self._releases:
            self._releases -= 1
            self._commands.end()

    # -- diagnostics and the end -------------------------------------------------------------------------------------

    def close(self) -> None:
        """Leave the autopilot without a command: zero, several times, and the channels given back."""
        if self._zeros < LAST_COMMANDS or self._latch.share or self._releases:
            for _ in range(LAST_COMMANDS):
                self.end()
        super().close()
        self._link.close()

    def values(self) -> dict[str, Any]:
        """The system, its origin, and the numbers of its messages."""
        values: dict[str, Any] = {"system": self._link.target}
        values |= {name.lower(): count for name, count in sorted(self._received.items()) if name in (*STREAMS, "HEARTBEAT")}
        if self._origin is not None:
            values |= {"origin_latitude": self._origin[0], "origin_longitude": self._origin[1]}
        return values

    def diagnostic_tasks(self) -> list[DiagnosticTask]:
        """Those of the commands, and the failsafes."""
        read, p = self._failsafes, self.parameters
        values = {"firmware": read.firmware, "system_id": p.system_id, "requests": p.stream_rate > 0.0, **read.values}
        failsafes = DiagnosticTask("failsafes", OK, f"{len(read.values)} parameters of the autopilot are known", values)
        return [*super().diagnostic_tasks(), failsafes]
