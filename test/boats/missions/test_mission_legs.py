"""Legs of a mission: parts, those that a vessel has completed, and those that leave the fence."""

import cmath
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vessel_hsmc_ros.boats.missions.legs import (
    breaches,
    completed,
    leaving_fence,
    parameters_of,
    part_of,
    unsendable,
    way_leaving_fence,
)
from vessel_hsmc_ros.boats.missions.mission import Fence, Mission, MissionPoint
from vessel_hsmc_ros.core.exceptions import ParameterError, ScenarioError
from vessel_hsmc_ros.core.schema import build
from vessel_hsmc_ros.guidance.factory import ReferenceShipParameters, make_reference, track_of
from vessel_hsmc_ros.guidance.waypoints import waypoints_of
from vessel_hsmc_ros.scenario.scenario import load_scenario

LAWN = [(100.0, 0.0), (100.0, 12.0), (0.0, 12.0), (0.0, 24.0), (100.0, 24.0), (100.0, 36.0), (0.0, 36.0)]
SQUARE = ((0.0, 0.0), (100.0, 0.0), (100.0, 100.0), (0.0, 100.0))


def mission(*places: tuple[float, float], **more: object) -> Mission:
    points = tuple(MissionPoint(place, f"item {k}", 1.0 + k) for k, place in enumerate(places, 1))
    return Mission(points, False, **more)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("legs", "numbers"), [("7", [6, 7]), ("3-5", [2, 3, 4, 5]), ("6-", [5, 6, 7]), ("1", [1]), ("1-", [1, 2, 3, 4, 5, 6, 7])]
)
def test_a_part_begins_at_the_waypoint_before_its_first_leg_and_passes_over_it(legs: str, numbers: list[int]) -> None:
    points = part_of(mission(*LAWN), legs).points
    assert [point.item for point in points] == [f"item {k}" for k in numbers]
    assert points[0].corner == ("through" if numbers[0] == 1 and legs[0] == "1" else "over")
    assert [point.speed for point in points] == [1.0 + k for k in numbers]


@pytest.mark.parametrize("legs", ["0", "8", "5-3", "-3", "a", "", "7-8", "1.5", "1-2-3"])
def test_a_leg_that_there_is_not_is_refused(legs: str) -> None:
    with pytest.raises(ParameterError, match=r"--legs must be a leg or a range of legs from 1 to 7"):
        part_of(mission(*LAWN), legs)


def sailed(places: list[tuple[float, float]], share: float, off: float, rng: np.random.Generator) -> np.ndarray:
    """The track of a vessel that has sailed a share of a way, with an error of its position."""
    line = [0j, *(complex(*place) for place in places)]
    lengths = np.abs(np.diff(line))
    s = np.arange(0.0, share * lengths.sum(), 0.5)
    p = np.interp(s, np.concatenate(([0.0], np.cumsum(lengths))), line)
    p = p + off * (rng.standard_normal(len(s)) + 1j * rng.standard_normal(len(s)))
    return np.column_stack((p.real, p.imag))


@settings(max_examples=60, deadline=None)
@given(done=st.integers(0, 6), share=st.floats(0.3, 0.7), seed=st.integers(0, 99))
def test_the_legs_that_a_vessel_has_sailed_are_completed_and_the_one_it_is_on_is_not(done: int, share: float, seed: int) -> None:
    lengths = [100.0, 12.0] * 3 + [100.0]
    way = (sum(lengths[:done]) + share * lengths[done]) / sum(lengths)
    assert completed(mission(*LAWN), sailed(LAWN, way, 0.2, np.random.default_rng(seed)), 2.0) == done


def test_a_mission_that_was_sailed_to_its_end_is_completed_and_an_empty_track_completes_nothing() -> None:
    assert completed(mission(*LAWN), sailed(LAWN, 1.0, 0.0, np.random.default_rng(0)), 2.0) == 7
    assert completed(mission(*LAWN), np.empty((0, 2)), 2.0) == 0
    assert completed(mission(*LAWN), np.full((5, 2), np.nan), 2.0) == 0


@pytest.mark.long
def test_the_planned_motion_of_a_vessel_completes_every_leg_as_far_as_it_has_come() -> None:
    """Corners are cut, and a stop is not overshot."""
    points = [*mission(*LAWN).points]
    points[3] = points[3]._replace(corner="stop", hold=5.0)
    given = Mission(tuple(point._replace(speed=1.0) for point in points), False)
    p = load_scenario("survey", {f"reference_ship.{key}": value for key, value in parameters_of(given).items()}).reference_ship
    reference = make_reference(p, 0.5)
    table = reference.constants.table  # type: ignore[attr-defined]
    track = table.rows[:, :2]
    assert completed(given, track, 2.0) == 7
    counts = [completed(given, track[:n], 2.0) for n in range(1, len(track), 25)]
    assert counts == sorted(counts)
    assert {*counts} >= {0, 1, 2, 3, 4, 5, 6}


def test_the_parameters_of_a_mission_are_its_waypoints_speeds_corners_holds_and_headings() -> None:
    one = MissionPoint((1.0, 2.0), "a", 1.5, 10.0, -0.5 * math.pi, "stop")
    given = Mission((one, MissionPoint((30.0, 4.0), "b")), False)
    p = build(ReferenceShipParameters, parameters_of(given), "reference_ship")
    first, second = waypoints_of(p.path, 0.9)
    assert (p.mode, first.position, first.speed, first.corner, first.hold) == ("path", 1 + 2j, 1.5, "stop", 10.0)
    assert first.heading == pytest.approx(1.5 * math.pi)
    assert (second.position, second.speed, second.corner, second.hold, second.heading) == (30 + 4j, 0.9, "through", 0.0, None)


