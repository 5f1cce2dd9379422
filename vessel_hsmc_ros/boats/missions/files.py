"""Reading a mission file, whatever its format: that is known by its content.

Tables are CSV with a row of names. GPX 1.0 and 1.1 (https://www.topografix.com/GPX/1/1/) is that of OpenCPN and other chart
plotters, whose planned speed is in knots; speeds and times of a track are those of a recording. In GeoJSON (RFC 7946) lines are
routes, points are waypoints in their order, and polygons areas to survey or, with the property `fence`, fences.
"""

import csv
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, ParseError

from vessel_hsmc_ros.boats.missions.mavlink import HEAD, read_cockpit, read_lines, read_plan
from vessel_hsmc_ros.boats.missions.mission import (
    KNOT,
    MAX_POINTS,
    NAMES,
    SPEEDS,
    Fence,
    Mission,
    MissionPoint,
    Pair,
    Refused,
    Source,
    with_properties,
    with_stops,
)
from vessel_hsmc_ros.core.exceptions import ScenarioError
from vessel_hsmc_ros.scenario.parameters_file import in_one_line

PLACES = {
    **dict.fromkeys(("latitude", "lat"), "latitude"),
    **dict.fromkeys(("longitude", "lon", "lng", "long"), "longitude"),
    **dict.fromkeys(("x", "east"), "x"),
    **dict.fromkeys(("y", "north"), "y"),
}
"""Columns of places: metres to the east and north, or degrees."""

UNUSED = ("z", "altitude", "alt", "number")

SEPARATORS = ",;\t"

FORM = (
    f"a row of names: latitude and longitude in degrees, or x and y in metres, and perhaps {', '.join(NAMES)};"
    f" {', '.join(UNUSED)} are not used"
)

FARTHEST = 1e6


def read_table(text: str, source: Source) -> Mission:
    """The mission of a table. Raises ScenarioError if a column is unknown or missing, or a value is no number or out of range."""
    lines = [(number, line) for number, line in enumerate(text.splitlines(), 1) if line.strip() and not line.startswith("#")]
    if not lines:
        raise source.error("it is empty")
    (first, head), *rows = lines
    separator = max(SEPARATORS, key=head.count)
    try:
        columns = _columns([cell.strip() for cell in next(csv.reader([head], delimiter=separator))], first, source)
        cells = [(n, next(csv.reader([line], delimiter=separator, skipinitialspace=True))) for n, line in rows]
    except csv.Error as error:
        raise source.error(f"it is no table: {error}") from None
    if len(cells) > MAX_POINTS:
        raise source.error(f"it must have at most {MAX_POINTS} rows (got {len(cells)})")
    return Mission(tuple(_row(columns, row, f"line {n}", source) for n, row in cells), "latitude" in columns)


def _columns(names: list[str], line: int, source: Source) -> list[str]:
    """What each column is. Raises ScenarioError as `read_table`."""
    columns = [PLACES.get(name.lower(), name.lower()) for name in names]
    unknown = [name for name, column in zip(names, columns, strict=True) if column not in (*PLACES, *NAMES, *UNUSED)]
    places = {"latitude", "longitude"} & {*columns}, {"x", "y"} & {*columns}
    if unknown or len({*columns}) < len(columns) or sorted(map(len, places)) != [0, 2]:
        shown = ", ".join(names)
        raise source.error(f"line {line} must be {FORM} (got {shown[:200]})")
    return columns


def _row(columns: list[str], row: list[str], item: str, source: Source) -> MissionPoint:
    if len(row) != len(columns):
        raise source.error(f"{item} must have {len(columns)} values (got {len(row)})")
    values = dict(zip(columns, row, strict=True))
    if "latitude" in values:
        place = source.degrees(values["latitude"], values["longitude"], item)
    else:
        place = tuple(source.number(values[name], f"{item}: {name}", -FARTHEST, FARTHEST) for name in ("x", "y"))  # type: ignore[assignment]
    return with_properties(place, item, {name: values[name] for name in NAMES if name in values}, source)


