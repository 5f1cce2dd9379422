"""Monitors of what no single sample shows: they warn after a time, and demand the safe action after a longer one.

Whether a measured heading fits the motion: a compass that is turned, or a heading that has been lost.

A ship that is driven ahead moves through the water where it heads. With the measured heading psi = psi_true + b, the velocity
over ground (u, v) along that heading, by the positions, and the velocity through the water (u_w, v_w),

    (u + i v) exp(i b) = u_w + i v_w + exp(-i (psi - b)) c,    v_w = k_1 r + k_2 U r + k_3 q + Im(exp(-i (psi - b)) w)

where the constants are: c, the current; w, the leeway by a steady wind; k_1, of a position that is not that of the centre of
lateral resistance; k_2 and k_3, the drift of a turn with the speed U, part of which decays slowly:

    T dq/dt = U r - q

The lateral part is linear:

    u sin(b) + v cos(b) = a_1 sin(psi) + a_2 cos(psi) + k_1 r + k_2 U r + k_3 q + error

No speed through the water is needed. The five regressors are projected out of u and v. In what is left, the direction of the
least sum of squares is (sin b, cos b), by orthogonal regression, as u and v have the same noise: eigenvectors of a matrix of 2 by
2 with the eigenvalues l_1 < l_2. The variance of b is l_1 l_2/((n - 6) (l_2 - l_1)^2) (T. W. Anderson, Ann. Math. Statist. 34,
1963). Ships that go astern and ahead look alike, so
that -90 deg < b <= 90 deg. On one straight course nothing of u is left and b is not known: it takes courses that differ, such as
there and back. A steady turn of radius R to one side hides b behind its drift, which is up to L/(2 R), with the pivot point at
the bow: that of the mean yaw rate is allowed for.

The error of a heading that is lost, as one that stands still while the ship turns, lasts from block to block, where noise of the
positions changes its sign: the mean product of errors that follow each other measures what no turned compass explains. Gusts
carry a hull to the side as well, by less and all the time: the products count by their squares.
"""

import math
from collections import deque
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.control.safety.parameters import MonitorParameters, Reason
from vessel_hsmc_ros.core.kernel import AT_LIMIT, Array
from vessel_hsmc_ros.core.kinematics import GRAVITY, Motion, wrap
from vessel_hsmc_ros.core.timing import NANOSECONDS, seconds

Pair = tuple[float, float]


class Alarm(IntEnum):
    """How far a monitor has come."""

    OK = 0
    WARN = 1
    SAFE = 2


class Monitor:
    """A condition that may last for a while.

    The safe action often ends the condition that caused it. So an alarm that demands it is kept until the condition has been
    absent for as long as a warning takes; then the law gets another try. `warning`, `safe`: times after which it is a warning,
    and demands the safe action, s.

    Attributes:
        detail: What was found, beyond the reason.
    """

    detail = ""

    def __init__(self, reason: Reason, warning: float, safe: float) -> None:
        self.reason = reason
        self._warning, self._safe = warning, safe
        self.reset()

    def reset(self) -> None:
        """Forget the past."""
        self.alarm = Alarm.OK
        self._present = self._absent = 0.0

    def watch(self, present: bool, period: float) -> Alarm:
        """Note whether the condition was present during a control period, s."""
        self._present = self._present + period if present else 0.0
        self._absent = 0.0 if present else self._absent + period
        if self._present >= self._safe:
            self.alarm = Alarm.SAFE
        elif self.alarm is not Alarm.SAFE or self._absent >= self._warning:
            self.alarm = Alarm.WARN if self._present >= self._warning else Alarm.OK
        return self.alarm


