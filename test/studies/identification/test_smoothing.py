"""Smoothing: the noise that it finds, and velocities and accelerations of a motion that is known."""

import numpy as np
import pytest

from vessel_hsmc_ros.studies.identification.types import Measurements, smooth

TIME = np.arange(0.0, 200.0, 0.1)


def circle(u: float, v: float, r: float, measured: bool) -> Measurements:
    """A ship that moves with constant body velocities, v among them."""
    psi = 0.7 + r * TIME
    x, y = (u * np.sin(psi) + v * np.cos(psi)) / r, (v * np.sin(psi) - u * np.cos(psi)) / r
    velocity = np.tile([u, v, r], (len(TIME), 1)) if measured else np.full((len(TIME), 3), np.nan)
    return Measurements(TIME, np.column_stack([x, y, psi]), velocity, np.zeros((len(TIME), 3)))


@pytest.mark.parametrize("measured", [True, False], ids=["velocities measured", "poses only"])
@pytest.mark.parametrize(("u", "v", "r"), [(2.0, -0.3, 0.05), (-1.0, 0.4, -0.08)])
def test_on_a_circle_the_body_velocities_are_constant(u: float, v: float, r: float, measured: bool) -> None:
    smoothed = smooth(circle(u, v, r, measured))
    inside = slice(100, -100)
    assert np.abs(smoothed.velocity[inside] - [u, v, r]).max() < 1e-3
    assert np.abs(smoothed.acceleration[inside]).max() < 1e-3, "beside r·v = 0.03 m/s² and more"


@pytest.mark.parametrize("measured", [True, False], ids=["velocities measured", "poses only"])
def test_the_noise_of_each_sensor_is_found_and_what_smoothing_leaves_of_it(measured: bool) -> None:
    run, random = circle(2.0, -0.3, 1e-9, measured), np.random.default_rng(3)
    sigma = np.array([0.5, 0.3, 0.01, 0.1, 0.05, 0.002])
    noisy = np.hstack([run.pose, run.velocity]) + sigma * random.normal(size=(len(TIME), 6))
    smoothed = smooth(run._replace(pose=noisy[:, :3], velocity=noisy[:, 3:]))
    found = 6 if measured else 3
    assert smoothed.noise[:found] == pytest.approx(sigma[:found], rel=0.1)
    assert np.isnan(smoothed.noise[found:]).all()
    left = smoothed.states - np.hstack([run.pose, np.tile([2.0, -0.3, 1e-9], (len(TIME), 1))])
    size = np.sqrt(np.mean(np.square(left[300:-300]), axis=0))
    assert (size < 2.5 * smoothed.error).all()
    assert (size > 0.3 * smoothed.error).all()
