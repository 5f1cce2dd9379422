"""Goals to follow: a pose to go to and stay at, or a stream of poses that move.

A goal at rest is gone to in legs: turn the bow to it, or the stern when it is near and behind, go there, stop; when the place is
reached, turn to its heading on the spot. A goal that moves, which a stream of poses tells, is followed by line of sight along its
course, its speed and its turning fed forward. Where it goes next nobody says, so it is followed with a small lag.
"""

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.kinematics import wrap
from vessel_hsmc_ros.core.schema import parameter
from vessel_hsmc_ros.reference.motion_filter import FilteredMotion, approach, clip

Array = NDArray[np.float64]

GAIN = 0.25
"""Speed over way to go, and yaw rate over angle to turn, near their ends, 1/s."""

NEAR, FREEZE, REACHED = 3.0, 0.5, 0.05
"""Nearer than the first it goes straight only, than the second a leg's direction holds, than the third it is there, m."""

STRAIGHT = 0.15
"""Near the place, it does not go with more than this to turn, rad."""

ALONG, TURN, STILL = 0.02, 0.02, 0.005
"""A leg is over when way and angle to go and the speed are below these, m, rad, m/s."""

STREAM_GAP, STREAM_SPEED = 1.5, 0.1
"""Goals that come within the first of each other, s, and move faster than the second, m/s, are a stream."""

LOOKAHEAD, LEG_LOOKAHEAD = 6.0, 15.0
"""Lookahead of line of sight, behind a moving goal and on a path's leg, which begins with a corner, m."""


NEVER = -1.0
"""The time of what does not happen, s: an empty list is none for ROS."""


@dataclass(frozen=True)
class GoalParameters:
    """Goals from the parameters file, for runs without a publisher of `goal_pose`."""

    poses: tuple[float, ...] = parameter(
        (0.0, 0.0, 0.0), "Goals one after the other: x [m], y [m], heading of the first, of the second.", low=-1e6, high=1e6
    )
    times: tuple[float, ...] = parameter(
        (NEVER,), "When each becomes the goal; increasing, below 0 for never.", unit="s", low=-1.0, high=1e9
    )
    astern_distance: float = parameter(10.0, "Goals nearer than this and behind are gone to astern.", unit="m", low=0.0, high=1e6)


class Target(NamedTuple):
    """A goal: its pose, when it was said and measured, and how it moves: m, m, rad, s, s, m/s, m/s, rad/s."""

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
        """m/s."""
        return math.hypot(self.dx, self.dy)


def programme(p: GoalParameters) -> list[tuple[float, tuple[float, float, float]]]:
    """Times and poses of the goals in the parameters.

    Raises:
        ParameterError: there is not one time for each x, y, heading, or the times do not increase.
    """
    if len(p.poses) != 3 * len(p.times):
        raise ParameterError(
            f"reference_ship.goal.poses with {len(p.poses)} numbers is not allowed: it takes x, y, heading for each of the"
            f" {len(p.times)} goal.times"
        )
    if any(later <= earlier for earlier, later in pairwise(time for time in p.times if time >= 0.0)):
        raise ParameterError(f"reference_ship.goal.times = {list(p.times)} is not allowed: it takes increasing times")
    return [(time, (p.poses[3 * i], p.poses[3 * i + 1], p.poses[3 * i + 2])) for i, time in enumerate(p.times)]


def _moved(last: Target, new: Target, elapsed: float) -> Target:
    """A new goal with the motion that it and the last one tell, smoothed over a second; at rest when long after it."""
    if not 0.0 < elapsed <= STREAM_GAP:
        return new
    share = 1.0 if last.speed == 0.0 else min(1.0, elapsed)
    return new._replace(
        dx=last.dx + share * ((new.x - last.x) / elapsed - last.dx),
        dy=last.dy + share * ((new.y - last.y) / elapsed - last.dy),
        r=last.r + share * (wrap(new.psi - last.psi) / elapsed - last.r),
    )


def _facing(turn: float, away: float) -> float:
    """The part of its speed at which to go with an angle still to turn: far away it may go in an arc, near only straight."""
    return max(0.0, math.cos(turn)) ** 2 if away > NEAR else max(0.0, 1.0 - abs(turn) / STRAIGHT)


