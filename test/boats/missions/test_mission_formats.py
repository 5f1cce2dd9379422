"""Every format reads back to the waypoints that were written, and a file that is cut off or wrong is named in one line."""

import json
import math
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import pytest
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
    line,
    of_points,
    plan,
    positions,
    simple_item,
    survey_item,
    waypoint_item,
    wpl,
)

from vessel_hsmc_ros.boats.missions.mission import KNOT, Mission
from vessel_hsmc_ros.boats.missions.placing import placed
from vessel_hsmc_ros.boats.missions.reading import read_mission
from vessel_hsmc_ros.core.exceptions import ScenarioError
from vessel_hsmc_ros.core.geodesy import Plane

PLACES = [(63.4401, 10.3901), (63.4410, 10.3920), (63.4420, 10.3880)]

OFFSETS = st.lists(st.tuples(*[st.floats(-20e3, 20e3)] * 2), min_size=2, max_size=6)

Read = Callable[..., Mission]


@pytest.fixture
def read(tmp_path: Path) -> Read:
    def of(text: str | bytes, name: str = "mission", **options: Any) -> Mission:
        file = tmp_path / name
        file.write_bytes(text if isinstance(text, bytes) else text.encode())
        return read_mission(file, **options)

    return of


@pytest.mark.parametrize("dialect", DIALECTS)
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


@pytest.mark.parametrize("dialect", DIALECTS)
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


@pytest.mark.parametrize("dialect", [name for name in DIALECTS if name.endswith(("plan", "cpm", "geojson"))])
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


def test_a_plan_has_its_fence_its_rally_points_and_its_home(read: Read) -> None:
    polygon = {"inclusion": True, "polygon": [list(place) for place in PLACES], "version": 1}
    circle = {"circle": {"center": list(PLACES[0]), "radius": 25.5}, "inclusion": False, "version": 1}
    rally = {"points": [[*PLACES[1], 0]], "version": 2}
    found = read(plan([waypoint_item(1, PLACES[0])], geoFence={"circles": [circle], "polygons": [polygon]}, rallyPoints=rally))
    assert [(fence.corners, fence.inside, fence.radius) for fence in found.fences] == [
        (tuple(PLACES), True, 0.0),
        ((PLACES[0],), False, 25.5),
    ]
    assert found.rally == (PLACES[1],)
    assert found.home == HOME


def test_holds_yaws_and_changes_of_speed_of_a_plan_are_those_of_its_waypoints(read: Read) -> None:
    items = [
        waypoint_item(1, PLACES[0]),
        simple_item(2, 178, (1, 1.5, -1, 0, 0, 0, 0), 2),
        waypoint_item(3, PLACES[1], hold=20, yaw=90),
        simple_item(4, 93, (7, 0, 0, 0, 0, 0, 0), 2),
        simple_item(5, 178, (1, 0.8, -1, 0, 0, 0, 0), 2),
        simple_item(6, 19, (30, 0, 0, 0, *PLACES[2], 0)),
        simple_item(7, 17, (0, 0, 0, 0, 0, 0, 0)),
    ]
    found = read(plan(items))
    assert not found.refused
    values = [(point.speed, point.hold, point.heading, point.corner) for point in found.points]
    assert values == [(0.0, 0.0, None, "through"), (1.5, 27.0, 0.0, "stop"), (0.8, 30.0, None, "stop")]


@pytest.mark.parametrize("command", [18, 20, 21, 22, 31, 82, 85, 112, 115, 189, 601, 4711])
def test_a_command_that_would_move_the_vessel_otherwise_is_refused_by_item_with_a_reason(read: Read, command: int) -> None:
    items = [waypoint_item(1, PLACES[0]), simple_item(2, command, (1, 0, 0, 0, *PLACES[1], 5)), waypoint_item(3, PLACES[2])]
    for found in (
        read(plan(items)),
        read(wpl([line(k, 3, i["command"], i["params"][:4], i["params"][4:6]) for k, i in enumerate(with_numbers(items), 1)])),
    ):
        (refused,) = found.refused
        assert refused.item == "item 2"
        assert f"command {command}" in refused.what
        assert len(refused.why) > 10
        assert [point.place for point in found.points] == [PLACES[0], PLACES[2]]


