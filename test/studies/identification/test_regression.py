"""The columns of the regression are the plant's own equations, each with the sign and place of its parameter."""

from typing import Any

import numpy as np
import pytest

from vessel_hsmc_ros.plant.dynamics import derivative
from vessel_hsmc_ros.studies.identification.regression import columns, input_size, least_known, regressors, strong_correlations
from vessel_hsmc_ros.studies.identification.types import DELAY, GAINS, HULL, OFFSETS, Measurements, Smoothed, vessel

CALM = (0.0, 0.0, 0.0)


def test_the_wrench_of_all_parameters_gives_the_accelerations_in_the_plant() -> None:
    random = np.random.default_rng(3)
    for _ in range(20):
        values = {name: float(random.uniform(0.2, 2.0)) for name in HULL}
        values |= {"surge_inertia": 20.0, "sway_inertia": 31.0, "yaw_inertia": 12.0}
        velocity, acceleration = random.normal(size=(1, 3)), random.normal(size=(1, 3))
        wrench = np.sum([values[name] * regressors(name, velocity, acceleration)[0] for name in HULL], axis=0)
        state = np.array([0.0, 0.0, 0.7, *velocity[0]])
        found = derivative(state, tuple(wrench), CALM, vessel(values))[3:]
        assert np.allclose(found, acceleration[0], rtol=1e-9, atol=1e-9)


def record(count: int = 40) -> tuple[Measurements, Smoothed]:
    """A run at changing headings whose three forces are unlike."""
    time: Any = 0.1 * np.arange(count)
    wrench = np.column_stack([5.0 + time, -2.0 * time, 0.5 * time**2])
    pose = np.column_stack([time, time, 0.9 + time])
    nothing = np.zeros((count, 3))
    run = Measurements(time, pose, nothing, wrench, "run")
    return run, Smoothed(pose, nothing, nothing, np.ones(6), np.ones(6), 1.0)


def test_the_columns_of_gains_offsets_and_delay_are_what_they_add_to_the_forces() -> None:
    run, smoothed = record()
    found = columns((*GAINS, *OFFSETS, DELAY), run, smoothed)
    c, s = np.cos(run.pose[:, 2]), np.sin(run.pose[:, 2])
    zero, one = np.zeros_like(c), np.ones_like(c)
    for k in range(3):
        assert np.allclose(found[:, :, k], -run.wrench * (np.arange(3) == k))
    # A force to the east, the north, and a moment, seen from the hull.
    for k, expected in enumerate(([c, -s, zero], [s, c, zero], [zero, zero, one])):
        assert np.allclose(found[:, :, 3 + k], -np.column_stack(expected))
    # W(t - d) = W - d·dW/dt, on the side of the forces, which counts negative.
    rates = np.column_stack([one, -2.0 * one, run.time])
    assert np.allclose(found[1:-1, :, 6], rates[1:-1])


@pytest.mark.parametrize(
    ("forces", "expected"),
    [
        ((6.0, 0.0, 3.0), (6.0, 6.0, 3.0)),
        ((0.0, 4.0, 3.0), (4.0, 4.0, 3.0)),
        ((6.0, 4.0, 3.0), (6.0, 4.0, 3.0)),
        ((6.0, 0.001, 0.0), (6.0, 6.0, 6.0)),
        ((0.0, 0.0, 3.0), (3.0, 3.0, 3.0)),
    ],
)
def test_an_equation_without_an_input_has_the_weight_of_the_other_force(
    forces: tuple[float, ...], expected: tuple[float, ...]
) -> None:
    run, smoothed = record()
    constant = run._replace(wrench=np.tile(forces, (len(run.time), 1)))
    assert input_size([(constant, smoothed)]) == pytest.approx(expected)


def test_errors_that_go_together_in_either_sense_can_hardly_be_separated() -> None:
    correlation = np.array([[1.0, -0.99, 0.1], [-0.99, 1.0, 0.985], [0.1, 0.985, 1.0]])
    found = strong_correlations(["a", "b", "c"], correlation)
    assert [text.split(" can")[0] for text in found] == ["a and b", "b and c"]
    assert "-0.990" in found[0]


def test_a_negative_estimate_is_as_well_known_as_a_positive_one() -> None:
    covariance = np.diag([0.01, 0.04])
    assert least_known(["a", "b"], np.array([-5.0, 3.0]), covariance, ()) == ("", "")
    assert least_known(["a", "b"], np.array([-0.05, 3.0]), covariance, ())[0] == "a"
