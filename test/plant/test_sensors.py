import numpy as np
import pytest

from vessel_hsmc_ros.core.kinematics import Motion
from vessel_hsmc_ros.core.timing import RateGrid
from vessel_hsmc_ros.plant.devices import Sampling, SensorParameters, measurement, sampling

STATE = Motion(5.0, 1.0, 0.3, 2.0, -0.4, 0.1)
NOISY = SensorParameters(position_noise=0.1, heading_noise=0.002, velocity_noise=0.01, yaw_rate_noise=0.001)
STEP = 10_000_000


def samples(parameters, count, seed=1):
    instants, random = Sampling(parameters.rates()), np.random.default_rng(seed)
    rows = [Motion(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)]
    for k in range(count):
        rows.append(measurement(STATE, rows[-1], instants.due(k * STEP), random.standard_normal(6), parameters.constants(1.0)))
    return np.array(rows[1:])


def test_noise_is_white_with_its_standard_deviation() -> None:
    errors = samples(NOISY, 20_000) - STATE
    sigma = np.array([0.1, 0.1, 0.002, 0.01, 0.01, 0.001])
    np.testing.assert_allclose(errors.std(axis=0), sigma, rtol=0.03)  # 6 standard errors of 20 000 samples
    assert np.all(np.abs(errors.mean(axis=0)) < 5.0 * sigma / np.sqrt(20_000))
    correlation = np.corrcoef(np.hstack((errors[:-1], errors[1:])).T) - np.eye(12)
    assert np.max(np.abs(correlation)) < 0.04


def test_bias_adds_up() -> None:
    biased = SensorParameters(position_bias=(1.0, -2.0), heading_bias=0.1, velocity_bias=(0.2, -0.3), yaw_rate_bias=0.01)
    np.testing.assert_allclose(samples(biased, 1)[0] - STATE, [1.0, -2.0, 0.1, 0.2, -0.3, 0.01])


def test_each_sensor_holds_its_last_sample() -> None:
    slow = SensorParameters(**{**vars(NOISY), "position_rate_hz": 1.0, "heading_rate_hz": 10.0, "velocity_rate_hz": 50.0})
    measured = samples(slow, 300)
    changes = (np.diff(measured, axis=0) != 0.0).sum(axis=0)
    np.testing.assert_array_equal(changes, [2, 2, 29, 149, 149, 149])
    assert np.all(np.flatnonzero(np.diff(measured[:, 2])) % 10 == 9)  # new at 0.1 s, 0.2 s, ...


@pytest.mark.parametrize("rates", [(0.0, 0.0, 0.0), (1.0, 33.3, 3.0), (7.0, 0.0, 150.0)])
def test_the_instants_of_a_whole_run_are_those_of_its_steps(rates: tuple[float, float, float]) -> None:
    stamps = RateGrid(120.0).stamps(1000)
    one_by_one = Sampling(rates)
    np.testing.assert_array_equal(sampling(rates, stamps), [one_by_one.due(int(stamp)) for stamp in stamps])


def test_velocities_that_are_not_measured_are_zero() -> None:
    blind = SensorParameters(velocity_noise=1.0, velocity_bias=(1.0, 1.0), measures_velocity=False)
    assert not samples(blind, 10)[:, 3:].any()


def test_the_same_seed_gives_bit_identical_noise_and_another_does_not() -> None:
    np.testing.assert_array_equal(samples(NOISY, 50), samples(NOISY, 50))
    assert not np.array_equal(samples(NOISY, 50), samples(NOISY, 50, seed=2))


@pytest.mark.parametrize("change", [{"position_noise": 0.1}, {"yaw_rate_bias": 1e-3}, {"heading_rate_hz": 5.0}])
def test_any_error_makes_the_sensors_imperfect(change) -> None:
    assert SensorParameters().perfect()
    assert not SensorParameters(**change).perfect()
