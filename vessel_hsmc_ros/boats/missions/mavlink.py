"""Mission items of MAVLink as waypoints: which commands a surface vessel sails, which leave it alone, and which are refused.

| command | meaning for the vessel |
|---|---|
| 16 NAV_WAYPOINT | a leg to it; with param1 > 0 a hold of so many seconds |
| 17 NAV_LOITER_UNLIM | a leg to it, and rest there: only as the last |
| 19 NAV_LOITER_TIME | a leg to it, and a hold of param1 seconds |
| 93 NAV_DELAY | a hold of param1 seconds at the waypoint before |
| 178 DO_CHANGE_SPEED | param2 is the speed of the legs from here on, m/s; relative ones (param4) are refused |
| 177 DO_JUMP | the items from number param1 on, param2 times more |
| autocontinue 0 of any | rest there, as nothing continues the mission: only with the last waypoint |
| 5001 to 5004, 5100 | fence and rally points |

Numbers and parameters: MAVLink common message set, MAV_CMD and MAV_FRAME (https://mavlink.io/en/messages/common.html). The yaw
of a waypoint is taken where the vessel holds; 0, 999 and no number are none, as planners write them. Altitudes and radii are not
used.

They are lines of .waypoints, or JSON by QGroundControl (.plan:
https://docs.qgroundcontrol.com/master/en/qgc-dev-guide/file_formats/plan.html) and Cockpit (.cpm, .json; type CockpitMission).
"""

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

from vessel_hsmc_ros.boats.missions.mission import MAX_POINTS, Fence, Mission, MissionPoint, Pair, Refused, Source

WAYPOINT, LOITER, LOITER_TIME, DELAY, JUMP, SPEED = 16, 17, 19, 93, 177, 178

GLOBAL_FRAMES = (0, 3, 5, 6, 10, 11)  # frames with latitude and longitude, which differ in the altitude
REFUSED = {
    18: ("NAV_LOITER_TURNS", "circles are not legs; give the circle as waypoints"),
    20: ("NAV_RETURN_TO_LAUNCH", "the way home is not in the file; give it as waypoints"),
    21: ("NAV_LAND", "a surface vessel does not land; rest at the last waypoint is usual"),
    22: ("NAV_TAKEOFF", "a surface vessel does not take off; a waypoint would do"),
    30: ("NAV_CONTINUE_AND_CHANGE_ALT", "a surface vessel has no altitude"),
    31: ("NAV_LOITER_TO_ALT", "a surface vessel has no altitude"),
    82: ("NAV_SPLINE_WAYPOINT", "the spline depends on the autopilot; waypoints along it would do"),
    84: ("NAV_VTOL_TAKEOFF", "a surface vessel does not take off"),
    85: ("NAV_VTOL_LAND", "a surface vessel does not land"),
    92: ("NAV_GUIDED_ENABLE", "nothing else steers within a mission"),
    94: ("NAV_PAYLOAD_PLACE", "it has no payload to place"),
    112: ("CONDITION_DELAY", "conditions are not kept; a hold (NAV_DELAY) would do"),
    113: ("CONDITION_CHANGE_ALT", "a surface vessel has no altitude"),
    114: ("CONDITION_DISTANCE", "conditions are not kept; a waypoint there would do"),
    115: ("CONDITION_YAW", "a heading is kept at a hold only: give it as the yaw of a held waypoint"),
    189: ("DO_LAND_START", "a surface vessel does not land"),
    194: ("DO_SET_REVERSE", "legs are sailed ahead"),
    601: ("DO_JUMP_TAG", "jumps are to numbers of items (DO_JUMP)"),
}
"""Commands that would move the vessel otherwise: name and reason."""

