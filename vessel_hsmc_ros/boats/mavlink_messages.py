"""What messages of MAVLink mean: motion in the plane, pulse widths, flags of the filter, time since boot.

MAVLink's earth frame is north, east, down, and its body frame forward, starboard, down: x and y of REP-103 are east and north,
and yaw, yaw rate and steering have the opposite sign.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

from vessel_hsmc_ros.core.kernel import clip
from vessel_hsmc_ros.core.kinematics import Motion, in_body_frame, wrap

AXIS = 1000  # the largest deflection of MANUAL_CONTROL
RELEASED = 0  # what RC_CHANNELS_OVERRIDE has for a channel that is given back to the radio
UNCHANGED = 65535  # what RC_CHANNELS_OVERRIDE has for a channel that it leaves as it is
OVERRIDDEN = 8  # channels of the radio for which RC_CHANNELS_OVERRIDE has these two numbers; further ones have others
YAW_RATE_AND_THRUST = 0b1000_0011  # the type mask of SET_ATTITUDE_TARGET that leaves out attitude, roll rate and pitch rate
SURFACE_MODES = {
    **{"MANUAL": 0, "ACRO": 1, "STEERING": 3, "HOLD": 4, "LOITER": 5, "FOLLOW": 6, "SIMPLE": 7, "DOCK": 8, "CIRCLE": 9},
    **{"AUTO": 10, "RTL": 11, "SMART_RTL": 12, "GUIDED": 15, "INITIALISING": 16},
}
"""The modes of ArduPilot's surface vehicles, by the numbers of HEARTBEAT."""


class Attitude(NamedTuple):
    """ATTITUDE: time since boot, s; roll, pitch and yaw from north, clockwise, rad; rates about the axes of the body, rad/s."""

    time: float
    roll: float
    pitch: float
    yaw: float
    p: float
    q: float
    r: float


class Position(NamedTuple):
    """LOCAL_POSITION_NED without the vertical: time since boot, s; position, m, and velocity, m/s, to the north and the east."""

    time: float
    north: float
    east: float
    north_velocity: float
    east_velocity: float


def mode_name(number: int) -> str:
    """The name of a mode, or its number where it has none."""
    return next((name for name, known in SURFACE_MODES.items() if known == number), str(number))


def yaw_rate(attitude: Attitude) -> float:
    """The rate of the yaw angle, clockwise: (q sin(phi) + r cos(phi))/cos(theta), finite below a pitch of 90°."""
    return (attitude.q * math.sin(attitude.roll) + attitude.r * math.cos(attitude.roll)) / math.cos(attitude.pitch)


def motion(position: Position, attitude: Attitude) -> Motion:
    """The motion in the plane at the time of the position, for which the yaw is extrapolated by its rate."""
    r = -yaw_rate(attitude)
    psi = wrap(0.5 * math.pi - attitude.yaw + r * (position.time - attitude.time))
    return in_body_frame(Motion(position.east, position.north, psi, position.east_velocity, position.north_velocity, r))


class BootClock:
    """The time of an autopilot, which stamps its messages since its boot or by a clock of its own, on the steady clock.

    The estimate of the time of boot is the least difference of receipt and stamp, so that the delays of single messages do not
    count. It may rise by CLOCK_DRIFT, the most by which two clocks diverge. Only the steady clock of this computer is looked at,
    as the other one may be stepped at any time. Stamps that go back by more than REBOOT are a reboot. Those that go back by less
    begin the estimate anew once there are LAGGING of them in a row; a single one has been overtaken on its way.
    """

    CLOCK_DRIFT = 2e-4
    REBOOT, LAGGING = 1.0, 2

    def __init__(self) -> None:
        self._boot, self._stamp, self.reboots = math.inf, 0.0, 0
        self._behind = 0

    def age(self, stamp: float, received: float) -> float:
        """How long before its receipt a message was stamped, s, by the least delay so far.

        `stamp`: its time since boot, s. `received`: time of its receipt on the steady clock, s.
        """
        back = self._stamp - stamp
        self._behind = self._behind + 1 if back > 0.0 else 0
        if back > self.REBOOT or self._behind >= self.LAGGING:
            self.reboots += back > self.REBOOT
            self._boot, self._stamp, self._behind = math.inf, stamp, 0
        elif back < 0.0:
            self._boot -= self.CLOCK_DRIFT * back
            self._stamp = stamp
        self._boot = min(self._boot, received - stamp)
        return received - stamp - self._boot

    def stamp(self, now: float) -> float | None:
        """The time of the autopilot at a time of the steady clock, s; None before its first message."""
        return None if self._boot == math.inf else now - self._boot


FILTER = {1: "attitude", 2: "horizontal velocity", 16: "horizontal position"}  # flags of EKF_STATUS_REPORT that must be set
NO_POSITION, UNINITIALISED = 128, 1024


def filter_problem(flags: int) -> str:
    """What EKF_STATUS_REPORT lacks for a position and a velocity that count; empty if nothing."""
    if flags & UNINITIALISED:
        return "the filter is not initialised"
    missing = [name for bit, name in FILTER.items() if not flags & bit]
    if flags & NO_POSITION:
        missing.append("source of position (constant position mode)")
    return f"the filter has no {', no '.join(missing)}" if missing else ""


class Pulses(NamedTuple):
    """Pulse widths of a full thrust astern, of none, and of a full thrust ahead, µs."""

    low: float
    trim: float
    high: float

    def width(self, share: float) -> int:
        """The pulse width of a share of -1 to 1."""
        share = clip(share, 1.0)
        return round(self.trim + share * ((self.high - self.trim) if share > 0.0 else (self.trim - self.low)))

    def share(self, width: float) -> float:
        """The share of a pulse width; 0 for a width of 0, which is an output that is switched off."""
        if not width:
            return 0.0
        beyond = width - self.trim
        return clip(beyond / ((self.high - self.trim) if beyond > 0.0 else (self.trim - self.low)), 1.0)


def axes(force: float, moment: float) -> tuple[int, int]:
    """The axes y, steering to starboard, and z, throttle, of MANUAL_CONTROL for shares of force and moment."""
    return round(-AXIS * clip(moment, 1.0)), round(AXIS * clip(force, 1.0))


def axis_width(axis: int, radio: Sequence[float]) -> int:
    """The pulse width, µs, that an axis of MANUAL_CONTROL is for an autopilot whose radio has a least and a largest one."""
    low, high = radio
    return round(low + (high - low) * (AXIS + axis) / (2 * AXIS))


def overrides(channels: dict[int, int]) -> list[int]:
    """The channels 1 to 8 of RC_CHANNELS_OVERRIDE, of which those that are not named stay as they are."""
    return [channels.get(number, UNCHANGED) for number in range(1, OVERRIDDEN + 1)]


def fields(message: object, name: str, count: int) -> list[int]:
    """The numbered fields of a message, such as `servo1_raw` and so on, for the name `servo{}_raw`."""
    return [int(getattr(message, name.format(number), 0) or 0) for number in range(1, count + 1)]
