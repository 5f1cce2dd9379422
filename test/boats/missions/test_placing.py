"""A datum, and places relative to it, are checked for sense."""

import pytest
from mission_writing import HOME

from vessel_hsmc_ros.boats.missions.legs import datum_of, placed
from vessel_hsmc_ros.boats.missions.mission import Fence, Mission, MissionPoint
from vessel_hsmc_ros.core.exceptions import ParameterError, ScenarioError

NEAR = (63.4401, 10.3901)


def mission(*places: tuple[float, float], **more: object) -> Mission:
    points = tuple(MissionPoint(place, f"item {k}") for k, place in enumerate(places, 1))
    return Mission(points, **more)  # type: ignore[arg-type]


def test_the_datum_is_the_given_one_or_the_home_or_the_first_waypoint() -> None:
    assert placed(mission(NEAR, home=HOME), NEAR, "a").datum == NEAR
    assert placed(mission(NEAR, home=HOME), None, "a").datum == HOME
    found = placed(mission(NEAR, (63.4402, 10.3901)), None, "a")
    assert (found.datum, found.datum_of) == (NEAR, "item 1")
    assert found.mission.points[0].place == (0.0, 0.0)
    assert found.mission.points[1].place == pytest.approx((0.0, 11.15), abs=0.01)
    assert placed(mission(NEAR, home=(0.0, 0.0)), None, "a").datum == NEAR  # of an autopilot without a fix


@pytest.mark.parametrize("text", ["63.4", "63.4,10.4,5", "", "a,b", "nan,10", "91,0.5", "63,181", "inf,1"])
def test_a_datum_that_is_no_place_is_refused(text: str) -> None:
    with pytest.raises(ParameterError, match=r"--datum must be a latitude within .* \(got "):
        datum_of(text)


def test_a_datum_that_is_exchanged_or_of_a_receiver_without_a_fix_is_named() -> None:
    with pytest.raises(ParameterError, match="are they exchanged"):
        datum_of("-122.4,37.8")
    with pytest.raises(ParameterError, match="0, 0 is that of a receiver without a fix"):
        datum_of("0.0,0")
    assert datum_of("63.44, 10.39") == HOME


def test_an_exchanged_waypoint_is_named_with_its_values() -> None:
    with pytest.raises(
        ScenarioError,
        match=r"item 2 must be within 100 km of the datum .*\(got 10.390100, 63.440100, .* exchanged\?\)",
    ):
        placed(mission(NEAR, NEAR[::-1]), None, "a")


@pytest.mark.parametrize("far", [(64.5, 10.39), (63.44, 12.5), (-63.44, 10.39)])
def test_a_place_that_is_far_from_the_datum_is_refused_with_the_distance(far: tuple[float, float]) -> None:
    square = (NEAR, (63.45, 10.39), far)
    for given in (
        mission(NEAR, far),
        mission(NEAR, fences=(Fence(square, True, "fence 1"),)),
        mission(NEAR, rally=(far,)),
        mission(NEAR, areas=(Fence(square, True, "area 1"),)),
    ):
        with pytest.raises(ScenarioError, match=r"must be within 100 km of the datum .* km away\)"):
            placed(given, HOME, "a")
    with pytest.raises(ScenarioError, match="of its home"):
        placed(mission(far, home=HOME), None, "a")


@pytest.mark.parametrize("places", [[(0.0, 0.0)], [NEAR, (0.0, 0.0)], [NEAR, (1e-9, -1e-9)]])
def test_a_waypoint_at_0_0_is_refused(places: list[tuple[float, float]]) -> None:
    with pytest.raises(ScenarioError, match="that of a receiver without a fix"):
        placed(mission(*places), None, "a")


def test_a_mission_in_metres_takes_no_datum_and_stays_near_the_origin() -> None:
    local = mission((1.0, 2.0), geographic=False)
    assert placed(local, None, "a").mission == local
    with pytest.raises(ParameterError, match="--datum must be left out, because a is in metres"):
        placed(local, HOME, "a")
    with pytest.raises(ScenarioError, match=r"item 1 must be within 100 km of the origin \(got x = 569812, y = 7.03449e\+06\)"):
        placed(mission((569812.0, 7034490.0), geographic=False), None, "a")


def test_a_mission_without_any_place_is_refused() -> None:
    with pytest.raises(ScenarioError, match="a must have a waypoint or an area"):
        placed(mission(home=HOME), None, "a")
