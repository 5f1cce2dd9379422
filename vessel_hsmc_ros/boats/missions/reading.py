"""Reading a mission file, whatever its format: that is known by its content."""

import json
from pathlib import Path
from typing import Any

from vessel_hsmc_ros.boats.missions.geojson_file import TYPES, read_geojson
from vessel_hsmc_ros.boats.missions.gpx_file import read_gpx
from vessel_hsmc_ros.boats.missions.mavlink_items import HEAD, read_lines
from vessel_hsmc_ros.boats.missions.mission import Mission, Source, with_stops
from vessel_hsmc_ros.boats.missions.plan_file import read_cockpit, read_plan
from vessel_hsmc_ros.boats.missions.table_file import read_table
from vessel_hsmc_ros.core.exceptions import ScenarioError
from vessel_hsmc_ros.scenario.parameters_file import in_one_line

FORMATS = "QGroundControl's .plan, .waypoints, Cockpit's missions, GPX, GeoJSON and CSV"


def read_mission(path: Path, route: str | None = None) -> Mission:
    """Read a mission.

    `route`: name of the route, of several in a GPX or GeoJSON file. Raises ScenarioError if it cannot be read, or is of another
    format, or a value of it is of another kind or out of range; the message names the item.
    """
    source = Source(f"mission file {path}")
    try:
        content = path.read_bytes()
    except OSError as error:
        raise ScenarioError(f"{source.title} cannot be read: {in_one_line(error)}") from None
    start = content[:200].lstrip(b"\xef\xbb\xbf \t\r\n")
    if start.startswith((b"<", b"\xff\xfe", b"\xfe\xff")):
        return with_stops(read_gpx(content, source, route))
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise source.error(f"it must be text in UTF-8 (got {in_one_line(error)})") from None
    if start.startswith((b"{", b"[")):
        return with_stops(_of_json(text, source, route))
    if route is not None:
        raise source.error(f"--route must be given with a GPX or GeoJSON file only (got {route})")
    if start.startswith(HEAD.encode()):
        return with_stops(read_lines(text.lstrip(), source))
    return with_stops(read_table(text, source))


def _of_json(text: str, source: Source, route: str | None) -> Mission:
    try:
        document: Any = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise source.error(f"it is not JSON: {in_one_line(error)}") from None
    document = source.mapping(document, "it")
    if document.get("type") in TYPES:
        return read_geojson(document, source, route)
    if route is not None:
        raise source.error(f"--route must be given with a GPX or GeoJSON file only (got {route})")
    if document.get("fileType") == "Plan":
        return read_plan(document, source)
    if "waypoints" in document and "settings" in document:
        return read_cockpit(document, source)
    raise source.error(
        f"it must be of a known format: {FORMATS} (got JSON with {', '.join(map(str, [*document][:8])) or 'nothing'})"
    )
