"""Routes and tracks in GPX 1.0 and 1.1, by OpenCPN and other chart plotters.

Format: https://www.topografix.com/GPX/1/1/. OpenCPN's planned speed is in knots; the speeds and times of a track are those of a
recording, and not sailed again.
"""

from typing import Any
from xml.etree.ElementTree import Element, ParseError

from vessel_hsmc_ros.boats.missions.mission import KNOT, MAX_POINTS, Mission, MissionPoint, Refused, Source
from vessel_hsmc_ros.scenario.parameters_file import in_one_line


def read_gpx(content: bytes, source: Source, route: str | None = None) -> Mission:
    """One route or track of a file.

    `route`: name of the route; None for the only one. Raises ScenarioError if it is not GPX, has no such route, or a position
    is no number or out of range.
    """
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
    found = [_point(point, f"{kind} {name}, point {k}", kind, speed, source) for k, point in enumerate(points, 1)]
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


def _point(point: Element, what: str, kind: str, route: Element | None, source: Source) -> MissionPoint:
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
