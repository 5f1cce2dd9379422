"""Velocities that do not fit the positions, as those in another frame, of another sign, in other units or not filled in.

Where u, v and r are the velocities over ground of the pose x, y, psi, the remainders

    (x, y) - integral R(psi)(u, v) dt    and    psi - integral r dt

are constant but for noise. Their means over blocks of BLOCK are compared: the median of the changes from block to block is the
error of the velocity, which neither noise nor a few jumps of the position move.
"""

import math
from collections import deque
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.kinematics import Motion, wrap
from vessel_hsmc_ros.core.timing import NANOSECONDS, seconds
from vessel_hsmc_ros.safety.monitors import Alarm, Monitor
from vessel_hsmc_ros.safety.parameters import MonitorParameters
from vessel_hsmc_ros.safety.reasons import Reason

Array = NDArray[np.float64]

BLOCK, BLOCKS, LEAST = NANOSECONDS, 8, 5
"""Length of a block, ns, and how many are compared: all of the last ones, once there are a few."""

GAP = NANOSECONDS
"""Longest time between two samples over which velocities are integrated, ns."""

SHARE, DEVIATIONS, SLOW = 0.4, 4.0, 0.02
"""An error counts above this share of the velocity, with so many deviations of noise, and the share of sqrt(g·L) that is slow."""

GRAVITY = 9.81


class Compared(NamedTuple):
    """The velocities of a ship by its positions and as measured.

    Attributes:
        moved, measured: x, y and psi per second, shape (3,).
        wrong: Whether they contradict each other.
        known: Whether the ship moves fast enough for a verdict.
        about: The quantity that is wrong: 0 for the velocity, 1 for the yaw rate.
    """

    moved: Array
    measured: Array
    wrong: bool
    known: bool
    about: int


class Velocities(Monitor):
    """Compares the measured velocities with the measured positions.

    The safe action ends the motion, so that nothing can be compared any more: an alarm then stays, until a moving ship shows
    velocities that fit, or until a reset.

    Args:
        parameters: Times.
        length: Of the ship, m.

    Attributes:
        detail: What contradicts what, and what to look for; empty without an alarm.
    """

    _last: tuple[int, Motion] | None
    _found: Compared | None

    def __init__(self, parameters: MonitorParameters, length: float) -> None:
        speed = SLOW * math.sqrt(GRAVITY * length)
        self._slow = speed, speed / length
        super().__init__(Reason.VELOCITY, parameters.velocity_warning, parameters.velocity_safe)

    def reset(self) -> None:
        """Forget the past."""
        super().reset()
        self.detail = ""
        self._begin()

    def step(self, stamp: int, motion: Motion, period: float) -> Alarm:
        """Watch a control period.

        Args:
            stamp: Time of the measurement, ns; that of the last call where there is no new one.
            motion: As measured.
            period: s.
        """
        if self._last is None or not 0 <= stamp - self._last[0] <= GAP:
            self._begin()
            self._last = stamp, motion
        elif stamp > self._last[0]:
            self._integrate(stamp, motion)
        found = self._found
        if found is not None and found.known:
            self.watch(found.wrong, period)
            self.detail = explained(found) if self.alarm is not Alarm.OK else ""
        return self.alarm

    def _begin(self) -> None:
        self._last = None
        self._psi = 0.0
        self._integral = np.zeros(3)
        self._sum, self._count, self._ends = np.zeros((2, 3)), 0, 0
        self._means: deque[Array] = deque(maxlen=BLOCKS)
        self._found = None

    def _integrate(self, stamp: int, motion: Motion) -> None:
        (before, last), dt = self._last or (stamp, motion), seconds(stamp - self._last[0]) if self._last else 0.0
        self._integral += 0.5 * dt * (in_world(last) + in_world(motion))
        self._psi += wrap(motion.psi - last.psi)
        self._last = stamp, motion
        self._ends = self._ends or before + BLOCK
        if stamp >= self._ends:
            self._end_block(stamp)
        self._sum += np.array([(motion.x, motion.y, self._psi), self._integral])
        self._count += 1

    def _end_block(self, stamp: int) -> None:
        """Keep the means of a block of samples; a comparison of the last ones follows."""
        self._means.append(self._sum / max(self._count, 1))
        self._sum, self._count, self._ends = np.zeros((2, 3)), 0, stamp + BLOCK
        if len(self._means) >= LEAST:
            self._found = compared(np.diff(np.array(self._means), axis=0) / seconds(BLOCK), self._slow)


def in_world(motion: Motion) -> Array:
    """Velocities of x, y and psi, (6)."""
    c, s = math.cos(motion.psi), math.sin(motion.psi)
    return np.array([c * motion.u - s * motion.v, s * motion.u + c * motion.v, motion.r])


def compared(rates: Array, slow: tuple[float, float]) -> Compared:
    """Compare the rates of several blocks.

    Args:
        rates: Of x, y and psi by the positions and by the velocities, shape (n, 2, 3).
        slow: Speed and yaw rate below which nothing is concluded, m/s and rad/s.
    """
    moved, measured = np.median(rates, axis=0)
    errors = rates[:, 0] - rates[:, 1]
    error = np.median(errors, axis=0)
    # Noise n of the means gives errors n[i+1] - n[i], whose changes have 6 times its variance; an error that turns with the ship
    # changes little from block to block, and is not noise.
    noise = 1.4826 * np.median(np.abs(np.diff(errors, axis=0)), axis=0) / math.sqrt(6.0)
    noise *= DEVIATIONS * 1.25 * math.sqrt(2.0 / len(errors))
    verdicts = []
    for part, least in zip((slice(0, 2), slice(2, 3)), slow, strict=True):
        fastest = max(np.linalg.norm(moved[part]), np.linalg.norm(measured[part]))
        allowed = SHARE * fastest + np.linalg.norm(noise[part]) + least
        verdicts.append((fastest > 2.0 * least, bool(np.linalg.norm(error[part]) > allowed)))
    wrong = [known and bad for known, bad in verdicts]
    return Compared(moved, measured, any(wrong), any(known for known, _ in verdicts), wrong.index(True) if any(wrong) else 0)


def explained(found: Compared) -> str:
    """What contradicts what, and what to look for."""
    if found.about:
        text = f"the heading turns at {found.moved[2]:.3g} rad/s, the measured yaw rate is {found.measured[2]:.3g} rad/s"
        return f"{text}: is it in rad/s, positive to port, and filled in?"
    (x, y), (u, v) = found.moved[:2], found.measured[:2]
    text = f"the positions move at ({x:.3g}, {y:.3g}) m/s, the measured velocities give ({u:.3g}, {v:.3g}) m/s"
    if math.hypot(u, v) < 0.1 * math.hypot(x, y):
        return f"{text}: is the twist not filled in? controller.observer.enabled: true needs none"
    return f"{text}: is the twist in the frame of the pose? controller.odometry.twist_frame: parent takes that"
