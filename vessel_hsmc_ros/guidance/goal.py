"""Goals: a pose to reach and keep, or a stream of poses that move.

A stationary goal is approached in stages: turn the bow towards it, or the stern if it is near and astern; go there; stop; turn to
its heading on the spot. A moving goal, which a stream of poses defines, is followed by line-of-sight guidance along its course,
with its speed and yaw rate as feedforward, both estimated from the stream. Its future motion is unknown, so the reference follows
with a small lag.

A reference filter: surge-speed and yaw-rate setpoints become a motion that a ship with propeller and rudder can follow.

| symbol | meaning | unit |
|---|---|---|
| x, y, psi, u, v, r | pose and body velocities of the reference | m, m, rad, m/s, m/s, rad/s |
| a, alpha | surge and yaw acceleration | m/s², rad/s² |
| u_c, r_c | setpoints of surge speed and yaw rate | m/s, rad/s |
| T | time of the ship's turns, sqrt(m33/tau_2max) | s |
| T_f, T_a | time constants of velocity and acceleration | s, s |

da = (sat((u_c - u)/T_f) - a)/T_a and likewise for alpha; dv = f_v(u, v, r) of (7), because sway is not actuated: the sway
velocity is that of the unforced hull, whose yaw acceleration alpha also moves the sway where m23 is not zero. Position, velocity
and acceleration are continuous and limited. The heading is not wrapped.
"""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from vessel_hsmc_ros.core.kernel import Array, clip, kernel
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, magnitude, wrap
from vessel_hsmc_ros.core.schema import parameter
from vessel_hsmc_ros.guidance.timetable import KernelReference
from vessel_hsmc_ros.guidance.waypoints import GoalParameters, scheduled_goals
from vessel_hsmc_ros.plant.dynamics import Vessel, unforced_sway

LAG, ACCELERATION_LAG = 0.4, 0.1
"""T_f and T_a in units of T; the damping ratio of velocity and acceleration is sqrt(T_f/T_a)/2 = 1, critical."""

GAIN = 0.75  # gain from distance to speed and from angle to yaw rate, in units of 1/T: with the two lags a damping ratio of 0.8
SHARE_OF_MOMENT = 0.25
"""Share of the yaw moment that the largest yaw acceleration is assumed to take, where the limit of the moment is not known."""


@dataclass(frozen=True)
class MotionLimits:
    """Limits of the reference's motion; the ship must be able to exceed them a little in order to correct errors."""

    speed: float = parameter(1.5, "Largest surge velocity.", unit="m/s", low=1e-3, high=1e3)
    acceleration: float = parameter(0.2, "Largest surge acceleration.", unit="m/s²", low=1e-6, high=1e3)
    yaw_rate: float = parameter(0.1, "Largest yaw rate.", unit="rad/s", low=1e-6, high=1e2)
    yaw_acceleration: float = parameter(0.02, "Largest yaw acceleration.", unit="rad/s²", low=1e-6, high=1e2)
    current: float = parameter(
        0.0,
        "Current that motions along routes allow for: they leave propulsion to go and turn against it.",
        unit="m/s",
        low=0.0,
        high=100.0,
    )


class Filter(NamedTuple):
    """A motion filter."""

    # speed, acceleration, yaw_rate, yaw_acceleration: limits of the motion
    speed: float
    acceleration: float
    yaw_rate: float
    yaw_acceleration: float
    # T_f, T_a: time constants of velocity and acceleration, s
    T_f: float
    T_a: float
    gain: float  # from distance to speed, and from angle to yaw rate, 1/s
    length: float  # radius of gyration of the hull, the unit of distances, m
    vessel: Vessel  # coefficients of the hull, for its sway
    period: float  # length of a step, s


class Filtered(NamedTuple):
    """State of the filter, or its time derivative: pose, body velocities, surge and yaw acceleration."""

    x: float
    y: float
    psi: float
    u: float
    v: float
    r: float
    a: float
    alpha: float


