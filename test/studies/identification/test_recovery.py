"""Identification recovers the ship that made the data, with standard errors that are true."""

import numpy as np
import pytest
from cybership2_runs import CYBERSHIP2, cybership2

from vessel_hsmc_ros.core.exceptions import IdentificationError
from vessel_hsmc_ros.studies.identification.estimate import identify
from vessel_hsmc_ros.studies.identification.types import COUPLED, Identified, model


@pytest.fixture(scope="module")
def found() -> list[Identified]:
    """CyberShip II identified from short noisy runs; `benchmarks/identification.py recover` does the same with 200 seeds."""
    return [identify([cybership2(seed, duration=120.0)], model("coupled")) for seed in range(3)]


def test_estimates_lie_within_three_standard_errors_of_the_true_values(found: list[Identified]) -> None:
    errors = [
        (each.values[name] - CYBERSHIP2.get(name, 0.0)) / error for each in found for name, error in each.standard_errors.items()
    ]
    assert np.mean(np.abs(errors) < 3.0) >= 0.95
    assert 0.5 < np.sqrt(np.mean(np.square(errors))) < 1.5


def test_parameters_that_the_runs_do_not_determine_are_held_with_the_reason(found: list[Identified]) -> None:
    for each in found:
        held = dict(each.unidentifiable)
        assert set(each.standard_errors) | set(held) == set(COUPLED)
        assert len(each.standard_errors) >= 14
        assert all(each.values[name] == 0.0 and reason for name, reason in held.items())


def test_residuals_are_the_noise_of_the_sensors(found: list[Identified]) -> None:
    for each in found:
        np.testing.assert_allclose(each.noise, (5e-3, 5e-3, 3e-3, 1e-2, 1e-2, 5e-3), rtol=0.15)


def test_a_ship_that_never_turns_leaves_sway_and_yaw_unidentified() -> None:
    run = cybership2(0, duration=60.0)
    ahead = (1.0, 0.0, 0.0)
    straight = run._replace(pose=run.pose * ahead, velocity=run.velocity * ahead, wrench=run.wrench * ahead)
    with pytest.raises(IdentificationError, match="the runs do not determine"):
        identify([straight], model("paper"))
