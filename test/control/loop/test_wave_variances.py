"""The wave filter begins with the variances that it would have in the long run: a sea does not begin with the run."""

import numpy as np
import pytest

from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.control.loop.observer import Observer, units, wave_motion
from vessel_hsmc_ros.control.loop.observer_model import DXI, XI, ObserverParameters, pass_waves


@pytest.mark.parametrize("period", [3.0, 8.0, 15.0])
def test_the_first_variances_of_the_wave_motion_are_the_stationary_ones(period: float) -> None:
    parameters = ObserverParameters(wave_period=period, wave_damping=0.3)
    c, dt = Observer(parameters, KnownVessel()).constants, 0.002 * period
    P, M = np.diag(c.start), np.zeros((len(c.start), len(c.start)))
    for _ in range(1500):  # from nothing, over three periods
        for each in (P, M):
            pass_waves(each, dt, c.model)
            pass_waves(each.T, dt, c.model)
            each[XI:, XI:] += dt * c.Q[XI:, XI:]
    np.testing.assert_allclose(np.diag(P)[XI:], c.start[XI:], rtol=0.02)
    np.testing.assert_allclose(np.diag(M)[XI:], c.start[XI:], rtol=0.05)
    expected = wave_motion(parameters, units(KnownVessel()), 2.0 * np.pi / period)
    np.testing.assert_allclose(np.sqrt(c.start[DXI:]), expected)
