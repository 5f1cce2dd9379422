"""The simulation of recorded runs: the steady forces and gains that are estimated beside the hull."""

import math
from typing import Any

import numpy as np
import pytest

from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.plant.hull_parameters import VesselParameters
from vessel_hsmc_ros.simulation.compilation import DISABLED
from vessel_hsmc_ros.studies.identification.types import Measurements, simulated, windows

SHIP = VesselParameters().coefficients()
TIME = np.arange(0.0, 2.0, 0.1)


def end_of(psi: float, wrench: Any = (0.0, 0.0, 0.0), gains: Any = (1.0, 1.0, 1.0), offsets: Any = (0.0, 0.0, 0.0)) -> Array:
    """The state after 1.9 s of a ship at rest of a heading."""
    recorded = np.tile(np.array(wrench, float), (len(TIME), 1))
    run = Measurements(TIME, np.zeros((len(TIME), 3)), np.zeros((len(TIME), 3)), recorded)
    start = np.array([[0.0, 0.0, psi, 0.0, 0.0, 0.0]])
    return np.asarray(simulated(windows([run], 2.0), start, SHIP, np.array(gains), np.array(offsets))[0, -1])


@pytest.mark.parametrize("interpreted", ["0", "1"])
def test_a_motion_that_diverges_is_not_finite_compiled_and_interpreted(monkeypatch: pytest.MonkeyPatch, interpreted: str) -> None:
    monkeypatch.setenv(DISABLED, interpreted)
    run = Measurements(TIME, np.zeros((len(TIME), 3)), np.zeros((len(TIME), 3)), np.tile([0.0, 0.0, 1e300], (len(TIME), 1)))
    states = simulated(windows([run], 2.0), np.zeros((1, 6)), SHIP, np.ones(3), np.zeros(3))[0]
    assert np.isfinite(states[0]).all()
    assert not np.isfinite(states[-1]).any()


@pytest.mark.parametrize("psi", [0.0, 0.5 * math.pi, math.pi, -0.5 * math.pi])
@pytest.mark.parametrize(("east", "north"), [(1e4, 0.0), (0.0, 1e4)])
def test_a_steady_force_moves_the_ship_to_its_side_whatever_the_heading(psi: float, east: float, north: float) -> None:
    x, y, *_ = end_of(psi, offsets=(east, north, 0.0))
    moved = (x, y) if east else (y, x)
    assert moved[0] > 0.05
    assert abs(moved[1]) < 1e-3 * moved[0]


def test_each_gain_acts_on_its_own_part_of_the_wrench() -> None:
    wrench = np.array([1e4, 5e3, 2e5])
    for axis in range(3):
        gains = np.ones(3)
        gains[axis] = 2.0
        np.testing.assert_allclose(end_of(0.3, wrench, gains), end_of(0.3, wrench * gains), rtol=1e-12)
    np.testing.assert_allclose(end_of(0.3, offsets=(0.0, 0.0, 2e5)), end_of(0.3, (0.0, 0.0, 2e5)), rtol=1e-12)