LEFT_OUT = {
    **dict.fromkeys((195, 196, 197, 201, 204, 205, 1000, 1001), "a camera mount"),
    **dict.fromkeys((200, 202, 203, 206, 214, 530, 531, 532, 534, 2000, 2001, 2003, 2500, 2501, 2502, 2503), "a camera"),
    **dict.fromkeys((181, 182), "a relay"),
    **dict.fromkeys((183, 184), "a servo"),
    **dict.fromkeys((207, 208, 209, 210, 211, 212, 216, 217, 218, 222, 223), "equipment of the autopilot"),
    179: "the home of the autopilot",
    600: "the mark of a jump",
    5000: "the return point of a fence",
}
"""Commands that do not move the vessel, and what they are for."""

FENCES = {5001: True, 5002: False, 5003: True, 5004: False}
"""Commands of the corners of polygons and of circles, and whether to stay inside."""

MAX_REPEATS = 100


class MavItem(NamedTuple):
    """A mission item: what error messages call it, its number that jumps name, command, frame, and its seven parameters.

    `continues`: whether the next item follows by itself.
    """

    item: str
    number: int
    command: int
    frame: int
    params: tuple[float | None, ...]
    continues: bool = True


class _Reader:
    """What has been read of a sequence of items."""

    def __init__(self, source: Source) -> None:
        self.source = source
        self.points: list[MissionPoint] = []
        self.fences: list[Fence] = []
        self.rally: list[Pair] = []
        self.refused: list[Refused] = []
        self.left_out: list[Refused] = []
        self.speed = 0.0
        self.ended = ""
        self.corners_left = 0

    def read(self, one: MavItem) -> None:
        """Take the next item."""
        if one.command in (WAYPOINT, LOITER, LOITER_TIME):
            self._waypoint(one)
        elif one.command == DELAY:
            self._delay(one)
        elif one.command == SPEED:
            self._change_speed(one)
        elif one.command in FENCES:
            self._fence(one)
        elif one.command == 5100:
            self.rally.append(self._place(one))
        elif one.command in LEFT_OUT or (one.command == 194 and not one.params[0]):
            why = LEFT_OUT.get(one.command, "sailing ahead, as always")
            self.left_out.append(Refused(one.item, f"command {one.command}", f"it is for {why}"))
        else:
            name, why = REFUSED.get(one.command, ("", "it is not known here"))
            self.refused.append(Refused(one.item, f"command {one.command} {name}".rstrip(), why))
        if not (one.continues or one.command in (*FENCES, 5100) or self.ended):
            self.ended = f"the pause of {one.item} (autocontinue off)"
            self.points[-1:] = [point._replace(corner="stop") for point in self.points[-1:]]

    def _place(self, one: MavItem) -> Pair:
        return self.source.degrees(one.params[4], one.params[5], one.item)

    def _waypoint(self, one: MavItem) -> None:
        what = f"command {one.command}"
        if one.frame not in GLOBAL_FRAMES:
            known = ", ".join(map(str, GLOBAL_FRAMES))
            why = f"it needs a latitude and a longitude (frames {known}): the origin of other frames is not in the file"
            self.refused.append(Refused(one.item, f"{what} in frame {one.frame}", why))
            return
        if self.ended:
            self.refused.append(Refused(one.item, what, f"{self.ended} before it has no end, so it is never reached"))
            return
        hold = 0.0
        if one.command != LOITER:
            hold = self.source.number(one.params[0] or 0.0, f"{one.item}: hold (param1)", 0.0, 1e6)
        if one.command == LOITER:
            self.ended = f"the hold of {one.item}"
        yaw = None if one.command == LOITER_TIME else one.params[3]
        heading = None if yaw in (None, 0.0, 999.0) else math.radians(90.0 - yaw)
        place, corner = self._place(one), "stop" if hold or one.command == LOITER else "through"
        if place == (0.0, 0.0) and self.points and one.command != WAYPOINT:  # to loiter at 0, 0 is to loiter on the spot
            last = self.points[-1]
            self.points[-1] = last._replace(
                hold=last.hold + hold, corner="stop", heading=last.heading if heading is None else heading
            )
            return
        self.points.append(MissionPoint(place, one.item, self.speed, hold, heading, corner))

    def _delay(self, one: MavItem) -> None:
        seconds = one.params[0]
        if seconds is None or seconds < 0.0 or not self.points:
            why = "it needs seconds in param1, and a waypoint before it; a time of the day is not waited for"
            self.refused.append(Refused(one.item, "command 93 NAV_DELAY", why))
            return
        last = self.points[-1]
        self.points[-1] = last._replace(hold=last.hold + seconds, corner="stop" if seconds else last.corner)

    def _change_speed(self, one: MavItem) -> None:
        kind, speed, _, relative = one.params[:4]
        if relative:
            why = "it is relative to a speed of the autopilot; give it in m/s"
            self.refused.append(Refused(one.item, "command 178 DO_CHANGE_SPEED", why))
        elif kind not in (0.0, 1.0):  # of climbing and descending
            self.left_out.append(Refused(one.item, "command 178", "it is for a vertical speed"))
        elif speed is None or speed in (-1.0, -2.0):  # no change, and back to the usual speed
            self.speed = 0.0 if speed == -2.0 else self.speed
        else:
            self.speed = self.source.number(speed, f"{one.item}: speed (param2)", 1e-3, 100.0)

    def _fence(self, one: MavItem) -> None:
        inside, place = FENCES[one.command], self._place(one)
        if one.command in (5003, 5004):
            radius = self.source.number(one.params[0], f"{one.item}: radius (param1)", 1e-3, 1e5)
            self.fences.append(Fence((place,), inside, one.item, radius))
            return
        count = self.source.whole(one.params[0], f"{one.item}: number of corners (param1)", 3, MAX_POINTS)
        if self.corners_left:
            last = self.fences[-1]
            self.fences[-1] = last._replace(corners=(*last.corners, place))
        else:
            self.corners_left = count
            self.fences.append(Fence((place,), inside, one.item))
        self.corners_left -= 1


