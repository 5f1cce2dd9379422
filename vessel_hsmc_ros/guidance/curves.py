"""Plane curves with continuous curvature, parametrised by their arc length: arc, figure eight, square with rounded corners.

| symbol | meaning | unit |
|---|---|---|
| s | arc length | m |
| p | position x + i·y, as a complex number | m |
| chi | course, the direction of the tangent | rad |
| kappa | curvature dchi/ds | 1/m |
| A, k | amplitude of the course and wavenumber of the figure eight | rad, 1/m |
| c | length of a corner of the square | m |
| q, theta, w | arc length, angle w·q and wavenumber in a bend | m, rad, 1/m |

Every curve begins at p = 0 with chi = 0 and turns to port first, so kappa >= 0 there. A curve to starboard is its mirror image.
The position is the integral of exp(i·chi); where chi is a constant plus a harmonic, exp(i·chi) is a short Fourier series with
Bessel functions as coefficients (Jacobi and Anger) and is integrated in closed form.

Parameters of shapes: curves to travel at constant speed, and search patterns from a point outwards.

The curves are straight, circle, figure eight and square. Each begins at the position of `initial_pose`, whose angle is the course
of travel there, so that the geometry does not depend on the hull; the heading differs from the course by the drift angle. A
positive size turns to port (counter-clockwise) first, a negative one to starboard.

The patterns are waypoints that a path sails:

| symbol | meaning | unit |
|---|---|---|
| d | distance between two tracks, positive to port | m |
| phi, R | angle about the centre of the spiral, radius of its beginning | rad, m |

The expanding square [1] has legs of d, d, 2·d, 2·d, 3·d ..., each at right angles to the one before. The spiral of Archimedes has
the radius R + d·phi/(2·pi); its points are so close together that no chord is farther from it than 4e-3 of the radius.

[1] IMO/ICAO: IAMSAR Manual, vol. II, search patterns.
"""

import cmath
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.kernel import Array, kernel
from vessel_hsmc_ros.core.kinematics import TURN
from vessel_hsmc_ros.core.schema import parameter

ComplexArray = NDArray[np.complex128]

CLOSING = 2.404825557695773
"""A of the figure eight, the first zero of the Bessel function J0: the curve closes because the mean of exp(i·chi) is J0(A)."""

CORNER_EXTENT = 1.8359749799326934
"""Distance from the beginning of a rounded corner to the vertex of the square, in multiples of the smallest radius."""

SAMPLES, HIGHEST = 64, 20
"""Number of samples per turn from which the Fourier coefficients of exp(i·chi) are computed, exact to rounding, and the highest
order that is not zero but for rounding."""


class CurveConstants(NamedTuple):
    """A curve as data: straight parts and bends, whose curvature is mean + cosine·cos(theta) + sine·sin(theta), theta = w·q."""

    period: float  # arc length after which the curvature repeats, m
    straight: float  # length of the straight part before and after a bend, m
    bend: float  # length of a bend, m
    w: float  # wavenumber of the curvature in a bend, 1/m
    # mean, cosine, sine: the curvature, 1/m
    mean: float
    cosine: float
    sine: float
    quarters: int  # quarter turns of the course in a period, with half a diagonal of the square that they form, m
    half_side: float
    lowest: float  # wavenumber of the first term of the position, as a multiple of w
    # amplitudes of the position in a bend, sum(a[n]·exp(i·(lowest + m - 1 - n)·theta)), shape (m,), m; empty for an arc
    a: ComplexArray
    start: complex  # that sum at the beginning of the bend, m


@kernel
def polynomial(z: Any, a: ComplexArray) -> Any:
    """The polynomial with coefficients a, the highest order first, by Horner's rule."""
    value = 0.0 * z
    for coefficient in a.tolist():
        value = value * z + coefficient
    return value


@kernel
def in_bend(q: float, c: CurveConstants) -> complex:
    """The position in a bend at an arc length q since its beginning, relative to there, m."""
    theta = c.w * q
    first = complex(math.cos(c.lowest * theta), math.sin(c.lowest * theta))
    moved: complex = first * polynomial(complex(math.cos(theta), math.sin(theta)), c.a) - c.start
    return moved


