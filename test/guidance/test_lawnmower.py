"""Surveys: legs where they are required, U-turns that the hull can sail, for boats of any size."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from durations import rest_long
from hulls import COUPLING
from hypothesis import given, settings
from hypothesis import strategies as st

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.schema import build
from vessel_hsmc_ros.guidance.factory import ReferenceShipParameters, make_reference, travel_limits
from vessel_hsmc_ros.guidance.lawnmower import plan_lawnmower, rectangle_legs, u_turn
from vessel_hsmc_ros.guidance.route import CONSTANT, FREE, Element, Route, Section, SpeedProfile, displacement, phases, turn
from vessel_hsmc_ros.guidance.sailing import Sailing, excesses, turning_at
from vessel_hsmc_ros.guidance.timetable import motion_at
from vessel_hsmc_ros.plant.dynamics import unforced_sway
from vessel_hsmc_ros.scenario.own_ship import MainData, scenario_text
from vessel_hsmc_ros.scenario.scenario import parse_scenario

START = (3.0, 4.0, 0.7)
COUPLED = {f"vessel.{name}": value for name, value in COUPLING.items()}


def parameters(**values: Any) -> ReferenceShipParameters:
    given = {"mode": "lawnmower", "initial_pose": list(START), "lawnmower.leg_length": 150.0, **values}
    return build(ReferenceShipParameters, given, "reference_ship")


def planned(p: ReferenceShipParameters) -> Sailing:
    x, y, course = p.initial_pose
    return plan_lawnmower(p.lawnmower, p.vessel.coefficients(), travel_limits(p), (x, y, course))


def boat(length: float, **values: Any) -> ReferenceShipParameters:
    """The survey that `init` writes for a boat of which the length is known."""
    ship = parse_scenario(scenario_text("boat", MainData(length=length)), "boat", source="boat")
    return ship.changed({"reference_ship.mode": "lawnmower", **values}).reference_ship


def states_of(sailing: Sailing, count: int = 4000) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times off the rows of the table, states (n, 6) and accelerations (n, 3)."""
    times = np.linspace(0.0, sailing.profile.times[-1], count + 1)[:-1] + 1e-4
    motions = [motion_at(float(t), sailing.table) for t in times]
    return times, np.array([m for m, _ in motions]), np.array([a for _, a in motions])


@pytest.mark.parametrize("angle", [0.05, -1.2, math.pi, 5.0])
def test_a_turn_has_its_angle_and_continuous_curvature(angle: float) -> None:
    route = Route([Element(turn(angle, 10.0, 8.0), 0, turn=True)], START)
    assert route.course(route.length) == pytest.approx(START[2] + angle)
    s = np.linspace(0.0, route.length, 2001)
    kappa, slope = route.curvature(s)
    assert np.abs(kappa).max() <= 0.1 + 1e-12
    assert (kappa[0], kappa[-1]) == pytest.approx((0.0, 0.0))
    np.testing.assert_allclose(np.gradient(kappa, s)[1:-1], slope[1:-1], atol=1e-4)
    np.testing.assert_allclose(np.gradient(route.position(s), s)[1:-1], np.exp(1j * route.course(s))[1:-1], atol=1e-4)


def test_an_arc_with_short_transitions_is_a_circle() -> None:
    assert displacement(turn(math.pi, 10.0, 1e-3)) == pytest.approx(20j, abs=2e-3)


@pytest.mark.parametrize("spacing", [100.0, -30.0, 22.0, 5.0, -0.1])
def test_a_u_turn_ends_abreast_on_the_next_leg(spacing: float) -> None:
    pieces = u_turn(spacing, 10.0, 6.0)
    assert displacement(pieces) == pytest.approx(1j * spacing, abs=1e-9)
    assert max(abs(k) for piece in pieces for k in piece[1:]) <= 0.1 + 1e-12
    assert Route([Element(pieces, 0, turn=True)], (0.0, 0.0, 0.0)).course(1e9) == pytest.approx(math.copysign(math.pi, spacing))


