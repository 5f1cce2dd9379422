"""The estimate of the current against ships and references whose current is known."""

import math

import pytest

from vessel_hsmc_ros.core.kinematics import Motion
from vessel_hsmc_ros.core.metrics import position_error, rms
from vessel_hsmc_ros.guided.current_estimate import (
    MAX_CURRENT,
    MAX_DISTANCE,
    STILL_WATER,
    Current,
    credible_part,
    guiding_current,
    in_body,
    informative_angle,
    learn_current,
    mean,
    speed_squared,
    turn_in_water,
)
from vessel_hsmc_ros.guided.parameters import GuidedParameters, gains
from vessel_hsmc_ros.law.known_vessel import INSTANT, KnownVessel
from vessel_hsmc_ros.runs.offline import load_scenario, simulate

G = gains(GuidedParameters(), KnownVessel(surge_lag=2.0, yaw_lag=2.0), 0.02)
SPEED, RATE, THETA = 2.0, 0.07, -0.8
CURRENT = Current(0.3, -0.4, THETA)


def after(current: Current, motion: Motion, speed: float, feedback_squared: float = 0.0, g=G) -> Current:
    """The estimate one period later, with a reference of a speed."""
    return learn_current(current, motion, motion.v, 0.0, informative_angle(motion.r, feedback_squared, speed**2, False, g), g)


def turned(current: Current, angle: float, g=G, true: Current = CURRENT, near: bool = True) -> Current:
    """The estimate after a steady turn through the water by an angle, from still water."""
    for k in range(round(angle / (RATE * g.T))):
        psi = k * RATE * g.T
        ahead, port = in_body(true, psi)
        motion = Motion(0.0, 0.0, psi, SPEED + ahead, THETA * SPEED * RATE + port, RATE)
        current = after(current, motion, SPEED, 0.0 if near else g.v_max**2, g)
    return current


def test_a_current_to_the_east_is_ahead_of_a_ship_heading_east_and_to_starboard_of_one_heading_north() -> None:
    assert in_body(Current(1.0, 0.0, 0.0), 0.0) == pytest.approx((1.0, 0.0))
    assert in_body(Current(1.0, 0.0, 0.0), math.pi / 2) == pytest.approx((0.0, -1.0))


def test_three_turns_show_the_current_and_the_sway_of_the_turn() -> None:
    assert turned(STILL_WATER, 6 * math.pi) == pytest.approx(CURRENT, abs=0.02)


def test_a_ship_of_still_water_has_no_current_after_three_turns() -> None:
    found = turned(STILL_WATER, 6 * math.pi, true=Current(0.0, 0.0, THETA))
    assert math.hypot(found.east, found.north) < 0.01


def test_on_a_straight_path_and_far_from_the_reference_nothing_is_learned_or_forgotten() -> None:
    straight = Motion(0.0, 0.0, 0.3, 2.0, 0.2, 0.0)
    assert after(CURRENT, straight, SPEED) == CURRENT
    assert turned(CURRENT, 1.0, near=False, true=STILL_WATER) == CURRENT


@pytest.mark.parametrize("speed", [0.0, 0.3])
def test_what_is_used_of_the_estimate_stays_below_the_speed_of_the_reference_and_vanishes_at_rest(speed: float) -> None:
    there = Motion(0.0, 0.0, 0.0, speed, 0.0, 0.05)
    used = guiding_current(CURRENT, (0.0, 0.0), 0.0, there, there, G)
    assert math.hypot(used.east, used.north) <= MAX_CURRENT * speed * (1 + 1e-12)


