"""A MAVLink connection to one autopilot: its messages alone, what is sent to it, and the commands of each form."""

import os
import time
from collections.abc import Iterator, Mapping
from typing import Any

from geometry_msgs.msg import TwistStamped
from pymavlink import mavutil
from pymavlink.dialects.v20 import ardupilotmega as mavlink
from std_msgs.msg import Float64

from vessel_hsmc_ros.boats.autopilot import RELEASED, YAW_RATE_AND_THRUST, Pulses, Sticks, axes, axis_width, overrides
from vessel_hsmc_ros.boats.takeover import PassingNode
from vessel_hsmc_ros.core.exceptions import RunError
from vessel_hsmc_ros.core.kernel import clip
from vessel_hsmc_ros.nodes.commands import UnstampedInput, finite

MOST_MESSAGES = 500  # messages that are read at a time: a flood must not keep the node from its other work
AUTOPILOT = mavlink.MAV_COMP_ID_AUTOPILOT1


class Link:
    """A connection to the autopilot of a system. `target`: system of the autopilot; 0: the first one whose heartbeat is heard."""

    def __init__(self, address: str, baud: int, system: int, target: int) -> None:
        os.environ["MAVLINK20"] = "1"  # read by pymavlink when it opens a connection
        self._arguments = (address, baud, system)
        self.target = target
        self.broken = ""
        self._began = time.monotonic()
        try:
            self._connection = self._opened()
        except (OSError, ValueError, IndexError, ImportError) as error:  # a serial port needs pyserial
            raise RunError(f"mavlink.connection = {address} cannot be opened: {error}") from None

    def _opened(self) -> Any:
        address, baud, system = self._arguments
        component = mavlink.MAV_COMP_ID_ONBOARD_COMPUTER
        return mavutil.mavlink_connection(
            address, baud=baud, source_system=system, source_component=component, dialect="ardupilotmega", retries=1
        )

    def reopen(self) -> None:
        """Open a broken connection again; it stays broken if that is not possible."""
        try:
            self._connection.close()
            self._connection = self._opened()
        except OSError as error:
            self.broken = str(error)
        else:
            self.broken = ""

    def receive(self) -> Iterator[Any]:
        """The messages of the autopilot that have come since the last call."""
        for _ in range(MOST_MESSAGES):
            try:
                message = None if self.broken else self._connection.recv_msg()
            except OSError as error:
                self.broken = str(error)
                return
            if message is None:
                return
            if self._is_of_autopilot(message):
                yield message

    def _is_of_autopilot(self, message: Any) -> bool:
        kind = message.get_type()
        if kind == "BAD_DATA" or message.get_srcComponent() != AUTOPILOT:
            return False
        system = message.get_srcSystem()
        if not self.target and kind == "HEARTBEAT" and message.autopilot != mavlink.MAV_AUTOPILOT_INVALID:
            self.target = system
        return bool(system == self.target)

    def _send(self, name: str, *values: Any) -> None:
        try:
            if not self.broken:
                getattr(self._connection.mav, f"{name}_send")(*values)
        except OSError as error:
            self.broken = str(error)

    def heartbeat(self) -> None:
        """Show that this program is there."""
        self._send(
            "heartbeat", mavlink.MAV_TYPE_ONBOARD_CONTROLLER, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, mavlink.MAV_STATE_ACTIVE
        )

    def request(self, name: str, rate: float) -> None:
        """Request a message at a rate, Hz, or once for a rate of 0."""
        number = getattr(mavlink, f"MAVLINK_MSG_ID_{name}")
        if rate:
            values = (mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, 0, number, 1e6 / rate, 0, 0, 0, 0, 0)
        else:
            values = (mavlink.MAV_CMD_REQUEST_MESSAGE, 0, number, 0, 0, 0, 0, 0, 0)
        self._send("command_long", self.target, AUTOPILOT, *values)

    def request_parameter(self, name: str) -> None:
        """Request the value of a parameter, which comes as PARAM_VALUE."""
        self._send("param_request_read", self.target, AUTOPILOT, name.encode(), -1)

    def manual(self, y: int, z: int) -> None:
        """Send steering and throttle."""
        self._send("manual_control", self.target, 0, y, z, 0, 0)

    def override(self, channels: Mapping[int, int]) -> None:
        """Send pulse widths of channels of the radio, µs."""
        self._send("rc_channels_override", self.target, AUTOPILOT, *overrides(dict(channels)))

    def velocity(self, speed: float, yaw_rate: float) -> None:
        """Send a speed as a share of the cruise speed, and a yaw rate, clockwise, rad/s."""
        since = round((time.monotonic() - self._began) * 1e3) & 0xFFFFFFFF
        level = [1.0, 0.0, 0.0, 0.0]
        self._send("set_attitude_target", since, self.target, AUTOPILOT, YAW_RATE_AND_THRUST, level, 0.0, 0.0, yaw_rate, speed)

    def close(self) -> None:
        """Close the connection."""
        self._connection.close()