class NotMoving(Monitor):
    """Driven but not moving: a force or moment near its limit does not move the ship, as with a lost or blocked propeller.

    `limits`: largest surge force and yaw moment, N and N·m.
    """

    def __init__(self, parameters: MonitorParameters, limits: Pair) -> None:
        super().__init__(Reason.NOT_MOVING, parameters.not_moving_warning, parameters.not_moving_safe)
        self._parameters, self._limits = parameters, limits
        self._axes = [_Axis(), _Axis()]

    def step(self, command: Pair, motion: Pair, period: float) -> Alarm:
        """Watch a control period.

        `command`: surge force and yaw moment that were commanded, N and N·m. `motion`: measured surge speed and yaw rate, m/s
        and rad/s. `period`: s.
        """
        p = self._parameters
        bounds = p.moving_speed, p.moving_yaw_rate
        stuck = [
            axis.driven(tau, p.driven_share * limit) and abs(velocity) < bound
            for axis, tau, limit, velocity, bound in zip(self._axes, command, self._limits, motion, bounds, strict=True)
        ]
        return self.watch(any(stuck), period)


class Saturation(Monitor):
    """A command at one and the same limit; a law that switches between its limits is not saturated.

    `limits`: largest surge force and yaw moment, N and N·m.
    """

    def __init__(self, parameters: MonitorParameters, limits: Pair) -> None:
        super().__init__(Reason.SATURATED, parameters.saturation_warning, parameters.saturation_safe)
        self._limits = limits
        self._axes = [_Axis(), _Axis()]

    def step(self, command: Pair, period: float) -> Alarm:
        """Watch the command of a control period, N and N·m; s."""
        driven = [axis.driven(tau, limit) for axis, tau, limit in zip(self._axes, command, self._limits, strict=True)]
        return self.watch(any(driven), period)


class Innovation(Monitor):
    """Measurements that contradict the estimate of the observer, by its own gate."""

    def __init__(self, parameters: MonitorParameters) -> None:
        super().__init__(Reason.INNOVATION, parameters.innovation_warning, parameters.innovation_safe)

    def step(self, rejected: bool, period: float) -> Alarm:
        """Watch whether the observer has rejected the measurement of a control period; s."""
        return self.watch(rejected, period)


class _Axis:
    """The direction in which a command has been at a bound since the last control period."""

    def __init__(self) -> None:
        self._side = 0

    def driven(self, tau: float, bound: float) -> bool:
        """Whether a command is at its bound, on the same side as the one before."""
        side = (tau >= AT_LIMIT * bound) - (tau <= -AT_LIMIT * bound)
        same, self._side = side != 0 and side == self._side, side
        return same


BLOCK, BLOCKS, LEAST = NANOSECONDS, 8, 5
"""Length of a block, ns, and how many are compared: all of the last ones, once there are a few."""

GAP = NANOSECONDS  # longest time between two samples over which velocities are integrated, ns
ERROR_SHARE, NOISE_DEVIATIONS, SLOW_SPEED = 0.4, 4.0, 0.02
"""An error counts above this share of the velocity, with so many deviations of noise, and the share of sqrt(g·L) that is slow."""


class Compared(NamedTuple):
    """The velocities of a ship by its positions and as measured."""

    # moved, measured: x, y and psi per second, shape (3,)
    moved: Array
    measured: Array
    wrong: bool  # whether they contradict each other
    known: bool  # whether the ship moves fast enough for a verdict
    about: int  # the quantity that is wrong: 0 for the velocity, 1 for the yaw rate
    fits: bool = True  # whether they agree without an allowance for noise, which a ship that slows down seems to have


