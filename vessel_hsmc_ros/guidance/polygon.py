"""Legs that cover a polygon: each lies in the middle of a strip of it, and is as long as the polygon is in the strip.

| symbol | meaning | unit |
|---|---|---|
| w, n, d | width across the legs, number of strips n = ceil(w/spacing), width of a strip d = w/n | m, -, m |

All of the polygon is within d/2 of a leg. A vessel goes from a leg to the next one abreast: whichever ends first is extended, so
that the turn is outside of the strip.
"""

import cmath
import math
from collections.abc import Sequence
from typing import NamedTuple

from vessel_hsmc_ros.core.exceptions import ParameterError

ROUNDING = 1e-9  # a width that exceeds a whole number of spacings by less, relative to a spacing, does not take another leg


class Strip(NamedTuple):
    """A leg with the straight ways before and after it, m."""

    before: float
    leg: float
    after: float


class PolygonLegs(NamedTuple):
    """The legs of a polygon."""

    strips: tuple[Strip, ...]  # in their order
    spacing: float  # between two, m, positive to port
    begin: complex  # where the first begins, m
    course: float  # of the first, rad


def polygon_legs(corners: tuple[float, ...], heading: float, spacing: float, here: complex, name: str) -> PolygonLegs:
    """The legs of a polygon, begun at that of their four ends that is nearest to a place.

    Args:
        corners: x, y of each corner, m.
        heading: Direction of the legs, rad.
        spacing: Largest distance between two legs, m.
        here: The place, m.
        name: Of the parameter, for error messages.

    Raises:
        ParameterError: there are fewer than three corners or no area, or a leg would leave the polygon.
    """
    if len(corners) % 2 or len(corners) < 6:
        raise ParameterError(f"{name} must have x and y of at least 3 corners (got {len(corners)} numbers)")
    along = cmath.exp(1j * heading)
    local = [complex(x, y) / along for x, y in zip(corners[::2], corners[1::2], strict=True)]
    low, high = min(p.imag for p in local), max(p.imag for p in local)
    if not high - low > ROUNDING * abs(spacing):
        raise ParameterError(f"{name} must have an area (got a width of {high - low:g} m across the legs)")
    count = max(1, math.ceil((high - low) / abs(spacing) - ROUNDING))
    d = (high - low) / count
    spans = [_span(local, low + i * d, low + (i + 1) * d, name) for i in range(count)]
    found = [_from_corner(spans, low + 0.5 * d, d, along, upwards, ahead) for upwards in (True, False) for ahead in (True, False)]
    return min(found, key=lambda legs: abs(legs.begin - here))


def _span(local: Sequence[complex], low: float, high: float, name: str) -> tuple[float, float]:
    """From where to where a polygon is in a strip.

    Raises ParameterError if the middle of the strip leaves the polygon and comes back to it.
    """
    sides = [*zip(local, [*local[1:], local[0]], strict=True)]
    found = [p.real for p in local if low <= p.imag <= high]
    middle = 0.5 * (low + high)
    for y in (low, middle, high):
        crossings = [
            a.real + (y - a.imag) / (b.imag - a.imag) * (b.real - a.real) for a, b in sides if (a.imag > y) != (b.imag > y)
        ]
        if y == middle and len(crossings) > 2:
            raise ParameterError(
                f"{name} must be crossed by each leg once (got one that leaves it and comes back):"
                " another heading, or two polygons would do"
            )
        found += crossings
    return min(found), max(found)


def _from_corner(
    spans: Sequence[tuple[float, float]], first: float, d: float, along: complex, upwards: bool, ahead: bool
) -> PolygonLegs:
    """The legs from the first or the last strip on, the first of them ahead or astern of the heading."""
    rows = list(spans if upwards else spans[::-1])
    y = first if upwards else first + (len(rows) - 1) * d
    strips, before = [], 0.0
    for i, (low, high) in enumerate(rows):
        after, following = 0.0, 0.0
        if i + 1 < len(rows):
            out = ahead == (i % 2 == 0)  # along the heading
            ends = (high, rows[i + 1][1]) if out else (-low, -rows[i + 1][0])
            after, following = max(0.0, ends[1] - ends[0]), max(0.0, ends[0] - ends[1])
        strips.append(Strip(before, high - low, after))
        before = following
    begin = complex(rows[0][0] if ahead else rows[0][1], y) * along
    course = cmath.phase(along if ahead else -along)
    return PolygonLegs(tuple(strips), d if upwards == ahead else -d, begin, course)
