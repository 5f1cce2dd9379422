"""Every format reads back to the waypoints that were written, and a file that is cut off or wrong is named in one line."""

import json
import math
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from durations import rest_long
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mission_writing import (
    DIALECTS,
    GPX,
    HOME,
    feature,
    geojson,
    gpx_point,
    gpx_route,
    gpx_track,
    of_points,
    plan,
    positions,
    simple_item,
    waypoint_item,
)

from vessel_hsmc_ros.boats.missions.files import read_mission
from vessel_hsmc_ros.boats.missions.legs import placed
from vessel_hsmc_ros.boats.missions.mission import KNOT, NAMES, Mission
from vessel_hsmc_ros.core.exceptions import ScenarioError
from vessel_hsmc_ros.core.kinematics import Plane

PLACES = [(63.4401, 10.3901), (63.4410, 10.3920), (63.4420, 10.3880)]

OFFSETS = st.lists(st.tuples(*[st.floats(-20e3, 20e3)] * 2), min_size=2, max_size=6)

Read = Callable[..., Mission]


@pytest.mark.parametrize("dialect", rest_long(DIALECTS, 5))
@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(places=OFFSETS)
def test_every_format_reads_back_to_the_same_metres(read: Read, dialect: str, places: list[tuple[float, float]]) -> None:
    plane = Plane(*HOME)
    mission = read(DIALECTS[dialect]([plane.coordinates(x, y) for x, y in places]), dialect)
    found = placed(mission, HOME, dialect).mission
    assert not mission.refused
    assert len(found.points) == len(places)
    for point, (x, y) in zip(found.points, places, strict=True):
        assert math.hypot(point.place[0] - x, point.place[1] - y) < 1e-3


@settings(max_examples=50, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    rows=st.lists(st.tuples(*[st.floats(-1e5, 1e5)] * 2, st.floats(0.01, 50.0), st.floats(0.0, 900.0)), min_size=1, max_size=5)
)
def test_a_table_in_metres_reads_back_with_speeds_and_holds(read: Read, rows: list[tuple[float, ...]]) -> None:
    text = "\n".join(["hold,y,x,speed", *(f"{hold!r},{y!r},{x!r},{speed!r}" for x, y, speed, hold in rows)])
    found = read(text)
    assert not found.geographic
    assert [(*point.place, point.speed, point.hold) for point in found.points] == rows
    assert [point.corner for point in found.points] == ["stop" if row[3] else "through" for row in rows]


