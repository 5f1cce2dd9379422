"""Goals: a pose to reach and keep, or a stream of poses that move.

A stationary goal is approached in stages: turn the bow towards it, or the stern if it is near and astern; go there; stop; turn to
its heading on the spot. A moving goal, which a stream of poses defines, is followed by line-of-sight guidance along its course,
with its speed and yaw rate as feedforward. Its future motion is unknown, so the reference follows with a small lag.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.kinematics import wrap
from vessel_hsmc_ros.reference.goal_parameters import GoalParameters, scheduled_goals
from vessel_hsmc_ros.reference.motion_filter import FilteredMotion
from vessel_hsmc_ros.reference.steering import follow_line, surge_setpoint, yaw_rate_setpoint

Array = NDArray[np.float64]

NEAR, HELD_BEARING, REACHED = 3.0, 0.5, 0.05
"""Distances to the goal, m: nearer than the first it is approached straight only; than the second its bearing is kept constant,
because it is ill-defined close to the goal; than the third the position is reached."""

STRAIGHT = 0.15
"""Heading error above which a near goal is not approached, rad."""

STOPPED_DISTANCE, STOPPED_ANGLE, STOPPED_SPEED = 0.02, 0.02, 0.005
"""A stage ends when distance, heading error and speed are below these, m, rad, m/s."""

STREAM_GAP, STREAM_SPEED = 1.5, 0.1
"""Goals that follow each other within the first, s, and move faster than the second, m/s, are a stream."""


class Target(NamedTuple):
    """A goal: pose, time of arrival, time of measurement, and velocity; m, m, rad, s, s, m/s, m/s, rad/s."""

    x: float
    y: float
    psi: float
    time: float = 0.0
    stamp: float | None = None
    dx: float = 0.0
    dy: float = 0.0
    r: float = 0.0

    @property
    def speed(self) -> float:
        """Speed over ground, m/s."""
        return math.hypot(self.dx, self.dy)


def estimate_velocity(last: Target, new: Target, elapsed: float) -> Target:
    """The new goal with the velocity between the last one and it, smoothed over a second.

    Args:
        last: The previous goal.
        new: The new goal, without velocity.
        elapsed: Time between the two, s; above STREAM_GAP the new goal is stationary.

    Returns:
        The new goal, with velocity and yaw rate if the two belong to one stream.
    """
    if not 0.0 < elapsed <= STREAM_GAP:
        return new
    # First-order low-pass with a time constant of 1 s; the first difference of a stream initialises it.
    share = 1.0 if last.speed == 0.0 else min(1.0, elapsed)
    return new._replace(
        dx=last.dx + share * ((new.x - last.x) / elapsed - last.dx),
        dy=last.dy + share * ((new.y - last.y) / elapsed - last.dy),
        r=last.r + share * (wrap(new.psi - last.psi) / elapsed - last.r),
    )


def speed_factor(heading_error: float, distance: float) -> float:
    """Reduction of the approach speed, in [0, 1], for a heading error: a far goal may be approached in an arc, a near one not."""
    if distance > NEAR:
        return max(0.0, math.cos(heading_error)) ** 2
    return max(0.0, 1.0 - abs(heading_error) / STRAIGHT)


class GoalReference:
    """A feasible motion to the latest goal; before the first goal it keeps its initial position.

    Args:
        motion: The motion to steer.
        parameters: Scheduled goals.
        period: Length of a step, s.

    Raises:
        ParameterError: poses and times of the goals differ in number, or the times do not increase.
    """

    def __init__(self, motion: FilteredMotion, parameters: GoalParameters, period: float) -> None:
        self._motion = motion
        self._goals = scheduled_goals(parameters)
        self._astern_distance = parameters.astern_distance
        self._period = period
        self.reset()

    @property
    def state(self) -> Array:
        """Pose x, y, psi and body velocities u, v, r of the present step, shape (6,)."""
        return self._motion.state

    @property
    def time(self) -> float:
        """Time since the start, s."""
        return self._steps * self._period

    def reset(self) -> None:
        """Return to the start: goals that were set are discarded, scheduled goals begin again."""
        self._motion.reset()
        self._steps = 0
        x, y, psi = self._motion.state[:3].tolist()
        self._target = Target(x, y, psi, -math.inf)
        self._arrived, self._direction, self._ahead = True, psi, 1.0
        self._set_scheduled()

    def acceleration(self) -> Array:
        """Derivatives du, dv, dr of the body velocities, shape (3,): m/s², m/s², rad/s²."""
        return self._motion.acceleration()

    def advance(self) -> None:
        """Advance by one period."""
        target = self.target()
        setpoints = self._approach(target) if target.speed < STREAM_SPEED else self._follow(target)
        self._motion.advance(*setpoints)
        self._steps += 1
        self._set_scheduled()

    def go_to(self, x: float, y: float, psi: float) -> None:
        """Set a stationary goal.

        Args:
            x, y: Position, m.
            psi: Heading, rad.
        """
        self._target = Target(x, y, psi, self.time)
        self._begin_stage(self._target)

    def set_goal(self, x: float, y: float, psi: float, stamp: float | None = None) -> None:
        """Set a goal; goals that follow each other shortly define a moving goal.

        Args:
            x, y: Position, m.
            psi: Heading, rad.
            stamp: Time of the measurement, s; None if it is unknown, then the present time counts.
        """
        last, now = self._target, self.time
        # A stationary goal that is published repeatedly is not a stream and must not restart the approach.
        if (x, y, psi) == last[:3] and last.speed == 0.0:
            self._target = last._replace(time=now, stamp=stamp)
            return
        elapsed = now - last.time if stamp is None or last.stamp is None else stamp - last.stamp
        self._target = estimate_velocity(last, Target(x, y, psi, now, stamp), elapsed)
        if self._target.speed > 2.0 * self._motion.limits.speed:  # a jump to a new goal, not a stream
            self._target = Target(x, y, psi, now, stamp)
        self._begin_stage(self._target)

    def target(self) -> Target:
        """The present goal: extrapolated while a stream continues, stationary after its end."""
        target, elapsed = self._target, self.time - self._target.time
        if target.speed == 0.0:
            return target
        if elapsed > STREAM_GAP:
            self._target = Target(target.x, target.y, target.psi, target.time, target.stamp)
            self._begin_stage(self._target)
            return self._target
        return target._replace(
            x=target.x + elapsed * target.dx,
            y=target.y + elapsed * target.dy,
            psi=wrap(target.psi + elapsed * target.r),
        )

    def _set_scheduled(self) -> None:
        for time, pose in self._goals:
            if time >= 0.0 and round(time / self._period) == self._steps:
                self.set_goal(*pose)

    def _begin_stage(self, target: Target) -> None:
        """Decide whether the position is reached, and whether to approach with the bow or with the stern."""
        x, y, psi = self.state[:3].tolist()
        distance = math.hypot(target.x - x, target.y - y)
        bearing = math.atan2(target.y - y, target.x - x)
        # Abaft the beam: more than 90 degrees off the bow.
        astern = abs(wrap(bearing - psi)) > 0.5 * math.pi
        self._arrived = distance < REACHED and target.speed == 0.0
        self._ahead = -1.0 if astern and distance < self._astern_distance else 1.0
        self._direction = bearing if self._ahead > 0.0 else wrap(bearing + math.pi)

    def _approach(self, target: Target) -> tuple[float, float]:
        """Setpoints of surge speed and yaw rate for a stationary goal."""
        x, y, psi, u = self.state[:4].tolist()
        dx, dy = target.x - x, target.y - y
        distance = math.hypot(dx, dy)
        stopped = abs(u) < STOPPED_SPEED
        # Near the goal the bearing rotates quickly, so it is kept constant, unless the ship has stopped short of the goal.
        if not self._arrived and (distance > HELD_BEARING or (stopped and distance > REACHED)):
            bearing = math.atan2(dy, dx)
            self._direction = bearing if self._ahead > 0.0 else wrap(bearing + math.pi)
        heading = target.psi if self._arrived else self._direction
        along = dx * math.cos(psi) + dy * math.sin(psi)
        error = wrap(heading - psi)
        factor = 1.0 if self._arrived else speed_factor(error, distance)
        u_c = factor * surge_setpoint(self._motion, along)
        # The stage has ended with a stop: either the position is reached, or the approach is repeated from here.
        if not self._arrived and stopped and abs(along) < STOPPED_DISTANCE and abs(error) < STOPPED_ANGLE:
            self._begin_stage(target)
        return u_c, yaw_rate_setpoint(self._motion, error)

    def _follow(self, target: Target) -> tuple[float, float]:
        """Setpoints of surge speed and yaw rate for a moving goal."""
        course = math.atan2(target.dy, target.dx)
        x, y = float(self.state[0]) - target.x, float(self.state[1]) - target.y
        # Along-track and cross-track error in the frame of the goal's course.
        along, across = x * math.cos(course) + y * math.sin(course), -x * math.sin(course) + y * math.cos(course)
        u_c = target.speed - surge_setpoint(self._motion, along)
        return follow_line(self._motion, course, across, u_c, target.r)
