"""What an autopilot says and means: messages of MAVLink and PX4, and when it has been taken over.

Both count north, east, down, and in the body forward, starboard, down: x and y of REP-103 are east and north, and yaw, yaw rate
and steering have the opposite sign. PX4 counts its quaternion from the body to the earth, w first.
"""

import math
from collections import deque
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from vessel_hsmc_ros.core.kernel import clip
from vessel_hsmc_ros.core.kinematics import Motion, in_body_frame, wrap
from vessel_hsmc_ros.core.thruster_layout import Thruster

FAILSAFE = (5, 6)  # system states of HEARTBEAT: critical and emergency


class Handover:
    """Whether an autopilot is ready for commands, and whether it has been taken over.

    `mode`: the number of the mode in which it takes commands. `timeout`: time without a heartbeat after which it counts as lost,
    s. `named`: the name of a mode by its number. `taken`: why commands have ended and may not go on; empty while they may.
    """

    def __init__(self, mode: int, timeout: float, named: Mapping[int, str]) -> None:
        self._mode, self._timeout, self._named = mode, timeout, named
        self._heard = -math.inf
        self._armed, self._present, self._state = False, -1, 0
        self._standby = True
        self.taken = ""

    def heartbeat(self, now: float, armed: bool, mode: int, state: int) -> None:
        """Take a heartbeat of the autopilot."""
        self.check(now)  # a gap before it counts, even if nothing has looked at it in between
        self._heard, self._armed, self._present, self._state = now, armed, mode, state
        self.check(now)

    def check(self, now: float) -> None:
        """Take over if the controller commands and the autopilot is not ready at a time, s."""
        if not self._standby and (reason := self.waits(now)):
            self.take_over(reason)

    def take_over(self, reason: str) -> None:
        """End the commands of a controller; in standby it has none."""
        if not self._standby and not self.taken:
            self.taken = reason

    def controller(self, standby: bool, now: float) -> None:
        """Take whether the controller is in standby, which permits that it is enabled again."""
        self._standby = standby
        if standby:
            self.taken = ""
        self.check(now)

    def passes(self, now: float) -> bool:
        """Whether commands may be passed on at a time, s."""
        return not (self._standby or self.taken or self.waits(now))

    def waits(self, now: float) -> str:
        """What the autopilot lacks for commands at a time, s; empty if nothing."""
        if now - self._heard > self._timeout:
            return f"no heartbeat of the autopilot for {self._timeout:g} s" if self._heard > -math.inf else "no autopilot heard"
        if not self._armed:
            return "the autopilot is disarmed"
        if self._present != self._mode:
            present, needed = (self._named.get(mode, str(mode)) for mode in (self._present, self._mode))
            return f"mode {present}, commands need {needed}"
        return "the autopilot reports a failsafe" if self._state in FAILSAFE else ""


class Sticks:
    """Whether a pilot moves a stick, by the pulse widths of the radio's channels that an autopilot reports.

    A channel without commands must stay where it was when the controller was enabled. One that commands override must show what
    was sent within MEMORY, once they have been sent for that long; if it does not, the radio has it. `channels`: numbers of the
    channels of the sticks. `threshold`: difference that counts as a movement, µs.
    """

    MEMORY = 1.5

    def __init__(self, channels: Sequence[int], threshold: float) -> None:
        self._channels, self._threshold = channels, threshold
        self._rest: dict[int, int] = {}
        self._sent: deque[tuple[float, Mapping[int, int]]] = deque()
        self._began = math.inf

    def rest(self) -> None:
        """Forget the positions, as when the controller is in standby."""
        self._rest.clear()
        self._sent.clear()
        self._began = math.inf

    def sent(self, now: float, widths: Mapping[int, int]) -> None:
        """Take the pulse widths that were sent for channels at a time, s."""
        self._began = min(self._began, now)
        self._sent.append((now, widths))
        self._forget(now)

    def _forget(self, now: float) -> None:
        while self._sent and self._sent[0][0] < now - self.MEMORY:
            self._sent.popleft()
        if not self._sent:
            self._began = math.inf

    def moved(self, now: float, widths: Sequence[int]) -> str:
        """Which stick has moved; empty if none has.

        `now`: time of the report, s. `widths`: pulse widths of the channels from 1 on, µs; 0 and 65535 are channels without a
        signal.
        """
        self._forget(now)
        for channel in self._channels:
            width = widths[channel - 1] if channel <= len(widths) else 0
            if width in (0, 65535):
                continue
            known = [sent[channel] for _, sent in self._sent if channel in sent]
            if known and now - self._began < self.MEMORY:
                continue
            known = known or [self._rest.setdefault(channel, width)]
            if not min(known) - self._threshold <= width <= max(known) + self._threshold:
                return f"channel {channel} of the radio is at {width} µs"
        return ""


