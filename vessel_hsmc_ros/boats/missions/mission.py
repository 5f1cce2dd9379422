"""What a mission file holds: waypoints with speeds, holds and headings, fences, rally points, and what cannot be sailed."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

from vessel_hsmc_ros.core.exceptions import ScenarioError
from vessel_hsmc_ros.core.kinematics import TURN
from vessel_hsmc_ros.core.quantities import number_of

Pair = tuple[float, float]  # latitude and longitude, degrees, or x and y, m
CORNERS = ("through", "over", "stop")

KNOT = 1852.0 / 3600.0  # m/s
MAX_POINTS = 20_000  # waypoints of the largest mission; the reference plans some thousands in seconds


class MissionPoint(NamedTuple):
    """A waypoint."""

    place: Pair  # where it is
    item: str  # what it is in its file, such as `item 5`
    speed: float = 0.0  # on the leg to it, m/s; 0 for the usual one
    hold: float = 0.0  # time at rest there, s
    heading: float | None = None  # at rest there, rad, counter-clockwise from east or x; None for any
    corner: str = "through"  # one of `CORNERS`
    name: str = ""  # empty for none


class Fence(NamedTuple):
    """An area to stay in, or to stay out of: a polygon, or a circle about its one corner with a radius above 0, m."""

    corners: tuple[Pair, ...]
    inside: bool
    item: str
    radius: float = 0.0


class Refused(NamedTuple):
    """An item that cannot be sailed, with the reason."""

    item: str
    what: str
    why: str

    def __str__(self) -> str:
        return f"{self.item}: {self.what}: {self.why}"


@dataclass(frozen=True)
class Mission:
    """A mission as its file has it."""

    points: tuple[MissionPoint, ...] = ()  # the waypoints
    geographic: bool = True  # whether places are latitudes and longitudes, not metres
    # fences, rally: areas, and places to return to
    fences: tuple[Fence, ...] = ()
    rally: tuple[Pair, ...] = ()
    areas: tuple[Fence, ...] = ()  # polygons that are neither fence nor route: they can be surveyed
    refused: tuple[Refused, ...] = ()  # items that cannot be sailed
    left_out: tuple[Refused, ...] = ()  # items that do not move the vessel, such as those of a camera
    home: Pair | None = None  # of the planner; None where it has none
    routes: tuple[str, ...] = field(default=())  # names of all routes of the file


def with_stops(mission: Mission) -> Mission:
    """A mission whose holds are stops, and whose headings are at stops: others are refused.

    The last waypoint is a stop: the vessel comes to rest there.
    """
    points, refused = [], []
    for number, point in enumerate(mission.points, 1):
        if point.hold:
            point = point._replace(corner="stop")
        if point.heading is not None and point.corner != "stop" and number < len(mission.points):
            degrees = f"heading {math.degrees(point.heading):.0f}°"
            refused.append(Refused(point.item, degrees, "a vessel under way points along its course; a hold there would do"))
            point = point._replace(heading=None)
        points.append(point)
    return replace(mission, points=tuple(points), refused=(*mission.refused, *refused))


class Source:
    """A file whose values are checked as they are read. `title`: what error messages call it, such as `mission file a.plan`."""

    def __init__(self, title: str) -> None:
        self.title = title

    def error(self, message: str) -> ScenarioError:
        """An error of this file."""
        return ScenarioError(f"{self.title}: {message}")

    def number(self, value: Any, what: str, low: float = -math.inf, high: float = math.inf) -> float:
        """A finite number within a range, also from a text. Raises ScenarioError if it is none, or out of range."""
        try:
            found = math.nan if isinstance(value, bool) or value is None else number_of(str(value).strip())
        except (ValueError, OverflowError):
            found = math.nan
        if not (math.isfinite(found) and low <= found <= high):
            ranged = f" from {low:g} to {high:g}" if math.isfinite(low) and math.isfinite(high) else ""
            ranged = ranged or (f" of at least {low:g}" if math.isfinite(low) else "")
            raise self.error(f"{what} must be a finite number{ranged} (got {_shown(value)})")
        return found

    def whole(self, value: Any, what: str, low: int, high: int) -> int:
        """A whole number within a range. Raises ScenarioError if it is none, or out of range."""
        found = self.number(value, what, low, high)
        if not found.is_integer():
            raise self.error(f"{what} must be a whole number (got {_shown(value)})")
        return int(found)

    def parameter(self, value: Any, what: str) -> float | None:
        """A number; None where it is not set, which programs write as null or NaN."""
        unset = value is None or (isinstance(value, float) and math.isnan(value)) or str(value).lower() in ("", "nan", "-nan")
        return None if unset else self.number(value, what)

    def place(self, value: Any, what: str) -> Pair:
        """A latitude and a longitude, degrees, from a list that begins with them. Raises ScenarioError if it is none."""
        if not isinstance(value, Sequence) or isinstance(value, str) or len(value) < 2:
            raise self.error(f"{what} must be a list of latitude and longitude (got {_shown(value)})")
        return self.degrees(value[0], value[1], what)

    def degrees(self, latitude: Any, longitude: Any, what: str) -> Pair:
        """A latitude and a longitude, degrees. Raises ScenarioError if one is no number, or out of range."""
        north = self.number(latitude, f"{what}: latitude")
        east = self.number(longitude, f"{what}: longitude")
        if not (abs(north) < 90.0 and abs(east) <= 180.0):
            swapped = "; are they exchanged?" if abs(east) < 90.0 and abs(north) <= 180.0 else ""
            raise self.error(
                f"{what}: latitude and longitude must be within -90 and 90, and -180 and 180 degrees"
                f" (got {north:g}, {east:g}{swapped})"
            )
        return north, east

    def mapping(self, value: Any, what: str) -> dict[str, Any]:
        """A JSON object. Raises ScenarioError if it is none."""
        if not isinstance(value, dict):
            raise self.error(f"{what} must be an object (got {_shown(value)})")
        return value

    def rows(self, value: Any, what: str) -> list[Any]:
        """A JSON list. Raises ScenarioError if it is none, or too long."""
        if not isinstance(value, list):
            raise self.error(f"{what} must be a list (got {_shown(value)})")
        if len(value) > MAX_POINTS:
            raise self.error(f"{what} must have at most {MAX_POINTS} entries (got {len(value)})")
        return value

    def chosen(self, names: Iterable[str], route: str | None) -> int:
        """The number of the route to read of several."""
        known = list(names)
        shown = ", ".join(known[:20]) + (", ..." if len(known) > 20 else "")
        if route is None and len(known) > 1:
            raise self.error(f"it has {len(known)} routes, of which --route NAME chooses one: {shown}")
        if route is not None and known.count(route) != 1:
            raise self.error(f"--route must be one of its routes {shown or '(it has none)'} (got {route})")
        return known.index(route) if route is not None else 0


def _shown(value: Any) -> str:
    text = "nothing" if value is None else str(value)
    return text if len(text) <= 60 else f"{text[:60]} ..."


SPEEDS = {"speed": 1.0, "speed_kn": KNOT}
HEADINGS: dict[str, Callable[[float], float]] = {
    "heading": lambda rad: rad,
    "heading_deg": math.radians,
    "compass_deg": lambda degrees: math.radians(90.0 - degrees),
}
"""Counter-clockwise from east or x, rad and degrees, and clockwise from north, degrees: each in rad from east."""

NAMES = (*SPEEDS, "hold", *HEADINGS, "corner", "name")  # what a waypoint may have besides its place


def with_properties(place: Pair, item: str, values: Mapping[str, Any], source: Source) -> MissionPoint:
    """A waypoint with what is named; an empty text is nothing."""
    given = {name: value for name, value in values.items() if value is not None and str(value).strip() != ""}
    for group in (SPEEDS, HEADINGS):
        if len(twice := [name for name in group if name in given]) > 1:
            raise source.error(f"{item} must have one of {', '.join(group)} (got {' and '.join(twice)})")
    speed = sum(
        unit * source.number(given[name], f"{item}: {name}", 0.0, 200.0) for name, unit in SPEEDS.items() if name in given
    )
    hold = source.number(given.get("hold", 0.0), f"{item}: hold", 0.0, 1e6)
    if "heading" in given:  # degrees are mostly beyond the range of radians
        source.number(given["heading"], f"{item}: heading, in radians, for degrees heading_deg or compass_deg,", -TURN, TURN)
    headings = [turned(source.number(given[name], f"{item}: {name}")) for name, turned in HEADINGS.items() if name in given]
    corner = str(given.get("corner", "through")).strip()
    if corner not in CORNERS:
        raise source.error(f"{item}: corner must be {', '.join(CORNERS)} (got {corner[:40]})")
    return MissionPoint(place, item, speed, hold, headings[0] if headings else None, corner, str(given.get("name", "")).strip())
