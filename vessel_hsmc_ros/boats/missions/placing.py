"""A mission in the plane of a datum, in metres; the datum and all distances from it are checked for sense."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

from vessel_hsmc_ros.boats.missions.mission import Fence, Mission, Pair
from vessel_hsmc_ros.core.exceptions import ParameterError, ScenarioError
from vessel_hsmc_ros.core.geodesy import Plane, exchanged
from vessel_hsmc_ros.messages.conversions import FARTHEST

NULL_ISLAND = 1e-6
"""Latitude and longitude, degrees, that are both smaller are those of a receiver without a fix, or of an empty field."""


@dataclass(frozen=True)
class Placed:
    """A mission whose places are x and y, m, and the datum that they are relative to, with its origin in words."""

    mission: Mission
    datum: Pair | None
    datum_of: str


def datum_of(text: str) -> Pair:
    """Read a datum, `latitude,longitude`. Raises ParameterError if it is none."""
    try:
        latitude, longitude = map(float, text.split(","))
    except ValueError:
        latitude = longitude = math.nan
    if not (abs(latitude) < 90.0 and abs(longitude) <= 180.0):
        swapped = "; are they exchanged?" if abs(longitude) < 90.0 and abs(latitude) <= 180.0 else ""
        raise ParameterError(
            f"--datum must be a latitude within -90 and 90 and a longitude within -180 and 180 degrees (got {text}{swapped})"
        )
    if _is_null_island((latitude, longitude)):
        raise ParameterError(f"--datum must be a place that was measured: 0, 0 is that of a receiver without a fix (got {text})")
    return latitude, longitude


def placed(mission: Mission, datum: Pair | None, title: str) -> Placed:
    """The mission in metres.

    `datum`: latitude and longitude, degrees; None for the planner's home, or the first waypoint where there is none. Raises
    ScenarioError if a place is too far from the datum, or 0, 0; ParameterError if the mission is in metres, and there is a
    datum.
    """
    if not mission.geographic:
        if datum is not None:
            raise ParameterError(f"--datum must be left out, because {title} is in metres (got {datum[0]:g}, {datum[1]:g})")
        _check_metres(mission, title)
        return Placed(mission, None, "")
    found, origin = (datum, "given") if datum is not None else _own_datum(mission, title)
    plane = Plane(*found)

    def to_plane(place: Pair, item: str) -> Pair:
        _check(plane, place, item, title)
        x, y, _ = plane.place(*place)
        return x, y

    def area_of(fence: Fence) -> Fence:
        return fence._replace(corners=tuple(to_plane(corner, fence.item) for corner in fence.corners))

    local = replace(
        mission,
        points=tuple(point._replace(place=to_plane(point.place, point.item)) for point in mission.points),
        fences=tuple(map(area_of, mission.fences)),
        areas=tuple(map(area_of, mission.areas)),
        rally=tuple(to_plane(place, f"rally point {k}") for k, place in enumerate(mission.rally, 1)),
        geographic=False,
        home=None,
    )
    return Placed(local, found, origin)


def _own_datum(mission: Mission, title: str) -> tuple[Pair, str]:
    """The home of the planner, or the first place of the mission."""
    places = [*_places(mission)]
    if not places:
        raise ScenarioError(f"{title} must have a waypoint or an area (got none)")
    item, first = places[0]
    if mission.home is not None and not _is_null_island(mission.home):
        _check(Plane(*mission.home), first, item, title, "its home (another one is set by --datum),")
        return mission.home, "the planner's home"
    if _is_null_island(first):
        raise ScenarioError(_null(item, first, title))
    return first, item


def _places(mission: Mission) -> Iterable[tuple[str, Pair]]:
    yield from ((point.item, point.place) for point in mission.points)
    yield from ((area.item, corner) for area in (*mission.areas, *mission.fences) for corner in area.corners)


def _check(plane: Plane, place: Pair, item: str, title: str, origin: str = "the datum") -> None:
    """Refuse a place that is not near to the datum. Raises ScenarioError if it is too far away, or 0, 0."""
    if _is_null_island(place):
        raise ScenarioError(_null(item, place, title))
    distance = plane.distance(*place)
    if distance > FARTHEST:
        swapped = "; are latitude and longitude exchanged?" if exchanged(plane, *place) else ""
        raise ScenarioError(
            f"{title}, {item} must be within {FARTHEST / 1e3:g} km of {origin} {plane.latitude:.6f}, {plane.longitude:.6f}"
            f" (got {place[0]:.6f}, {place[1]:.6f}, {distance / 1e3:.0f} km away{swapped})"
        )


def _check_metres(mission: Mission, title: str) -> None:
    for item, (x, y) in _places(mission):
        if math.hypot(x, y) > FARTHEST:
            raise ScenarioError(
                f"{title}, {item} must be within {FARTHEST / 1e3:g} km of the origin (got x = {x:g}, y = {y:g});"
                " are they metres in the frame of the odometry?"
            )


def _is_null_island(place: Pair) -> bool:
    return max(map(abs, place)) < NULL_ISLAND


def _null(item: str, place: Pair, title: str) -> str:
    return f"{title}, {item} must be a place that was measured (got {place[0]:g}, {place[1]:g}, that of a receiver without a fix)"
