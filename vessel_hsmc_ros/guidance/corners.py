"""Corners of a path: cut through with a turn before and after the waypoint, or begun over it.

Through a corner of the angle theta, the turn begins and ends at the same distance from the waypoint. Over the waypoint, the ship
turns only when it has passed it, by theta + eps, and back by eps, so that it is on the next leg again. A corner sharper than
SHARPEST cannot be cut through and is sailed over its waypoint.

Under way, a path begins with the present course and curvature: the curvature decays, and one turn points at the first waypoint.
"""

import cmath
import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.core.kinematics import wrap
from vessel_hsmc_ros.guidance.route import Piece, Pieces, displacement, turn

SHARPEST = math.radians(120.0)

LEAST_ANGLE = 1e-9  # a corner with less is none, rad
LARGEST_EPS = 0.8 * math.pi

BISECTIONS, SCANNED = 50, 96  # bisections of an angle, and angles that are tried in a full turn to one side
THROUGH, OVER, STOP = "through", "over", "stop"


class Corner(NamedTuple):
    """A corner: its pieces, and how far before and after the waypoint it begins and ends, m."""

    pieces: Pieces
    before: float
    after: float


def corner_of(kind: str, angle: float, radius: float, transition: float) -> Corner:
    """The corner at a waypoint.

    `kind`: THROUGH or OVER. `angle`: change of the course, rad, in (-pi, pi]. `radius`: smallest radius, m. `transition`:
    length of its transitions, m.
    """
    if abs(angle) < LEAST_ANGLE:
        return Corner((), 0.0, 0.0)
    if kind == THROUGH and abs(angle) <= SHARPEST:
        pieces = turn(angle, radius, transition)
        # By symmetry the chord has half the angle.
        reach = 0.5 * abs(displacement(pieces)) / math.cos(0.5 * angle)
        return Corner(pieces, reach, reach)
    return _over(angle, radius, transition)


def _over(angle: float, radius: float, transition: float) -> Corner:
    side, size = math.copysign(1.0, angle), abs(angle)

    def pieces(eps: float, to: float = 1.0) -> Pieces:
        return (*turn(to * (size + eps), radius, transition), *turn(-to * eps, radius, transition))

    def end(eps: float) -> complex:
        """Where it ends, in the frame of the next leg."""
        return displacement(pieces(eps)) * cmath.exp(-1j * size)

    low, high = 0.0, LARGEST_EPS
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        # On the outer side of the next leg at first, and the nearer the farther the ship turns.
        low, high = (middle, high) if end(middle).imag < 0.0 else (low, middle)
    return Corner(pieces(high, side), 0.0, end(high).real)


def join(target: complex, curvature: float, decay: float, radius: float, transition: float, run: float) -> tuple[Pieces, Pieces]:
    """The shortest turn from the present course, along which the position is 0 and the course 0, to a point.

    Args:
        target: The point, m.
        curvature: Present curvature, 1/m.
        decay: Length in which it decays, m.
        radius: Smallest radius of the turn, m.
        transition: Length of its transitions, m.
        run: Way between the two, m.

    Returns:
        The decay of the curvature with the way after it, and the turn; without a way to the point, the turn leads past it.
    """
    first = tuple(piece for piece in (Piece(decay, curvature, 0.0), Piece(run, 0.0, 0.0)) if piece.length > 0.0)

    def left(angle: float) -> complex:
        """The way from the end of the turn to the point, in the frame of the course there."""
        pieces = (*first, *turn(angle, radius, transition))
        course = sum(0.5 * piece.length * (piece.begin + piece.end) for piece in pieces)
        return (target - displacement(pieces)) * cmath.exp(-1j * course)

    found = []
    for side in (1.0, -1.0):
        angles = side * np.linspace(0.0, 2.0 * math.pi, SCANNED + 1)
        ways = [left(float(angle)) for angle in angles]
        for i in range(SCANNED):
            before, after = ways[i], ways[i + 1]
            if before.imag * after.imag <= 0.0 and before.real > 0.0 and after.real > 0.0:
                angle = _zero(left, float(angles[i]), float(angles[i + 1]), before.imag > 0.0)
                found.append((abs(angle) * radius + left(angle).real, angle))
    angle = min(found)[1] if found else wrap(cmath.phase(left(0.0)))
    return first, turn(angle if abs(angle) > LEAST_ANGLE else 0.0, radius, transition)


def _zero(left: Callable[[float], complex], low: float, high: float, positive: bool) -> float:
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if (left(middle).imag > 0.0) == positive else (low, middle)
    return 0.5 * (low + high)