def read_gpx(content: bytes, source: Source, route: str | None = None) -> Mission:
    """One route or track of a file."""
    from defusedxml import DefusedXmlException  # here: the command shows its help without the libraries of its verbs
    from defusedxml.ElementTree import fromstring

    try:
        root = fromstring(content)
    except DefusedXmlException as error:
        raise source.error(f"it must be XML without entities (got {type(error).__name__})") from None
    except (ParseError, ValueError, LookupError) as error:  # ValueError and LookupError: of encodings
        raise source.error(f"it is not XML: {in_one_line(error)}") from None
    if _local(root) != "gpx":
        raise source.error(f"it must be a GPX file, whose root is gpx (got {_local(root)})")
    routes = _routes(root)
    marks = [child for child in root if _local(child) == "wpt"]
    why = "a single mark is no part of a route"
    left_out = tuple(Refused(f"mark {k}", _text(mark, "name") or "without a name", why) for k, mark in enumerate(marks, 1))
    if not routes:
        return Mission(left_out=left_out)
    name, kind, points, speed = routes[source.chosen([one[0] for one in routes], route)]
    if len(points) > MAX_POINTS:
        raise source.error(f"{kind} {name} must have at most {MAX_POINTS} points (got {len(points)})")
    found = [_route_point(point, f"{kind} {name}, point {k}", kind, speed, source) for k, point in enumerate(points, 1)]
    return Mission(tuple(found), left_out=left_out, routes=tuple(one[0] for one in routes))


def _routes(root: Element) -> list[tuple[str, str, list[Element], Element | None]]:
    """Name, kind, points and extensions of each route, and of each segment of a track: the way between two is unknown."""
    found: list[tuple[str, str, list[Element], Element | None]] = []
    for number, child in enumerate((one for one in root if _local(one) in ("rte", "trk")), 1):
        name = _text(child, "name") or str(number)
        if _local(child) == "rte":
            found.append((name, "route", [one for one in child if _local(one) == "rtept"], child))
            continue
        segments = [one for one in child if _local(one) == "trkseg"]
        for k, segment in enumerate(segments, 1):
            points = [one for one in segment if _local(one) == "trkpt"]
            found.append((name if len(segments) == 1 else f"{name}:{k}", "track", points, None))
    return [one for one in found if one[2]]


def _route_point(point: Element, what: str, kind: str, route: Element | None, source: Source) -> MissionPoint:
    place = source.degrees(point.get("lat"), point.get("lon"), what)
    speed = 0.0
    if kind == "route":
        given: Any = next((found for one in (point, route) if one is not None and (found := _planned_speed(one))), None)
        speed = 0.0 if given is None else source.number(given, f"{what}: planned speed", 0.0, 200.0) * KNOT
    return MissionPoint(place, what, speed, name=_text(point, "name"))


def _planned_speed(element: Element) -> str:
    """OpenCPN's planned speed of a point or route, kn; empty for none, as which it writes 0 too."""
    extensions = next((child for child in element if _local(child) == "extensions"), None)
    text = "" if extensions is None else _text(extensions, "planned_speed")
    return "" if text.strip("0.") == "" else text


def _text(element: Element, name: str) -> str:
    """The text of the first child of a name; empty for none."""
    return next((" ".join((child.text or "").split()) for child in element if _local(child) == name), "")


def _local(element: Element) -> str:
    """The name of an element without its namespace: each version of GPX has its own, and some programs write none."""
    return str(element.tag).rpartition("}")[2]


TYPES = (
    *("FeatureCollection", "Feature", "GeometryCollection"),
    *("Point", "MultiPoint", "LineString", "MultiLineString", "Polygon", "MultiPolygon"),
)

FENCES = {"inclusion": True, "exclusion": False}

WGS84 = ("urn:ogc:def:crs:OGC:1.3:CRS84", "urn:ogc:def:crs:OGC::CRS84", "urn:ogc:def:crs:EPSG::4326", "EPSG:4326")


def read_geojson(document: dict[str, Any], source: Source, route: str | None = None) -> Mission:
    """One route of a document, its fences and areas."""
    _require_degrees(document.get("crs"), source)
    routes: list[tuple[str, list[MissionPoint]]] = []
    marks: list[MissionPoint] = []
    areas: list[Fence] = []
    fences: list[Fence] = []
    refused: list[Refused] = []
    for item, kind, coordinates, properties in _geometries(document, source):
        if kind == "Point":
            marks.append(_point(coordinates, item, properties, source))
        elif kind == "LineString":
            name = str(properties.get("name") or item)
            routes.append((name, _line(coordinates, item, properties, source)))
            lost = [one for one in NAMES if one in properties and one not in (*SPEEDS, "name")]
            refused += [Refused(item, one, "a line has a speed and a name; points with it would do") for one in lost]
        elif kind == "Polygon":
            outline, *holes = _polygon(coordinates, item, properties, source)
            (fences if "fence" in properties else areas).append(outline)
            if "fence" in properties and outline.inside:
                fences += holes
            elif holes:
                refused.append(Refused(item, "a hole in a polygon", "an area without holes or an exclusion fence would do"))
        else:
            refused.append(Refused(item, f"geometry {kind}", "points, lines and polygons are known"))
        if "fence" in properties and kind != "Polygon":
            refused.append(Refused(item, f"fence of a {kind}", "a fence is a polygon"))
    if not routes:
        return Mission(tuple(marks), fences=tuple(fences), areas=tuple(areas), refused=tuple(refused))
    why = "a single mark is no part of a route"
    left_out = tuple(Refused(mark.item, mark.name or "a point", why) for mark in marks)
    names = [name for name, _ in routes]
    points = tuple(routes[source.chosen(names, route)][1])
    return Mission(points, True, tuple(fences), (), tuple(areas), tuple(refused), left_out, routes=tuple(names))


