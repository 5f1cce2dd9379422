"""Writes waypoints in each format of mission files, as its specification has it."""

import json
from collections.abc import Callable, Sequence
from typing import Any
from xml.sax.saxutils import escape

Places = Sequence[tuple[float, float]]
"""Latitudes and longitudes, degrees."""

HOME = (63.44, 10.39)


def simple_item(number: int, command: int, params: Sequence[Any], frame: int = 3) -> dict[str, Any]:
    return {
        "AMSLAltAboveTerrain": None,
        "Altitude": 0,
        "AltitudeMode": 1,
        "autoContinue": True,
        "command": command,
        "doJumpId": number,
        "frame": frame,
        "params": list(params),
        "type": "SimpleItem",
    }


def waypoint_item(number: int, place: tuple[float, float], hold: float = 0, yaw: float | None = None) -> dict[str, Any]:
    return simple_item(number, 16, (hold, 0, 0, yaw, *place, 0))


def plan(items: Sequence[dict[str, Any]], **more: Any) -> str:
    """A file by QGroundControl."""
    fence = more.pop("geoFence", {"circles": [], "polygons": [], "version": 2})
    rally = more.pop("rallyPoints", {"points": [], "version": 2})
    mission = {
        "cruiseSpeed": 15,
        "firmwareType": 3,
        "globalPlanAltitudeMode": 1,
        "hoverSpeed": 5,
        "items": list(items),
        "plannedHomePosition": [*HOME, 0],
        "vehicleType": 11,
        "version": 2,
        **more,
    }
    document = {"fileType": "Plan", "geoFence": fence, "groundStation": "QGroundControl", "mission": mission}
    return json.dumps({**document, "rallyPoints": rally, "version": 1}, indent=4)


def survey_item(places: Places, with_items: bool = True, kind: str = "survey") -> dict[str, Any]:
    """A survey: waypoints, between them commands of a camera, as version 4 saves it."""
    items: list[dict[str, Any]] = []
    for place in places if with_items else ():
        items += [waypoint_item(len(items) + 2, place), simple_item(len(items) + 3, 206, (25, 0, 1, 0, 0, 0, 0), 2)]
    style = {
        "CameraCalc": {"AdjustedFootprintFrontal": 25, "AdjustedFootprintSide": 25, "CameraName": "Manual (no camera specs)"},
        "CameraShots": 7,
        "Items": items,
        "TurnAroundDistance": 10,
        "VisualTransectPoints": [list(place) for place in places],
        "version": 1,
    }
    polygon = [list(place) for place in places[:3]]
    return {
        "TransectStyleComplexItem": style,
        "angle": 0,
        "complexItemType": kind,
        "polygon": polygon,
        "type": "ComplexItem",
        "version": 5,
    }


def of_plan(places: Places) -> str:
    return plan([waypoint_item(k, place) for k, place in enumerate(places, 1)])


def of_survey(places: Places) -> str:
    return plan([survey_item(places)])


def of_drawn_survey(places: Places) -> str:
    return plan([survey_item(places, with_items=False)])


def line(number: int, frame: int, command: int, params: Sequence[float], place: tuple[float, float]) -> str:
    """A line of a .waypoints file, as Mission Planner writes it."""
    numbers = [f"{value:.8f}" for value in params] + [f"{value:.10f}" for value in place] + ["0.000000", "1"]
    return "\t".join([str(number), "1" if number == 0 else "0", str(frame), str(command), *numbers])


def wpl(lines: Sequence[str]) -> str:
    return "\r\n".join(["QGC WPL 110", line(0, 0, 16, (0, 0, 0, 0), HOME), *lines, ""])


def of_waypoints(places: Places) -> str:
    return wpl([line(k, 3, 16, (0, 0, 0, 0), place) for k, place in enumerate(places, 1)])


