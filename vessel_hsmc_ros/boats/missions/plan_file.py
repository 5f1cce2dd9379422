"""Missions in JSON by QGroundControl (.plan) and Cockpit (.cpm, .json), both of MAVLink's mission items.

Formats: https://docs.qgroundcontrol.com/master/en/qgc-dev-guide/file_formats/plan.html, and Cockpit's type CockpitMission.
"""

import re
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from vessel_hsmc_ros.boats.missions.mavlink_items import SPEED, WAYPOINT, MavItem, mission_of
from vessel_hsmc_ros.boats.missions.mission import Fence, Mission, Refused, Source

SURVEYS = ("survey", "CorridorScan")  # complex items that are legs of waypoints
MAX_COMMAND = 65535

COMMANDS = {
    "MAV_CMD_NAV_WAYPOINT": WAYPOINT,
    "MAV_CMD_NAV_LOITER_UNLIM": 17,
    "MAV_CMD_NAV_LOITER_TURNS": 18,
    "MAV_CMD_NAV_LOITER_TIME": 19,
    "MAV_CMD_NAV_RETURN_TO_LAUNCH": 20,
    "MAV_CMD_NAV_LAND": 21,
    "MAV_CMD_NAV_TAKEOFF": 22,
    "MAV_CMD_NAV_SPLINE_WAYPOINT": 82,
    "MAV_CMD_NAV_DELAY": 93,
    "MAV_CMD_DO_JUMP": 177,
    "MAV_CMD_DO_CHANGE_SPEED": SPEED,
    "MAV_CMD_DO_SET_HOME": 179,
    "MAV_CMD_DO_SET_SERVO": 183,
    "MAV_CMD_DO_SET_RELAY": 181,
    "MAV_CMD_DO_SET_REVERSE": 194,
    "MAV_CMD_DO_SET_CAM_TRIGG_DIST": 206,
    "MAV_CMD_IMAGE_START_CAPTURE": 2000,
}
"""Commands by their names, which Cockpit writes."""


def read_plan(document: dict[str, Any], source: Source) -> Mission:
    """The mission of a .plan file.

    Raises ScenarioError if it is not complete, or a value of it is of another kind or out of range.
    """
    source.whole(document.get("version", 1), "version", 1, 1)
    mission = source.mapping(document.get("mission"), "mission")
    source.whole(mission.get("version", 2), "mission.version", 1, 2)
    read = [*_plan_items(mission, source)]
    refused = tuple(item for item in read if isinstance(item, Refused))
    found = mission_of([item for item in read if isinstance(item, MavItem)], source)
    home = mission.get("plannedHomePosition")
    fences, rally = document.get("geoFence"), document.get("rallyPoints")
    return replace(
        found,
        refused=refused + found.refused,
        home=None if home is None else source.place(home, "plannedHomePosition"),
        fences=() if fences is None else tuple(_fences(source.mapping(fences, "geoFence"), source)),
        rally=() if rally is None else tuple(_rally(source.mapping(rally, "rallyPoints"), source)),
    )


def _rally(rally: dict[str, Any], source: Source) -> Iterator[tuple[float, float]]:
    for k, point in enumerate(source.rows(rally.get("points", []), "rallyPoints.points"), 1):
        yield source.place(point, f"rally point {k}")


def _plan_items(mission: dict[str, Any], source: Source) -> Iterator[MavItem | Refused]:
    """The simple items, and those of surveys; a `Refused` for every other complex item."""
    number = 0
    for k, entry in enumerate(source.rows(mission.get("items"), "mission.items"), 1):
        item = source.mapping(entry, f"item {k}")
        kind = item.get("type")
        if kind == "SimpleItem":
            number += 1
            yield _simple(item, f"item {k}", number, source)
        elif kind == "ComplexItem":
            name = str(item.get("complexItemType"))
            if name not in SURVEYS:
                yield Refused(f"item {k}", f"complex item {name}", f"it is no route; of complex items {', '.join(SURVEYS)} are")
                continue
            found = _transects(item, f"item {k}", number, source)
            if not found:
                why = "it has no transects; saving it again with QGroundControl 4 adds them"
                yield Refused(f"item {k}", f"complex item {name}", why)
            number += len(found)
            yield from found
        else:
            raise source.error(f"item {k}: type must be SimpleItem or ComplexItem (got {kind})")


