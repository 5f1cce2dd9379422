"""Parameters of shapes: curves to travel at constant speed, and search patterns from a point outwards.

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
from dataclasses import dataclass
from typing import NamedTuple

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.kinematics import TURN
from vessel_hsmc_ros.core.schema import parameter
from vessel_hsmc_ros.guidance.curves import CORNER_EXTENT, Arc, Curve, FigureEight, Square

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
