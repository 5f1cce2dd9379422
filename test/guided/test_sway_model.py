"""The sway model and the current that are learned together, against hulls and currents that are known."""

import math

import numpy as np
import pytest
from compiling import only_compiled

from vessel_hsmc_ros.core.kinematics import GRAVITY, Motion
from vessel_hsmc_ros.core.metrics import position_error, rms
from vessel_hsmc_ros.guided.current_estimate import MAX_CURRENT_LOW_DAMPING, Current, guiding_current
from vessel_hsmc_ros.guided.parameters import GuidedParameters, gains
from vessel_hsmc_ros.guided.sway_model import (
    FORGOTTEN_A,
    FORGOTTEN_C,
    MIN_DECAY,
    decay_rate,
    first_sway,
    learn_sway,
    sway_prior,
    turn_slope,
)
from vessel_hsmc_ros.law.known_vessel import KnownVessel
from vessel_hsmc_ros.runs.offline import simulate
from vessel_hsmc_ros.scenario.own_ship import scenario_for, ship_of
from vessel_hsmc_ros.scenario.scenario import parse_scenario
from vessel_hsmc_ros.scenario.ship_rules import scale_of
from vessel_hsmc_ros.scenario.vessels import read_vessel

FERRY = KnownVessel(
    length=30.0, surge_inertia=5.6e5, sway_inertia=6.6e5, yaw_inertia=4e7, yaw_moment_limit=5e5, sway_damping_rate=0.05
)
PRIOR = sway_prior(FERRY)
T = 0.02


def turned(
    angle: float, current: tuple[float, float], damping: tuple[float, float, float], kappa: float = PRIOR.kappa
) -> np.ndarray:
    """What is learned of a hull that turns by an angle, at a rate that varies, with m22·dv = -m11·u·r - m22·A·v in a current."""
    sway, psi, v, angle_so_far, t = first_sway(PRIOR), 0.0, 0.0, 0.0, 0.0
    while angle_so_far < angle:
        u, r = 2.0, 0.03 + 0.015 * math.sin(0.02 * t)
        rate = damping[0] + damping[1] * abs(v) + damping[2] * abs(r)
        dv = -kappa * u * r - rate * v
        c, s = math.cos(psi), math.sin(psi)
        c_h, c_n = current[0] * c + current[1] * s, -current[0] * s + current[1] * c
        learn_sway(sway, Motion(0.0, 0.0, psi, u + c_h, v + c_n, r), v + c_n, dv - r * c_h, T * r, PRIOR)
        v, psi, t, angle_so_far = v + T * dv, psi + T * r, t + T, angle_so_far + T * r
    return sway


@pytest.mark.parametrize("current", [(0.0, 0.0), (0.5, 0.0), (-0.2, 0.4)])
@pytest.mark.parametrize("damping", [(0.05, 0.0, 0.0), (0.03, 0.03, 0.0), (0.1, 0.0, 0.5)])
def test_four_turns_show_the_current_and_the_sway_damping(
    current: tuple[float, float], damping: tuple[float, float, float]
) -> None:
    sway = turned(8.0 * math.pi, current, damping)
    assert sway[0, :2] == pytest.approx(current, abs=0.05)
    v = -PRIOR.kappa * 2.0 * 0.03 / 0.07
    actual = damping[0] + damping[1] * abs(v) + damping[2] * 0.03
    assert decay_rate(sway[0].tolist(), v, 0.03) == pytest.approx(actual, rel=0.15)


@pytest.mark.parametrize("error", [0.8, 1.2])
def test_a_ratio_of_inertias_that_is_a_fifth_off_leaves_the_current_nearly_as_it_is(error: float) -> None:
    sway = turned(8.0 * math.pi, (0.5, 0.0), (0.05, 0.0, 0.0), kappa=error * PRIOR.kappa)
    assert sway[0, :2] == pytest.approx((0.5, 0.0), abs=0.1)


def test_without_a_turn_nothing_changes() -> None:
    sway = first_sway(PRIOR)
    learn_sway(sway, Motion(0.0, 0.0, 0.3, 2.0, 0.4, 0.0), 0.4, 0.1, 0.0, PRIOR)
    np.testing.assert_array_equal(sway, first_sway(PRIOR))


def test_the_covariance_stays_positive_and_below_its_initial_value() -> None:
    sway = turned(100.0, (0.3, 0.1), (0.05, 0.02, 0.1))
    P = sway[1:]
    np.testing.assert_allclose(P, P.T, atol=1e-12)
    assert np.linalg.eigvalsh(P / np.sqrt(np.outer(PRIOR.spread, PRIOR.spread))).min() > 0.0
    assert (np.diag(P) <= np.array(PRIOR.spread) * (1.0 + 1e-9)).all()