def _simple(item: dict[str, Any], what: str, number: int, source: Source) -> MavItem:
    params = source.rows(item.get("params"), f"{what}: params")
    if len(params) == 4 and "coordinate" in item:  # before version 3.3
        params = [*params, *source.rows(item["coordinate"], f"{what}: coordinate")]
    if len(params) != 7:
        raise source.error(f"{what}: params must be 7 numbers (got {len(params)})")
    command = source.whole(item.get("command"), f"{what}: command", 0, MAX_COMMAND)
    frame = source.whole(item.get("frame", 0), f"{what}: frame", 0, 255)
    jump = source.whole(item.get("doJumpId", number), f"{what}: doJumpId", 0, MAX_COMMAND)
    return MavItem(what, jump, command, frame, tuple(source.parameter(value, f"{what}: params") for value in params))


def _transects(item: dict[str, Any], what: str, number: int, source: Source) -> list[MavItem]:
    """The items of a survey, or waypoints at the points that the planner draws, where it has saved no items."""
    style = source.mapping(item.get("TransectStyleComplexItem", {}), f"{what}: TransectStyleComplexItem")
    items = source.rows(style.get("Items", []), f"{what}: Items")
    if items:
        return [_simple(source.mapping(one, f"{what}.{k}"), f"{what}.{k}", number + k, source) for k, one in enumerate(items, 1)]
    points = source.rows(style.get("VisualTransectPoints", []), f"{what}: VisualTransectPoints")
    places = [source.place(point, f"{what}.{k}") for k, point in enumerate(points, 1)]
    return [MavItem(f"{what}.{k}", number + k, WAYPOINT, 3, (0, 0, 0, None, *place, 0)) for k, place in enumerate(places, 1)]


def _fences(given: dict[str, Any], source: Source) -> Iterator[Fence]:
    for k, entry in enumerate(source.rows(given.get("polygons", []), "geoFence.polygons"), 1):
        what = f"fence polygon {k}"
        polygon = source.mapping(entry, what)
        corners = [source.place(corner, what) for corner in source.rows(polygon.get("polygon"), what)]
        if len(corners) < 3:
            raise source.error(f"{what} must have at least 3 corners (got {len(corners)})")
        yield Fence(tuple(corners), _inclusion(polygon, what, source), what)
    for k, entry in enumerate(source.rows(given.get("circles", []), "geoFence.circles"), 1):
        what = f"fence circle {k}"
        outer = source.mapping(entry, what)
        circle = source.mapping(outer.get("circle"), what)
        radius = source.number(circle.get("radius"), f"{what}: radius", 1e-3, 1e7)
        yield Fence((source.place(circle.get("center"), what),), _inclusion(outer, what, source), what, radius)


def _inclusion(fence: dict[str, Any], what: str, source: Source) -> bool:
    """Whether to stay inside; a fence of which that is not known is of no use."""
    inside = fence.get("inclusion")
    if not isinstance(inside, bool):
        raise source.error(f"{what}: inclusion must be true or false (got {inside})")
    return inside


def read_cockpit(document: dict[str, Any], source: Source) -> Mission:
    """The mission of a file by Cockpit; its cruise speed is that of the legs without one.

    Raises ScenarioError if it is not complete, or a value of it is of another kind or out of range.
    """
    settings = source.mapping(document.get("settings", {}), "settings")
    cruise, items = settings.get("defaultCruiseSpeed"), []
    if cruise is not None:
        speed = source.number(cruise, "settings.defaultCruiseSpeed", 0.0, 100.0)
        items += [MavItem("settings.defaultCruiseSpeed", -1, SPEED, 2, (1, speed, -1, 0, 0, 0, 0))] if speed else []
    for k, entry in enumerate(source.rows(document.get("waypoints"), "waypoints"), 1):
        what = f"waypoint {k}"
        waypoint = source.mapping(entry, what)
        place = source.place(waypoint.get("coordinates"), what)
        commands = source.rows(waypoint.get("commands", [waypoint]), f"{what}: commands")
        if not commands:
            raise source.error(f"{what}: commands must not be empty (got no command)")
        for j, one in enumerate(commands, 1):
            label = what if len(commands) == 1 else f"{what}.{j}"
            items.append(_cockpit_item(source.mapping(one, label), place, label, len(items), source))
    return mission_of(items, source)


def _cockpit_item(command: dict[str, Any], place: tuple[float, float], what: str, number: int, source: Source) -> MavItem:
    given = command.get("command", WAYPOINT)
    if isinstance(given, dict):
        given = given.get("type")
    params = [command.get(f"param{k}", 0 if k < 4 else None) for k in range(1, 5)]
    params = [source.parameter(value, f"{what}: parameters") for value in params]
    if isinstance(given, str) and not re.fullmatch(r"\d+", given):
        if given not in COMMANDS:
            return MavItem(what, number, -1, 3, (*params, *place, 0))
        given = COMMANDS[given]
    return MavItem(what, number, source.whole(given, f"{what}: command", 0, MAX_COMMAND), 3, (*params, *place, 0))
