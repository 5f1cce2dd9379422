"""A mission in metres: its datum, a part of its legs, how far a vessel has come on them, and the parameters that sail them.

The datum and all distances from it are checked for sense. Leg k leads to waypoint k, from the one before it; leg 1 from where the
vessel lies. The mission's own fence is that of `core.fence`, so that what is accepted here is accepted by the reference ship.
"""

import cmath
import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.boats.missions.mission import Fence, Mission, MissionPoint, Pair, Refused
from vessel_hsmc_ros.core.exceptions import ParameterError, ScenarioError
from vessel_hsmc_ros.core.fence import CIRCLE_CORNERS, FenceParameters, clearance, fence_of
from vessel_hsmc_ros.core.fence import Fence as Area
from vessel_hsmc_ros.core.kinematics import TURN, Plane, exchanged
from vessel_hsmc_ros.core.schema import build
from vessel_hsmc_ros.guidance.planned_track import PlannedTrack, track_leaving
from vessel_hsmc_ros.guidance.tasks import Progress
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

    `datum`: latitude and longitude, degrees; None for the planner's home, or the first waypoint where there is none.
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


Array = NDArray[np.float64]


def positions(points: Sequence[MissionPoint]) -> list[complex]:
    """The places of waypoints in metres."""
    return [complex(*point.place) for point in points]


def part_of(mission: Mission, legs: str) -> Mission:
    """The mission with some of its legs, begun at the waypoint before the first of them.

    The vessel passes over that waypoint, so that the leg is sailed from its beginning on. `mission`: the mission, in metres.
    `legs`: a number, `7`; a range, `7-9`; or all from one on, `7-`.
    """
    found, count = re.fullmatch(r"(\d{1,9})(-(\d{1,9})?)?", legs.strip()), len(mission.points)
    first = int(found[1]) if found else 0
    last = 0 if found is None else first if found[2] is None else count if found[3] is None else int(found[3])
    if not 1 <= first <= last <= count:
        raise ParameterError(f"--legs must be a leg or a range of legs from 1 to {count}, such as 7, 7-9 or 7- (got {legs})")
    points = list(mission.points[first - 1 : last])
    if first > 1:
        before = mission.points[first - 2]
        points.insert(0, before._replace(corner="over", hold=0.0, heading=None))
    return replace(mission, points=tuple(points))


def completed(mission: Mission, track: Array, least_room: float) -> int:
    """How many of the first legs a vessel has completed, in their order.

    Legs are counted as by `Progress`; the last one is completed when the vessel has come to its end. `mission`: the mission, in
    metres. `track`: x, y of the vessel, (n, 2) m. `least_room`: distance within which it passes a waypoint however short the
    legs are, m.
    """
    places = track[:, 0] + 1j * track[:, 1]
    places = places[np.isfinite(places)]
    if not len(places):
        return 0
    progress = Progress(complex(places[0]), positions(mission.points), least_room)
    for place in places:
        progress.advance(complex(place))
        if progress.leg == progress.legs and progress.distance_to_end(complex(place)) <= least_room:
            return progress.legs
    return progress.leg - 1


def leaving_fence(mission: Mission) -> list[Refused]:
    """The legs of a mission, or the sides of the area to survey where it has no legs, that leave its own fence."""
    if mission.points:
        return breaches(positions(mission.points), mission.fences, [point.item for point in mission.points])
    if not mission.areas:
        raise ScenarioError("the mission must have a waypoint (got none)")
    return [
        wrong
        for area in mission.areas
        for wrong in breaches(
            [complex(*corner) for corner in (*area.corners, area.corners[0])],
            mission.fences,
            [area.item] * (len(area.corners) + 1),
        )
    ]


def way_leaving_fence(track: PlannedTrack, fences: Sequence[Fence]) -> list[Refused]:
    """As `leaving_fence`, of a planned way with its turns."""
    areas = [(fence, _area(fence)) for fence in fences]
    return [
        Refused("the planned way", found, _why(fence)) for fence, area in areas if area and (found := track_leaving(area, track))
    ]


def unsendable(mission: Mission) -> list[Refused]:
    """What a path message has no field for: a running vessel sails positions, at the speed that it is set to."""
    why = "a path message has positions only: --into and a start with its parameters do it"
    found = []
    for number, point in enumerate(mission.points, 1):
        what = [f"speed {point.speed:g} m/s"] if point.speed else []
        what += [f"hold {point.hold:g} s"] if point.hold else []
        what += ["heading"] if point.heading is not None else []
        what += [f"corner {point.corner}"] if point.corner != "through" and number < len(mission.points) else []
        found += [Refused(point.item, ", ".join(what), why)] if what else []
    return found