class Velocities(Monitor):
    """Compares the measured velocities with the measured positions: another frame, sign or unit, or none filled in.

    Where u, v and r are the velocities over ground of the pose x, y, psi, the remainders

        (x, y) - integral R(psi)(u, v) dt    and    psi - integral r dt

    are constant but for noise. Their means over blocks of BLOCK are compared: the median of the changes from block to block is
    the error of the velocity, which neither noise nor a few jumps of the position move.

    The safe action ends the motion, so that nothing can be compared any more: an alarm then stays, until a moving ship shows
    velocities that fit, or until a reset. `length`: of the ship, m.

    Attributes:
        detail: What contradicts what, and what to look for; empty without an alarm.
    """

    _last: tuple[int, Motion] | None
    _found: Compared | None

    def __init__(self, parameters: MonitorParameters, length: float) -> None:
        speed = SLOW_SPEED * math.sqrt(GRAVITY * length)
        self._slow = speed, speed / length
        super().__init__(Reason.VELOCITY, parameters.velocity_warning, parameters.velocity_safe)

    def reset(self) -> None:
        """Forget the past."""
        super().reset()
        self.detail = ""
        self._begin()

    def step(self, stamp: int, motion: Motion, period: float) -> Alarm:
        """Watch a control period. `stamp`: time of the measurement, ns; that of the last call where there is no new one."""
        if self._last is None or not 0 <= stamp - self._last[0] <= GAP:
            self._begin()
            self._last = stamp, motion
        elif stamp > self._last[0]:
            self._integrate(stamp, motion)
        found = self._found
        if found is not None and found.known and (found.wrong or found.fits or self.alarm is Alarm.OK):
            self.watch(found.wrong, period)
            self.detail = explained(found) if self.alarm is not Alarm.OK else ""
        return self.alarm

    def _begin(self) -> None:
        self._last = None
        self._psi = 0.0
        self._integral = np.zeros(3)
        self._sum, self._count, self._ends = np.zeros((2, 3)), 0, 0
        self._elapsed = self._times = 0.0
        self._means: deque[tuple[float, Array]] = deque(maxlen=BLOCKS)
        self._found = None

    def _integrate(self, stamp: int, motion: Motion) -> None:
        (before, last), dt = self._last or (stamp, motion), seconds(stamp - self._last[0]) if self._last else 0.0
        self._integral += 0.5 * dt * (in_world(last) + in_world(motion))
        self._elapsed += dt
        self._psi += wrap(motion.psi - last.psi)
        self._last = stamp, motion
        self._ends = self._ends or before + BLOCK
        if stamp >= self._ends:
            self._end_block(stamp)
        self._sum += np.array([(motion.x, motion.y, self._psi), self._integral])
        self._times += self._elapsed
        self._count += 1

    def _end_block(self, stamp: int) -> None:
        """Keep the means of a block of samples; a comparison of the last ones follows."""
        if self._count:
            self._means.append((self._times / self._count, self._sum / self._count))
        self._sum, self._times, self._count, self._ends = np.zeros((2, 3)), 0.0, 0, stamp + BLOCK
        if len(self._means) >= LEAST:
            # With the means of the times, blocks of samples that are far apart give the right rates as well.
            times, means = (np.array(each) for each in zip(*self._means, strict=True))
            self._found = compared(np.diff(means, axis=0) / np.diff(times)[:, None, None], self._slow)


def in_world(motion: Motion) -> Array:
    """Velocities of x, y and psi, (6)."""
    c, s = math.cos(motion.psi), math.sin(motion.psi)
    return np.array([c * motion.u - s * motion.v, s * motion.u + c * motion.v, motion.r])


def compared(rates: Array, slow: tuple[float, float]) -> Compared:
    """Compare the rates of several blocks.

    `rates`: of x, y and psi by the positions and by the velocities, shape (n, 2, 3). `slow`: speed and yaw rate below which
    nothing is concluded, m/s and rad/s.
    """
    moved, measured = np.median(rates, axis=0)
    errors = rates[:, 0] - rates[:, 1]
    error = np.median(errors, axis=0)
    # Noise n of the means gives errors n[i+1] - n[i], whose changes have 6 times its variance; an error that turns with the ship
    # changes little from block to block, and is not noise.
    noise = 1.4826 * np.median(np.abs(np.diff(errors, axis=0)), axis=0) / math.sqrt(6.0)
    noise *= NOISE_DEVIATIONS * 1.25 * math.sqrt(2.0 / len(errors))
    verdicts, fits = [], True
    for part, least in zip((slice(0, 2), slice(2, 3)), slow, strict=True):
        fastest = max(np.linalg.norm(moved[part]), np.linalg.norm(measured[part]))
        allowed = ERROR_SHARE * fastest + np.linalg.norm(noise[part]) + least
        verdicts.append((fastest > 2.0 * least, bool(np.linalg.norm(error[part]) > allowed)))
        fits = fits and bool(fastest <= 2.0 * least or np.linalg.norm(error[part]) <= ERROR_SHARE * fastest)
    wrong = [known and bad for known, bad in verdicts]
    known = any(each for each, _ in verdicts)
    return Compared(moved, measured, any(wrong), known, wrong.index(True) if any(wrong) else 0, fits)