def filter_of(limits: MotionLimits, vessel: Vessel, period: float, yaw_moment: float = math.inf) -> Filter:
    """The filter of a hull. `yaw_moment`: largest yaw moment, N·m; infinite where it is not known."""
    given = limits.speed, limits.acceleration, limits.yaw_rate, limits.yaw_acceleration
    acceleration = yaw_moment / vessel.m33 if math.isfinite(yaw_moment) else limits.yaw_acceleration / SHARE_OF_MOMENT
    # Runge-Kutta steps longer than twice the shortest time constant would not converge.
    T = max(1.0 / math.sqrt(acceleration), period / ACCELERATION_LAG)
    return Filter(*given, LAG * T, ACCELERATION_LAG * T, GAIN / T, math.sqrt(vessel.m33 / vessel.m22), vessel, period)


@kernel
def read_filter(s: Filtered, c: Filter) -> tuple[Motion, Acceleration]:
    """The motion, and the derivatives of its velocities."""
    dv = unforced_sway(s.u, s.v, s.r, s.alpha, c.vessel)
    return Motion(s.x, s.y, s.psi, s.u, s.v, s.r), Acceleration(s.a, dv, s.alpha)


@kernel
def advance_filter(s: Filtered, u_c: float, r_c: float, c: Filter) -> Filtered:
    """Advance by one period towards the setpoints, by one Runge-Kutta step.

    `u_c`: surge-speed setpoint, m/s; limited to the largest speed. `r_c`: yaw-rate setpoint, rad/s; limited to the largest yaw
    rate. `c`: limits, hull and period. Returns the state one period later.
    """
    u_c, r_c = clip(u_c, c.speed), clip(r_c, c.yaw_rate)
    # Velocity and acceleration are integrated with the pose, so that all published derivatives are consistent.
    h = c.period
    k1 = rate_of_filter(s, u_c, r_c, c)
    k2 = rate_of_filter(shifted(s, 0.5 * h, k1), u_c, r_c, c)
    k3 = rate_of_filter(shifted(s, 0.5 * h, k2), u_c, r_c, c)
    k4 = rate_of_filter(shifted(s, h, k3), u_c, r_c, c)
    total = Filtered(
        k1.x + 2.0 * (k2.x + k3.x) + k4.x,
        k1.y + 2.0 * (k2.y + k3.y) + k4.y,
        k1.psi + 2.0 * (k2.psi + k3.psi) + k4.psi,
        k1.u + 2.0 * (k2.u + k3.u) + k4.u,
        k1.v + 2.0 * (k2.v + k3.v) + k4.v,
        k1.r + 2.0 * (k2.r + k3.r) + k4.r,
        k1.a + 2.0 * (k2.a + k3.a) + k4.a,
        k1.alpha + 2.0 * (k2.alpha + k3.alpha) + k4.alpha,
    )
    return shifted(s, h / 6.0, total)


@kernel
def rate_of_filter(s: Filtered, u_c: float, r_c: float, c: Filter) -> Filtered:
    """The time derivative of the state; the arguments are those of `advance_filter`."""
    cosine, sine = math.cos(s.psi), math.sin(s.psi)
    # The acceleration demand is limited before the second lag, so that the acceleration itself stays within its limit.
    jerk = (clip((u_c - s.u) / c.T_f, c.acceleration) - s.a) / c.T_a
    yaw_jerk = (clip((r_c - s.r) / c.T_f, c.yaw_acceleration) - s.alpha) / c.T_a
    dv = unforced_sway(s.u, s.v, s.r, s.alpha, c.vessel)
    return Filtered(s.u * cosine - s.v * sine, s.u * sine + s.v * cosine, s.r, s.a, dv, s.alpha, jerk, yaw_jerk)


@kernel
def shifted(s: Filtered, step: float, rate: Filtered) -> Filtered:
    """The state moved by a step at a rate."""
    return Filtered(
        s.x + step * rate.x,
        s.y + step * rate.y,
        s.psi + step * rate.psi,
        s.u + step * rate.u,
        s.v + step * rate.v,
        s.r + step * rate.r,
        s.a + step * rate.a,
        s.alpha + step * rate.alpha,
    )