def test_the_speed_rises_and_falls_within_the_acceleration_as_far_as_the_legs_allow() -> None:
    sections = [Section(50.0, 2.0, FREE), Section(10.0, 0.5, CONSTANT), Section(1.0, 2.0, FREE), Section(30.0, 1.0, FREE)]
    profile = SpeedProfile(phases(sections, 0.1))
    t = np.linspace(0.0, profile.times[-1], 20001)
    s, W, rate = profile.at(t)
    assert s[-1] == pytest.approx(91.0)
    assert (W[0], W[-1]) == (0.0, 0.0)
    np.testing.assert_allclose(np.gradient(s, t), W, atol=1e-4)
    np.testing.assert_allclose(np.gradient(W, t), rate, atol=5e-4)
    assert np.abs(rate).max() == pytest.approx(0.1, rel=1e-3)
    assert 1.5 < W[s < 50.0].max() <= 2.0
    np.testing.assert_allclose(W[(s > 50.0) & (s < 60.0)], 0.5)
    np.testing.assert_allclose(profile.at(profile.time_at(np.array([7.0, 55.0])))[0], [7.0, 55.0])


def test_the_legs_lie_in_the_rectangle_in_their_order() -> None:
    sailing = planned(parameters(**{"lawnmower.spacing": -25.0, "lawnmower.legs": 3}))
    _, states, _ = states_of(sailing)
    x, y, course = START
    local = (states[:, 0] - x + 1j * (states[:, 1] - y)) * np.exp(-1j * course)
    inside = (local.real > 1e-6) & (local.real < 150.0 - 1e-6)
    # Within the rectangle the ship is on a leg, and in the order of the legs.
    nearest = np.round(local.imag[inside] / -25.0)
    assert np.abs(local.imag[inside] + 25.0 * nearest).max() < 1e-6
    assert np.all(np.diff(nearest) >= 0.0)
    assert set(nearest) == {0.0, 1.0, 2.0}
    assert local[-1] == pytest.approx(150.0 - 50.0j, abs=0.01)


@pytest.mark.parametrize(
    ("changes", "spacing"),
    rest_long(
        [
            ({}, 20.0),
            (COUPLED, 20.0),
            (COUPLED, 250.0),
            ({"vessel.sway_inertia": 1.0e5}, 250.0),
            ({"vessel.sway_inertia": 1.2e5}, 20.0),
        ]
    ),
)
def test_the_motion_is_one_of_the_hull_without_a_sway_force(changes: dict[str, Any], spacing: float) -> None:
    p = parameters(**{"lawnmower.spacing": spacing, **changes})
    sailing, vessel = planned(p), p.vessel.coefficients()
    times, states, accelerations = states_of(sailing)
    u, v, r = states[:, 3:].T
    unforced = np.array([unforced_sway(*row, vessel) for row in zip(u, v, r, accelerations[:, 2], strict=True)])
    assert np.abs(accelerations[:, 1] - unforced).max() < 5e-3 * np.abs(unforced).max()
    # Velocities and accelerations are the derivatives of the pose.
    h = 1e-3
    later = np.array([motion_at(float(t) + h, sailing.table)[0] for t in times])
    velocity = np.column_stack((u * np.cos(states[:, 2]) - v * np.sin(states[:, 2]), r))
    np.testing.assert_allclose((later - states)[:, [0, 2]] / h, velocity, atol=1e-3)
    np.testing.assert_allclose((later - states)[:, 3:] / h, accelerations, atol=1e-3)


def test_the_geometry_is_that_of_the_route_and_at_its_speed() -> None:
    sailing = planned(parameters())
    times, states, _ = states_of(sailing)
    off = np.abs(states[:, 0] + 1j * states[:, 1] - sailing.route.position(sailing.profile.at(times)[0]))
    assert off.max() < 1e-6
    np.testing.assert_allclose(np.hypot(states[:, 3], states[:, 4]), sailing.profile.at(times)[1], atol=1e-5)


def test_port_and_starboard_are_mirror_images() -> None:
    port, starboard = (states_of(planned(parameters(**{"lawnmower.spacing": side * 30.0})), 400)[1] for side in (1.0, -1.0))
    np.testing.assert_allclose(starboard[:, 3:], port[:, 3:] * (1.0, -1.0, -1.0), atol=1e-6)


