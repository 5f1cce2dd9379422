"""Waypoints by named values: the columns of a table, and the properties of a GeoJSON point."""

import math
from collections.abc import Mapping
from typing import Any

from vessel_hsmc_ros.boats.missions.mission import CORNERS, KNOT, MissionPoint, Pair, Source

SPEEDS = {"speed": 1.0, "speed_kn": KNOT}
HEADINGS = ("heading", "heading_deg", "compass_deg")
"""Counter-clockwise from east or x, rad and degrees, and clockwise from north, degrees."""

NAMES = (*SPEEDS, "hold", *HEADINGS, "corner", "name")  # what a waypoint may have besides its place


def with_properties(place: Pair, item: str, values: Mapping[str, Any], source: Source) -> MissionPoint:
    """A waypoint with what is named; an empty text is nothing.

    Raises ScenarioError if a value is of another kind or out of range, or two name the same thing.
    """
    given = {name: value for name, value in values.items() if value is not None and str(value).strip() != ""}
    for group in (tuple(SPEEDS), HEADINGS):
        if len(twice := [name for name in group if name in given]) > 1:
            raise source.error(f"{item} must have one of {', '.join(group)} (got {' and '.join(twice)})")
    speed = sum(
        unit * source.number(given[name], f"{item}: {name}", 0.0, 200.0) for name, unit in SPEEDS.items() if name in given
    )
    hold = source.number(given.get("hold", 0.0), f"{item}: hold", 0.0, 1e6)
    heading = next((_heading(name, source.number(given[name], f"{item}: {name}")) for name in HEADINGS if name in given), None)
    corner = str(given.get("corner", "through")).strip()
    if corner not in CORNERS:
        raise source.error(f"{item}: corner must be {', '.join(CORNERS)} (got {corner[:40]})")
    return MissionPoint(place, item, speed, hold, heading, corner, str(given.get("name", "")).strip())


def _heading(name: str, value: float) -> float:
    """A heading counter-clockwise from east or x, rad."""
    if name == "heading":
        return value
    return math.radians(value if name == "heading_deg" else 90.0 - value)