def _require_degrees(crs: Any, source: Source) -> None:
    """Refuse other coordinates than latitude and longitude, which versions before RFC 7946 may have."""
    if crs is None:
        return
    name = source.mapping(source.mapping(crs, "crs").get("properties", {}), "crs.properties").get("name")
    if name not in WGS84:
        raise source.error(f"crs must be WGS 84, {WGS84[0]} (got {str(name)[:60]})")


Geometry = tuple[str, str, list[Any], dict[str, Any]]  # what it is in the file, type, coordinates and properties


def _geometries(document: dict[str, Any], source: Source) -> Iterator[Geometry]:
    """The single geometries of a document."""
    if document.get("type") != "FeatureCollection":
        yield from _geometry(document, "feature 1", {}, source)
        return
    for k, feature in enumerate(source.rows(document.get("features"), "features"), 1):
        yield from _geometry(source.mapping(feature, f"feature {k}"), f"feature {k}", {}, source)


def _geometry(one: dict[str, Any], item: str, properties: dict[str, Any], source: Source, depth: int = 0) -> Iterator[Geometry]:
    kind = str(one.get("type"))
    if kind == "Feature":
        own = one.get("properties")
        named = {} if own is None else {key.lower(): value for key, value in source.mapping(own, f"{item}: properties").items()}
        inner = one.get("geometry")
        if inner is not None and depth < 1:
            yield from _geometry(source.mapping(inner, f"{item}: geometry"), item, named, source, depth + 1)
    elif kind.startswith("Multi") and kind in TYPES:
        for k, coordinates in enumerate(source.rows(one.get("coordinates"), f"{item}: coordinates"), 1):
            label = {**properties, "name": f"{properties['name']}:{k}"} if "name" in properties else properties
            yield f"{item}.{k}", kind.removeprefix("Multi"), source.rows(coordinates, f"{item}.{k}"), label
    elif kind in ("Point", "LineString", "Polygon"):
        yield item, kind, source.rows(one.get("coordinates"), f"{item}: coordinates"), properties
    elif kind in TYPES:
        yield item, kind, [], properties
    else:
        raise source.error(f"{item}: type must be one of {', '.join(TYPES)} (got {kind[:40]})")


def _place(position: Any, item: str, source: Source) -> Pair:
    numbers = source.rows(position, f"{item}: position")
    if len(numbers) < 2:
        raise source.error(f"{item}: a position must have longitude and latitude (got {len(numbers)} numbers)")
    return source.degrees(numbers[1], numbers[0], item)


def _point(position: Any, item: str, properties: dict[str, Any], source: Source) -> MissionPoint:
    own = {name: properties[name] for name in NAMES if name in properties}
    return with_properties(_place(position, item, source), item, own, source)


def _line(positions: list[Any], item: str, properties: dict[str, Any], source: Source) -> list[MissionPoint]:
    """The waypoints of a line, which share its speed."""
    own = {name: properties[name] for name in SPEEDS if name in properties}
    if len(positions) < 2:
        raise source.error(f"{item}: a line must have at least 2 positions (got {len(positions)})")
    labels = [f"{item}, point {k}" for k in range(1, len(positions) + 1)]
    return [
        with_properties(_place(position, label, source), label, own, source)
        for position, label in zip(positions, labels, strict=True)
    ]


def _polygon(rings: list[Any], item: str, properties: dict[str, Any], source: Source) -> list[Fence]:
    """The outline of a polygon, and its holes, of which each is the opposite."""
    kind = str(properties.get("fence", "inclusion"))
    if kind not in FENCES:
        raise source.error(f"{item}: fence must be {' or '.join(FENCES)} (got {kind[:40]})")
    found = []
    for k, ring in enumerate(rings or [None]):
        corners = [_place(position, item, source) for position in source.rows(ring, f"{item}: ring")]
        if len(corners) > 1 and corners[0] == corners[-1]:
            corners.pop()
        if len(corners) < 3:
            raise source.error(f"{item}: a polygon must have at least 3 corners (got {len(corners)})")
        found.append(Fence(tuple(corners), FENCES[kind] == (k == 0), f"{item}, hole {k}" if k else item))
    return found


FORMATS = "QGroundControl's .plan, .waypoints, Cockpit's missions, GPX, GeoJSON and CSV"


def read_mission(path: Path, route: str | None = None) -> Mission:
    """Read a mission."""
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
