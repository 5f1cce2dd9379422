"""A goal with its velocity, which is estimated from a stream of poses."""

from typing import NamedTuple

from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.kinematics import magnitude, wrap

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