STREAM_GAP, STREAM_SPEED = 1.5, 0.067
"""Goals that follow each other within the first, s, which is a property of publishers, and move faster than the second, relative
to the largest speed, are a stream."""


class Target(NamedTuple):
    """A goal: pose, time of arrival, time of measurement, NaN if unknown, and velocity; m, m, rad, s, s, m/s, m/s, rad/s."""

    x: float
    y: float
    psi: float
    time: float
    stamp: float
    dx: float
    dy: float
    r: float

    @property
    def speed(self) -> float:
        """Speed over ground, m/s."""
        return speed_of(self)


@kernel
def speed_of(target: Target) -> float:
    """The speed of a goal over ground, m/s."""
    return magnitude(target.dx, target.dy)


@kernel
def stationary(x: float, y: float, psi: float, time: float, stamp: float) -> Target:
    """A goal without velocity; the arguments are those of `Target`."""
    return Target(x, y, psi, time, stamp, 0.0, 0.0, 0.0)


@kernel
def estimate_velocity(last: Target, new: Target, elapsed: float) -> Target:
    """The new goal with the velocity between the last one and it, smoothed over a second.

    `new`: the new goal, without velocity. `elapsed`: time between the two, s; above STREAM_GAP the new goal is stationary.
    Returns the new goal, with velocity and yaw rate if the two belong to one stream.
    """
    if not 0.0 < elapsed <= STREAM_GAP:
        return new
    # First-order low-pass with a time constant of 1 s; the first difference of a stream initialises it.
    share = 1.0 if speed_of(last) == 0.0 or elapsed > 1.0 else elapsed
    dx = last.dx + share * ((new.x - last.x) / elapsed - last.dx)
    dy = last.dy + share * ((new.y - last.y) / elapsed - last.dy)
    r = last.r + share * (wrap(new.psi - last.psi) / elapsed - last.r)
    return Target(new.x, new.y, new.psi, new.time, new.stamp, dx, dy, r)


LEAST_SPEED = 0.2  # the drift angle is computed with at least this share of the largest speed: it is undefined at rest


@kernel
def approach(distance: float, braking: float, largest: float, gain: float) -> float:
    """The speed at which to approach a point so that the motion can stop there.

    With the gain k and the deceleration b it is k·x near the point, and sqrt(2·b·(x - b/(2·k²))) beyond x = b/k², where both
    and their slopes are equal: nowhere does it take more than b. `distance`: distance to go, m, or angle, rad; its sign is that
    of the result. `braking`: deceleration to plan with, m/s² or rad/s². `largest`: largest speed, m/s or rad/s. `gain`: 1/s.
    Returns speed, m/s, or yaw rate, rad/s, with the sign of the distance.
    """
    size, joint = abs(distance), braking / (gain * gain)
    speed = gain * size if size < joint else math.sqrt(2.0 * braking * (size - 0.5 * joint))
    return math.copysign(largest if largest < speed else speed, distance)


@kernel
def surge_setpoint(distance: float, c: Filter) -> float:
    """The surge speed with which to stop after a distance, m, positive ahead; half the acceleration is kept in reserve."""
    return approach(distance, 0.5 * c.acceleration, c.speed, c.gain)


@kernel
def yaw_rate_setpoint(angle: float, feedforward: float, c: Filter) -> float:
    """The yaw rate with which to turn by an angle; half the yaw acceleration is kept in reserve.

    `angle`: angle to turn by, rad, wrapped. `feedforward`: yaw rate of the desired heading, rad/s. Returns yaw rate, rad/s; the
    motion filter limits it.
    """
    return feedforward + approach(angle, 0.5 * c.yaw_acceleration, c.yaw_rate, c.gain)


