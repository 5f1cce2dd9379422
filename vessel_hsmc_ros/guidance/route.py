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
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
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
    """A plane curve of pieces.

    `start`: position x, y [m] and course at the beginning.
    """

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
