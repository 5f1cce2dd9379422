"""Surge-speed and yaw-rate setpoints that bring a reference to a point, to a heading, or onto a line."""

import math

from vessel_hsmc_ros.core.kinematics import wrap
from vessel_hsmc_ros.core.limits import clip
from vessel_hsmc_ros.reference.motion_filter import FilteredMotion

GAIN = 0.25
"""Proportional gain from distance to speed and from angle to yaw rate, 1/s."""

GOAL_LOOKAHEAD, LEG_LOOKAHEAD = 6.0, 15.0
"""Lookahead distance of line-of-sight guidance behind a moving goal and on a path's leg, which begins with a corner, m."""

LEAST_SPEED = 0.3
"""The drift angle is computed with at least this surge speed, m/s: it is undefined at rest."""


def approach(distance: float, braking: float, largest: float) -> float:
    """The speed at which to approach a point so that the motion can stop there.

    Proportional to the distance near the point, along the braking curve sqrt(2·braking·distance) farther away.

    Args:
        distance: Distance to go, m, or angle, rad; its sign is that of the result.
        braking: Deceleration to plan with, m/s² or rad/s².
        largest: Largest speed, m/s or rad/s.

    Returns:
        Speed, m/s, or yaw rate, rad/s, with the sign of the distance.
    """
    # The smallest of the three bounds: proportional, braking curve, largest speed.
    magnitude = abs(distance)
    return math.copysign(min(GAIN * magnitude, math.sqrt(2.0 * braking * magnitude), largest), distance)


def surge_setpoint(motion: FilteredMotion, distance: float) -> float:
    """The surge speed with which to stop after a distance, m, positive ahead; half the acceleration is kept in reserve."""
    limits = motion.limits
    return approach(distance, 0.5 * limits.acceleration, limits.speed)


def yaw_rate_setpoint(motion: FilteredMotion, angle: float, feedforward: float = 0.0) -> float:
    """The yaw rate with which to turn by an angle; half the yaw acceleration is kept in reserve.

    Args:
        motion: The reference's motion.
        angle: Angle to turn by, rad, wrapped.
        feedforward: Yaw rate of the desired heading, rad/s.

    Returns:
        Yaw rate, rad/s; the motion filter limits it.
    """
    limits = motion.limits
    return feedforward + approach(angle, 0.5 * limits.yaw_acceleration, limits.yaw_rate)


def follow_line(
    motion: FilteredMotion,
    course: float,
    cross_track: float,
    speed: float,
    yaw_rate: float = 0.0,
    lookahead: float = GOAL_LOOKAHEAD,
) -> tuple[float, float]:
    """Setpoints that bring the motion onto a line and along it, by line-of-sight guidance of its course.

    The course is heading plus drift angle; the desired course is that of the line minus atan(cross_track/lookahead). While the
    heading is far off, the speed is reduced by the cosine of the error.

    Args:
        motion: The reference's motion.
        course: Direction of the line, rad.
        cross_track: Distance to the left of the line, m.
        speed: Speed along the line, m/s.
        yaw_rate: Rate at which the line turns, rad/s.
        lookahead: Lookahead distance, m.

    Returns:
        Surge speed [m/s] and yaw rate [rad/s].
    """
    psi, u, v = motion.state[2:5].tolist()
    # The sideslip angle: an underactuated hull moves along its course, not along its heading.
    drift = math.atan2(v, max(u, LEAST_SPEED))
    error = wrap(course - math.atan(cross_track / lookahead) - drift - psi)
    return speed * max(0.0, math.cos(error)), yaw_rate_setpoint(motion, error, clip(yaw_rate, motion.limits.yaw_rate))
