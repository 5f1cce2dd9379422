"""Whether a measured heading fits the motion: a compass that is turned, or a heading that has been lost.

A ship that is driven ahead moves through the water where it heads. With the measured heading psi = psi_true + b, the velocity
over ground (u, v) along that heading, by the positions, and the velocity through the water (u_w, v_w),

    (u + i v) exp(i b) = u_w + i v_w + exp(-i (psi - b)) c,    v_w = k_1 r + k_2 U r + Im(exp(-i (psi - b)) w)

where the constants are: c, the current; w, the leeway by a steady wind; k_1, of a position that is not that of the centre of
lateral resistance; k_2, the drift of a turn, with the speed U. The lateral part is linear:

    u sin(b) + v cos(b) = a_1 sin(psi) + a_2 cos(psi) + k_1 r + k_2 U r + error

No speed through the water is needed. The four regressors are projected out of u and v. In what is left, the direction of the
least sum of squares is (sin b, cos b), by orthogonal regression, as u and v have the same noise: eigenvectors of a matrix of 2 by
2 with the eigenvalues l_1 < l_2. The variance of b is l_1 l_2/((n - 5) (l_2 - l_1)^2) (T. W. Anderson, Ann. Math. Statist. 34,
1963). Ships that go astern and ahead look alike, so
that -90 deg < b <= 90 deg. On one straight course nothing of u is left and b is not known: it takes courses that differ, such as
there and back. A steady turn of radius R to one side hides b behind its drift, which is up to L/(2 R), with the pivot point at
the bow: that of the mean yaw rate is allowed for.

The error of a heading that is lost, as one that stands still while the ship turns, lasts from block to block, where noise of the
positions changes its sign: the mean product of errors that follow each other measures what no turned compass explains.
"""

import math
from collections import deque
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.control.safety.monitors import SLOW_SPEED, Alarm, Monitor
from vessel_hsmc_ros.control.safety.parameters import MonitorParameters
from vessel_hsmc_ros.control.safety.reasons import Reason
from vessel_hsmc_ros.core.arrays import Array
from vessel_hsmc_ros.core.kinematics import GRAVITY, Motion, wrap
from vessel_hsmc_ros.core.timing import NANOSECONDS, seconds

BLOCKS, LEAST_BLOCKS = 120, 20  # means over blocks that are compared: all of the last ones, once there are a few
LEAST_WAY = 3.0  # least extent of the way, ship lengths: at rest, wind and waves move a ship to all sides
LEAST_SPREAD = 0.3  # least circular variance of the headings: courses that differ by 90 deg have 0.29
DEVIATIONS = 4.0  # of the bias that are allowed for: its variance takes the errors for independent, and they are not
JUMP = 4.0  # how many times the usual speed the jump of a position is, and no motion
NAMED_BIAS = math.radians(5.0)  # least bias that a person is told to correct
LARGEST_BIAS = math.radians(20.0)  # least bias that is an alarm: laws bear less, as an additional current
LOST_SHARE = 0.04  # share of the motion above which an error that lasts, and is fast enough, is a lost heading


class Bias(NamedTuple):
    """How far a measured heading is turned."""

    angle: float  # measured minus true heading, counter-clockwise, rad
    deviation: float  # its standard deviation, rad; infinite where the courses do not differ enough
    lost: bool  # whether the motion contradicts the heading, however that is turned

    @property
    def known(self) -> bool:
        """Whether there is a verdict: lost, or turned by an angle whose deviation is known."""
        return self.lost or math.isfinite(self.deviation)

    @property
    def beyond(self) -> float:
        """By how much it is turned at least, rad."""
        return max(abs(self.angle) - DEVIATIONS * self.deviation, 0.0)

    def text(self) -> str:
        """What is found, as a person reads a compass."""
        if self.lost:
            return "the heading does not follow the turns of the course"
        if not self.known:
            return "the courses do not show what the compass reads"
        side = "left" if self.angle > 0.0 else "right"
        spread = math.ceil(math.degrees(0.5 * DEVIATIONS * self.deviation))
        return f"the compass reads {math.degrees(abs(self.angle)):.0f} deg to the {side}, +-{spread} deg"


def block_length(length: float) -> float:
    """Time over which positions and headings of a ship of a length, m, are averaged, s: two of sqrt(L/g), and at least 1 s."""
    return max(1.0, 2.0 * math.sqrt(length / GRAVITY))