@kernel
def follow_line(
    motion: Filtered, course: float, cross_track: float, speed: float, yaw_rate: float, c: Filter
) -> tuple[float, float]:
    """Setpoints that bring the motion onto a line and along it, by line-of-sight guidance of its course.

    The course is heading plus drift angle; the desired course is that of the line minus atan(cross_track/lookahead). The
    lookahead distance is the largest speed divided by the gain, so that the ship comes onto the line as fast as it turns. While
    the heading is far off, the speed is reduced by the cosine of the error. `course`: direction of the line, rad.
    `cross_track`: distance to the left of the line, m. `speed`: speed along the line, m/s. `yaw_rate`: rate at which the line
    turns, rad/s. Returns surge speed [m/s] and yaw rate [rad/s].
    """
    # The sideslip angle: an underactuated hull moves along its course, not along its heading.
    least = LEAST_SPEED * c.speed
    drift = math.atan2(motion.v, motion.u if motion.u > least else least)
    error = wrap(course - math.atan(cross_track * c.gain / c.speed) - drift - motion.psi)
    aligned = math.cos(error)
    share = aligned if aligned > 0.0 else 0.0
    return speed * share, yaw_rate_setpoint(error, clip(yaw_rate, c.yaw_rate), c)


NEAR, HELD_BEARING, REACHED = 0.16, 0.026, 0.0026
"""Distances to the goal in radii of gyration of the hull: nearer than the first it is approached straight only; than the second
its bearing is kept constant, because it is ill-defined close to the goal; than the third the position is reached."""

ASTERN = 1.2  # distance up to which goals are approached astern, in radii of gyration, unless it is set
STRAIGHT = 0.15  # heading error above which a near goal is not approached, rad
STOPPED_DISTANCE, STOPPED_ANGLE, STOPPED_SPEED = 0.001, 0.02, 0.003
"""A stage ends when distance, heading error and speed are below these, in radii of gyration, rad, and of the largest speed."""


class GoalConstants(NamedTuple):
    """Constants of a goal reference."""

    filter: Filter  # the motion filter
    astern_distance: float  # goals abaft the beam and nearer than this are approached astern, m
    due: Any  # steps at which goals are scheduled, shape (n,)
    poses: Array  # scheduled goals x, y, psi, shape (n, 3)


class GoalMemory(NamedTuple):
    """Memory of a goal reference."""

    motion: Filtered  # state of the motion filter
    target: Target  # the latest goal
    arrived: bool  # whether its position is reached, so that only the heading remains
    direction: float  # desired heading on the way there, rad
    ahead: float  # 1 if the goal is approached ahead, -1 astern
    steps: int  # number of steps since the start


@kernel
def begin_stage(m: GoalMemory, latest: Target, target: Target, c: GoalConstants) -> GoalMemory:
    """Decide whether the position is reached, and whether to approach with the bow or with the stern."""
    x, y, psi = m.motion.x, m.motion.y, m.motion.psi
    distance = magnitude(target.x - x, target.y - y)
    bearing = math.atan2(target.y - y, target.x - x)
    # Abaft the beam: more than 90 degrees off the bow.
    astern = abs(wrap(bearing - psi)) > 0.5 * math.pi
    arrived = distance < REACHED * c.filter.length and speed_of(target) == 0.0
    ahead = -1.0 if astern and distance < c.astern_distance else 1.0
    return GoalMemory(m.motion, latest, arrived, leading(bearing, ahead), ahead, m.steps)


@kernel
def leading(bearing: float, ahead: float) -> float:
    """The heading with which bow or stern point towards a bearing."""
    return bearing if ahead > 0.0 else wrap(bearing + math.pi)


@kernel
def present_target(m: GoalMemory, c: GoalConstants) -> tuple[Target, GoalMemory]:
    """The present goal: extrapolated while a stream continues, stationary after its end."""
    t, elapsed = m.target, m.steps * c.filter.period - m.target.time
    if speed_of(t) == 0.0:
        return t, m
    if elapsed > STREAM_GAP:
        end = stationary(t.x, t.y, t.psi, t.time, t.stamp)
        return end, begin_stage(m, end, end, c)
    psi = wrap(t.psi + elapsed * t.r)
    return Target(t.x + elapsed * t.dx, t.y + elapsed * t.dy, psi, t.time, t.stamp, t.dx, t.dy, t.r), m


