"""The items of QGroundControl's and Mission Planner's files: sailed, left out or refused by item."""

import math
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mission_writing import (
    HOME,
    line,
    plan,
    simple_item,
    survey_item,
    waypoint_item,
    wpl,
)

from vessel_hsmc_ros.boats.missions.legs import placed
from vessel_hsmc_ros.boats.missions.mission import Mission
from vessel_hsmc_ros.core.exceptions import ScenarioError

PLACES = [(63.4401, 10.3901), (63.4410, 10.3920), (63.4420, 10.3880)]

OFFSETS = st.lists(st.tuples(*[st.floats(-20e3, 20e3)] * 2), min_size=2, max_size=6)

Read = Callable[..., Mission]


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


@pytest.mark.parametrize(("target", "repeats"), [(2, -1), (9, 1), (3, 1), (2, 1000), (None, 1), (1.5, 1), (1, 1.5)])
def test_a_jump_ahead_without_end_or_to_no_item_is_refused(read: Read, target: float | None, repeats: float) -> None:
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


def test_a_relative_change_of_speed_is_refused(read: Read) -> None:
    found = read(
        plan([waypoint_item(1, PLACES[0]), simple_item(2, 178, (1, 0.5, -1, 1, 0, 0, 0), 2), waypoint_item(3, PLACES[1])])
    )
    assert [item.item for item in found.refused] == ["item 2"]
    assert [point.speed for point in found.points] == [0.0, 0.0]


@pytest.mark.parametrize("form", ["plan", "waypoints"])
@settings(max_examples=20, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(commands=st.lists(st.sampled_from((16, 19, 178, 201)), min_size=1, max_size=8), data=st.data())
def test_nothing_after_an_item_that_does_not_continue_is_sailed(
    read: Read, form: str, commands: list[int], data: st.DataObject
) -> None:
    pause = data.draw(st.integers(1, len(commands)), label="pause")
    if form == "plan":
        items = [simple_item(k, c, (1, 1, -1, 0, *PLACES[k % 3], 0)) for k, c in enumerate(commands, 1)]
        items[pause - 1]["autoContinue"] = False
        found = read(plan(items))
    else:
        lines = [line(k, 3, c, (1, 1, -1, 0), PLACES[k % 3]) for k, c in enumerate(commands, 1)]
        lines[pause - 1] = lines[pause - 1].removesuffix("1") + "0"
        found = read(wpl(lines))
    sailed = [k for k, c in enumerate(commands, 1) if c in (16, 19)]
    assert [point.item for point in found.points] == [f"item {k}" for k in sailed if k <= pause]
    assert [refused.item for refused in found.refused] == [f"item {k}" for k in sailed if k > pause]
    assert all(refused.why.startswith(f"the pause of item {pause} (autocontinue off)") for refused in found.refused)
    assert all(point.corner == "stop" for point in found.points[-1:])


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


def test_a_plan_of_before_version_3_3_is_read(read: Read) -> None:
    item = {**waypoint_item(1, PLACES[0]), "params": [0, 0, 0, 0], "coordinate": [*PLACES[0], 0]}
    assert read(plan([item])).points[0].place == PLACES[0]


def test_a_waypoint_at_0_0_of_a_plan_is_not_the_one_before_it(read: Read) -> None:
    found = read(plan([waypoint_item(1, PLACES[0]), waypoint_item(2, (0.0, 0.0)), simple_item(3, 19, (5, 0, 0, 0, 0, 0, 0))]))
    assert [(point.place, point.hold) for point in found.points] == [(PLACES[0], 0.0), ((0.0, 0.0), 5.0)]
    with pytest.raises(ScenarioError, match="item 2 must be a place that was measured"):
        placed(found, HOME, "a")
