"""Riding through a lost position: for a declared time the last place moves on by the velocities, along the measured heading.

    (x, y)' = R(psi)(u, v),    trapezoidal between two measurements

It needs measurements that go on to come, with a heading, while their position is NaN. The error of the place grows with that of
the velocities: with 0.1 m/s it is 1 m after 10 s.
"""

import math

from vessel_hsmc_ros.core.kinematics import Motion, to_body
from vessel_hsmc_ros.core.timing import NANOSECONDS, seconds


class DeadReckoning:
    """Fills in the position of measurements that lack it.

    `limit`: longest time without a position, s; 0: never.

    Attributes:
        elapsed: Time since the last measured position, s; 0 while there is one.
    """

    def __init__(self, limit: float) -> None:
        self._limit = round(limit * NANOSECONDS)
        self.reset()

    def reset(self) -> None:
        """Forget the last place."""
        self.elapsed = 0.0
        self._known: int | None = None
        self._last: tuple[int, Motion] | None = None

    def fill(self, stamp: int, motion: Motion, estimate: Motion | None = None) -> Motion:
        """The measurement of a time, ns, with a position where it lacks one and that may be bridged; else as it is.

        `estimate`: the motion by an observer, whose velocities count; None without one. Velocities that are lost as well stay
        those of before.
        """
        if math.isfinite(motion.x) and math.isfinite(motion.y):
            self._known, self._last, self.elapsed = stamp, (stamp, motion), 0.0
            return motion
        if self._last is None or self._known is None or not math.isfinite(motion.psi):
            return motion
        if not self._last[0] < stamp <= self._known + self._limit:
            return motion
        before = self._last[1]
        source = estimate or motion
        velocities = (source.u, source.v, source.r)
        u, v, r = velocities if all(map(math.isfinite, velocities)) else (before.u, before.v, before.r)
        filled = Motion(before.x, before.y, motion.psi, u, v, r)
        dt = 0.5 * seconds(stamp - self._last[0])
        (x_0, y_0), (x_1, y_1) = (to_body(m.u, m.v, -m.psi) for m in (before, filled))
        filled = filled._replace(x=before.x + dt * (x_0 + x_1), y=before.y + dt * (y_0 + y_1))
        self._last, self.elapsed = (stamp, filled), seconds(stamp - self._known)
        return filled