def mission_of(items: Sequence[MavItem], source: Source) -> Mission:
    """The mission of a sequence of items. Raises ScenarioError if a place, speed or hold is no number, or out of range."""
    reader = _Reader(source)
    for one in _unrolled(items, reader):
        reader.read(one)
    if reader.corners_left:
        raise source.error(f"{reader.fences[-1].item}: its fence must have all its corners (got {reader.corners_left} too few)")
    return Mission(
        tuple(reader.points),
        True,
        tuple(reader.fences),
        tuple(reader.rally),
        refused=tuple(reader.refused),
        left_out=tuple(reader.left_out),
    )


def _unrolled(items: Sequence[MavItem], reader: _Reader) -> list[MavItem]:
    """The items in the order in which they are sailed: jumps back are repetitions."""
    index: dict[float | None, int] = {one.number: i for i, one in enumerate(items)}
    done: list[MavItem] = []
    i, left = 0, dict[int, int]()
    while i < len(items):
        one = items[i]
        i += 1
        if one.command != JUMP:
            done.append(one)
            if len(done) > MAX_POINTS:
                raise reader.source.error(f"its jumps must not give more than {MAX_POINTS} items (got more at {one.item})")
            continue
        target, repeats = one.params[:2]
        to = index.get(target)
        if to is None or to >= i - 1 or repeats not in range(MAX_REPEATS + 1):
            why = f"it needs the number of an item before it and 0 to {MAX_REPEATS} repetitions"
            given = f"command 177 DO_JUMP to {target or 0:g}, {repeats or 0:g} times"
            reader.refused.append(Refused(one.item, given, why))
            continue
        if left.setdefault(i, int(repeats or 0)) > 0:
            left[i] -= 1
            i = to
        else:
            del left[i]  # the next pass of an outer jump begins it anew
    return done


HEAD = "QGC WPL"

VERSIONS = ("110", "120")