def parameters_of(mission: Mission) -> dict[str, object]:
    """The parameters of the reference ship that sail a mission."""
    points = mission.points
    headings = [-1.0 if point.heading is None else point.heading % TURN for point in points]
    return {
        "mode": "path",
        "path.waypoints": [value for point in points for value in point.place],
        "path.speeds": [point.speed for point in points],
        "path.corners": [point.corner for point in points],
        "path.holds": [point.hold for point in points],
        "path.headings": headings,
        "path.time": 0.0,
    }


def fence_of_mission(mission: Mission) -> dict[str, dict[str, object]]:
    """The parameters, by node, that keep controller and reference ship inside of a mission's fence; none without one."""
    rings: dict[str, list[float]] = {"inside": [], "outside": []}
    for fence in mission.fences:
        rings["inside" if fence.inside else "outside"] += _ring(fence)
    given = {name: values for name, values in rings.items() if values}
    fence_of(build(FenceParameters, given, "fence"), "the mission's fence")
    if not given:
        return {}
    groups = {"controller": "safety.fence", "reference_ship": "fence"}
    return {node: {f"{group}.{name}": values for name, values in given.items()} for node, group in groups.items()}


def survey_of(mission: Mission, swath: float, along: float, speed: float | None) -> dict[str, object]:
    """The parameters of the reference ship that survey the area of a mission.

    `mission`: the mission, in metres. `swath`: width that a leg covers, m. `along`: direction of the legs, rad,
    counter-clockwise from x. `speed`: on the legs, m/s; None for that of the scenario.
    """
    if len(mission.areas) != 1:
        raise ScenarioError(f"--swath must be given with a file of one polygon that is no fence (got {len(mission.areas)})")
    corners = [value for corner in mission.areas[0].corners for value in corner]
    found: dict[str, object] = {
        "mode": "lawnmower",
        "lawnmower.polygon": corners,
        "lawnmower.spacing": swath,
        "lawnmower.heading": math.remainder(along, TURN),
    }
    return found if speed is None else {**found, "lawnmower.speed": speed}


def table_of(mission: Mission, first: int) -> list[list[str]]:
    """The rows of a table: leg, name, x, y, length, course, speed, time and hold; courses clockwise from north (y)."""
    rows, points = [], positions(mission.points)
    for k, point in enumerate(mission.points):
        way = points[k] - points[k - 1] if k else 0j
        course = f"{(90.0 - math.degrees(cmath.phase(way))) % 360.0:.1f}" if way else "-"
        time = f"{abs(way) / point.speed:.0f}" if point.speed and k else "-"
        numbers = [f"{round(value, 2) + 0.0:.2f}" for value in point.place] + [f"{abs(way):.2f}" if k else "-", course]
        speed, hold = f"{point.speed:.3g}" if point.speed else "-", f"{point.hold:g}" if point.hold else "-"
        rows.append([str(first + k), point.name or point.item, point.corner, *numbers, speed, time, hold])
    return rows


def breaches(points: Sequence[complex], fences: Sequence[Fence], items: Sequence[str]) -> list[Refused]:
    """The legs that touch or leave an area to stay in, or touch or enter one to stay out of."""
    legs = [*pairwise(points)] or [(points[0], points[0])]
    found = []
    for fence in fences:
        area, named = _area(fence), zip(items[-len(legs) :], legs, strict=True)
        if area and (wrong := [item for item, leg in named if clearance(area, np.array(leg)) <= 0.0]):
            more = f" and {len(wrong) - 1} more" if len(wrong) > 1 else ""
            found.append(Refused(wrong[0], f"its leg{more}", _why(fence)))
    return found


def _area(fence: Fence) -> Area | None:
    return fence_of(build(FenceParameters, {"inside" if fence.inside else "outside": _ring(fence)}, "fence"), fence.item)


def _why(fence: Fence) -> str:
    what = "leaves the area to stay in" if fence.inside else "enters the area to stay out of"
    return f"it {what}, {fence.item}"


def _ring(fence: Fence) -> list[float]:
    """The x, y of its corners, closed, as parameters have them; a circle is a polygon within it, or around one to stay out of."""
    corners = fence.corners
    if fence.radius:
        r = fence.radius if fence.inside else fence.radius / math.cos(math.pi / CIRCLE_CORNERS)
        steps = [TURN * k / CIRCLE_CORNERS for k in range(CIRCLE_CORNERS)]
        corners = tuple((corners[0][0] + r * math.cos(step), corners[0][1] + r * math.sin(step)) for step in steps)
    return [value for corner in (*corners, corners[0]) for value in corner]