@kernel
def set_goal(m: GoalMemory, x: float, y: float, psi: float, stamp: float, c: GoalConstants) -> GoalMemory:
    """Set a goal; goals that follow each other shortly define a moving goal.

    `x`, `y`, `psi`: the goal, m, m, rad. `stamp`: time of the measurement, s; NaN if it is unknown, then the present time
    counts. Returns the memory with the new goal.
    """
    last, new = m.target, stationary(x, y, psi, m.steps * c.filter.period, stamp)
    # A stationary goal that is published repeatedly is not a stream and must not restart the approach.
    if x == last.x and y == last.y and psi == last.psi and speed_of(last) == 0.0:
        return GoalMemory(m.motion, new, m.arrived, m.direction, m.ahead, m.steps)
    unknown = math.isnan(stamp) or math.isnan(last.stamp)
    moving = estimate_velocity(last, new, new.time - last.time if unknown else stamp - last.stamp)
    if speed_of(moving) > 2.0 * c.filter.speed:  # a jump to a new goal, not a stream
        moving = new
    return begin_stage(m, moving, moving, c)


@kernel
def set_scheduled(m: GoalMemory, c: GoalConstants) -> GoalMemory:
    """Set the goals that are scheduled for the present step."""
    for i in range(len(c.due)):
        if c.due[i] == m.steps:
            m = set_goal(m, float(c.poses[i, 0]), float(c.poses[i, 1]), float(c.poses[i, 2]), math.nan, c)
    return m


@kernel
def speed_factor(heading_error: float, near: bool) -> float:
    """Reduction of the approach speed, in [0, 1], for a heading error: a far goal may be approached in an arc, a near one not."""
    factor = 1.0 - abs(heading_error) / STRAIGHT if near else math.cos(heading_error)
    if factor < 0.0:
        return 0.0
    return factor if near else factor * factor


@kernel
def approach_goal(m: GoalMemory, target: Target, c: GoalConstants) -> tuple[float, float, GoalMemory]:
    """Setpoints of surge speed and yaw rate for a stationary goal."""
    psi, dx, dy = m.motion.psi, target.x - m.motion.x, target.y - m.motion.y
    distance = magnitude(dx, dy)
    stopped, length = abs(m.motion.u) < STOPPED_SPEED * c.filter.speed, c.filter.length
    direction = m.direction
    # Near the goal the bearing rotates quickly, so it is kept constant, unless the ship has stopped short of the goal.
    if not m.arrived and (distance > HELD_BEARING * length or (stopped and distance > REACHED * length)):
        direction = leading(math.atan2(dy, dx), m.ahead)
    along = dx * math.cos(psi) + dy * math.sin(psi)
    error = wrap((target.psi if m.arrived else direction) - psi)
    factor = 1.0 if m.arrived else speed_factor(error, distance <= NEAR * length)
    u_c = factor * surge_setpoint(along, c.filter)
    ended = not m.arrived and stopped and abs(along) < STOPPED_DISTANCE * length and abs(error) < STOPPED_ANGLE
    m = GoalMemory(m.motion, m.target, m.arrived, direction, m.ahead, m.steps)
    # The stage has ended with a stop: either the position is reached, or the approach is repeated from here.
    if ended:
        m = begin_stage(m, m.target, target, c)
    return u_c, yaw_rate_setpoint(error, 0.0, c.filter), m


@kernel
def follow_goal(motion: Filtered, target: Target, c: Filter) -> tuple[float, float]:
    """Setpoints of surge speed and yaw rate for a moving goal."""
    course = math.atan2(target.dy, target.dx)
    x, y = motion.x - target.x, motion.y - target.y
    # Along-track and cross-track error in the frame of the goal's course.
    along, across = x * math.cos(course) + y * math.sin(course), -x * math.sin(course) + y * math.cos(course)
    u_c = speed_of(target) - surge_setpoint(along, c)
    return follow_line(motion, course, across, u_c, target.r, c)