@settings(max_examples=6, deadline=None)
@given(st.floats(math.log(0.5), math.log(300.0)), st.floats(0.2, 30.0), st.sampled_from([0.0, 0.15]))
def test_a_boat_of_any_size_keeps_its_limits(logarithm: float, spacing: float, current: float) -> None:
    length = math.exp(logarithm)
    p = boat(length)
    lawnmower = replace(p.lawnmower, spacing=spacing * length)
    p = replace(p, lawnmower=lawnmower, motion=replace(p.motion, current=current * lawnmower.speed))
    sailing = planned(p)
    assert not excesses(sailing.motion, travel_limits(p))
    times, states, _ = states_of(sailing, 300)
    s, W, _ = sailing.profile.at(times)
    assert np.abs(states[:, 0] + 1j * states[:, 1] - sailing.route.position(s)).max() < 1e-5 * length
    # Never slower than on the legs but for the start and the end.
    assert W[(s > 6.0 * length) & (s < sailing.route.length - 6.0 * length)].min() > 0.99 * lawnmower.speed


@pytest.mark.parametrize("logarithm", rest_long([5.3, 5.375, 5.4]))
def test_turns_that_just_keep_the_yaw_rate_alone_keep_it_in_a_survey_at_full_speed(logarithm: float) -> None:
    length = math.exp(logarithm)
    p = boat(length, **{"reference_ship.lawnmower.spacing": 16.0 * length})
    sailing = planned(p)
    assert not excesses(sailing.motion, travel_limits(p))
    s, W, _ = sailing.profile.at(np.linspace(0.0, sailing.profile.times[-1], 2000))
    on_the_way = (s > 6.0 * length) & (s < sailing.route.length - 6.0 * length)
    np.testing.assert_allclose(W[on_the_way], p.lawnmower.speed, rtol=1e-9)


@pytest.mark.long
def test_a_survey_of_three_hundred_legs_is_sailed() -> None:
    p = boat(4.0, **{"reference_ship.lawnmower.legs": 300})
    sailing = planned(p)
    assert sum(not element.turn and element.leg >= 0 for element in sailing.route.elements) == 300
    assert not excesses(sailing.motion, travel_limits(p))


def test_surveys_are_similar_in_the_units_of_the_boat() -> None:
    radii = [turning_at(p.lawnmower.speed, p.vessel.coefficients(), travel_limits(p)).radius for p in map(boat, (1.0, 100.0))]
    # By rules of thumb the draught, and so the hull, is not quite similar.
    assert 60.0 < radii[1] / radii[0] < 600.0


def test_a_set_radius_slows_the_turns_only() -> None:
    p = boat(5.0, **{"reference_ship.lawnmower.turn_radius": 2.0})
    sailing = planned(p)
    s, W, _ = sailing.profile.at(np.linspace(0.0, sailing.profile.times[-1], 5000))
    bent = sailing.route.curvature(s)[0] != 0.0
    assert W[bent].max() < 0.7 * p.lawnmower.speed
    assert W.max() == pytest.approx(p.lawnmower.speed)
    assert np.abs(sailing.route.curvature(s)[0]).max() == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"lawnmower.spacing": 0.0}, r"reference_ship\.lawnmower\.spacing must have a magnitude .*got 0 m"),
        ({"lawnmower.speed": 9.0}, r"lawnmower\.speed = 9 m/s needs a surge force of .* at most [\d.]+ m/s would do"),
        ({"lawnmower.speed": 2.0, "motion.current": 7.0}, r"= 2 m/s against a current of 7 m/s needs a surge force"),
        ({"lawnmower.turn_radius": 0.01}, r"lawnmower\.turn_radius: no turn .* 0\.01 m .*; [\d.]+ m at 1\.5 m/s would do"),
    ],
)
def test_a_survey_that_cannot_be_sailed_is_one_line_with_what_would_do(changes: dict[str, Any], reason: str) -> None:
    limited = {"vessel.surge_force_limit": 2e5, "vessel.yaw_moment_limit": 3e6, "vessel.name": "mine"}
    with pytest.raises(ParameterError, match=reason):
        make_reference(parameters(**{**limited, **changes}), 0.1)


