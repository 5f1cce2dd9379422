"""Missions as lines of text, `QGC WPL 110`: .waypoints and .txt files by Mission Planner, MAVProxy and others.

Format: https://mavlink.io/en/file_formats/. The item with number 0 is the home of the autopilot, not a waypoint.
"""

from dataclasses import replace

from vessel_hsmc_ros.boats.missions.mavlink_items import GLOBAL_FRAMES, WAYPOINT, MavItem, mission_of
from vessel_hsmc_ros.boats.missions.mission import MAX_POINTS, Mission, Refused, Source

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
