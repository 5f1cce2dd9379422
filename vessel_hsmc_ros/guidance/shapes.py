"""Parameters of the curves to travel at constant speed: straight, circle, figure eight, square.

A curve begins at the position of `initial_pose`, whose angle is the course of travel there, so that the geometry does not depend
on the hull; the heading differs from the course by the drift angle. A positive size turns to port (counter-clockwise) first, a
negative one to starboard.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.schema import parameter
from vessel_hsmc_ros.guidance.curves import CORNER_EXTENT, Arc, Curve, FigureEight, Square

SMALLEST = 0.01  # smallest magnitude of a size, m
DEFAULT_CORNER, SHARPEST_CORNER = 0.2, 0.002
"""Radius of a corner in multiples of the side: by default, and the smallest that the solution of the drift angle resolves."""


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


def _checked(name: str, value: float) -> float:
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
        radius = _checked("circle.radius", self.radius)
        return Shape(Arc(1.0 / radius), math.copysign(1.0, self.radius), f"radius {radius:g} m")


@dataclass(frozen=True)
class FigureEightParameters:
    """A figure eight, begun at its crossing."""

    length: float = size(150.0, "Distance between the ends of the figure eight")
    speed: float = speed("the figure eight")
    rise_time: float = rise_time()

    def shape(self) -> Shape:
        """The figure eight. Raises ParameterError if the length is zero."""
        length = _checked("figure_eight.length", self.length)
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
        side = _checked("square.side", self.side)
        radius = self.corner_radius or DEFAULT_CORNER * side
        low, high = SHARPEST_CORNER * side, 0.5 * side / CORNER_EXTENT
        if not low <= radius <= high:
            raise ParameterError(
                f"reference_ship.square.corner_radius must be {low:.3g} to {high:.3g} m, for a side of {side:g} m"
                f" (got {radius:g} m)"
            )
        sizes = f"side {side:g} m with corners of {radius:g} m"
        return Shape(Square(side, radius), math.copysign(1.0, self.side), sizes)