def test_what_a_path_message_cannot_hold_is_named_by_item() -> None:
    point = MissionPoint((1.0, 2.0), "a")
    given = Mission(
        (point, point._replace(speed=1.0, item="b"), point._replace(hold=3.0, corner="stop", heading=0.0, item="c"), point), False
    )
    assert [(item.item, item.what) for item in unsendable(given)] == [
        ("b", "speed 1 m/s"),
        ("c", "hold 3 s, heading, corner stop"),
    ]


def test_a_mission_that_leaves_its_own_fence_is_refused_by_leg() -> None:
    inclusion, exclusion = Fence(SQUARE, True, "fence polygon 1"), Fence(((50.0, 50.0),), False, "fence circle 1", 10.0)
    fine = mission((10.0, 10.0), (90.0, 10.0), (90.0, 90.0), fences=(inclusion, exclusion))
    assert leaving_fence(fine) == []
    wrong = leaving_fence(mission((10.0, 10.0), (90.0, 90.0), (110.0, 50.0), (120.0, 0.0), fences=(inclusion, exclusion)))
    assert [(item.item, item.what) for item in wrong] == [("item 3", "its leg and 1 more"), ("item 2", "its leg")]
    assert "fence polygon 1" in wrong[0].why
    with pytest.raises(ScenarioError, match="must have a waypoint"):
        leaving_fence(Mission())


def test_an_area_that_leaves_the_fence_is_refused() -> None:
    inclusion = Fence(SQUARE, True, "fence polygon 1")
    areas = tuple(Fence(((10.0, 10.0), (x, 10.0), (50.0, 50.0)), True, f"to {x:g}") for x in (90.0, 110.0))
    assert [item.item for item in leaving_fence(mission(areas=areas, fences=(inclusion,)))] == ["to 110"]


def test_a_planned_way_whose_turns_leave_the_fence_is_refused() -> None:
    points = [(60.0, 0.0), (60.0, 10.0), (0.0, 10.0)]
    values = {**parameters_of(mission(*points)), "path.speeds": [1.0], "path.corners": ["over"]}
    track = track_of(
        load_scenario("survey", {f"reference_ship.{key}": value for key, value in values.items()}).reference_ship, 0.5
    )
    assert track is not None
    fences = [Fence(((-20.0, -20.0), (x, -20.0), (x, 30.0), (-20.0, 30.0)), True, f"to {x:g}") for x in (61.0, 90.0)]
    given = mission((0.0, 0.0), *points, fences=tuple(fences))
    assert leaving_fence(given) == []
    assert [item.why for item in way_leaving_fence(track, fences)] == ["it leaves the area to stay in, to 61"]


CONCAVE = ((0.0, 0.0), (30.0, 0.0), (30.0, 30.0), (20.0, 30.0), (20.0, 10.0), (10.0, 10.0), (10.0, 30.0), (0.0, 30.0))


@pytest.mark.parametrize(
    ("a", "b", "kept"),
    [
        ((5.0, 25.0), (25.0, 25.0), False),  # across the bay
        ((5.0, 5.0), (25.0, 5.0), True),
        ((0.0, 0.0), (30.0, 0.0), False),  # along a side, which the controller's guard would not let it sail
        ((0.0, 30.0), (30.0, 30.0), False),  # along two sides, with the bay between them
        ((10.0, 10.0), (20.0, 10.0), False),
        ((5.0, 5.0), (5.0, 31.0), False),
    ],
)
def test_a_leg_stays_within_a_concave_area_only_with_all_of_it(
    a: tuple[float, float], b: tuple[float, float], kept: bool
) -> None:
    legs = [complex(*a), complex(*b)]
    assert (not breaches(legs, [Fence(CONCAVE, True, "f")], ["a", "b"])) == kept


@pytest.mark.long
@settings(max_examples=300, deadline=None)
@given(
    st.lists(st.tuples(*[st.floats(-150, 150)] * 2), min_size=2, max_size=2),
    st.integers(3, 7),
    st.floats(0.0, 6.0),
    st.booleans(),
)
def test_a_leg_keeps_to_a_fence_if_all_of_its_points_do(
    ends: list[tuple[float, float]], n: int, turned: float, inside: bool
) -> None:
    corners = [100.0 * cmath.exp(1j * (turned + 2 * math.pi * k / n)) for k in range(n)]
    a, b = (complex(*end) for end in ends)
    # A convex polygon: a point is inside if it is to port of every side.
    margins = np.array(
        [
            [((d - c).conjugate() * (p - c)).imag / abs(d - c) for c, d in zip(corners, [*corners[1:], corners[0]], strict=True)]
            for p in a + np.linspace(0, 1, 400) * (b - a)
        ]
    )
    depth = margins.min(axis=1)
    clear = depth.min() if inside else -depth.max()
    if abs(clear) < 1.0:  # between two of the points
        return
    fence = Fence(tuple((c.real, c.imag) for c in corners), inside, "f")
    assert (not breaches([a, b], [fence], ["a", "b"])) == (clear > 0.0)
