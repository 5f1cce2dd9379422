"""The observer on a ship whose true motion is known."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from sailing import STEP, rms, sail

from vessel_hsmc_ros.control.interface.known_vessel import INSTANT, KnownVessel
from vessel_hsmc_ros.control.loop.observer import LONGEST_HOLD, Observer, units, wave_motion
from vessel_hsmc_ros.control.loop.observer_model import (
    D1,
    ObserverParameters,
    change,
    jacobian,
    model,
    pass_waves,
    propagate,
    wave_transition,
)
from vessel_hsmc_ros.core.kinematics import wrap
from vessel_hsmc_ros.plant.devices import ActuatorParameters, SensorParameters
from vessel_hsmc_ros.plant.disturbance import CurrentParameters, EarthFixedParameters, WaveParameters
from vessel_hsmc_ros.plant.dynamics import derivative
from vessel_hsmc_ros.plant.hull_parameters import VesselParameters
from vessel_hsmc_ros.plant.simulator import DisturbanceParameters

SHIP = KnownVessel(**INSTANT)

DECAYS = {"surge": 0.18, "sway": 0.83, "yaw": 0.126}


def test_estimation_errors_are_below_the_noise_and_match_the_covariance() -> None:
    errors, claims = sail()
    assert np.all(rms(errors)[:3] < np.array([0.5, 0.5, 0.005]) / 2.5)
    assert np.all(rms(errors)[3:] < [0.06, 0.05, 0.002])
    ratio = rms(errors) / claims.mean(axis=0)
    assert np.all((ratio > 0.4) & (ratio < 1.4)), ratio


def test_wind_current_and_a_wrong_inertia_are_estimated_as_disturbance() -> None:
    disturbances = DisturbanceParameters(
        earth_fixed=EarthFixedParameters(east_force=2e4, gust_deviation=3e3), current=CurrentParameters(0.4, -0.3)
    )
    errors, claims = sail(disturbances=disturbances, known=replace(SHIP, surge_inertia=0.8 * 120e3, yaw_inertia=1.2 * 636e5))
    assert np.all(rms(errors) < 2.5 * claims.mean(axis=0))
    assert np.all(rms(errors)[:3] < np.array([0.5, 0.5, 0.005]) / 2.0)
    assert np.all(np.abs(errors.mean(axis=0)) < [0.1, 0.1, 1e-3, 0.02, 0.02, 5e-4])


def test_estimated_decay_rates_are_better_than_wrong_ones_and_close_to_the_true_ones() -> None:
    none, true_rates = ({f"{axis}_decay": share * value for axis, value in DECAYS.items()} for share in (0.0, 1.0))
    undamped, estimated, known = (rms(sail(seconds=100, **tuning)[0])[4] for tuning in (none, {}, true_rates))
    assert estimated < 0.7 * undamped
    assert estimated < 2.0 * known


def test_the_actuator_lag_improves_the_yaw_rate_estimate() -> None:
    lagging = ActuatorParameters(surge_lag=1.0, yaw_lag=1.0)
    surprised, prepared = (rms(sail(actuators=lagging, frequency=0.5, seconds=80, actuator_lag=lag)[0])[5] for lag in (0.0, 1.0))
    assert prepared < 0.7 * surprised


def test_the_wave_filter_has_its_period_and_damping() -> None:
    waves = model(ObserverParameters(wave_period=2.0 * math.pi, wave_damping=0.1), SHIP)
    tenth, full_step = (np.reshape(wave_transition(dt, waves), (2, 2)) for dt in (0.1, 1.0))
    np.testing.assert_allclose(np.linalg.matrix_power(tenth, 10), full_step, atol=1e-12)
    np.testing.assert_allclose(np.abs(np.linalg.eigvals(full_step)), math.exp(-0.1), rtol=1e-9)


def test_measured_velocities_are_ignored() -> None:
    observers = [Observer(ObserverParameters(), SHIP) for _ in range(2)]
    poses = np.random.default_rng(3).normal(size=(50, 6))
    for k, pose in enumerate(poses):
        blind = np.concatenate((pose[:3], np.full(3, math.nan)))
        first, second = (o.update(k * STEP, sample, (1e5, 0.0)) for o, sample in zip(observers, (pose, blind), strict=True))
        assert first == second


def test_a_held_sample_is_used_once() -> None:
    slow = SensorParameters(position_noise=0.5, heading_noise=0.005, position_rate_hz=5.0, heading_rate_hz=10.0)
    errors, claims = sail(slow)
    ratio = rms(errors) / claims.mean(axis=0)
    assert np.all((ratio > 0.4) & (ratio < 1.4)), ratio
    assert rms(errors)[0] < 0.3  # at 2.4 m/s a held sample is up to 0.5 m behind


def test_a_constant_measurement_is_used_after_the_longest_hold() -> None:
    observer = Observer(ObserverParameters(), SHIP)
    pose = np.array([3.0, 4.0, 0.5])
    for k in range(20 * 60):
        estimate = observer.update(k * STEP, pose, (2e4, 0.0))  # a disturbance that the ship does not yield to
    assert LONGEST_HOLD < 60.0
    assert math.dist(estimate[:2], pose[:2]) < 0.2
    assert math.hypot(estimate.u, estimate.v) < 0.1


def test_the_wave_filter_removes_the_wave_motion() -> None:
    disturbances = DisturbanceParameters(waves=WaveParameters(significant_height=1.0, direction=2.0))
    errors, filtered = (sail(disturbances=disturbances, seconds=100, wave_period=period)[0] for period in (0.0, 6.0))
    assert np.all(rms(filtered)[[2, 5]] < 0.7 * rms(errors)[[2, 5]])
    assert np.all(rms(filtered)[3:5] < 1.2 * rms(errors)[3:5])


def test_the_output_is_continuous_where_the_heading_wraps() -> None:
    observer = Observer(ObserverParameters(heading_noise=0.001), SHIP)
    for k in range(1500):
        psi = 0.1 * 0.05 * k
        estimate = observer.update(k * STEP, np.array([0.0, 0.0, wrap(psi)]), (0.0, 0.0))
        assert -math.pi < estimate[2] <= math.pi
        if k > 500:
            assert abs(wrap(estimate[2] - psi)) < 0.002


def test_an_outlier_is_rejected_and_a_permanent_jump_is_followed() -> None:
    observer = Observer(ObserverParameters(), SHIP)
    poses = [np.array([0.1 * k, 0.0, 0.0]) for k in range(400)]
    poses[200] = np.array([500.0, 0.0, 3.0])
    poses[300:] = [pose + np.array([0.0, 1e4, 0.0]) for pose in poses[300:]]
    estimates = np.array([observer.update(k * STEP, pose, (0.0, 0.0)) for k, pose in enumerate(poses)])
    assert np.linalg.norm(estimates[200, :2] - [20.0, 0.0]) < 0.2
    assert np.linalg.norm(estimates[399, :2] - [39.9, 1e4]) < 0.2


@pytest.mark.parametrize("sensor", [0, 1, 2])
@pytest.mark.parametrize("every", [1, 3])
def test_each_sensor_alone_that_has_jumped_for_good_is_refused_and_then_followed_again_and_again(sensor: int, every: int) -> None:
    """The other sensor is right all the time, and has a sample in every step or in every third one."""
    observer, jump = Observer(ObserverParameters(), SHIP), (500.0, -700.0, 2.0)[sensor]
    hold = round(LONGEST_HOLD / (STEP * 1e-9))
    for number in range(3):
        for k in range(40 + 2 * hold):
            at = 1000 * number + k
            pose = [1e-6 * (at // every)] * 3
            pose[sensor] = jump * (number + (k >= 40)) + 1e-6 * at
            observer.update(at * STEP, (pose[0], pose[1], wrap(pose[2])), (0.0, 0.0))
            away = observer.estimate[sensor] - pose[sensor]
            assert observer.accepts == (k < 40 or k > 40 + hold) or abs(k - 40 - hold) <= 2 * every
            assert k != 40 or abs(wrap(away) if sensor == 2 else away) > 1.0
        assert (wrap(away) if sensor == 2 else away) == pytest.approx(0.0, abs=0.1)


def test_a_position_that_stays_away_is_followed_though_the_headings_between_are_accepted() -> None:
    """Positions come in every second step, headings in every one, so that most steps have nothing to refuse."""
    observer, jump = Observer(ObserverParameters(), SHIP), 500.0
    for k in range(40 + round(2.0 * LONGEST_HOLD / (STEP * 1e-9))):
        there = 0.0 if k < 40 else jump + 1e-6 * (k // 2)
        observer.update(k * STEP, (there, 0.0, 1e-6 * k), (0.0, 0.0))
    assert observer.estimate.x == pytest.approx(jump, abs=1.0)


def test_after_each_jump_that_is_followed_the_headings_before_the_next_position_are_accepted() -> None:
    observer, per_position, accepted = Observer(ObserverParameters(), SHIP), 10, []
    for k in range(0, 900):
        number = k // per_position
        there = 500.0 * (number // 30)
        observer.update(k * STEP, (there + 1e-6 * number, 0.0, 1e-6 * k), (0.0, 0.0))
        accepted.append(observer.accepts)
    refused = [k for k, good in enumerate(accepted) if not good]
    longest = round(LONGEST_HOLD / (STEP * 1e-9))
    assert {k // 300 for k in refused} == {1, 2}, "both jumps are refused at first"
    assert all(k % 300 <= longest for k in refused)


def test_a_measurement_that_comes_late_does_not_set_the_time_of_the_filter_back() -> None:
    estimates = []
    for third in (STEP, 2 * STEP):
        observer = Observer(ObserverParameters(), SHIP)
        for k, stamp in enumerate((0, STEP, 2 * STEP, third, 3 * STEP, 4 * STEP)):
            estimate = observer.update(stamp, (1.0 + 0.1 * k, 0.0, 0.02 * k), (1e5, 1e6))
        estimates.append(estimate)
    assert estimates[0] == estimates[1]


def test_learned_damping_stays_within_a_factor_of_ten() -> None:
    """A force that never arrives looks like damping without bound."""
    observer = Observer(ObserverParameters(), SHIP)
    first = observer.constants.decay
    for k in range(2000):
        observer.update(k * STEP, (1e-6 * k, 0.0, 0.0), (2e5, 0.0))
    learned = observer.state.x[D1 : D1 + 3]
    assert np.all(np.abs(learned - first) <= math.log(10.0) + 1e-12)
    assert learned[0] > first[0]


def test_after_a_reset_the_next_measurement_initialises_the_filter() -> None:
    observer = Observer(ObserverParameters(), SHIP)
    for k in range(100):
        observer.update(k * STEP, np.array([0.05 * k, 0.0, 0.0]), (0.0, 0.0))
    observer.reset()
    np.testing.assert_array_equal(observer.update(0, np.array([9.0, 8.0, 0.7]), (0.0, 0.0)), [9.0, 8.0, 0.7, 0.0, 0.0, 0.0])


@given(st.sampled_from([0.0, 6.0]), st.sampled_from([10, 50, 200]), st.integers(0, 2**31 - 1))
@example(0.0, 10, 38)
def test_the_covariance_stays_positive_and_finite(wave_period: float, rate_hz: int, seed: int) -> None:
    random = np.random.default_rng(seed)
    observer = Observer(ObserverParameters(wave_period=wave_period), SHIP)
    for k in range(60):
        pose = random.uniform([-100.0, -100.0, -math.pi], [100.0, 100.0, math.pi])
        estimate = observer.update(k * 10**9 // rate_hz, pose, tuple(random.uniform(-1e7, 1e7, 2)))
    assert np.isfinite(estimate).all()
    assert np.all(observer.deviation > 0.0)
    assert np.all(np.linalg.eigvalsh(observer.covariance) > -1e-9)


def test_the_wrench_is_limited_to_the_known_limits() -> None:
    observer = Observer(ObserverParameters(), SHIP)
    estimates = []
    for wrench in ((2e5, -3e6), (1e9, -1e12)):
        observer.reset()
        estimates.append([observer.update(k * STEP, np.zeros(3), wrench) for k in range(50)])
    assert estimates[0] == estimates[1]


@pytest.mark.parametrize("stamp", [0, STEP])
def test_a_repeated_stamp_causes_no_prediction(stamp: int) -> None:
    observer = Observer(ObserverParameters(), SHIP)
    observer.update(0, np.array([1.0, 2.0, 0.1]), (0.0, 0.0))
    once = observer.update(stamp, np.array([1.1, 2.0, 0.1]), (1e5, 0.0))
    np.testing.assert_array_equal(observer.update(stamp, np.array([1.1, 2.0, 0.1]), (1e5, 0.0)), once)


def test_the_jacobian_is_the_derivative_of_the_model() -> None:
    """To first order in dt: (F - I)/dt against central differences of the propagated states."""
    m, dt, step = model(ObserverParameters(wave_period=6.0), SHIP), 1e-4, 1e-5
    motion, disturbances = [3.0, -2.0, 0.7, 1.5, -0.4, 0.2], [0.03, -0.05, 0.01, -1.7, -0.2, -2.1, 0.4, -0.6]
    x = np.array([*motion, *disturbances, 0.1, -0.2, 0.03, 0.2, 0.1, -0.01])
    columns = []
    for difference in step * np.eye(20):
        ahead, behind = x + difference, x - difference
        for changed in (ahead, behind):
            propagate(changed, 0.1, 0.02, dt, m)
        columns.append((ahead - behind) / (2.0 * step))
    F = np.eye(20)
    pass_waves(F, dt, m)
    F[:6] += change(np.eye(20), jacobian(x, dt, m))
    np.testing.assert_allclose((F - np.eye(20)) / dt, (np.array(columns).T - np.eye(20)) / dt, atol=1e-3)


def innovation_of(deviations: float, index: int) -> tuple[float, float]:
    """An innovation of so many standard deviations in x, y or heading, and by how much it moves the estimate."""
    observer = Observer(ObserverParameters(), SHIP)
    pose = np.array([1.0, 2.0, 0.5])
    observer.update(0, pose, (0.0, 0.0))
    noise = (0.5, 0.5, 0.005)[index]
    innovation = deviations * math.hypot(observer.deviation[index], noise)
    pose[index] += innovation
    return innovation, observer.update(0, pose, (0.0, 0.0))[index] - (pose[index] - innovation)


@pytest.mark.parametrize("index", range(3))
def test_the_gate_accepts_a_measurement_ten_deviations_off_and_rejects_one_thirty_off(index: int) -> None:
    innovation, moved = innovation_of(10.0, index)
    assert moved > 0.2 * innovation
    assert innovation_of(30.0, index)[1] == 0.0


def test_a_new_heading_is_used_while_the_position_sample_is_held() -> None:
    observer = Observer(ObserverParameters(), SHIP)
    for k in range(20):
        estimate = observer.update(k * STEP, np.array([1.0, 2.0, 0.5 + 0.002 * k]), (0.0, 0.0))
    assert estimate.psi == pytest.approx(0.538, abs=0.01)  # without its samples it would stay at 0.5
    assert estimate.r > 0.01


def test_a_new_position_is_used_while_the_heading_sample_is_held() -> None:
    observer = Observer(ObserverParameters(), SHIP)
    for k in range(20):
        estimate = observer.update(k * STEP, np.array([1.0 + 0.1 * k, 2.0, 0.5]), (0.0, 0.0))
    assert estimate.x == pytest.approx(2.9, abs=0.4)


@pytest.mark.parametrize("x_p", [-3.0, 0.0, 4.0])
def test_the_yaw_moment_of_a_coupled_hull_moves_it_sideways_as_the_plant_does(x_p: float) -> None:
    """Predicted without a new sample, and compared with the equations of the plant, which know of no centre of percussion."""
    coupling, moment = 177.9e3 * x_p, 1e6
    known = replace(SHIP, sway_yaw_inertia=coupling)
    assert known.percussion_point == pytest.approx(x_p)
    observer = Observer(ObserverParameters(sway_decay=0.0, surge_decay=0.0, yaw_decay=0.0), known)
    for stamp in (0, STEP // 10):
        estimate = observer.update(stamp, (0.0, 0.0, 0.0), (0.0, moment))
    ship = VesselParameters(sway_yaw_inertia=coupling, yaw_sway_inertia=coupling).coefficients()
    rates = derivative(np.zeros(6), (0.0, moment), (0.0, 0.0, 0.0), ship)
    assert np.array(estimate[3:]) / (STEP * 1e-10) == pytest.approx(rates[3:], rel=1e-3, abs=1e-9)


def test_a_compass_that_freezes_in_a_turn_is_not_believed() -> None:
    """The ship turns on at 0.03 rad/s; within 20 deviations the frozen heading would be taken again and again."""
    observer, random = Observer(ObserverParameters(), SHIP), np.random.default_rng(4)
    held, errors = 0.0, []
    for k in range(520):
        psi = 0.03 * 0.05 * k
        held = wrap(psi + 0.005 * random.normal()) if k < 400 else held
        place = 67.0 * np.array([math.sin(psi), 1.0 - math.cos(psi)]) + 0.5 * random.normal(size=2)
        estimate = observer.update(k * STEP, (*place, held), (0.0, 0.0))
        errors.append(abs(wrap(estimate.psi - psi)))
    assert max(errors[300:400]) < 0.02
    assert max(errors[400:]) < 0.02, "the frozen heading is 0.18 rad behind"


def test_a_longer_hull_averages_the_waves_in_position_and_heading() -> None:
    short, long = (wave_motion(ObserverParameters(), units(replace(SHIP, length=length)), 1.0) for length in (10.0, 100.0))
    assert (long < short).all()
    assert (long > 0.1 * short).all()