@kernel
def position(s: float, c: CurveConstants) -> complex:
    """The position p at an arc length, m."""
    if len(c.a) == 0:
        # An arc: the chord in the direction of half the turn, the same without the division by a curvature of zero.
        half = 0.5 * c.mean * s
        chord = s * (math.sin(half) / half if half != 0.0 else 1.0)
        return complex(chord * math.cos(half), chord * math.sin(half))
    rest = s % c.period
    turns = c.quarters * math.floor((s - rest) / c.period + 0.5) % 4
    turn = complex((1.0, 0.0, -1.0, 0.0)[turns], (0.0, 1.0, 0.0, -1.0)[turns])
    q = rest - c.straight
    if q <= 0.0:
        part = complex(rest, 0.0)
    elif q <= c.bend:
        part = c.straight + in_bend(q, c)
    else:
        part = c.straight + in_bend(c.bend, c) + complex(0.0, q - c.bend)
    # The sum of a half diagonal and its quarter turns so far: a geometric series.
    return complex(0.0, c.half_side) * (1.0 - turn) + turn * part


@kernel
def angle(s: float, c: CurveConstants) -> float:
    """The angle theta at an arc length, from 0 to that of a whole bend: on the straight parts it is at one of the two ends."""
    q = s % c.period - c.straight
    return c.w * (0.0 if q < 0.0 else c.bend if q > c.bend else q)


@kernel
def course(s: float, c: CurveConstants) -> float:
    """The course chi at an arc length, rad, not wrapped."""
    if len(c.a) == 0:
        return c.mean * s
    laps = math.floor((s - s % c.period) / c.period + 0.5)
    theta = angle(s, c)
    bent = c.mean * theta + c.cosine * math.sin(theta) + c.sine * (1.0 - math.cos(theta))
    return 0.5 * math.pi * c.quarters * laps + bent / c.w


@kernel
def curvature(cosine: Any, sine: Any, c: CurveConstants) -> tuple[Any, Any]:
    """The curvature [1/m] and its slope [1/m²] for cos(theta) and sin(theta), numbers or arrays."""
    return c.mean + c.cosine * cosine + c.sine * sine, c.w * (c.sine * cosine - c.cosine * sine)


class Curve:
    """A plane curve whose curvature is a periodic function of the arc length."""

    constants: CurveConstants  # the curve as the kernels take it
    period: float  # arc length after which the curvature repeats, m
    shortest_bend: float  # arc length over which the curvature rises and falls, m; infinite if it is constant

    def curvature(self, s: ArrayLike) -> Array:
        """The curvature kappa, 1/m."""
        return self._bent(s)[0]

    def curvature_slope(self, s: ArrayLike) -> Array:
        """The derivative of the curvature dkappa/ds, 1/m²."""
        return self._bent(s)[1]

    def _bent(self, s: ArrayLike) -> tuple[Array, Array]:
        c = self.constants
        theta = c.w * np.clip(np.mod(s, c.period) - c.straight, 0.0, c.bend)
        kappa, slope = curvature(np.cos(theta), np.sin(theta), c)
        return kappa, slope


def fourier(function: Callable[[Array], ComplexArray]) -> ComplexArray:
    """The Fourier coefficients of a smooth function of an angle, of the orders -HIGHEST to HIGHEST, shape (2·HIGHEST + 1,)."""
    theta = 2.0 * np.pi * np.arange(SAMPLES) / SAMPLES
    found = np.fft.fft(function(theta)) / SAMPLES
    return np.concatenate((found[-HIGHEST:], found[: HIGHEST + 1]))


ORDERS: Array = np.arange(-HIGHEST, HIGHEST + 1.0)


class Arc(Curve):
    """A circle to port, or a straight line if the curvature is zero. `curvature`: kappa >= 0, 1/m."""

    def __init__(self, curvature: float) -> None:
        # A constant curvature has any period.
        self.period, self.shortest_bend = 1.0, math.inf
        self.constants = CurveConstants(1.0, 0.0, 1.0, 1.0, curvature, 0.0, 0.0, 0, 0.0, 0.0, np.empty(0, np.complex128), 0j)