def with_numbers(items: list[dict[str, Any]]) -> list[dict[str, Any]]:
    return [{**item, "params": [value or 0 for value in item["params"]]} for item in items]


@pytest.mark.parametrize("command", [179, 183, 201, 203, 206, 2000])
def test_a_command_that_does_not_move_the_vessel_is_left_out_by_item(read: Read, command: int) -> None:
    found = read(plan([waypoint_item(1, PLACES[0]), simple_item(2, command, (1, 0, 0, 0, 0, 0, 0), 2)]))
    assert not found.refused
    assert [item.item for item in found.left_out] == ["item 2"]


@pytest.mark.parametrize("frame", [1, 2, 4, 7, 8, 9, 12, 20])
def test_a_waypoint_in_a_frame_whose_origin_is_not_in_the_file_is_refused(read: Read, frame: int) -> None:
    found = read(plan([simple_item(1, 16, (0, 0, 0, None, *PLACES[0], 0), frame), waypoint_item(2, PLACES[1])]))
    assert [item.what for item in found.refused] == [f"command 16 in frame {frame}"]
    assert len(found.points) == 1


@pytest.mark.parametrize("frame", [0, 3, 5, 6, 10, 11])
def test_frames_that_differ_in_the_altitude_are_alike(read: Read, frame: int) -> None:
    assert read(plan([simple_item(1, 16, (0, 0, 0, None, *PLACES[0], 40), frame)])).points[0].place == PLACES[0]


@pytest.mark.parametrize(
    ("target", "repeats", "order"), [(2, 2, [1, 2, 3, 2, 3, 2, 3, 4]), (1, 1, [1, 2, 3, 1, 2, 3, 4]), (3, 0, [1, 2, 3, 4])]
)
def test_a_jump_back_repeats_the_items_from_there(read: Read, target: int, repeats: int, order: list[int]) -> None:
    places = {k: (63.44 + 1e-3 * k, 10.39) for k in range(1, 6)}
    items = [waypoint_item(k, places[k]) for k in (1, 2, 3)]
    items += [simple_item(4, 177, (target, repeats, 0, 0, 0, 0, 0), 2), waypoint_item(5, places[4])]
    found = read(plan(items))
    assert not found.refused
    assert [point.place for point in found.points] == [places[k] for k in order]


@pytest.mark.parametrize(("target", "repeats"), [(2, -1), (9, 1), (3, 1), (2, 1000), (None, 1)])
def test_a_jump_ahead_without_end_or_to_no_item_is_refused(read: Read, target: int | None, repeats: int) -> None:
    items = [waypoint_item(1, PLACES[0]), waypoint_item(2, PLACES[1]), simple_item(3, 177, (target, repeats, 0, 0, 0, 0, 0), 2)]
    found = read(plan(items))
    assert ["DO_JUMP" in item.what for item in found.refused] == [True]
    assert len(found.points) == 2


def test_what_follows_a_hold_without_end_is_refused(read: Read) -> None:
    found = read(plan([simple_item(1, 17, (0, 0, 0, None, *PLACES[0], 0)), waypoint_item(2, PLACES[1])]))
    assert [(item.item, "item 1" in item.why) for item in found.refused] == [("item 2", True)]


@pytest.mark.parametrize("kind", ["StructureScan", "fwLandingPattern", "VTOLLandingPattern"])
def test_a_complex_item_without_legs_is_refused_and_a_corridor_is_read(read: Read, kind: str) -> None:
    found = read(plan([survey_item(PLACES, kind="CorridorScan"), survey_item(PLACES, kind=kind)]))
    assert [point.place for point in found.points] == PLACES
    assert [(item.item, kind in item.what) for item in found.refused] == [("item 2", True)]
    assert {item.item for item in found.left_out} == {"item 1.2", "item 1.4", "item 1.6"}