def bias(means: Array, length: float) -> Bias | None:
    """The bias of a heading; None where the motion does not show it.

    `means`: time, x, y and unwrapped heading over successive blocks, (n, 4). `length`: of the ship, m.
    """
    slow = SLOW_SPEED * math.sqrt(GRAVITY * length)
    rates, psi = np.diff(means, axis=0), 0.5 * (means[1:, 3] + means[:-1, 3])
    rates = rates[:, 1:] / rates[:, :1]
    ahead = (rates[:, 0] + 1j * rates[:, 1]) * np.exp(-1j * psi)
    speed = np.abs(ahead)
    known = (speed > 2.0 * slow) & (speed < JUMP * np.median(speed))
    if known.sum() < LEAST_BLOCKS or math.hypot(*np.ptp(means[:, 1:3], axis=0)) < LEAST_WAY * length:
        return None
    ahead, speed, r, psi = ahead[known], speed[known], rates[known, 2], psi[known]
    shown = np.column_stack((ahead.imag, ahead.real))
    others = np.column_stack((np.sin(psi), np.cos(psi), r, speed * r))
    left = shown - others @ np.linalg.lstsq(others, shown, rcond=None)[0]
    (least, most), vectors = np.linalg.eigh(left.T @ left)
    n, least = len(psi) - others.shape[1] - 1, max(float(least), 0.0)
    if most < n * slow**2 or least >= most:
        return None
    cosine, sine = vectors[:, 0] * (1.0 if vectors[0, 0] >= 0.0 else -1.0)
    turned = 1.0 - abs(np.exp(1j * psi).mean()) > LEAST_SPREAD
    error = left @ vectors[:, 0]
    lasting = float((error[1:] * error[:-1]).mean())
    lost = lasting > slow**2 and lasting * n > LOST_SHARE * most
    drift = 0.5 * length * abs(float(r.mean())) / float(speed.mean())
    deviation = math.hypot(math.sqrt(least * most / n) / (most - least), drift / DEVIATIONS)
    return Bias(math.atan2(sine, cosine), deviation if turned else math.inf, lost)


class Heading(Monitor):
    """Compares the measured heading with the way of the ship, and demands the safe action where one contradicts the other.

    Blocks of a ship at rest show nothing: an alarm stays until the heading of a moving ship fits, or until a reset. `length`: of
    the ship, m.

    Attributes:
        found: The bias; None as long as the motion has not shown it.
    """

    found: Bias | None

    def __init__(self, parameters: MonitorParameters, length: float) -> None:
        self._length, self._block = length, round(block_length(length) * NANOSECONDS)
        super().__init__(Reason.HEADING, parameters.heading_warning, parameters.heading_safe)

    def reset(self) -> None:
        """Forget the past."""
        super().reset()
        self.detail, self.found = "", None
        self._means: deque[tuple[float, ...]] = deque(maxlen=BLOCKS)
        self._last: tuple[int, float] | None = None
        self._begin(0)

    def _begin(self, stamp: int) -> None:
        self._began, self._sums, self._count = stamp, [0.0] * 4, 0

    def step(self, stamp: int, motion: Motion) -> Alarm:
        """Take a measurement of a time, ns; that of the last call where there is no new one."""
        if self._last is not None and stamp < self._last[0]:
            self.reset()
        if self._last is None:
            self._begin(stamp)
            self._last = stamp - 1, motion.psi
        if stamp > self._last[0]:
            psi = self._last[1] + wrap(motion.psi - self._last[1])
            self._take(stamp, (motion.x, motion.y, psi))
            self._last = stamp, psi
        return self.alarm

    def _take(self, stamp: int, place: tuple[float, float, float]) -> None:
        if stamp - self._began >= self._block and self._count:
            self._means.append(tuple(total / self._count for total in self._sums))
            elapsed = seconds(stamp - self._began)
            self._begin(stamp)
            self._judge(elapsed)
        for k, value in enumerate((seconds(stamp), *place)):
            self._sums[k] += value
        self._count += 1

    def _judge(self, elapsed: float) -> None:
        """Judge the last blocks at the end of one that took a time, s."""
        found = bias(np.array(self._means), self._length) if len(self._means) > LEAST_BLOCKS else None
        if found is None or not found.known:
            return
        self.found = found
        self.watch(found.lost or found.beyond > LARGEST_BIAS, elapsed)
        self.detail = found.text() if self.alarm is not Alarm.OK else ""