def explained(found: Compared) -> str:
    """What contradicts what, and what to look for."""
    if found.about:
        text = f"the heading turns at {found.moved[2]:.3g} rad/s, the measured yaw rate is {found.measured[2]:.3g} rad/s"
        return f"{text}: is it in rad/s, positive to port, and filled in?"
    (x, y), (u, v) = found.moved[:2], found.measured[:2]
    text = f"the positions move at ({x:.3g}, {y:.3g}) m/s, the measured velocities give ({u:.3g}, {v:.3g}) m/s"
    if math.hypot(u, v) < 0.1 * math.hypot(x, y):
        return f"{text}: is the twist not filled in? observer.enabled: true needs none"
    return f"{text}: is the twist in the frame of the pose? odometry.twist_frame: parent is for that"


HEADING_BLOCKS, LEAST_BLOCKS = 120, 20  # means over blocks that are compared: all of the last ones, once there are a few
LEAST_WAY = 3.0  # least extent of the way, ship lengths: at rest, wind and waves move a ship to all sides
LEAST_SPREAD = 0.3  # least circular variance of the headings: courses that differ by 90 deg have 0.29
DEVIATIONS = 4.0  # of the bias that are allowed for: its variance takes the errors for independent, and they are not
JUMP = 4.0  # how many times the usual speed the jump of a position is, and no motion
NAMED_BIAS = math.radians(5.0)  # least bias that a person is told to correct
LARGEST_BIAS = math.radians(20.0)  # least bias that is an alarm: laws bear less, as an additional current
LOST_SHARE = 0.15  # share of the motion above which an error that lasts, and is fast enough, is a lost heading
SWAY_MEMORY = 3.0  # blocks in which the sway of a turn decays to 1/e


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
    drift = decayed(np.where(known, speed * rates[:, 2], 0.0))
    ahead, speed, r, psi, drift = ahead[known], speed[known], rates[known, 2], psi[known], drift[known]
    shown = np.column_stack((ahead.imag, ahead.real))
    others = np.column_stack((np.sin(psi), np.cos(psi), r, speed * r, drift))
    left = shown - others @ np.linalg.lstsq(others, shown, rcond=None)[0]
    (least, most), vectors = np.linalg.eigh(left.T @ left)
    n, least = len(psi) - others.shape[1] - 1, max(float(least), 0.0)
    if most < n * slow**2 or least >= most:
        return None
    cosine, sine = vectors[:, 0] * (1.0 if vectors[0, 0] >= 0.0 else -1.0)
    turned = 1.0 - abs(np.exp(1j * psi).mean()) > LEAST_SPREAD
    error = left @ vectors[:, 0]
    products = error[1:] * error[:-1]
    largest = float((products * np.abs(products)).mean())  # a mean of squares, with the signs of the products
    lost = float(products.mean()) > slow**2 and largest > (LOST_SHARE * most / n) ** 2
    hidden = 0.5 * length * abs(float(r.mean())) / float(speed.mean())
    deviation = math.hypot(math.sqrt(least * most / n) / (most - least), hidden / DEVIATIONS)
    return Bias(math.atan2(sine, cosine), deviation if turned else math.inf, lost)


def decayed(values: Array) -> Array:
    """The sum of the values up to each block, which decay with SWAY_MEMORY."""
    weights = np.exp(-np.arange(8.0 * SWAY_MEMORY) / SWAY_MEMORY)
    return np.convolve(values, weights)[: len(values)]


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
        self._means: deque[tuple[float, ...]] = deque(maxlen=HEADING_BLOCKS)
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
