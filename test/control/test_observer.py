"""The observer on a ship whose true motion is known."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vessel_hsmc_ros.control.observer import LONGEST_HOLD, Observer
from vessel_hsmc_ros.control.observer_model import jacobian, propagate, wave_transition
from vessel_hsmc_ros.control.observer_parameters import ObserverParameters
from vessel_hsmc_ros.core.kinematics import wrap
from vessel_hsmc_ros.laws.known_vessel import KnownVessel
from vessel_sim_node.actuators import ActuatorParameters
from vessel_sim_node.disturbance import CurrentParameters, EarthFixedParameters
from vessel_sim_node.sensors import SensorParameters
from vessel_sim_node.simulator import DisturbanceParameters, PlantParameters, Simulator
from vessel_sim_node.waves import WaveParameters

STEP = 50_000_000
POSE_ONLY = SensorParameters(position_noise=0.5, heading_noise=0.005, measures_velocity=False)


DECAYS = {"surge": 0.18, "sway": 0.83, "yaw": 0.126}


def sail(sensors=POSE_ONLY, weather=None, seconds=160, known=None, actuators=None, swing=0.05, **tuning):
    """A ship that swings to and fro under a known wrench: errors of the estimates and deviations they claim, at 20 Hz."""
    simulator = Simulator(
        PlantParameters(
            sensors=sensors, disturbance=weather or DisturbanceParameters(), actuators=actuators or ActuatorParameters()
        ),
        0.05,
    )
    observer = Observer(ObserverParameters(**tuning), known or KnownVessel())
    errors, claims = [], []
    wrench = (0.0, 0.0)
    for k in range(20 * seconds):
        push = simulator.disturbance(0.05 * k)
        error = np.array(observer.update(k * STEP, simulator.measured(k * STEP), wrench)) - simulator.state
        error[2] = wrap(error[2])
        errors.append(error)
        claims.append(observer.deviation)
        wrench = (1e5, 1e6 * math.sin(swing * 0.05 * k))
        simulator.advance(simulator.applied(wrench), push)
    settled = slice(20 * seconds // 4, None)
    return np.array(errors)[settled], np.array(claims)[settled]


def rms(errors):
    return np.sqrt(np.mean(errors**2, axis=0))


def test_estimates_are_better_than_the_measurements_and_as_good_as_they_claim():
    errors, claims = sail()
    assert np.all(rms(errors)[:3] < np.array([0.5, 0.5, 0.005]) / 2.5)
    assert np.all(rms(errors)[3:] < [0.06, 0.05, 0.002])
    ratio = rms(errors) / claims.mean(axis=0)
    assert np.all((ratio > 0.4) & (ratio < 1.4)), ratio


def test_wind_current_and_a_wrong_inertia_become_part_of_the_unknown_acceleration():
    weather = DisturbanceParameters(
        earth_fixed=EarthFixedParameters(east_force=2e4, gust_deviation=3e3), current=CurrentParameters(0.4, -0.3)
    )
    errors, claims = sail(weather=weather, known=KnownVessel(surge_inertia=0.8 * 120e3, yaw_inertia=1.2 * 636e5))
    assert np.all(rms(errors) < 2.5 * claims.mean(axis=0))
    assert np.all(rms(errors)[:3] < np.array([0.5, 0.5, 0.005]) / 2.0)
    assert np.all(np.abs(errors.mean(axis=0)) < [0.1, 0.1, 1e-3, 0.02, 0.02, 5e-4])


def test_knowing_how_a_drift_fades_roughly_is_worth_much():
    deaf, told = ({f"{axis}_decay": share * value for axis, value in DECAYS.items()} for share in (0.0, 0.5))
    unknown, rough, known = (rms(sail(**tuning)[0])[4] for tuning in (deaf, told, {}))
    assert known < rough < 0.7 * unknown


def test_knowing_the_lag_of_the_actuators_makes_the_yaw_rate_better():
    lagging = ActuatorParameters(surge_lag=1.0, yaw_lag=1.0)
    surprised, prepared = (rms(sail(actuators=lagging, swing=0.5, actuator_lag=lag)[0])[5] for lag in (0.0, 1.0))
    assert prepared < 0.7 * surprised


def test_the_waves_model_keeps_its_period_and_fades():
    whole = wave_transition(1.0, 0.1, 1.0)
    np.testing.assert_allclose(np.linalg.matrix_power(wave_transition(1.0, 0.1, 0.1), 10), whole, atol=1e-12)
    np.testing.assert_allclose(np.abs(np.linalg.eigvals(whole)), math.exp(-0.1), rtol=1e-9)


def test_velocities_are_never_looked_at():
    observers = [Observer(ObserverParameters(), KnownVessel()) for _ in range(2)]
    poses = np.random.default_rng(3).normal(size=(50, 6))
    for k, pose in enumerate(poses):
        blind = np.concatenate((pose[:3], np.full(3, math.nan)))
        seen = [observer.update(k * STEP, said, (1e5, 0.0)) for observer, said in zip(observers, (pose, blind), strict=True)]
        np.testing.assert_array_equal(*seen)


def test_a_sample_that_is_held_is_taken_once():
    slow = SensorParameters(position_noise=0.5, heading_noise=0.005, position_rate_hz=5.0, heading_rate_hz=10.0)
    errors, claims = sail(slow)
    ratio = rms(errors) / claims.mean(axis=0)
    assert np.all((ratio > 0.4) & (ratio < 1.4)), ratio
    assert rms(errors)[0] < 0.3  # at 2.4 m/s a held sample is up to 0.5 m behind


def test_a_measurement_that_really_stands_still_is_taken_in_the_end():
    observer = Observer(ObserverParameters(), KnownVessel())
    pose = np.array([3.0, 4.0, 0.5])
    for k in range(20 * 60):
        estimate = observer.update(k * STEP, pose, (2e4, 0.0))  # a push that the ship does not yield to
    assert LONGEST_HOLD < 60.0
    assert math.dist(estimate[:2], pose[:2]) < 0.2
    assert math.hypot(estimate.u, estimate.v) < 0.1


def test_the_waves_are_filtered_out_where_that_is_asked_for():
    weather = DisturbanceParameters(waves=WaveParameters(significant_height=1.0, direction=2.0))
    errors, filtered = sail(weather=weather)[0], sail(weather=weather, wave_period=6.0)[0]
    assert np.all(rms(filtered)[[2, 5]] < 0.7 * rms(errors)[[2, 5]])
    assert np.all(rms(filtered)[3:5] < 1.2 * rms(errors)[3:5])


def test_nothing_jumps_where_the_heading_does():
    observer = Observer(ObserverParameters(heading_noise=0.001), KnownVessel())
    for k in range(3000):
        psi = 0.1 * 0.05 * k
        estimate = observer.update(k * STEP, np.array([0.0, 0.0, wrap(psi)]), (0.0, 0.0))
        assert -math.pi < estimate[2] <= math.pi
        if k > 500:
            assert abs(wrap(estimate[2] - psi)) < 0.002


def test_a_glitch_is_left_out_and_a_jump_is_followed():
    observer = Observer(ObserverParameters(), KnownVessel())
    poses = [np.array([0.1 * k, 0.0, 0.0]) for k in range(400)]
    poses[200] = np.array([500.0, 0.0, 3.0])
    poses[300:] = [pose + np.array([0.0, 1e4, 0.0]) for pose in poses[300:]]
    said = np.array([observer.update(k * STEP, pose, (0.0, 0.0)) for k, pose in enumerate(poses)])
    assert np.linalg.norm(said[200, :2] - [20.0, 0.0]) < 0.2
    assert np.linalg.norm(said[399, :2] - [39.9, 1e4]) < 0.2


def test_reset_starts_at_the_next_measurement():
    observer = Observer(ObserverParameters(), KnownVessel())
    for k in range(100):
        observer.update(k * STEP, np.array([0.05 * k, 0.0, 0.0]), (0.0, 0.0))
    observer.reset()
    np.testing.assert_array_equal(observer.update(0, np.array([9.0, 8.0, 0.7]), (0.0, 0.0)), [9.0, 8.0, 0.7, 0.0, 0.0, 0.0])


@given(st.sampled_from([0.0, 6.0]), st.sampled_from([10, 50, 200]), st.integers(0, 2**31 - 1))
def test_the_claimed_deviations_stay_positive_and_finite(wave_period, rate_hz, seed):
    random = np.random.default_rng(seed)
    observer = Observer(ObserverParameters(wave_period=wave_period), KnownVessel())
    for k in range(60):
        pose = random.uniform([-100.0, -100.0, -math.pi], [100.0, 100.0, math.pi])
        estimate = observer.update(k * 10**9 // rate_hz, pose, tuple(random.uniform(-1e7, 1e7, 2)))
    assert np.isfinite(estimate).all()
    assert np.all(observer.deviation > 0.0)
    assert np.all(np.linalg.eigvalsh(observer.covariance) > -1e-9)


def test_the_wrench_counts_up_to_the_known_limits():
    observer = Observer(ObserverParameters(), KnownVessel())
    known, beyond = [], []
    for wrench, kept in (((2e5, -3e6), known), ((1e9, -1e12), beyond)):
        observer.reset()
        for k in range(50):
            kept.append(observer.update(k * STEP, np.zeros(3), wrench))
    np.testing.assert_array_equal(known, beyond)


@pytest.mark.parametrize("stamp", [0, STEP])
def test_no_time_has_passed_between_two_updates_of_one_stamp(stamp):
    observer = Observer(ObserverParameters(), KnownVessel())
    observer.update(0, np.array([1.0, 2.0, 0.1]), (0.0, 0.0))
    once = observer.update(stamp, np.array([1.1, 2.0, 0.1]), (1e5, 0.0))
    np.testing.assert_array_equal(observer.update(stamp, np.array([1.1, 2.0, 0.1]), (1e5, 0.0)), once)


def test_the_jacobian_is_the_derivative_of_the_model() -> None:
    """To first order in dt: (F - I)/dt against central differences of the propagated states."""
    p, dt, step = ObserverParameters(), 1e-4, 1e-5
    x = np.array([3.0, -2.0, 0.7, 1.5, -0.4, 0.2, 0.03, -0.05, 0.01, 0.04, -0.06])
    columns = []
    for change in step * np.eye(11):
        ahead, behind = (propagate(x + d, 0.1, 0.02, dt, p) for d in (change, -change))
        columns.append((ahead - behind) / (2.0 * step))
    np.testing.assert_allclose((jacobian(x, dt, p) - np.eye(11)) / dt, (np.array(columns).T - np.eye(11)) / dt, atol=1e-3)


def innovation_of(deviations: float, index: int) -> tuple[float, float]:
    """An innovation of so many standard deviations in x, y or heading, and by how much it moves the estimate."""
    observer = Observer(ObserverParameters(), KnownVessel())
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
    observer = Observer(ObserverParameters(), KnownVessel())
    for k in range(20):
        estimate = observer.update(k * STEP, np.array([1.0, 2.0, 0.5 + 0.002 * k]), (0.0, 0.0))
    assert estimate.psi == pytest.approx(0.538, abs=0.01)  # without its samples it would stay at 0.5
    assert estimate.r > 0.01


def test_a_new_position_is_used_while_the_heading_sample_is_held() -> None:
    observer = Observer(ObserverParameters(), KnownVessel())
    for k in range(20):
        estimate = observer.update(k * STEP, np.array([1.0 + 0.1 * k, 2.0, 0.5]), (0.0, 0.0))
    assert estimate.x == pytest.approx(2.9, abs=0.4)