def test_a_survey_without_its_transects_is_refused_with_what_would_do(read: Read) -> None:
    found = read(plan([survey_item([]), waypoint_item(1, PLACES[0])]))
    assert "saving it again" in found.refused[0].why


def test_a_heading_under_way_is_refused_and_the_waypoint_kept(read: Read) -> None:
    found = read(plan([waypoint_item(1, PLACES[0], yaw=45), waypoint_item(2, PLACES[1], yaw=45)]))
    assert [(item.item, item.what) for item in found.refused] == [("item 1", "heading 45°")]
    assert [point.heading for point in found.points] == [None, pytest.approx(math.radians(45))]  # at rest at the end


def test_fences_and_rally_points_of_a_waypoints_file_are_read(read: Read) -> None:
    lines = [line(k, 3, 5001, (3, 0, 0, 0), place) for k, place in enumerate(PLACES, 1)]
    lines += [line(k, 3, 5002, (3, 0, 0, 0), place) for k, place in enumerate(PLACES, 4)]
    lines += [line(7, 3, 5004, (12.5, 0, 0, 0), PLACES[0]), line(8, 3, 5100, (0, 0, 0, 0), PLACES[1])]
    found = read(wpl(lines))
    assert [(len(fence.corners), fence.inside, fence.radius) for fence in found.fences] == [
        (3, True, 0),
        (3, False, 0),
        (1, False, 12.5),
    ]
    assert found.rally == (PLACES[1],)
    with pytest.raises(ScenarioError, match="item 1: its fence must have all its corners"):
        read(wpl(lines[:2]))


def test_item_0_of_a_waypoints_file_is_home_and_not_a_waypoint(read: Read) -> None:
    assert read(wpl([line(1, 3, 16, (0, 0, 0, 0), PLACES[0])])).home == HOME
    unset = wpl([line(1, 3, 16, (0, 0, 0, 0), PLACES[0])]).replace(f"{HOME[0]:.10f}\t{HOME[1]:.10f}", "0\t0")
    found = read(unset)
    assert found.home is None
    assert len(found.points) == 1
    assert [item.item for item in found.left_out] == ["item 0"]


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
        ScenarioError, match="it has 4 routes, of which --route NAME takes one: out, back & home, yesterday:1, yesterday:2"
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


def test_a_plan_of_before_version_3_3_is_read(read: Read) -> None:
    item = {**waypoint_item(1, PLACES[0]), "params": [0, 0, 0, 0], "coordinate": [*PLACES[0], 0]}
    assert read(plan([item])).points[0].place == PLACES[0]


def test_a_waypoint_at_0_0_of_a_plan_is_not_the_one_before_it(read: Read) -> None:
    found = read(plan([waypoint_item(1, PLACES[0]), waypoint_item(2, (0.0, 0.0)), simple_item(3, 19, (5, 0, 0, 0, 0, 0, 0))]))
    assert [(point.place, point.hold) for point in found.points] == [(PLACES[0], 0.0), ((0.0, 0.0), 5.0)]
    with pytest.raises(ScenarioError, match="item 2 must be a place that was measured"):
        placed(found, HOME, "a")


def test_what_a_line_of_geojson_cannot_have_is_refused_and_its_speed_is_that_of_its_legs(read: Read) -> None:
    found = read(geojson(feature("LineString", positions(PLACES), speed=0.8, hold=5, corner="over", colour="red", name="a")))
    assert [point.speed for point in found.points] == [0.8] * 3
    assert [(item.item, item.what) for item in found.refused] == [("feature 1", "hold"), ("feature 1", "corner")]
