"""The legs of a mission in metres: a part of them, how far a vessel has come on them, and the parameters that sail them.

Leg k leads to waypoint k, from the one before it; leg 1 from where the vessel lies. The mission's own fence is that of
`core.fence`, so that what is accepted here is accepted by the reference ship.
"""

import cmath
import math
import re
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.boats.missions.mission import Fence, Mission, MissionPoint, Refused
from vessel_hsmc_ros.core.exceptions import ParameterError, ScenarioError
from vessel_hsmc_ros.core.fence import CIRCLE_CORNERS, FenceParameters, clearance, fence_of
from vessel_hsmc_ros.core.fence import Fence as Area
from vessel_hsmc_ros.core.kinematics import TURN
from vessel_hsmc_ros.core.schema import build
from vessel_hsmc_ros.guidance.planned_track import PlannedTrack, track_leaving
from vessel_hsmc_ros.guidance.tasks import Progress

Array = NDArray[np.float64]


def positions(points: Sequence[MissionPoint]) -> list[complex]:
    """The places of waypoints in metres."""
    return [complex(*point.place) for point in points]


def part_of(mission: Mission, legs: str) -> Mission:
    """The mission with some of its legs, begun at the waypoint before the first of them.

    The vessel passes over that waypoint, so that the leg is sailed from its beginning on. `mission`: the mission, in metres.
    `legs`: a number, `7`; a range, `7-9`; or all from one on, `7-`. Raises ParameterError if it is none of them, or there is no
    such leg.
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
    """The legs of a mission, or the sides of the area to survey where it has no legs, that leave its own fence.

    Raises ScenarioError if it has neither.
    """
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
    """The parameters, by node, that keep controller and reference ship inside of a mission's fence; none without one.

    `mission`: the mission, in metres. Raises ParameterError if a polygon is none.
    """
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
    counter-clockwise from x. `speed`: on the legs, m/s; None for that of the scenario. Raises ScenarioError if it has no area,
    or several.
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
    """The rows of a table: leg, name, x, y, length, course, speed, time and hold; courses clockwise from north (y).

    `mission`: the mission, in metres. `first`: number of its first waypoint.
    """
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
    """The legs that touch or leave an area to stay in, or touch or enter one to stay out of.

    `points`: the waypoints, m; the first leg begins at the first one. `fences`: the areas, m. Raises ParameterError if a polygon
    is none.
    """
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