class GoalReference:
    """A feasible motion to the latest goal; before the first it keeps its place.

    Attributes:
        state: x, y, psi, u, v, r, shape (6,).

    Args:
        motion: What moves.
        parameters: Goals known beforehand.
        period: Time between two steps, s.

    Raises:
        ParameterError: the goals make no sense.
    """

    def __init__(self, motion: FilteredMotion, parameters: GoalParameters, period: float) -> None:
        self._motion = motion
        self._goals = programme(parameters)
        self._astern_distance = parameters.astern_distance
        self._period = period
        self.reset()

    @property
    def state(self) -> Array:
        """The pose x, y, psi and the body velocities u, v, r of the present step, shape (6,)."""
        return self._motion.state

    @property
    def time(self) -> float:
        """Time since the start, s."""
        return self._steps * self._period

    def reset(self) -> None:
        """Back to the start; goals that were set are forgotten, those of the parameters begin anew."""
        self._motion.reset()
        self._steps = 0
        x, y, psi = (float(value) for value in self._motion.state[:3])
        self._target = Target(x, y, psi, -math.inf)
        self._arrived, self._direction, self._ahead = True, psi, 1.0
        self._take_due()

    def acceleration(self) -> Array:
        """The derivatives du, dv, dr of the body velocities, shape (3,): m/s², m/s², rad/s²."""
        return self._motion.acceleration()

    def advance(self) -> None:
        """Move on by one period."""
        target = self.target()
        wishes = self._to_rest(target) if target.speed < STREAM_SPEED else self._to_moving(target)
        self._motion.advance(*wishes)
        self._steps += 1
        self._take_due()

    def go_to(self, x: float, y: float, psi: float) -> None:
        """Take a new goal at rest."""
        self._target = Target(x, y, psi, self.time)
        self._begin_leg(self._target)

    def set_goal(self, x: float, y: float, psi: float, stamp: float | None = None) -> None:
        """Take a new goal; one that comes soon after the last tells how it moves.

        Args:
            x, y, psi: The goal, m, m, rad.
            stamp: When it was measured, s; None for now.
        """
        last, now = self._target, self.time
        if (x, y, psi) == last[:3] and last.speed == 0.0:
            self._target = last._replace(time=now, stamp=stamp)
            return
        elapsed = now - last.time if stamp is None or last.stamp is None else stamp - last.stamp
        self._target = _moved(last, Target(x, y, psi, now, stamp), elapsed)
        if self._target.speed > 2.0 * self._motion.limits.speed:  # no stream but another place
            self._target = Target(x, y, psi, now, stamp)
        self._begin_leg(self._target)

    def target(self) -> Target:
        """The goal now: carried on while a stream lasts, at rest after it."""
        target, elapsed = self._target, self.time - self._target.time
        if target.speed == 0.0:
            return target
        if elapsed > STREAM_GAP:
            self._target = Target(target.x, target.y, target.psi, target.time, target.stamp)
            self._begin_leg(self._target)
            return self._target
        return target._replace(
            x=target.x + elapsed * target.dx,
            y=target.y + elapsed * target.dy,
            psi=wrap(target.psi + elapsed * target.r),
        )

    def _take_due(self) -> None:
        for time, pose in self._goals:
            if time >= 0.0 and round(time / self._period) == self._steps:
                self.set_goal(*pose)

    def _begin_leg(self, target: Target) -> None:
        """Choose bow or stern, and the direction."""
        x, y, psi = (float(value) for value in self.state[:3])
        away = math.hypot(target.x - x, target.y - y)
        bearing = math.atan2(target.y - y, target.x - x)
        behind = abs(wrap(bearing - psi)) > 0.5 * math.pi
        self._arrived = away < REACHED and target.speed == 0.0
        self._ahead = -1.0 if behind and away < self._astern_distance else 1.0
        self._direction = bearing if self._ahead > 0.0 else wrap(bearing + math.pi)

    def _to_rest(self, target: Target) -> tuple[float, float]:
        """Wishes for a goal at rest."""
        x, y, psi, u = (float(value) for value in self.state[:4])
        away_x, away_y = target.x - x, target.y - y
        away = math.hypot(away_x, away_y)
        if not self._arrived and (away > FREEZE or (abs(u) < STILL and away > REACHED)):
            bearing = math.atan2(away_y, away_x)
            self._direction = bearing if self._ahead > 0.0 else wrap(bearing + math.pi)
        heading = target.psi if self._arrived else self._direction
        along = away_x * math.cos(psi) + away_y * math.sin(psi)
        turn = wrap(heading - psi)
        limits = self._motion.limits
        facing = 1.0 if self._arrived else _facing(turn, away)
        u_c = facing * approach(along, GAIN, 0.5 * limits.acceleration, limits.speed)
        if not self._arrived and abs(along) < ALONG and abs(turn) < TURN and abs(u) < STILL:
            self._begin_leg(target)
        return u_c, turning(self._motion, turn)

    def _to_moving(self, target: Target) -> tuple[float, float]:
        """Wishes for a goal that moves."""
        course = math.atan2(target.dy, target.dx)
        x, y = float(self.state[0]) - target.x, float(self.state[1]) - target.y
        along, across = x * math.cos(course) + y * math.sin(course), -x * math.sin(course) + y * math.cos(course)
        u_c = target.speed - approach(along, GAIN, 0.5 * self._motion.limits.acceleration, self._motion.limits.speed)
        return follow(self._motion, course, across, u_c, target.r)


def turning(motion: FilteredMotion, turn: float, feedforward: float = 0.0) -> float:
    """The yaw rate wished for an angle to turn, on top of one that is known."""
    limits = motion.limits
    return feedforward + approach(turn, GAIN, 0.5 * limits.yaw_acceleration, limits.yaw_rate)


def follow(
    motion: FilteredMotion, course: float, across: float, speed: float, yaw_rate: float = 0.0, lookahead: float = LOOKAHEAD
) -> tuple[float, float]:
    """Wishes that bring the motion onto a line and along it: line of sight for its course, which is heading plus drift angle.

    Args:
        motion: What moves.
        course: Of the line, rad.
        across: How far to the line's left it is, m.
        speed: Speed along the line, m/s.
        yaw_rate: With which the line turns, rad/s.
        lookahead: How far ahead on the line to aim, m.
    """
    psi, u, v = (float(value) for value in motion.state[2:5])
    drift = math.atan2(v, max(u, 0.3))
    turn = wrap(course - math.atan(across / lookahead) - drift - psi)
    return speed * max(0.0, math.cos(turn)), turning(motion, turn, clip(yaw_rate, motion.limits.yaw_rate))
