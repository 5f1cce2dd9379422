"""References whose clock slows and stands: while the vessel is behind, or while they are held.

| symbol | meaning | unit |
|---|---|---|
| t, h | time, length of a step | s |
| d, b, e | how far the vessel is behind along the track, from where on the clock slows, and where it stands | m |
| p | pace that the lag demands, 1 - 10·q³ + 15·q⁴ - 6·q⁵ with q = (d - b)/(e - b), between 1 and 0 | - |
| a, s | p after one and after two first-order lags of time constant T: T·da/dt = p - a, T·ds/dt = a - s | - |
| sigma | clock of the timetable, dsigma/dt = s | s |
| V, A | velocities u, v, r of the timetable, and their derivatives by sigma | m/s, rad/s, ... |

The reference has the pose of the timetable at sigma, the velocities s·V and the accelerations s²·A + ds/dt·V, so that it is
one motion. A demand changes s by at most 1/(e·T) per second (e of the exponential function), from which T follows.
"""

import cmath
import math
from collections import deque
from typing import Any, NamedTuple

import numpy as np

from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.guidance.goal import MotionLimits

TRAIL_POINTS = 64  # number of points in which the way behind the reference is kept, up to where its clock stands


class Waiting(NamedTuple):
    """How a reference waits: the lags at which its clock slows and stands, m, and the time constant of its pace, s."""

    slows: float
    stands: float
    time_constant: float


class PaceMemory(NamedTuple):
    """The two states of the pace; a clock that stands has zeros."""

    a: float = 0.0
    s: float = 0.0


class PaceStep(NamedTuple):
    """The pace after a step, and the time by which the clock has advanced in it, s."""

    memory: PaceMemory
    advanced: float


def waiting_of(lengths: float, hull_length: float, speed: float, motion: MotionLimits) -> Waiting:
    """How a reference waits.

    `lengths`: lag at which the clock slows, in lengths of the hull. `hull_length`: m. `speed`: largest speed of the timetable,
    m/s. `motion`: limits of the reference: its clock slows and speeds up within their accelerations.
    """
    slows = lengths * hull_length
    # With less way than the one in which it stops, the reference would stop and go.
    way = max(slows, 0.5 * speed * speed / motion.acceleration)
    slowest = max(speed / motion.acceleration, motion.yaw_rate / motion.yaw_acceleration)
    return Waiting(slows, slows + way, slowest / math.e)


def demanded_pace(lag: float, waiting: Waiting) -> float:
    """The pace between 0 and 1 that a lag demands.

    `lag`: how far the vessel is behind along the track, m; negative if it is ahead.
    """
    q = min(max((lag - waiting.slows) / (waiting.stands - waiting.slows), 0.0), 1.0)
    return 1.0 - q * q * q * (10.0 - 15.0 * q + 6.0 * q * q)


def next_pace(m: PaceMemory, demand: float, T: float, h: float) -> PaceStep:
    """The exact solution of the two lags over a step with a constant demand."""
    decay, a, s = math.exp(-h / T), m.a - demand, m.s - demand
    # Rounding may leave the range by a last digit.
    after = (min(max(value, 0.0), 1.0) for value in (demand + a * decay, demand + (s + a * h / T) * decay))
    advanced = demand * h + s * T * (1.0 - decay) + a * (T * (1.0 - decay) - h * decay)
    return PaceStep(PaceMemory(*after), min(max(advanced, 0.0), h))


def rate_of(m: PaceMemory, T: float) -> float:
    """The rate of the pace ds/dt, 1/s."""
    return (m.a - m.s) / T