def test_a_ship_at_rest_in_a_steady_current_is_under_way_through_the_water_and_one_far_away_or_without_a_current_is_not() -> None:
    rest, steady = Motion(0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (10.0 * G.c_rest, -5.0 * G.c_rest)
    size = math.hypot(*steady)
    used = guiding_current(STILL_WATER, steady, size, rest, rest, G)
    assert (used.east, used.north) == pytest.approx(steady, rel=1e-3)
    assert speed_squared(used, 0.0, G) == pytest.approx(125.0 * G.c_rest**2, rel=1e-3)
    assert speed_squared(used, 4.0 * G.U_xi**2, G) == 4.0 * G.U_xi**2
    far = rest._replace(x=MAX_DISTANCE * G.v_max / G.k_p)
    assert guiding_current(STILL_WATER, steady, size, far, rest, G) == STILL_WATER
    doubtful = guiding_current(STILL_WATER, (0.1 * G.c_rest, 0.0), 0.1 * G.c_rest, rest, rest, G)
    assert 0.0 < doubtful.east < 1e-4 * 0.1 * G.c_rest
    moving = rest._replace(u=2.0 * G.U_xi)
    assert guiding_current(STILL_WATER, steady, size, rest, moving, G) == STILL_WATER


def test_the_mean_of_a_current_that_turns_with_the_ship_vanishes_and_a_steady_one_stays() -> None:
    turning, steady = (0.0, 0.0), (0.0, 0.0)
    for k in range(4000):
        turning = mean(turning, math.cos(0.01 * k), math.sin(0.01 * k), 0.08 * 0.01)
        steady = mean(steady, 1.0, 0.5, 0.08 * 0.01)
    assert math.hypot(*turning) < 0.1
    assert steady == pytest.approx((1.0, 0.5), rel=0.05)


def test_half_of_an_estimate_of_the_doubt_is_used_and_next_to_nothing_of_a_small_one() -> None:
    half, small = credible_part(Current(G.c_doubt, 0.0, THETA), G), credible_part(Current(0.1 * G.c_doubt, 0.0, THETA), G)
    assert half == pytest.approx((0.5 * G.c_doubt, 0.0, THETA))
    assert abs(small.east) < 1e-4 * 0.11 * G.c_doubt


@pytest.mark.parametrize("u", [2.0, -2.0])
@pytest.mark.parametrize("psi", [0.0, 1.0, 2.5, -2.0])
def test_the_turn_through_the_water_has_the_derivatives_that_it_states(psi: float, u: float) -> None:
    r, dr, h = 0.08, 0.01, 1e-3
    g = G._replace(v_0=0.0)

    def course_beyond(t: float) -> float:
        heading = psi + r * t + 0.5 * dr * t * t + (math.pi if u < 0.0 else 0.0)
        x, y = abs(u) * math.cos(heading), abs(u) * math.sin(heading)
        return math.remainder(math.atan2(y - CURRENT.north, x - CURRENT.east) - heading, 2.0 * math.pi)

    before, now, after = (course_beyond(t) for t in (-h, 0.0, h))
    added = turn_in_water(CURRENT, Motion(0.0, 0.0, psi, u, 0.0, r), dr, g)
    assert added.rate == pytest.approx((after - before) / (2.0 * h), abs=1e-6)
    assert added.acceleration == pytest.approx((after - 2.0 * now + before) / h**2, abs=1e-5)


def test_still_water_adds_nothing_to_the_turn_of_the_reference() -> None:
    assert turn_in_water(STILL_WATER, Motion(0.0, 0.0, 0.4, 2.0, -0.1, 0.05), 0.01, G) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("lag", [0.7, 2.0])
def test_a_circle_in_half_a_metre_per_second_of_current_is_tracked_to_five_centimetres(lag: float) -> None:
    changes: dict[str, object] = {f"controller.vessel.{name}": value for name, value in INSTANT.items()}
    changes |= {f"{node}.{each}_lag": lag for node in ("vessel_sim.actuators", "controller.vessel") for each in ("surge", "yaw")}
    changes |= {f"{node}.rate_hz": 20.0 for node in ("vessel_sim", "reference_ship", "controller")}
    changes |= {"controller.law": "guided", "vessel_sim.disturbance.current.east": 0.5, "vessel_sim.duration": 250.0}
    run = simulate(load_scenario("case2_tracking", changes))
    late = run.time > 200.0
    error = rms(position_error(run.state[late], run.reference[late]))
    assert error < 0.05


@pytest.mark.parametrize("known", [{}, {"sway_damping_rate": 0.05}], ids=["quick sway", "sway_damping_rate"])
@pytest.mark.parametrize("v", [0.0, 0.5, -0.5])
def test_as_much_of_the_current_is_used_astern_as_ahead(known: dict[str, float], v: float) -> None:
    g = gains(GuidedParameters(), KnownVessel(surge_inertia=120e3, **known), 0.02)  # type: ignore[arg-type]
    motions = (Motion(0.0, 0.0, 0.4, u, v, 0.05) for u in (2.0, -2.0))
    ahead, astern = (guiding_current(CURRENT, (0.0, 0.0), 0.0, each, each, g) for each in motions)
    assert ahead == astern
    assert math.hypot(astern.east, astern.north) > 0.3


@pytest.mark.parametrize("u", [2.0, -2.0])
def test_the_sway_that_the_turn_through_the_water_causes_has_the_derivative_that_it_states(u: float) -> None:
    """In a steady turn the sway is theta·u·r, through the water and over ground, ahead and astern."""
    psi, r, dr, h = 0.7, 0.08, 0.01, 1e-4
    g = G._replace(v_0=0.0)

    def beyond(t: float) -> float:
        heading, rate = psi + r * t + 0.5 * dr * t * t, r + dr * t
        added = turn_in_water(CURRENT, Motion(0.0, 0.0, heading, u, 0.0, rate), dr, g)
        through_water = math.hypot(u * math.cos(heading) - CURRENT.east, u * math.sin(heading) - CURRENT.north)
        return CURRENT.theta * (math.copysign(through_water, u) * (rate + added.rate) - u * rate)

    added = turn_in_water(CURRENT, Motion(0.0, 0.0, psi, u, 0.0, r), dr, g)
    assert added.dv == pytest.approx((beyond(h) - beyond(-h)) / (2.0 * h), abs=1e-5)
    assert abs(added.dv) > 2e-4


@pytest.mark.parametrize("near", [True, False])
def test_a_turn_to_starboard_shows_as_much_as_one_to_port(near: bool) -> None:
    port, starboard = (informative_angle(r, 0.0, 4.0, near, G) for r in (0.05, -0.05))
    assert starboard == port > 0.0
