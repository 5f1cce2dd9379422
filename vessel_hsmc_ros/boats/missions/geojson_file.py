"""Missions in GeoJSON (RFC 7946): lines are routes, points are waypoints in their order, polygons are fences or areas to survey.

A polygon with the property `fence`, `inclusion` or `exclusion`, is a fence. Places are longitude and latitude, in this order.
"""

from collections.abc import Iterator
from typing import Any

from vessel_hsmc_ros.boats.missions.mission import (
    NAMES,
    SPEEDS,
    Fence,
    Mission,
    MissionPoint,
    Pair,
    Refused,
    Source,
    with_properties,
)

TYPES = (
    *("FeatureCollection", "Feature", "GeometryCollection"),
    *("Point", "MultiPoint", "LineString", "MultiLineString", "Polygon", "MultiPolygon"),
)

FENCES = {"inclusion": True, "exclusion": False}

WGS84 = ("urn:ogc:def:crs:OGC:1.3:CRS84", "urn:ogc:def:crs:OGC::CRS84", "urn:ogc:def:crs:EPSG::4326", "EPSG:4326")


def read_geojson(document: dict[str, Any], source: Source, route: str | None = None) -> Mission:
    """One route of a document, its fences and areas.

    `route`: name of the route; None for the only one. Raises ScenarioError if it is not GeoJSON in latitude and longitude, has
    no such route, or a position is no number or out of range.
    """
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
            fence = _polygon(coordinates, item, properties, source)
            (fences if "fence" in properties else areas).append(fence)
            if len(coordinates) > 1:
                refused.append(Refused(item, "a hole in a polygon", "an area without holes or an exclusion fence would do"))
        else:
            refused.append(Refused(item, f"geometry {kind}", "points, lines and polygons are known"))
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
        named = {} if own is None else source.mapping(own, f"{item}: properties")
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


def _polygon(rings: list[Any], item: str, properties: dict[str, Any], source: Source) -> Fence:
    ring = source.rows(rings[0] if rings else None, f"{item}: ring")
    corners = [_place(position, item, source) for position in ring]
    if len(corners) > 1 and corners[0] == corners[-1]:
        corners.pop()
    if len(corners) < 3:
        raise source.error(f"{item}: a polygon must have at least 3 corners (got {len(corners)})")
    kind = properties.get("fence", "inclusion")
    if kind not in FENCES:
        raise source.error(f"{item}: fence must be {' or '.join(FENCES)} (got {str(kind)[:40]})")
    return Fence(tuple(corners), FENCES[kind], item)