class FigureEight(Curve):
    """A figure eight whose curvature is a sine of the arc length, the sine-generated curve that crosses itself.

    chi = A·(1 - cos(k·s)) and kappa = A·k·sin(k·s). It begins at the crossing; the long axis lies A - pi/2 = 47.8 degrees to
    port of the initial course. `length`: distance between the ends of the two loops, m.
    """

    def __init__(self, length: float) -> None:
        tangent = fourier(lambda theta: np.exp(1j * CLOSING * (1.0 - np.cos(theta))))
        # The mean, J0(A), is zero but for rounding; without it the tangent has an integral, and the curve closes exactly.
        mean = ORDERS == 0.0
        unit: ComplexArray = np.where(mean, 0j, tangent / (1j * (ORDERS + mean)))
        ends = [np.exp(1j * turn * math.pi * ORDERS) @ unit for turn in (0.5, 1.5)]
        k = float(abs(ends[1] - ends[0])) / length
        self.period = self.shortest_bend = 2.0 * math.pi / k
        self.constants = _bend(self.period, 0.0, k, (0.0, 0.0, CLOSING * k), 0, 0.0, 0.0, unit / k)


class Square(Curve):
    """A square with rounded corners, begun in the middle of a side.

    In a corner kappa = pi/(2·c)·(1 - cos(2·pi·q/c)) with the arc length q since its beginning, so curvature and its derivative
    are continuous and the smallest radius is c/pi. `side`: length of a side between the vertices of the square, m.
    `corner_radius`: smallest radius of a corner, m; a corner takes CORNER_EXTENT times that of both its sides.
    """

    def __init__(self, side: float, corner_radius: float) -> None:
        self.shortest_bend = bend = math.pi * corner_radius
        w = 2.0 * math.pi / bend
        # exp(i·chi) is this series times exp(i·theta/4), so no wavenumber of the product is zero.
        tangent = fourier(lambda theta: np.exp(-0.25j * np.sin(theta)))
        corner = tangent / (1j * w * (ORDERS + 0.25))
        # At the end of the corner the series is i times that at its beginning.
        extent = float(((1j - 1.0) * np.sum(corner)).real)
        straight = 0.5 * side - extent
        self.period = 2.0 * straight + bend
        self.constants = _bend(bend, straight, w, (0.25 * w, -0.25 * w, 0.0), 1, 0.5 * side, 0.25, corner)


def _bend(
    bend: float,
    straight: float,
    w: float,
    harmonic: tuple[float, float, float],
    quarters: int,
    half_side: float,
    shift: float,
    a: ComplexArray,
) -> CurveConstants:
    """The constants of a curve with bends; the wavenumbers of its position are (shift + order)·w."""
    mean, cosine, sine = harmonic
    lowest, period = shift - HIGHEST, 2.0 * straight + bend
    unplaced = CurveConstants(period, straight, bend, w, mean, cosine, sine, quarters, half_side, lowest, a[::-1].copy(), 0j)
    return unplaced._replace(start=in_bend(0.0, unplaced))


SMALLEST = 0.01  # smallest magnitude of a size, m
DEFAULT_CORNER, SHARPEST_CORNER = 0.2, 0.002
"""Radius of a corner in multiples of the side: by default, and the smallest that the solution of the drift angle resolves."""

POINTS_OF_A_TURN = 36


class Shape(NamedTuple):
    """A curve to port, the side to which it is travelled, +1 for port and -1 for starboard, and its size in words."""

    curve: Curve
    side: float
    size: str


def speed(what: str) -> float:
    """Declare the speed along a curve."""
    return parameter(1.5, f"Speed along {what}, constant after the start.", unit="m/s", low=1e-3, high=100.0)


def rise_time() -> float:
    """Declare the duration of the start."""
    text = "Time in which the speed rises from zero; 0 for the full speed from the start."
    return parameter(10.0, text, unit="s", low=0.0, high=1e4)


def size(default: float, description: str) -> float:
    """Declare the size of a curve, whose sign is that of the first turn."""
    text = f"{description}; positive turns to port (counter-clockwise) first, negative to starboard."
    return parameter(default, text, unit="m", low=-1e5, high=1e5)


def magnitude(name: str, value: float) -> float:
    """The magnitude of a size, m. Raises ParameterError if it is none."""
    if abs(value) < SMALLEST:
        raise ParameterError(f"reference_ship.{name} must have a magnitude of at least {SMALLEST:g} m (got {value:g} m)")
    return abs(value)


@dataclass(frozen=True)
class StraightParameters:
    """A straight line along the initial course."""

    speed: float = speed("the line")
    rise_time: float = rise_time()

    def shape(self) -> Shape:
        """The line."""
        return Shape(Arc(0.0), 1.0, "a straight line")