AXIS = 1000  # the largest deflection of MANUAL_CONTROL
RELEASED = 0  # what RC_CHANNELS_OVERRIDE has for a channel that is given back to the radio
UNCHANGED = 65535  # what RC_CHANNELS_OVERRIDE has for a channel that it leaves as it is
OVERRIDDEN = 8  # channels of the radio for which RC_CHANNELS_OVERRIDE has these two numbers; further ones have others
YAW_RATE_AND_THRUST = 0b1000_0011  # the type mask of SET_ATTITUDE_TARGET that leaves out attitude, roll rate and pitch rate
SURFACE_MODES = {
    **{"MANUAL": 0, "ACRO": 1, "STEERING": 3, "HOLD": 4, "LOITER": 5, "FOLLOW": 6, "SIMPLE": 7, "DOCK": 8, "CIRCLE": 9},
    **{"AUTO": 10, "RTL": 11, "SMART_RTL": 12, "GUIDED": 15, "INITIALISING": 16},
}
"""The numbers in HEARTBEAT of the modes of ArduPilot's surface vehicles."""

MODE_NAMES = {number: name for name, number in SURFACE_MODES.items()}


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
        """How long before its receipt a message was stamped, s, by the least delay so far."""
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


def thrusts(shares: Sequence[float], thrusters: Sequence[Thruster]) -> list[float]:
    """The thrusts, N, of thrusters with some shares of their thrust ahead, or astern."""
    return [share * (t.thrust_ahead if share > 0.0 else t.thrust_astern) for share, t in zip(shares, thrusters, strict=True)]


def skid_steering(shares: Sequence[float], limits: tuple[float, float]) -> tuple[float, float]:
    """The surge force, N, and the yaw moment, N·m, of the shares of left and right, with the largest force and moment."""
    left, right = shares
    return 0.5 * (left + right) * limits[0], 0.5 * (right - left) * limits[1]


def wrench_of(thrusters: Sequence[Thruster], forces: Sequence[float], angles: Sequence[float]) -> tuple[float, float, float]:
    """Surge and sway force, N, and yaw moment, N·m, of thrusters with some thrusts, N, and angles, rad."""
    ahead = [force * math.cos(angle) for force, angle in zip(forces, angles, strict=True)]
    to_port = [force * math.sin(angle) for force, angle in zip(forces, angles, strict=True)]
    return sum(ahead), sum(to_port), sum(t.x * y - t.y * x for t, x, y in zip(thrusters, ahead, to_port, strict=True))


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


OFFBOARD = 14  # `nav_state` of the mode in which PX4 takes setpoints of another computer
ARMED = 2  # `arming_state` with running motors
NED, FRD, BODY = 1, 2, 3  # frames: aligned with north, turned from it by some fixed angle, and that of the body


def problem(message: Any) -> str:
    """Why a message has no motion; empty if it has one."""
    if message.pose_frame not in (NED, FRD) or message.velocity_frame not in (message.pose_frame, BODY):
        return (
            f"frames must be 1 or 2 (pose), and the same or 3 (velocity) (got {message.pose_frame} and {message.velocity_frame})"
        )
    parts = (message.position[:2], message.q, message.velocity, message.angular_velocity)
    names = ("position", "q", "velocity", "angular_velocity")
    wrong = [name for name, part in zip(names, parts, strict=True) if not all(map(math.isfinite, part))]
    if wrong:
        return f"{', '.join(wrong)} not finite"
    return "" if sum(part * part for part in message.q) > 0.5 else "q is not filled in"


def motion_of(message: Any) -> Motion:
    """The motion of a message without a problem, x to the east and y to the north or, with the frame FRD, turned with it."""
    attitude = attitude_of(message.q, message.angular_velocity)
    velocity = [float(v) for v in message.velocity]
    if message.velocity_frame == BODY:
        velocity = rotated(message.q, velocity)
    north, east = (float(p) for p in message.position[:2])
    return motion(Position(0.0, north, east, velocity[0], velocity[1]), attitude)


def attitude_of(q: Sequence[float], rates: Sequence[float]) -> Attitude:
    """Roll, pitch, yaw from north, clockwise, and rates about the axes of the body.

    `q`: the quaternion w, x, y, z of any length but 0. `rates`: rates about the axes of the body, rad/s.
    """
    w, x, y, z = map(float, q)
    size = w * w + x * x + y * y + z * z
    roll = math.atan2(2.0 * (w * x + y * z), w * w - x * x - y * y + z * z)
    pitch = math.asin(max(-1.0, min(1.0, 2.0 * (w * y - x * z) / size)))
    yaw = math.atan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z)
    return Attitude(0.0, roll, pitch, yaw, *map(float, rates))


def rotated(q: Sequence[float], vector: Sequence[float]) -> list[float]:
    """A vector of the body along the axes of the earth, by the quaternion w, x, y, z of length 1."""
    w, x, y, z = map(float, q)
    a, b, c = vector
    return [
        (1.0 - 2.0 * (y * y + z * z)) * a + 2.0 * (x * y - w * z) * b + 2.0 * (x * z + w * y) * c,
        2.0 * (x * y + w * z) * a + (1.0 - 2.0 * (x * x + z * z)) * b + 2.0 * (y * z - w * x) * c,
        2.0 * (x * z - w * y) * a + 2.0 * (y * z + w * x) * b + (1.0 - 2.0 * (x * x + y * y)) * c,
    ]
