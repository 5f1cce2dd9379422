"""Surge-speed and yaw-rate setpoints that bring a reference to a point, to a heading, or onto a line."""

import math

from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.kinematics import wrap
from vessel_hsmc_ros.core.limits import clip
from vessel_hsmc_ros.reference.motion_filter import Filter, Filtered

LEAST_SPEED = 0.2
"""The drift angle is computed with at least this share of the largest speed: it is undefined at rest."""


@kernel
def approach(distance: float, braking: float, largest: float, gain: float) -> float:
    """The speed at which to approach a point so that the motion can stop there.

    With the gain k and the deceleration b it is k·x near the point, and sqrt(2·b·(x - b/(2·k²))) beyond x = b/k², where both and
    their slopes are equal: nowhere does it take more than b.

    Args:
        distance: Distance to go, m, or angle, rad; its sign is that of the result.
        braking: Deceleration to plan with, m/s² or rad/s².
        largest: Largest speed, m/s or rad/s.
        gain: 1/s.

    Returns:
        Speed, m/s, or yaw rate, rad/s, with the sign of the distance.
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

    Args:
        angle: Angle to turn by, rad, wrapped.
        feedforward: Yaw rate of the desired heading, rad/s.
        c: Limits of the motion.

    Returns:
        Yaw rate, rad/s; the motion filter limits it.
    """
    return feedforward + approach(angle, 0.5 * c.yaw_acceleration, c.yaw_rate, c.gain)


@kernel
def follow_line(
    motion: Filtered, course: float, cross_track: float, speed: float, yaw_rate: float, c: Filter
) -> tuple[float, float]:
    """Setpoints that bring the motion onto a line and along it, by line-of-sight guidance of its course.

    The course is heading plus drift angle; the desired course is that of the line minus atan(cross_track/lookahead). The
    lookahead distance is the largest speed divided by the gain, so that the ship comes onto the line as fast as it turns. While
    the heading is far off, the speed is reduced by the cosine of the error.

    Args:
        motion: The reference's motion.
        course: Direction of the line, rad.
        cross_track: Distance to the left of the line, m.
        speed: Speed along the line, m/s.
        yaw_rate: Rate at which the line turns, rad/s.
        c: Limits of the motion.

    Returns:
        Surge speed [m/s] and yaw rate [rad/s].
    """
    # The sideslip angle: an underactuated hull moves along its course, not along its heading.
    least = LEAST_SPEED * c.speed
    drift = math.atan2(motion.v, motion.u if motion.u > least else least)
    error = wrap(course - math.atan(cross_track * c.gain / c.speed) - drift - motion.psi)
    aligned = math.cos(error)
    share = aligned if aligned > 0.0 else 0.0
    return speed * share, yaw_rate_setpoint(error, clip(yaw_rate, c.yaw_rate), c)