def test_after_the_last_leg_the_ship_rests_where_it_ended() -> None:
    reference = make_reference(parameters(**{"lawnmower.legs": 1}), 10.0)
    for _ in range(100):
        reference.advance()
    x, y, course = START
    assert reference.state == pytest.approx([x + 150.0 * math.cos(course), y + 150.0 * math.sin(course), course, 0, 0, 0])
    np.testing.assert_array_equal(reference.acceleration(), 0.0)
    reference.reset()
    assert reference.state == pytest.approx([x, y, course, 0, 0, 0])


@pytest.mark.parametrize("length", rest_long([0.6, 250.0]))
def test_a_rectangle_is_surveyed_between_its_long_sides_from_the_nearest_corner(length: float) -> None:
    size = {"rectangle": [30.0 * length, -25.0 * length, 20.0 * length, 11.0 * length], "heading": 0.5, "spacing": -4.0 * length}
    p = boat(length, **{f"reference_ship.lawnmower.{name}": value for name, value in size.items()})
    reference: Any = make_reference(p, 0.02)
    legs = (np.array(reference.track.waypoints) / length - complex(30.0, -25.0)) * np.exp(-0.5j)
    # In the axes of the rectangle, from its center: the corner nearest to the start is ahead of it and to port.
    assert np.abs(legs.real) == pytest.approx(10.0)
    assert legs.imag == pytest.approx(np.repeat([5.5, 5.5 / 3.0, -5.5 / 3.0, -5.5], 2))
    assert np.sign(legs.real) == pytest.approx([-1.0, 1.0, 1.0, -1.0, -1.0, 1.0, 1.0, -1.0])
    first, last = (motion_at(t, reference.constants.table)[0] for t in (0.0, 1e9))
    assert first == pytest.approx((*p.initial_pose, 0.0, 0.0, 0.0))
    assert complex(last.x, last.y) == pytest.approx(reference.track.waypoints[-1], abs=1e-6 * length)
    times = np.linspace(0.0, reference.constants.table.times[-1], 500)
    states = np.array([motion_at(float(t), reference.constants.table)[0] for t in times])
    assert np.abs(states[:, 5]).max() <= 1.001 * p.motion.yaw_rate
    assert np.hypot(*states[:, 3:5].T).max() <= 1.001 * p.lawnmower.speed
    (sailed,) = reference.track.stretches
    on = times > sailed.begin
    off = states[on, 0] + 1j * states[on, 1] - sailed.route.position(sailed.profile.at(times[on] - sailed.begin)[0])
    assert np.abs(off).max() < 1e-3 * length


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"rectangle": [1.0, 2.0, 100.0, 0.0]}, r"rectangle must be .*got \[1.0, 2.0, 100.0, 0.0\]"),
        ({"rectangle": [1.0, 2.0, 100.0]}, "must be x, y of the center"),
        ({"rectangle": [1.0, 2.0, 100.0, 50.0], "spacing": 0.0}, r"spacing must have a magnitude of at least 0.01 m \(got 0 m\)"),
        ({"rectangle": [0.0, 0.0, 100.0, 80.0]}, "run_in must be above 0 m with a rectangle"),
    ],
)
def test_what_is_no_rectangle_is_refused(values: dict[str, Any], message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        make_reference(parameters(**{f"lawnmower.{name}": value for name, value in values.items()}), 0.02)


@pytest.mark.parametrize("spacing", [0.3, -0.7, 25.0])
def test_a_width_of_whole_spacings_has_no_leg_more_for_the_rounding_of_their_quotient(spacing: float) -> None:
    """And one that is wider by a little has one more, as no two legs may be further apart than the spacing."""
    for gaps in range(1, 60):
        width = round(gaps * abs(spacing), 9)
        assert len(rectangle_legs((0.0, 0.0, 10.0, width), 0.3, spacing, 0j).strips) == gaps + 1
        wider = rectangle_legs((0.0, 0.0, 10.0, 1.001 * width), 0.3, spacing, 0j)
        assert len(wider.strips) == gaps + 2
        assert abs(wider.spacing) == pytest.approx(1.001 * width / (gaps + 1))
