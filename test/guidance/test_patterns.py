"""Search patterns and surveys of polygons: where they go, and that a vessel sails them."""

import cmath
import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from durations import rest_long
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.metrics import NO_LEG
from vessel_hsmc_ros.guidance.curves import ExpandingSquareParameters, SpiralParameters
from vessel_hsmc_ros.guidance.factory import make_reference, track_of
from vessel_hsmc_ros.guidance.lawnmower import polygon_legs
from vessel_hsmc_ros.guidance.planned_track import PlannedTrack, leg_count
from vessel_hsmc_ros.guidance.waypoints import apart
from vessel_hsmc_ros.scenario.scenario import load_scenario

NAME = "reference_ship.lawnmower.polygon"


def planned(mode: str, **values: Any) -> PlannedTrack:
    changes = {f"reference_ship.{mode}.{name}": value for name, value in values.items()}
    track = track_of(load_scenario("survey", {"reference_ship.mode": mode, **changes}).reference_ship, 0.05)
    assert track is not None
    return track


@settings(max_examples=100, deadline=None)
@given(st.integers(1, 30), st.floats(0.5, 500.0), st.sampled_from([1.0, -1.0]), st.floats(-3.0, 3.0))
def test_the_tracks_of_an_expanding_square_are_a_spacing_apart_on_its_side(n: int, d: float, side: float, course: float) -> None:
    start = 3.0 - 4.0j
    found = ExpandingSquareParameters(legs=n, spacing=side * d).places(start, course)
    legs = np.diff([start, *found])
    np.testing.assert_allclose(np.abs(legs), [d * (k // 2 + 1) for k in range(n)])
    assert cmath.phase(legs[0] * cmath.exp(-1j * course)) == pytest.approx(0.0, abs=1e-9)
    for a, b in pairwise(legs):
        assert cmath.phase(b / a) == pytest.approx(side * 0.5 * math.pi)


@settings(max_examples=100, deadline=None)
@given(st.floats(0.2, 9.0), st.floats(0.5, 50.0), st.floats(1.0, 90.0), st.sampled_from([1.0, -1.0]), st.floats(-3.0, 3.0))
def test_a_spiral_begins_on_its_course_and_grows_by_its_spacing_a_turn(
    turns: float, d: float, radius: float, side: float, course: float
) -> None:
    start = -7.0 + 2.0j
    points = np.array(SpiralParameters(radius=radius, spacing=side * d, turns=turns).places(start, course))
    angle = side * (0.5 * math.pi + math.atan2(d / (2.0 * math.pi), radius))
    centre = start + radius * cmath.exp(1j * (course + angle))
    assert abs(points[-1] - centre) == pytest.approx(radius + d * turns)
    assert np.all(np.diff(np.abs(points - centre)) > 0.0)
    turned = np.unwrap(np.angle(np.concatenate(([start], points)) - centre))
    assert turned[-1] - turned[0] == pytest.approx(side * 2.0 * math.pi * turns)
    first = SpiralParameters(radius=radius, spacing=side * d, turns=0.1).places(start, course)[0] - start
    step = 2.0 * math.pi / len(points) * turns
    assert abs(cmath.phase(first * cmath.exp(-1j * course))) < step


@pytest.mark.parametrize("side", rest_long([1.0, -1.0]))
def test_a_vessel_sails_the_patterns_within_a_corner_of_their_tracks(side: float) -> None:
    square = planned("expanding_square", spacing=20.0 * side, legs=6, speed=1.0)
    spiral = planned("spiral", spacing=15.0 * side, radius=15.0, turns=1.5, speed=1.0)
    for track, off in ((square, 5.0), (spiral, 0.5)):
        points = np.array([0j, *track.waypoints])
        sailed = track.stretches[0].route.position(np.linspace(0.0, track.stretches[0].route.length, 2000))
        assert apart(sailed, points).max() < off
        assert apart(points, sailed).max() < off


@pytest.mark.parametrize("mode", ["expanding_square", "spiral"])
def test_a_pattern_without_a_spacing_or_that_is_too_tight_is_refused(mode: str) -> None:
    with pytest.raises(ParameterError, match=rf"{mode}.spacing must have a magnitude of at least 0.01 m \(got 0 m\)"):
        planned(mode, spacing=0.0)
    with pytest.raises(ParameterError, match=rf"reference_ship.{mode}: speed"):
        planned(mode, speed=50.0)


def test_a_pattern_waits_for_its_vessel() -> None:
    changes = {
        "reference_ship.mode": "expanding_square",
        "reference_ship.follow": "vessel",
        "reference_ship.expanding_square.legs": 3,
    }
    p = load_scenario("survey", {**changes, "reference_ship.expanding_square.speed": 1.0}).reference_ship
    reference = make_reference(p, 0.5)
    for _ in range(40):
        reference.advance()  # without a position of the vessel
    assert reference.state[:2] == pytest.approx([0.0, 0.0])


def convex(n: int, radii: list[float], turned: float) -> list[complex]:
    """A polygon about the origin, in which each ray crosses the border once; convex for equal radii."""
    return [radii[k % len(radii)] * cmath.exp(1j * (turned + 2.0 * math.pi * k / n)) for k in range(n)]


@pytest.mark.long
@settings(max_examples=150, deadline=None)
@given(
    st.integers(3, 9),
    st.floats(0.0, 6.0),
    st.floats(-3.0, 3.0),
    st.floats(3.0, 150.0),
    st.sampled_from([1.0, -1.0]),
    st.tuples(st.floats(-300, 300), st.floats(-300, 300)),
)
def test_every_point_of_a_polygon_is_within_half_a_swath_of_a_leg(
    n: int, turned: float, heading: float, swath: float, side: float, here: tuple[float, float]
) -> None:
    corners = convex(n, [100.0], turned)
    flat = tuple(value for p in corners for value in (p.real, p.imag))
    legs = polygon_legs(flat, heading, side * swath, complex(*here), NAME)
    ends, place, course = [], legs.begin, cmath.exp(1j * legs.course)
    assert legs.strips[0].before == 0.0
    assert abs(legs.spacing) <= swath * (1.0 + 1e-9)
    for k, strip in enumerate(legs.strips):
        place += strip.before * course
        ends.append((place, place + strip.leg * course))
        place += (strip.leg + strip.after) * course
        place += (-1.0) ** k * legs.spacing * 1j * course  # the turn ends abreast
        course = -course
    rng = np.random.default_rng(n)
    weights = rng.dirichlet(np.full(n, 0.4), 300)
    inside = weights @ np.array(corners)
    distance = np.min([apart(inside, np.array(leg)) for leg in ends], axis=0)
    assert distance.max() <= 0.5 * abs(legs.spacing) + 1e-6
    length = sum(abs(b - a) for a, b in ends)
    assume(swath < 20.0)
    assert length * abs(legs.spacing) < 1.6 * 0.5 * n * 100.0**2 * math.sin(2.0 * math.pi / n) + 250.0 * swath


def test_a_polygon_is_begun_at_the_end_of_a_leg_that_is_nearest() -> None:
    square = (0.0, 0.0, 100.0, 0.0, 100.0, 40.0, 0.0, 40.0)
    for here, begin, course, spacing in (
        (-10.0 - 10.0j, 0.0 + 5.0j, 0.0, 10.0),
        (110.0 - 10.0j, 100.0 + 5.0j, math.pi, -10.0),
        (-10.0 + 50.0j, 0.0 + 35.0j, 0.0, -10.0),
        (110.0 + 50.0j, 100.0 + 35.0j, math.pi, 10.0),
    ):
        legs = polygon_legs(square, 0.0, 10.0, here, NAME)
        assert legs.begin == pytest.approx(begin)
        assert [abs(legs.course), legs.spacing] == pytest.approx([course, spacing])
        assert [strip.leg for strip in legs.strips] == pytest.approx([100.0] * 4)


BAY = (0.0, 0.0, 90.0, 0.0, 90.0, 60.0, 60.0, 60.0, 60.0, 20.0, 30.0, 20.0, 30.0, 60.0, 0.0, 60.0)


def test_a_polygon_that_a_leg_would_leave_is_refused_and_another_heading_does() -> None:
    with pytest.raises(ParameterError, match=r"must be crossed by each leg once .*: another heading, or two polygons would do"):
        polygon_legs(BAY, 0.0, 10.0, 0j, NAME)
    assert len(polygon_legs(BAY, 0.5 * math.pi, 10.0, 0j, NAME).strips) == 9


@pytest.mark.parametrize(
    ("corners", "reason"),
    [
        ((1.0, 2.0, 3.0, 4.0), "must have x and y of at least 3 corners"),
        ((1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0), "got 7 numbers"),
        ((0.0, 0.0, 10.0, 0.0, 20.0, 0.0), "must have an area"),
    ],
)
def test_a_polygon_without_an_area_is_refused(corners: tuple[float, ...], reason: str) -> None:
    with pytest.raises(ParameterError, match=reason):
        polygon_legs(corners, 0.0, 10.0, 0j, NAME)


@pytest.mark.long
def test_a_vessel_sails_all_legs_of_a_polygon_with_its_own_turns() -> None:
    corners = [20.0, 40.0, 90.0, 60.0, 110.0, 120.0, 30.0, 140.0]
    values = {"polygon": corners, "spacing": 20.0, "heading": 0.2, "run_in": 20.0, "speed": 1.0}
    track = planned("lawnmower", **values)
    legs = polygon_legs(tuple(corners), 0.2, 20.0, 0j, NAME)
    assert leg_count(track) == len(legs.strips)
    (stretch,) = track.stretches
    lengths = {element.leg: element.length for element in stretch.route.elements if not element.turn and element.leg != NO_LEG}
    assert [*lengths.values()] == pytest.approx([strip.leg for strip in legs.strips])
    with pytest.raises(ParameterError, match="run_in must be above 0 m with a rectangle or a polygon"):
        planned("lawnmower", **{**values, "run_in": 0.0})
    with pytest.raises(ParameterError, match="rectangle must be left out with a polygon"):
        planned("lawnmower", **values, rectangle=[0.0, 0.0, 100.0, 50.0])
