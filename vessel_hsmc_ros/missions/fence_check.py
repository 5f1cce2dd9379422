"""Whether the legs of a mission stay within its own fence: polygons by crossings of a ray, and by crossings of their sides."""

from collections.abc import Sequence
from itertools import pairwise

from vessel_hsmc_ros.missions.mission import Fence, Refused

MARGIN = 1e-6  # distance from a side, m, within which a leg along it is inside


def breaches(points: Sequence[complex], fences: Sequence[Fence], items: Sequence[str]) -> list[Refused]:
    """The legs that leave an area to stay in, or enter one to stay out of.

    `points`: the waypoints, m; the first leg begins at the first one. `fences`: the areas, m.
    """
    found = []
    for fence in fences:
        legs = zip(items[1:], pairwise(points), strict=True)
        wrong = [item for item, (a, b) in legs if not _keeps(a, b, fence)]
        if len(points) == 1 and _inside(points[0], fence) != fence.inside:
            wrong = [items[0]]
        if wrong:
            what = "leaves the area to stay in" if fence.inside else "enters the area to stay out of"
            more = f" and {len(wrong) - 1} more" if len(wrong) > 1 else ""
            found.append(Refused(wrong[0], f"its leg{more}", f"it {what}, {fence.item}"))
    return found


def _keeps(a: complex, b: complex, fence: Fence) -> bool:
    """Whether a leg stays inside, or outside."""
    if fence.radius:
        (center,) = (complex(*corner) for corner in fence.corners)
        if fence.inside:  # the end that is farther away
            return max(abs(a - center), abs(b - center)) <= fence.radius
        return _distance(center, a, b) >= fence.radius
    # Between two crossings of sides a leg is inside or outside as a whole.
    cuts = sorted({0.0, 1.0, *(t for c, d in _sides(fence) if (t := _crossing(a, b, c, d)) is not None)})
    parts = [0.0, 1.0, *(0.5 * (first + last) for first, last in pairwise(cuts))]
    return all(_inside(a + t * (b - a), fence) == fence.inside for t in parts)


def _sides(fence: Fence) -> list[tuple[complex, complex]]:
    corners = [complex(*corner) for corner in fence.corners]
    return [*zip(corners, [*corners[1:], corners[0]], strict=True)]


def _inside(p: complex, fence: Fence) -> bool:
    """Whether a point is inside; one on the side of an area is as it has to be."""
    if fence.radius:
        return abs(p - complex(*fence.corners[0])) <= fence.radius
    sides = _sides(fence)
    if min(_distance(p, c, d) for c, d in sides) <= MARGIN:
        return fence.inside
    crossed = [
        (c.imag > p.imag) != (d.imag > p.imag) and p.real < (d.real - c.real) * (p.imag - c.imag) / (d.imag - c.imag) + c.real
        for c, d in sides
    ]
    return sum(crossed) % 2 == 1


def _distance(p: complex, a: complex, b: complex) -> float:
    """The distance of a point from a line between two others, m."""
    way = b - a
    if not way:
        return abs(p - a)
    along = ((p - a) * way.conjugate()).real / abs(way) ** 2
    return abs(p - a - min(max(along, 0.0), 1.0) * way)


def _crossing(a: complex, b: complex, c: complex, d: complex) -> float | None:
    """Where a side crosses a leg, as a share of the leg; None where it does not, or is parallel to it."""
    leg, side = b - a, d - c
    area = (leg.conjugate() * side).imag
    if not area:
        return None
    t, s = ((c - a).conjugate() * side).imag / area, ((c - a).conjugate() * leg).imag / area
    return t if 0.0 <= t <= 1.0 and 0.0 <= s <= 1.0 else None