Shares = tuple[float, ...]


class Commands:
    """The commands of one form: the latest one, and its message.

    manual has the shares of force and moment, channels that of each thruster, and guided the share of the cruise speed and the
    yaw rate, rad/s. `sticks`: takes what is sent for channels of the radio.
    """

    def __init__(self, node: PassingNode, link: Link, sticks: Sticks) -> None:
        p = node.parameters
        self._node, self._link, self._sticks, self._refuse = node, link, sticks, node.refuse
        self._pulses = Pulses(*p.pulses)
        self._thrusters = p.vessel.thrusters.thrusters() if p.form == "channels" else []
        self.nothing: Shares = (0.0,) * (len(self._thrusters) or 2)
        self.input: Any  # a CommandInput or an UnstampedInput
        if p.form == "manual":
            self.input = node.take_wrench()
        elif p.form == "guided":
            self.input = UnstampedInput(
                node, TwistStamped, ["cmd_vel"], p.command_timeout, lambda m: (m.twist.linear.x, m.twist.angular.z)
            )
        else:
            topics = [f"thrusters/{thruster.name}/thrust" for thruster in self._thrusters]
            self.input = UnstampedInput(node, Float64, topics, p.command_timeout)

    def present(self) -> Shares | None:
        """The command that holds now; None if there is none."""
        p, values = self._node.parameters, self.input.present()
        if values is None:
            return None
        if p.form == "manual":
            shares: Shares = p.shares(values)
            return shares
        if p.form == "guided":
            return clip(values[0] / p.cruise_speed, 1.0), values[1]
        return tuple(
            clip(thrust / ((t.thrust_ahead if thrust > 0.0 else t.thrust_astern) or t.thrust_ahead), 1.0)
            for t, thrust in zip(self._thrusters, values, strict=True)
        )

    def send(self, command: Shares) -> None:
        """Send a command to the autopilot."""
        p, command = self._node.parameters, finite(command, self._refuse)
        if p.form == "guided":
            self._link.velocity(command[0], -command[1])
            return
        if p.form == "channels":
            widths = {int(c): self._pulses.width(share) for c, share in zip(p.channels, command, strict=True)}
            self._link.override(widths)
        else:
            y, z = axes(*command)
            self._link.manual(y, z)
            widths = {int(c): axis_width(axis, p.radio_range) for c, axis in zip(p.stick_channels, (y, z), strict=True)}
        self._sticks.sent(time.monotonic(), widths)

    def end(self) -> None:
        """Repeat what has ended the commands: the channels given back or, in guided, zero."""
        if self._node.parameters.form == "guided":
            self.send(self.nothing)
        else:
            self.give_back()

    def give_back(self) -> None:
        """Give the channels back to the radio, which the commands of guided do not use."""
        p = self._node.parameters
        if p.form != "guided":
            channels = p.channels if p.form == "channels" else p.stick_channels
            self._link.override({int(number): RELEASED for number in channels})