class Trail:
    """The way that a reference has come, as a line; the lag of a vessel is measured along it.

    `reach`: length of way that is kept, m.
    """

    def __init__(self, reach: float) -> None:
        self._reach = reach
        self._points: deque[tuple[complex, float, float]] = deque()  # position, m; heading; way until there, m
        self._way = 0.0
        self._head = 0j

    def lead(self, position: complex, heading: float) -> None:
        """Note where the reference is."""
        if not self._points:
            self._points.append((position, heading, 0.0))
        else:
            self._way += abs(position - self._head)
            if self._way - self._points[-1][2] >= self._reach / TRAIL_POINTS:
                self._points.append((position, heading, self._way))
        self._head = position
        while len(self._points) > 1 and self._way - self._points[1][2] > self._reach:
            self._points.popleft()

    def lag(self, vessel: complex) -> float:
        """How far a vessel is behind the reference: the way from the nearest point of the trail, m.

        Where that is the beginning of the trail, the distance behind it counts too. `vessel`: its position, m.
        """
        first, heading, _ = self._points[0]
        line = np.array([*(point for point, _, _ in self._points), self._head])
        ways = np.array([*(way for _, _, way in self._points), self._way])
        step = np.diff(line)
        along = ((vessel - line[:-1]) * step.conj()).real
        share = np.clip(along / np.maximum(np.abs(step) ** 2, np.finfo(float).tiny), 0.0, 1.0)
        # Of equally near points the latest: a vessel on the reference is not behind it.
        distance = np.abs(line[:-1] + share * step - vessel)
        i = len(step) - 1 - int(np.argmin(distance[::-1]))
        lag = float(ways[-1] - ways[i] - share[i] * abs(step[i]))
        if i == 0 and share[0] == 0.0:
            lag += max(0.0, -((vessel - first) * cmath.exp(-1j * heading)).real)
        return lag


AT_PACE = PaceMemory(1.0, 1.0)


class PacedReference:
    """A reference whose clock slows, stands while it is held, and goes on after that.

    What the reference that it paces has besides the motion, such as paths to set, is also had of this one. `reference`: a
    reference that is a function of the number of its steps. `period`: length of a step, s.

    Attributes:
        held: Whether it comes to a stand, and stays.
    """

    FIRST = AT_PACE  # the pace at the start

    def __init__(self, reference: Any, waiting: Waiting, period: float) -> None:
        self._reference, self._waiting, self._period = reference, waiting, period
        self._start()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._reference, name)

    def _start(self) -> None:
        self._pace, self.held = self.FIRST, False

    @property
    def pace(self) -> float:
        """Rate of the timetable's clock, between 0 and 1."""
        return self._pace.s

    @property
    def state(self) -> Array:
        """Pose x, y, psi and body velocities u, v, r of the present step, shape (6,)."""
        pose, velocity = np.split(self._reference.state, 2)
        return np.concatenate((pose, self._pace.s * velocity))

    def acceleration(self) -> Array:
        """Derivatives du, dv, dr of the body velocities at the present step, shape (3,): m/s², m/s², rad/s²."""
        if self._pace == AT_PACE:  # the sum below would change the sign of a zero
            return self._reference.acceleration()  # type: ignore[no-any-return]
        s, rate = self._pace.s, rate_of(self._pace, self._waiting.time_constant)
        scaled: Array = s * s * self._reference.acceleration() + rate * self._reference.state[3:]
        return scaled

    def reset(self) -> None:
        """Return to the start."""
        self._reference.reset()
        self._start()

    def advance(self) -> None:
        """Advance by one period of time, and by the pace's share of it on the timetable."""
        demand = 0.0 if self.held else self._demand()
        self._pace, advanced = next_pace(self._pace, demand, self._waiting.time_constant, self._period)
        memory = self._reference.memory
        self._reference.memory = memory._replace(steps=memory.steps + advanced / self._period)

    def _demand(self) -> float:
        return 1.0


class FollowingReference(PacedReference):
    """A reference that waits for its vessel; it stands until the first position of the vessel is known."""

    FIRST = PaceMemory()

    def _start(self) -> None:
        super()._start()
        self._trail = Trail(self._waiting.stands)
        self._vessel: complex | None = None
        self._note()

    def _note(self) -> None:
        x, y, psi = self._reference.state[:3]
        self._trail.lead(complex(x, y), float(psi))

    def observe(self, vessel: tuple[float, float] | None) -> None:
        """Take the position x, y of the vessel, m; with None, where it is not known, the reference comes to a stand."""
        self._vessel = None if vessel is None or not all(map(math.isfinite, vessel)) else complex(*vessel)

    def _demand(self) -> float:
        return 0.0 if self._vessel is None else demanded_pace(self._trail.lag(self._vessel), self._waiting)

    def advance(self) -> None:
        """Advance by one period of time, and by the pace's share of it on the timetable."""
        super().advance()
        self._note()
