"""Mission items of MAVLink as waypoints: which commands a surface vessel sails, which leave it alone, and which are refused.

| command | meaning for the vessel |
|---|---|
| 16 NAV_WAYPOINT | a leg to it; with param1 > 0 a hold of so many seconds |
| 17 NAV_LOITER_UNLIM | a leg to it, and rest there: only as the last |
| 19 NAV_LOITER_TIME | a leg to it, and a hold of param1 seconds |
| 93 NAV_DELAY | a hold of param1 seconds at the waypoint before |
| 178 DO_CHANGE_SPEED | param2 is the speed of the legs from here on, m/s |
| 177 DO_JUMP | the items from number param1 on, param2 times more |
| 5001 to 5004, 5100 | fence and rally points |

Numbers and parameters: MAVLink common message set, MAV_CMD and MAV_FRAME (https://mavlink.io/en/messages/common.html). The yaw
of a waypoint is taken where the vessel holds; 0, 999 and no number are none, as planners write them. Altitudes and radii are not
used.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

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
    """A mission item: what error messages call it, its number that jumps name, command, frame, and its seven parameters."""

    item: str
    number: int
    command: int
    frame: int
    params: tuple[float | None, ...]


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

    def _place(self, one: MavItem) -> Pair:
        return self.source.degrees(one.params[4], one.params[5], one.item)

    def _waypoint(self, one: MavItem) -> None:
        what = f"command {one.command}"
        if one.frame not in GLOBAL_FRAMES:
            known = ", ".join(map(str, GLOBAL_FRAMES))
            why = f"it takes a latitude and a longitude (frames {known}): the origin of other frames is not in the file"
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
            why = "it takes seconds in param1, and a waypoint before it; a time of the day is not waited for"
            self.refused.append(Refused(one.item, "command 93 NAV_DELAY", why))
            return
        last = self.points[-1]
        self.points[-1] = last._replace(hold=last.hold + seconds, corner="stop" if seconds else last.corner)

    def _change_speed(self, one: MavItem) -> None:
        kind, speed = one.params[:2]
        if kind not in (0.0, 1.0):  # of climbing and descending
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
    index = {one.number: i for i, one in enumerate(items)}
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
        to = None if target is None else index.get(int(target))
        if to is None or to >= i - 1 or repeats is None or not 0 <= repeats <= MAX_REPEATS:
            why = f"it takes the number of an item before it and 0 to {MAX_REPEATS} repetitions"
            given = f"command 177 DO_JUMP to {target or 0:g}, {repeats or 0:g} times"
            reader.refused.append(Refused(one.item, given, why))
            continue
        if left.setdefault(i, int(repeats)) > 0:
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
    return MavItem(f"item {index}", index, command, frame, params)