def of_cockpit(places: Places) -> str:
    """A mission by Cockpit."""
    command = {
        "type": "MAVLINK_NAV_COMMAND",
        "command": "MAV_CMD_NAV_WAYPOINT",
        "param1": 0,
        "param2": 5,
        "param3": 0,
        "param4": 999,
    }
    waypoints = [
        {
            "id": f"id-{k}",
            "coordinates": list(place),
            "altitude": 0,
            "altitudeReferenceType": "Relative to home",
            "commands": [command],
        }
        for k, place in enumerate(places)
    ]
    settings = {
        "mapCenter": list(HOME),
        "zoom": 15,
        "currentWaypointType": "Pass by",
        "currentWaypointAltitude": 0,
        "currentWaypointAltitudeRefType": "Relative to home",
        "defaultCruiseSpeed": 1,
    }
    return json.dumps({"version": 0, "settings": settings, "waypoints": waypoints})


GPX = (
    '<?xml version="1.0" encoding="utf-8" ?>\n<gpx version="1.1" creator="OpenCPN" xmlns="http://www.topografix.com/GPX/1/1"'
    ' xmlns:opencpn="http://www.opencpn.org">\n{}</gpx>\n'
)


def gpx_point(kind: str, place: tuple[float, float], name: str = "", inner: str = "") -> str:
    named = f"<name>{escape(name)}</name>" if name else ""
    return f'<{kind} lat="{place[0]:.10f}" lon="{place[1]:.10f}"><time>2026-05-01T10:00:00Z</time>{named}{inner}</{kind}>\n'


def gpx_route(places: Places, name: str = "harbour", speed: str = "0.00", point_speed: str = "") -> str:
    """A route as OpenCPN exports it."""
    inner = f"<extensions><opencpn:planned_speed>{point_speed}</opencpn:planned_speed></extensions>" if point_speed else ""
    points = "".join(gpx_point("rtept", place, f"00{k}", inner) for k, place in enumerate(places, 1))
    extensions = f"<extensions><opencpn:viz>1</opencpn:viz><opencpn:planned_speed>{speed}</opencpn:planned_speed></extensions>"
    return f"<rte><name>{escape(name)}</name>{extensions}\n{points}</rte>\n"


def gpx_track(segments: Sequence[Places], name: str = "yesterday") -> str:
    parts = "".join(f"<trkseg>{''.join(gpx_point('trkpt', place) for place in places)}</trkseg>" for places in segments)
    return f"<trk><name>{escape(name)}</name>{parts}</trk>\n"


def of_route(places: Places) -> str:
    return GPX.format(gpx_route(places))


def of_track(places: Places) -> str:
    return GPX.format(gpx_track([places]))


def positions(places: Places) -> list[list[float]]:
    return [[longitude, latitude] for latitude, longitude in places]


def feature(kind: str, coordinates: Any, **properties: Any) -> dict[str, Any]:
    return {"type": "Feature", "properties": properties, "geometry": {"type": kind, "coordinates": coordinates}}


def geojson(*features: dict[str, Any]) -> str:
    return json.dumps({"type": "FeatureCollection", "features": list(features)})


def of_line(places: Places) -> str:
    return geojson(feature("LineString", positions(places)))


def of_points(places: Places) -> str:
    return geojson(*(feature("Point", one) for one in positions(places)))


def of_table(places: Places) -> str:
    return "\n".join(["name,lat,lon", *(f"p{k},{north!r},{east!r}" for k, (north, east) in enumerate(places)), ""])


def of_semicolons(places: Places) -> str:
    return "\n".join(["Longitude;Latitude", *(f"{east!r};{north!r}" for north, east in places), ""])


DIALECTS: dict[str, Callable[[Places], str]] = {
    "qgroundcontrol.plan": of_plan,
    "survey.plan": of_survey,
    "drawn_survey.plan": of_drawn_survey,
    "mission_planner.waypoints": of_waypoints,
    "cockpit.cpm": of_cockpit,
    "route.gpx": of_route,
    "track.gpx": of_track,
    "line.geojson": of_line,
    "points.geojson": of_points,
    "table.csv": of_table,
    "semicolons.csv": of_semicolons,
}