def test_an_outlier_moves_the_estimate_by_a_bounded_step() -> None:
    once, largest = first_sway(PRIOR), first_sway(PRIOR)
    learn_sway(once, Motion(0.0, 0.0, 0.0, 2.0, 0.0, 0.03), 0.0, 1e6, 1e-3, PRIOR)
    learn_sway(largest, Motion(0.0, 0.0, 0.0, 2.0, 0.0, 0.03), 0.0, 1e3, 1e-3, PRIOR)
    np.testing.assert_array_equal(once, largest)


def test_no_damping_is_learned_that_would_feed_the_sway() -> None:
    sway = turned(10.0, (0.0, 0.0), (-0.01, 0.0, 0.0))
    assert sway[0, 2] >= MIN_DECAY * PRIOR.a
    assert (sway[0, 3:] >= 0.0).all()


@pytest.mark.parametrize("damping", [(0.05, 0.0, 0.0), (0.03, 0.04, 0.0), (0.03, 0.0, 0.6)])
def test_the_slope_is_the_change_of_the_sway_of_a_steady_turn(damping: tuple[float, float, float]) -> None:
    def steady(r: float) -> float:
        v = 0.0
        for _ in range(200):
            v = -PRIOR.kappa * 2.0 * r / (damping[0] + damping[1] * abs(v) + damping[2] * r)
        return v

    sway = first_sway(PRIOR)
    sway[0, 2:] = damping
    numerical = (steady(0.0301) - steady(0.0299)) / (2.0 * 0.0002)
    assert turn_slope(sway, steady(0.03), 0.03, PRIOR) == pytest.approx(numerical, rel=1e-3)


def test_less_of_the_current_is_used_where_the_reference_moves_as_fast_sideways_as_ahead() -> None:
    g = gains(GuidedParameters(), FERRY, T)

    def used(u: float, v: float) -> float:
        desired = Motion(0.0, 0.0, 0.0, u, v, 0.0)
        return guiding_current(Current(5.0, 0.0, 0.0), (0.0, 0.0), 0.0, desired, desired, g).east

    assert used(2.0, 0.0) == pytest.approx(MAX_CURRENT_LOW_DAMPING * 2.0)
    assert used(1.5, 1.5) == 0.0


@only_compiled
@pytest.mark.parametrize("name", ["gunnerus", "heron", "viknes_830"])
def test_a_vessel_that_a_turn_carries_sideways_tracks_a_circle_in_a_current(name: str) -> None:
    """0.03 sqrt(g·L) of current: at most 0.01 L rms (0.05, 0.013 and 0.03 L before the current was learned)."""
    values = read_vessel(name).values
    scenario, scale = parse_scenario(scenario_for(values, name), name), scale_of(ship_of(values))
    current = 0.03 * math.sqrt(GRAVITY * scale.L)
    run = simulate(scenario.changed({"vessel_sim.disturbance.current.north": current, "controller.law": "guided"}))
    last = run.time >= 0.75 * run.time[-1]
    assert rms(position_error(run.state[last], run.reference[last])) < 0.01 * scale.L


def test_what_is_forgotten_of_the_covariance_is_a_share_in_a_radian() -> None:
    """A surge speed at which the residual shows nothing: only forgetting is left."""
    sway, step = first_sway(PRIOR), 1e-3
    sway[1:] *= 0.1
    for _ in range(round(1.0 / step)):
        learn_sway(sway, Motion(0.0, 0.0, 0.3, 1e12, 0.0, 0.03), 0.0, 0.0, step, PRIOR)
    shares = np.diag(sway[1:]) / np.array(PRIOR.spread)
    kept = np.exp(-np.array([FORGOTTEN_C] * 2 + [FORGOTTEN_A] * 3))
    assert shares == pytest.approx(1.0 - 0.9 * kept, rel=1e-3)


@pytest.mark.parametrize(("v", "r"), [(-0.3, 0.04), (0.3, -0.04), (0.2, 0.04)])
def test_a_motion_that_the_model_explains_changes_nothing_of_what_is_learned(v: float, r: float) -> None:
    sway = first_sway(PRIOR)
    sway[0] = 0.2, -0.1, 0.06, 0.02, 0.3
    c_h, c_n = 0.2 * math.cos(0.4) - 0.1 * math.sin(0.4), -0.2 * math.sin(0.4) - 0.1 * math.cos(0.4)
    dv = -r * c_h - PRIOR.kappa * (2.0 - c_h) * r - (0.06 + 0.02 * abs(v) + 0.3 * abs(r)) * v
    before = sway[0].copy()
    learn_sway(sway, Motion(0.0, 0.0, 0.4, 2.0, v + c_n, r), v + c_n, dv, 0.01, PRIOR)
    np.testing.assert_allclose(sway[0], before, atol=1e-12)
