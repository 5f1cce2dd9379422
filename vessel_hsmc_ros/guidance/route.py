"""Routes: legs and turns as plane geometry in arc length, with continuous curvature and a continuous rate of it.

| symbol | meaning | unit |
|---|---|---|
| s, q, z | arc length, arc length since the beginning of a piece, z = q/l with the length l of the piece | m, m, - |
| p | position x + i·y, as a complex number | m |
| chi, kappa | course, curvature dchi/ds | rad, 1/m |
| R, c | radius of a turn, length of its transitions | m, m |

A piece is straight, an arc, or a transition between two curvatures, kappa = k0 + (k1 - k0)·(3·z² - 2·z³): a clothoid whose ends
are rounded, so that the yaw acceleration of a ship on it is continuous as well. Course and position are integrals, the former in
closed form, the latter by Gauss-Legendre quadrature, exact to rounding.

Speed along a route: on legs as fast as speed and acceleration may be, and in turns constant or with less acceleration.

| symbol | meaning | unit |
|---|---|---|
| s, t | arc length, time | m, s |
| W | speed along the route | m/s |
| a | largest acceleration along the route | m/s² |
| z | t/tau since the beginning of a change of speed with the duration tau | - |

The acceleration of a change of speed is a trapezoid of z, which rises and falls in RISE each, so that it is continuous, with the
mean a·(1 - RISE). A change that is small beside the largest speed takes less acceleration, so that its jerk is limited.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vessel_hsmc_ros.core.kernel import Array

RISE = 0.25  # share of a change of speed in which its acceleration rises, and falls
SMALL = 0.5  # change of speed, relative to the largest speed, below which the jerk limits it and not the acceleration
BISECTIONS = 60

ROUNDING = 1.0 - 1e-9  # share of the largest acceleration that is used, so that it is not exceeded by rounding


CONSTANT, FREE = 0.0, 1.0  # shares of the acceleration in sections of constant speed, and on legs


class Section(NamedTuple):
    """A part of a route: length, m, largest speed, m/s, and the share of the acceleration with which it may change."""

    length: float
    speed: float
    share: float


class Phase(NamedTuple):
    """A time in which the speed is constant or changes once: duration, s, speeds at its ends, m/s."""

    duration: float
    begin: float
    end: float


class Changes(NamedTuple):
    """How fast the speed changes: mean acceleration, m/s², and the largest speed of the route, m/s."""

    mean: float
    top: float

    def reduced(self, share: float) -> "Changes":
        """The changes with a share of the acceleration."""
        return self._replace(mean=share * self.mean)

    def duration(self, begin: float, end: float) -> float:
        """Duration of a change of speed, s; longer for a small change, whose jerk is limited."""
        change = abs(end - begin)
        return max(change, math.sqrt(change * SMALL * self.top)) / self.mean

    def way(self, begin: float, end: float) -> float:
        """Length of a change of speed, m."""
        return 0.5 * (begin + end) * self.duration(begin, end)

    def reached(self, low: float, high: float, length: float) -> float:
        """The largest speed up to `high` that a length allows from a lower one, or from which it allows to come down to it."""
        if self.way(low, high) <= length:
            return high
        slow = low
        for _ in range(BISECTIONS):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self.way(slow, middle) <= length else (low, middle)
        return low


def changes_of(acceleration: float, top: float) -> Changes:
    """The changes of speed of a route. `top`: largest speed, m/s."""
    return Changes(ROUNDING * acceleration * (1.0 - RISE), top)


def phases(sections: Sequence[Section], acceleration: float, start: float = 0.0, end: float = 0.0) -> list[Phase]:
    """The phases of the fastest travel. `start`, `end`: speeds at the two ends of the route, m/s."""
    changes = changes_of(acceleration, max(start, *(section.speed for section in sections)))
    speeds = _at_ends(sections, changes, start, end)
    found = []
    for section, low, high in zip(sections, speeds[:-1], speeds[1:], strict=True):
        if section.share:
            found += _leg(section, low, high, changes.reduced(section.share))
        else:
            found.append(Phase(section.length / low, low, low))
    return found


def _at_ends(sections: Sequence[Section], changes: Changes, start: float, end: float) -> list[float]:
    """The speeds between the sections: the largest from which the others can be reached forwards and backwards."""
    n = len(sections)
    speeds = [start, *(min(sections[i].speed, sections[i + 1].speed) for i in range(n - 1)), end]
    for i in (*range(n), *reversed(range(n))):
        low, high = sorted((i, i + 1), key=speeds.__getitem__)
        share = sections[i].share
        reached = changes.reduced(share).reached(speeds[low], speeds[high], sections[i].length) if share else speeds[low]
        speeds[high] = reached
    return speeds


def _leg(section: Section, begin: float, end: float, changes: Changes) -> list[Phase]:
    """Up to the largest speed that the length allows, along, and down to that of the end."""
    least = max(begin, end)
    low, top = least, max(section.speed, least)

    def ways(speed: float) -> float:
        return changes.way(begin, speed) + changes.way(speed, end)

    if ways(top) > section.length:
        for _ in range(BISECTIONS):
            middle = 0.5 * (low + top)
            low, top = (middle, top) if ways(middle) <= section.length else (low, middle)
        top = low
    along = Phase(max(section.length - ways(top), 0.0) / top, top, top)
    parts = (Phase(changes.duration(begin, top), begin, top), along, Phase(changes.duration(top, end), top, end))
    return [part for part in parts if part.duration > 0.0]


class SpeedProfile:
    """The arc length as a function of time."""

    def __init__(self, parts: Sequence[Phase]) -> None:
        self._tau, self._begin, self._end = np.array(parts, np.float64).T
        self.times: Array = np.concatenate(([0.0], np.cumsum(self._tau)))
        """Times at which the phases begin, and at which the last ends, shape (n + 1,), s."""
        self._s: Array = np.concatenate(([0.0], np.cumsum(0.5 * self._tau * (self._begin + self._end))))
        self.top = float(max(self._begin.max(), self._end.max()))

    @property
    def corners(self) -> Array:
        """The times at which a phase begins or ends, or its trapezoid of acceleration has a corner, increasing, s."""
        rises = RISE * np.diff(self.times)
        return np.unique(np.concatenate((self.times, self.times[:-1] + rises, self.times[1:] - rises)))

    def at(self, t: Array) -> tuple[Array, Array, Array]:
        """Arc length [m], speed [m/s] and acceleration [m/s²] at times, s."""
        index = np.clip(np.searchsorted(self.times, t, side="right") - 1, 0, len(self._tau) - 1)
        tau, begin = self._tau[index], self._begin[index]
        rise = self._end[index] - begin
        z = np.clip((t - self.times[index]) / tau, 0.0, 1.0)
        way, share, rate = _trapezoid(z)
        return self._s[index] + tau * (begin * z + rise * way), begin + rise * share, rise * rate / tau

    def time_at(self, s: Array) -> Array:
        """Times at arc lengths, s, by bisection."""
        low, high = np.zeros_like(s), np.full_like(s, self.times[-1])
        for _ in range(BISECTIONS):
            middle = 0.5 * (low + high)
            before = self.at(middle)[0] < s
            low, high = np.where(before, middle, low), np.where(before, high, middle)
        return 0.5 * (low + high)


def _trapezoid(z: Array) -> tuple[Array, Array, Array]:
    """A change from 0 to 1 with a trapezoid as its derivative: its integral, itself and its derivative."""
    p, height = RISE, 1.0 / (1.0 - RISE)
    y = 1.0 - z
    rate = height * np.minimum(1.0, np.minimum(z, y) / p)
    share = np.where(z < p, 0.5 * z * z / p, np.where(y < p, (1.0 - p) - 0.5 * y * y / p, z - 0.5 * p))
    early, middle = z**3 / (6.0 * p), 0.5 * z * z - 0.5 * p * z + p * p / 6.0
    # The change is symmetric: at z its integral is z - 1/2 more than at 1 - z.
    late = (1.0 - p) * (z - 0.5) + y**3 / (6.0 * p)
    return height * np.where(z < p, early, np.where(y < p, late, middle)), height * share, rate


ComplexArray = NDArray[np.complex128]

NODES, WEIGHTS = np.polynomial.legendre.leggauss(24)

ROUGHLY = 1e-12  # a straight part shorter than this share of a turn is left out


class Piece(NamedTuple):
    """A part of a route: its length, m, and the curvature at its two ends, 1/m."""

    length: float
    begin: float
    end: float


Pieces = tuple[Piece, ...]


class Element(NamedTuple):
    """A leg or a turn of a route: its pieces, and the number of the leg, or of the leg before the turn, from 0 on."""

    pieces: Pieces
    leg: int
    turn: bool

    @property
    def length(self) -> float:
        """Its arc length, m."""
        return sum(piece.length for piece in self.pieces)

    @property
    def sharpest(self) -> float:
        """Its largest curvature, 1/m."""
        return max(max(abs(piece.begin), abs(piece.end)) for piece in self.pieces)


def straight(length: float) -> Pieces:
    """A straight part."""
    return (Piece(length, 0.0, 0.0),)


def turn(angle: float, radius: float, transition: float) -> Pieces:
    """A turn: a transition from straight to an arc, the arc, and a transition back.

    `angle`: change of the course, rad, positive to port. `radius`: radius of the arc, m; larger where the angle is too small
    for both transitions, and there is no arc then. `transition`: length of each transition, m. Returns its pieces, none without
    an angle.
    """
    if angle == 0.0:
        return ()
    # Each transition turns by half of what an arc of its length would.
    k, c = math.copysign(min(1.0 / radius, abs(angle) / transition), angle), transition
    arc = abs(angle / k) - c
    middle = (Piece(arc, k, k),) if arc > ROUGHLY * c else ()
    return (Piece(c, 0.0, k), *middle, Piece(c, k, 0.0))


class Route:
    """A plane curve of pieces. `start`: position x, y [m] and course at the beginning."""

    def __init__(self, elements: Sequence[Element], start: tuple[float, float, float]) -> None:
        self.elements = tuple(element for element in elements if element.pieces)
        pieces = [piece for element in self.elements for piece in element.pieces]
        self._l, self._k0, self._k1 = np.array(pieces, np.float64).reshape(-1, 3).T
        self.ends: Array = np.concatenate(([0.0], np.cumsum(self._l)))
        """Arc lengths at which the pieces begin, and at which the last ends, shape (n + 1,), m."""
        self.element_ends: Array = np.concatenate(([0.0], np.cumsum([element.length for element in self.elements])))
        """The same of the elements."""
        x, y, course = map(float, start)
        self._chi: Array = course + np.concatenate(([0.0], np.cumsum(0.5 * self._l * (self._k0 + self._k1))))
        index = np.arange(len(pieces))
        self._p: ComplexArray = complex(x, y) + np.concatenate(([0j], np.cumsum(self._moved(index, self._l))))
        self.length = float(self.ends[-1])

    def index_at(self, s: ArrayLike) -> NDArray[np.int64]:
        """The number of the leg or turn at an arc length, m, in `elements`."""
        return np.minimum(np.searchsorted(self.element_ends[1:], s, side="right"), len(self.elements) - 1)

    def course(self, s: ArrayLike) -> Array:
        """The course chi, rad, not wrapped."""
        index, q = self._at(s)
        return self._course(index, q)

    def position(self, s: ArrayLike) -> ComplexArray:
        """The position p, m."""
        index, q = self._at(s)
        return self._p[index] + self._moved(index, q)

    def curvature(self, s: ArrayLike) -> tuple[Array, Array]:
        """The curvature kappa [1/m] and its slope dkappa/ds [1/m²]."""
        index, q = self._at(s)
        z, rise = q / self._l[index], (self._k1 - self._k0)[index]
        return self._k0[index] + rise * z * z * (3.0 - 2.0 * z), rise * 6.0 * z * (1.0 - z) / self._l[index]

    def _at(self, s: ArrayLike) -> tuple[NDArray[np.int64], Array]:
        along: Array = np.clip(np.asarray(s, np.float64), 0.0, self.length)
        index = np.clip(np.searchsorted(self.ends, along, side="right") - 1, 0, len(self._l) - 1)
        return index, along - self.ends[index]

    def _course(self, index: NDArray[np.int64], q: Array) -> Array:
        z = q / self._l[index]
        bent = (self._k1 - self._k0)[index] * z * z * z * (1.0 - 0.5 * z)
        return self._chi[index] + self._l[index] * (self._k0[index] * z + bent)

    def _moved(self, index: NDArray[np.int64], q: Array) -> ComplexArray:
        """The way from the beginning of a piece, m."""
        fractions = 0.5 * (1.0 + NODES)
        courses = self._course(index[..., None], q[..., None] * fractions)
        return np.asarray(0.5 * q * (np.exp(1j * courses) @ WEIGHTS), dtype=np.complex128)


def displacement(pieces: Pieces) -> complex:
    """Where pieces end that begin at 0 with the course 0, m."""
    whole = Route([Element(pieces, 0, turn=True)], (0.0, 0.0, 0.0))
    return complex(whole.position(whole.length))


class TravelLimits(NamedTuple):
    """Limits of a motion along a route, m/s², rad/s, rad/s², N, N·m, infinite where unknown, and the current allowed for, m/s."""

    acceleration: float
    yaw_rate: float
    yaw_acceleration: float
    surge_force: float
    yaw_moment: float
    current: float


class Turning(NamedTuple):
    """A turn: speed, m/s, radius, m, length of its transitions, m."""

    speed: float
    radius: float
    transition: float