@dataclass(frozen=True)
class CircleParameters:
    """A circle, abeam of its start."""

    radius: float = size(50.0, "Radius of the circle")
    speed: float = speed("the circle")
    rise_time: float = rise_time()

    def shape(self) -> Shape:
        """The circle. Raises ParameterError if the radius is zero."""
        radius = magnitude("circle.radius", self.radius)
        return Shape(Arc(1.0 / radius), math.copysign(1.0, self.radius), f"radius {radius:g} m")


@dataclass(frozen=True)
class FigureEightParameters:
    """A figure eight, begun at its crossing."""

    length: float = size(150.0, "Distance between the ends of the figure eight")
    speed: float = speed("the figure eight")
    rise_time: float = rise_time()

    def shape(self) -> Shape:
        """The figure eight. Raises ParameterError if the length is zero."""
        length = magnitude("figure_eight.length", self.length)
        return Shape(FigureEight(length), math.copysign(1.0, self.length), f"length {length:g} m")


@dataclass(frozen=True)
class SquareParameters:
    """A square with rounded corners, begun in the middle of a side."""

    side: float = size(100.0, "Side of the square")
    corner_radius: float = parameter(
        0.0, "Smallest radius in the rounded corners; 0 for a fifth of the side.", unit="m", low=0.0, high=1e5
    )
    speed: float = speed("the square")
    rise_time: float = rise_time()

    def shape(self) -> Shape:
        """The square. Raises ParameterError if the side is zero, or the corners are too large or too small for it."""
        side = magnitude("square.side", self.side)
        radius = self.corner_radius or DEFAULT_CORNER * side
        low, high = SHARPEST_CORNER * side, 0.5 * side / CORNER_EXTENT
        if not low <= radius <= high:
            raise ParameterError(
                f"reference_ship.square.corner_radius must be {low:.3g} to {high:.3g} m, for a side of {side:g} m"
                f" (got {radius:g} m)"
            )
        sizes = f"side {side:g} m with corners of {radius:g} m"
        return Shape(Square(side, radius), math.copysign(1.0, self.side), sizes)


def _speed() -> float:
    return parameter(1.5, "Speed over ground along the pattern; corners may be slower.", unit="m/s", low=1e-3, high=100.0)


def _spacing() -> float:
    return parameter(
        20.0, "Distance between two tracks; positive turns to port, negative to starboard.", unit="m", low=-1e5, high=1e5
    )


@dataclass(frozen=True)
class ExpandingSquareParameters:
    """A search from the start outwards on a square that grows."""

    legs: int = parameter(8, "Number of legs.", low=1, high=1000)
    spacing: float = _spacing()
    speed: float = _speed()

    def places(self, start: complex, course: float) -> list[complex]:
        """The corners, m, from a start with the course of the first leg, rad. Raises ParameterError if the spacing is zero."""
        d = magnitude("expanding_square.spacing", self.spacing)
        along, found = cmath.exp(1j * course), [start]
        for leg in range(self.legs):
            found.append(found[-1] + (leg // 2 + 1) * d * along)
            along *= 1j if self.spacing > 0.0 else -1j
        return found[1:]


@dataclass(frozen=True)
class SpiralParameters:
    """A search about a point beside the start, on a spiral outwards."""

    radius: float = parameter(
        30.0,
        "Radius at the beginning: the centre is so far from the start, on the side of `spacing`.",
        unit="m",
        low=0.1,
        high=1e5,
    )
    spacing: float = _spacing()
    turns: float = parameter(3.0, "Number of turns.", low=0.1, high=100.0)
    speed: float = _speed()

    def places(self, start: complex, course: float) -> list[complex]:
        """Points of the spiral, m, from a start with the course there, rad. Raises ParameterError if the spacing is zero."""
        side = math.copysign(1.0, self.spacing)
        d = magnitude("spiral.spacing", self.spacing)
        # At the beginning the course is ahead of the tangent of the circle by the angle at which the radius grows.
        inward = cmath.exp(1j * (course + side * (0.5 * math.pi + math.atan2(d / TURN, self.radius))))
        centre, count = start + self.radius * inward, math.ceil(self.turns * POINTS_OF_A_TURN)
        angles = (self.turns * TURN * k / count for k in range(1, count + 1))
        return [centre - inward * (self.radius + d * phi / TURN) * cmath.exp(1j * side * phi) for phi in angles]