@pytest.mark.parametrize("dialect", rest_long(DIALECTS, 7))
def test_a_file_that_is_cut_off_anywhere_is_an_error_of_one_line_or_a_shorter_mission(read: Read, dialect: str) -> None:
    text = DIALECTS[dialect](PLACES).rstrip()
    for end in range(0, len(text), max(1, len(text) // 150)):
        error = error_of(partial(read, text[:end], dialect))
        if dialect.endswith((".waypoints", ".csv")) and not error:  # of lines, each of which is complete
            continue
        assert error.startswith("mission file ")
        assert "\n" not in error


def error_of(call: Callable[[], object]) -> str:
    """The message of the error of a call; empty without one. Another error than those of this package goes on."""
    try:
        call()
    except ScenarioError as error:
        return str(error)
    return ""


def place(read: Read, content: str | bytes, dialect: str) -> None:
    placed(read(content, dialect), None, "mission")


WRONG = [None, True, "abc", {}, [], [1], 1e400, -1e9, "1_0", {"type": "Point"}, "\u0661"]


def spots(value: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """The paths of all values of a document."""
    found = [path] if path else []
    keys = value if isinstance(value, dict) else range(len(value)) if isinstance(value, list) else ()
    for key in keys:
        found += spots(value[key], (*path, key))
    return found


@pytest.mark.parametrize("dialect", rest_long([name for name in DIALECTS if name.endswith(("plan", "cpm", "geojson"))]))
@settings(max_examples=120, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_a_value_of_another_kind_is_an_error_of_one_line_or_without_effect(read: Read, dialect: str, data: st.DataObject) -> None:
    document = json.loads(DIALECTS[dialect](PLACES))
    *way, last = data.draw(st.sampled_from(spots(document)))
    inner = document
    for key in way:
        inner = inner[key]
    inner[last] = data.draw(st.sampled_from(WRONG))
    assert "\n" not in error_of(partial(place, read, json.dumps(document), dialect))


@settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(name=st.sampled_from(["fence", *NAMES]), value=st.sampled_from(WRONG), kind=st.sampled_from(["Polygon", "MultiPoint"]))
def test_a_property_of_another_kind_is_an_error_of_one_line_or_without_effect(
    read: Read, name: str, value: object, kind: str
) -> None:
    corners = [[longitude, latitude] for latitude, longitude in PLACES]
    shape = {"type": kind, "coordinates": [corners] if kind == "Polygon" else corners}
    document = json.dumps({"type": "Feature", "properties": {name: value}, "geometry": shape})
    assert "\n" not in error_of(partial(place, read, document, "x.geojson"))


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    content=st.one_of(st.binary(max_size=60), st.text(max_size=60).map(str.encode)),
    dialect=st.sampled_from([*DIALECTS]),
    at=st.floats(0, 1),
)
def test_a_damaged_file_is_an_error_of_one_line_at_most(read: Read, content: bytes, dialect: str, at: float) -> None:
    text = DIALECTS[dialect](PLACES).encode()
    i = int(at * len(text))
    for damaged in (content, text[:i] + content + text[i + 1 :]):
        assert "\n" not in error_of(partial(place, read, damaged, dialect))


def test_a_route_of_opencpn_has_its_planned_speed_and_names(read: Read) -> None:
    found = read(GPX.format(gpx_route(PLACES, speed="6.00")))
    assert [point.speed for point in found.points] == pytest.approx([6.0 * KNOT] * 3)
    assert [point.name for point in found.points] == ["001", "002", "003"]
    own = read(GPX.format(gpx_route(PLACES, speed="6.00", point_speed="2.5")))
    assert own.points[1].speed == pytest.approx(2.5 * KNOT)
    assert read(GPX.format(gpx_route(PLACES, speed="0.00"))).points[1].speed == 0.0


def test_one_route_of_several_is_taken_by_its_name(read: Read) -> None:
    text = GPX.format(
        gpx_point("wpt", PLACES[0], "mark")
        + gpx_route(PLACES, "out")
        + gpx_route(PLACES[::-1], "back & home")
        + gpx_track([PLACES[:2], PLACES[1:]])
    )
    with pytest.raises(
        ScenarioError, match="it has 4 routes, of which --route NAME chooses one: out, back & home, yesterday:1, yesterday:2"
    ):
        read(text)
    assert [point.place for point in read(text, route="back & home").points] == PLACES[::-1]
    assert [point.place for point in read(text, route="yesterday:2").points] == PLACES[1:]
    assert [item.what for item in read(text, route="out").left_out] == ["mark"]
    with pytest.raises(ScenarioError, match=r"--route must be one of its routes .* \(got home\)"):
        read(text, route="home")


@pytest.mark.parametrize("namespace", ["", ' xmlns="http://www.topografix.com/GPX/1/0"'])
def test_gpx_of_any_version_is_read(read: Read, namespace: str) -> None:
    text = f"<gpx{namespace}><rte>{''.join(gpx_point('rtept', place) for place in PLACES)}</rte></gpx>"
    assert [point.place for point in read(text.encode("utf-16")).points] == PLACES
    assert [point.place for point in read(text).points] == PLACES


@pytest.mark.parametrize(
    "text",
    [
        '<!DOCTYPE gpx [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;&a;">]><gpx><rte><name>&b;</name></rte></gpx>',
        '<!DOCTYPE gpx [<!ENTITY a SYSTEM "file:///etc/passwd">]><gpx><rte><name>&a;</name></rte></gpx>',
    ],
)
def test_entities_in_xml_are_refused(read: Read, text: str) -> None:
    with pytest.raises(ScenarioError, match="it must be XML without entities"):
        read(text)


def test_points_of_geojson_have_their_properties(read: Read) -> None:
    first, second, third = positions(PLACES)
    found = read(
        geojson(
            feature("Point", first, speed_kn=2.0, name="pier"),
            feature("Point", second, hold=30, compass_deg=90.0),
            feature("Point", third, speed=0.7, corner="over"),
        )
    )
    assert [(p.speed, p.hold, p.heading, p.corner, p.name) for p in found.points] == [
        (pytest.approx(2.0 * KNOT), 0.0, None, "through", "pier"),
        (0.0, 30.0, 0.0, "stop", ""),
        (0.7, 0.0, None, "over", ""),
    ]


def test_polygons_of_geojson_are_areas_or_fences_and_holes_are_refused(read: Read) -> None:
    ring = [*positions(PLACES), positions(PLACES)[0]]
    found = read(
        geojson(
            feature("LineString", positions(PLACES)),
            feature("Polygon", [ring]),
            feature("Polygon", [ring, ring], fence="exclusion"),
            feature("MultiPolygon", [[ring], [ring]]),
            {"type": "Feature", "properties": None, "geometry": {"type": "GeometryCollection", "geometries": []}},
        )
    )
    assert [area.item for area in found.areas] == ["feature 2", "feature 4.1", "feature 4.2"]
    assert [(fence.item, fence.inside, fence.corners) for fence in found.fences] == [("feature 3", False, tuple(PLACES))]
    assert [(item.item, item.what) for item in found.refused] == [
        ("feature 3", "a hole in a polygon"),
        ("feature 5", "geometry GeometryCollection"),
    ]


def test_a_hole_of_a_fence_to_stay_in_is_a_fence_to_stay_out_of(read: Read) -> None:
    ring = [*positions(PLACES), positions(PLACES)[0]]
    found = read(geojson(feature("Polygon", [ring, ring], fence="inclusion")))
    assert [(fence.item, fence.inside) for fence in found.fences] == [("feature 1", True), ("feature 1, hole 1", False)]
    assert not found.refused


def test_a_fence_is_found_by_its_property_in_any_case_and_refused_where_it_is_no_polygon(read: Read) -> None:
    ring = [*positions(PLACES), positions(PLACES)[0]]
    found = read(geojson(feature("Polygon", [ring], Fence="exclusion"), feature("LineString", ring, FENCE="exclusion")))
    assert [(fence.item, fence.inside) for fence in found.fences] == [("feature 1", False)]
    assert [(item.item, item.what) for item in found.refused] == [("feature 2", "fence of a LineString")]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "it is empty"),
        ("{}", "it must be of a known format"),
        ("[1, 2]", "it must be an object"),
        ("<svg/>", "whose root is gpx (got svg)"),
        ("\xff\xfe\x00", "it is not XML"),
        ("QGC WPL 100\n", "line 1 must be QGC WPL 110 or 120 (got QGC WPL 100)"),
        ("1,2\n3,4\n", "line 1 must be a row of names: latitude and longitude in degrees, or x and y in metres"),
        ("lat,lon,depth\n63.4,10.4,5\n", "(got lat, lon, depth)"),
        ("lat,x\n63.4,10.4\n", "(got lat, x)"),
        ("lat,lon,x,y\n63.4,10.4,1,2\n", "(got lat, lon, x, y)"),
        ("lat,latitude,lon\n63.4,63.4,10.4\n", "(got lat, latitude, lon)"),
        ("x,y\n1\n", "line 2 must have 2 values (got 1)"),
        ("x,y\n1,nan\n", "line 2: y must be a finite number from -1e+06 to 1e+06 (got nan)"),
        ("x,y,speed\n1,2,-1\n", "line 2: speed must be a finite number from 0 to 200 (got -1)"),
        ("x,y,heading\n1,2,90\n", "in radians, for degrees heading_deg or compass_deg, must be a finite number from -6.28319"),
        ("x,y,speed,speed_kn\n1,2,1,2\n", "line 2 must have one of speed, speed_kn (got speed and speed_kn)"),
        ("x,y,corner\n1,2,round\n", "line 2: corner must be through, over, stop (got round)"),
        ("lat,lon\n163.4,10.4\n", "(got 163.4, 10.4; are they exchanged?)"),
        ('{"fileType": "Plan"}', "mission must be an object (got nothing)"),
        (json.dumps({"type": "Feature", "geometry": {"type": "Blob"}}), "feature 1: type must be one of"),
        (json.dumps({**json.loads(of_points(PLACES)), "crs": {"properties": {"name": "EPSG:32632"}}}), "crs must be WGS 84"),
        (
            plan([{**waypoint_item(1, PLACES[0]), "type": "Simple"}]),
            "item 1: type must be SimpleItem or ComplexItem (got Simple)",
        ),
        (plan([simple_item(1, 16, (0, 0, 0, None, *PLACES[0]))]), "item 1: params must be 7 numbers (got 6)"),
        (
            plan([waypoint_item(1, PLACES[0], hold=-3)]),
            "item 1: hold (param1) must be a finite number from 0 to 1e+06 (got -3.0)",
        ),
        (plan([waypoint_item(1, (633440000.0, 103900000.0))]), "(got 6.3344e+08, 1.039e+08)"),
    ],
)
def test_what_is_no_mission_is_named_with_what_is_allowed(read: Read, text: str, reason: str) -> None:
    with pytest.raises(ScenarioError) as refused:
        read(text.encode("latin-1"))
    assert reason in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_file_that_does_not_exist_or_is_a_folder_is_named(tmp_path: Path) -> None:
    for path in (tmp_path, tmp_path / "none.plan"):
        with pytest.raises(ScenarioError, match=f"mission file {path} cannot be read"):
            read_mission(path)


def test_what_a_line_of_geojson_cannot_have_is_refused_and_its_speed_is_that_of_its_legs(read: Read) -> None:
    found = read(geojson(feature("LineString", positions(PLACES), speed=0.8, hold=5, corner="over", colour="red", name="a")))
    assert [point.speed for point in found.points] == [0.8] * 3
    assert [(item.item, item.what) for item in found.refused] == [("feature 1", "hold"), ("feature 1", "corner")]