@kernel
def move(m: GoalMemory, c: GoalConstants) -> GoalMemory:
    """The reference one period later."""
    target, m = present_target(m, c)
    if speed_of(target) < STREAM_SPEED * c.filter.speed:
        u_c, r_c, m = approach_goal(m, target, c)
    else:
        u_c, r_c = follow_goal(m.motion, target, c.filter)
    motion = advance_filter(m.motion, u_c, r_c, c.filter)
    return set_scheduled(GoalMemory(motion, m.target, m.arrived, m.direction, m.ahead, m.steps + 1), c)


@kernel
def read(m: GoalMemory, c: GoalConstants) -> tuple[Motion, Acceleration]:
    """State, and the derivatives of its velocities."""
    return read_filter(m.motion, c.filter)


class GoalReference(KernelReference):
    """A feasible motion to the latest goal; before the first goal it keeps its initial position."""

    move, read = staticmethod(move), staticmethod(read)

    def __init__(self, start: Filtered, motion: Filter, parameters: GoalParameters) -> None:
        goals = [(round(time / motion.period), pose) for time, pose in scheduled_goals(parameters) if time >= 0.0]
        steps, poses = np.array([step for step, _ in goals], np.int64), np.array([pose for _, pose in goals], np.float64)
        given = float(parameters.astern_distance)
        self.constants = GoalConstants(motion, given if given >= 0.0 else ASTERN * motion.length, steps, poses.reshape(-1, 3))
        self._start = start
        self.reset()

    def reset(self) -> None:
        """Return to the start: goals that were set are discarded, scheduled goals begin again."""
        start = self._start
        target = stationary(start.x, start.y, start.psi, -math.inf, math.nan)
        self.memory = set_scheduled(GoalMemory(start, target, True, start.psi, 1.0, 0), self.constants)

    def set_goal(self, x: float, y: float, psi: float, stamp: float | None = None) -> None:
        """Set a goal; goals that follow each other shortly define a moving goal.

        `psi`: heading, rad. `stamp`: time of the measurement, s; None if it is unknown, then the present time counts.
        """
        self.memory = set_goal(self.memory, x, y, psi, math.nan if stamp is None else stamp, self.constants)

    def target(self) -> Target:
        """The present goal: extrapolated while a stream continues, stationary after its end."""
        target, self.memory = present_target(self.memory, self.constants)
        return target

    def go_to(self, x: float, y: float, psi: float) -> None:
        """Set a goal that is part of no stream, whatever was set before it; m, m, rad."""
        goal = stationary(x, y, psi, self.memory.steps * self.constants.filter.period, math.nan)
        self.memory = begin_stage(self.memory, goal, goal, self.constants)

    def halt(self) -> None:
        """Go where the reference can stop: ahead, or astern where it goes astern."""
        m, c = self.memory.motion, self.constants.filter
        braking = 0.5 * c.acceleration  # as in `surge_setpoint`
        way = math.copysign(0.5 * m.u * m.u / braking + abs(m.u) / c.gain, m.u) if m.u else 0.0
        self.go_to(m.x + way * math.cos(m.psi), m.y + way * math.sin(m.psi), m.psi)

    @property
    def arrived(self) -> bool:
        """Whether the reference is at rest at its goal."""
        m, c = self.memory, self.constants.filter
        still = abs(m.motion.u) < STOPPED_SPEED * c.speed and abs(m.motion.r) < STOPPED_SPEED * c.yaw_rate
        return m.arrived and still and abs(wrap(m.target.psi - m.motion.psi)) < STOPPED_ANGLE

    @property
    def time_left(self) -> float:
        """About the time until the reference is at rest at its goal, s: that of the way, and of the turn at its end."""
        m, c = self.memory, self.constants.filter
        course = m.motion.psi if m.arrived else m.direction
        turn = abs(wrap(m.target.psi - course)) + (0.0 if m.arrived else abs(wrap(course - m.motion.psi)))
        distance = magnitude(m.target.x - m.motion.x, m.target.y - m.motion.y)
        return float(distance / c.speed + turn / c.yaw_rate)