def read_lines(text: str, source: Source) -> Mission:
    """The mission of such a file. Raises ScenarioError if a line is not of twelve numbers, or a number is out of range."""
    head, *lines = text.splitlines()
    if head.split()[2:] not in ([version] for version in VERSIONS):
        raise source.error(f"line 1 must be {HEAD} {' or '.join(VERSIONS)} (got {head[:40]})")
    items = [
        _item(line, number, source) for number, line in enumerate(lines, 2) if line.strip() and not line.lstrip().startswith("#")
    ]
    if len(items) > MAX_POINTS:
        raise source.error(f"it must have at most {MAX_POINTS} items (got {len(items)})")
    home, count = None, len(items)
    if items and items[0].number == 0 and items[0].command == WAYPOINT and items[0].frame in GLOBAL_FRAMES:
        place = source.degrees(items[0].params[4], items[0].params[5], "item 0")
        home, items = place if place != (0.0, 0.0) else None, items[1:]
    found = mission_of(items, source)
    noted = (Refused("item 0", "command 16", "it is the home of the autopilot, not a waypoint"),) if len(items) < count else ()
    return replace(found, home=home, left_out=noted + found.left_out)


def _item(line: str, number: int, source: Source) -> MavItem:
    cells = line.split()
    if len(cells) != 12:
        raise source.error(f"line {number} must have 12 numbers (got {len(cells)})")
    index, _, frame, command = (source.whole(cell, f"line {number}", 0, 65535) for cell in cells[:4])
    params = tuple(source.parameter(cell, f"line {number}") for cell in cells[4:11])
    continues = source.number(cells[11], f"line {number}: autocontinue") != 0.0
    return MavItem(f"item {index}", index, command, frame, params, continues)


SURVEYS = ("survey", "CorridorScan")  # complex items that are legs of waypoints
MAX_COMMAND = 65535

COMMANDS = {f"MAV_CMD_{name}": number for number, (name, _) in REFUSED.items()} | {
    "MAV_CMD_NAV_WAYPOINT": WAYPOINT,
    "MAV_CMD_NAV_LOITER_UNLIM": LOITER,
    "MAV_CMD_NAV_LOITER_TIME": LOITER_TIME,
    "MAV_CMD_NAV_DELAY": DELAY,
    "MAV_CMD_DO_JUMP": JUMP,
    "MAV_CMD_DO_CHANGE_SPEED": SPEED,
    "MAV_CMD_DO_SET_HOME": 179,
    "MAV_CMD_DO_SET_RELAY": 181,
    "MAV_CMD_DO_SET_SERVO": 183,
    "MAV_CMD_DO_SET_CAM_TRIGG_DIST": 206,
    "MAV_CMD_IMAGE_START_CAPTURE": 2000,
}
"""Commands by their names, which Cockpit writes."""


def read_plan(document: dict[str, Any], source: Source) -> Mission:
    """The mission of a .plan file."""
    source.whole(document.get("version", 1), "version", 1, 1)
    mission = source.mapping(document.get("mission"), "mission")
    source.whole(mission.get("version", 2), "mission.version", 1, 2)
    read = [*_plan_items(mission, source)]
    refused = tuple(item for item in read if isinstance(item, Refused))
    found = mission_of([item for item in read if isinstance(item, MavItem)], source)
    home = mission.get("plannedHomePosition")
    fences, rally = document.get("geoFence"), source.mapping(document.get("rallyPoints") or {}, "rallyPoints")
    harbours = enumerate(source.rows(rally.get("points", []), "rallyPoints.points"), 1)
    return replace(
        found,
        refused=refused + found.refused,
        home=None if home is None else source.place(home, "plannedHomePosition"),
        fences=() if fences is None else tuple(_fences(source.mapping(fences, "geoFence"), source)),
        rally=tuple(source.place(point, f"rally point {k}") for k, point in harbours),
    )


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
    numbers = tuple(source.parameter(value, f"{what}: params") for value in params)
    return MavItem(what, jump, command, frame, numbers, item.get("autoContinue") not in (False, 0))


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
    """The mission of a file by Cockpit; its cruise speed is that of the legs without one."""
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
