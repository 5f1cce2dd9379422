"""Search patterns from a point outwards: the expanding square and the spiral, as waypoints that a path sails.

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

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.kinematics import TURN
from vessel_hsmc_ros.core.schema import parameter
from vessel_hsmc_ros.guidance.shapes import SMALLEST

POINTS_OF_A_TURN = 36


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
        d = _checked("expanding_square.spacing", self.spacing)
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
        d = _checked("spiral.spacing", self.spacing)
        # At the beginning the course is ahead of the tangent of the circle by the angle at which the radius grows.
        inward = cmath.exp(1j * (course + side * (0.5 * math.pi + math.atan2(d / TURN, self.radius))))
        centre, count = start + self.radius * inward, math.ceil(self.turns * POINTS_OF_A_TURN)
        angles = (self.turns * TURN * k / count for k in range(1, count + 1))
        return [centre - inward * (self.radius + d * phi / TURN) * cmath.exp(1j * side * phi) for phi in angles]


def _checked(name: str, value: float) -> float:
    if abs(value) < SMALLEST:
        raise ParameterError(f"reference_ship.{name} must have a magnitude of at least {SMALLEST:g} m (got {value:g} m)")
    return abs(value)
