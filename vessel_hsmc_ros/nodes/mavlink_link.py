"""A MAVLink connection to one autopilot: its messages alone, and what is sent to it."""

import os
import time
from collections.abc import Iterator, Mapping
from typing import Any

from pymavlink import mavutil
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from vessel_hsmc_ros.core.exceptions import RunError
from vessel_hsmc_ros.messages.mavlink import YAW_RATE_AND_THRUST, overrides

MOST_MESSAGES = 500
"""Messages that are read at a time: a flood must not keep the node from its other work."""

AUTOPILOT = mavlink.MAV_COMP_ID_AUTOPILOT1


class Link:
    """A connection to the autopilot of a system.

    Args:
        address, baud: As pymavlink has them.
        system: Own system.
        target: System of the autopilot; 0: the first one whose heartbeat is heard.

    Raises:
        RunError: the connection cannot be opened.
    """

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

    # -- sending ------------------------------------------------------------------------------------------------------

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
