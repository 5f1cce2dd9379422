"""The covariance of the estimates is that of linear least squares, for white residuals, for those that last, and for bursts."""

import numpy as np
import pytest

from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.studies.identification import regression
from vessel_hsmc_ros.studies.identification.types import Windows

DRAWS = 100


def variances(samples: int, parameters: int, slow: float, lasting: float = 0.0, burst: float = 1.0) -> tuple[Array, Array]:
    """Stated variances of least squares by draw, and the actual ones, (d, p) and (p,).

    Args:
        samples: Of the one window.
        parameters: Number of parameters.
        slow: Correlation of each row of the derivatives with the next.
        lasting: The same of the noise.
        burst: Factor on noise and derivatives in the last tenth of the window.
    """
    random = np.random.default_rng(1)
    tail = samples - samples // 10
    jacobian = np.zeros((1, samples + 1, 6, parameters))
    jacobian[0, :-1] = correlated(random.standard_normal((samples, 6, parameters)), slow)
    jacobian[0, tail:] *= burst
    rows, whole, unused = jacobian.reshape(-1, parameters), np.zeros((1, samples, 6)), np.zeros(0)
    at = np.zeros(1, np.int64)
    cut = Windows(whole[:, :, 0], whole[:, :, :3], whole, at, at + samples, 1, unused, unused, unused, at)
    projection, stated, errors = np.linalg.pinv(rows), [], []
    for _ in range(DRAWS):
        noise = np.zeros((samples + 1, 6))
        noise[:-1] = correlated(random.standard_normal((samples, 6)), lasting)
        noise[tail:] *= burst
        errors.append(projection @ noise.reshape(-1))
        left = (noise.reshape(-1) - rows @ errors[-1]).reshape(1, samples + 1, 6)
        stated.append(np.diag(regression.covariance(cut, left, jacobian)))
    return np.array(stated), np.var(errors, axis=0)


def correlated(values: Array, kept: float) -> Array:
    """First-order Gauss-Markov sequences along the first axis, of variance one."""
    for row in range(1, len(values)):
        values[row] = kept * values[row - 1] + np.sqrt(1.0 - kept * kept) * values[row]
    return values


def test_a_short_run_with_many_parameters_loses_their_degrees_of_freedom() -> None:
    stated, actual = variances(20, 60, 0.0)
    assert np.mean(stated) == pytest.approx(np.mean(actual), rel=0.2)


def test_white_residuals_hardly_enlarge_a_standard_error() -> None:
    stated, actual = variances(100, 2, 0.98)
    assert np.mean(stated / actual) == pytest.approx(1.1, abs=0.2)


def test_the_autocorrelation_of_white_residuals_is_seldom_taken_for_a_lasting_one() -> None:
    random = np.random.default_rng(0)
    found = []
    for _ in range(1000):
        slow = correlated(random.standard_normal((1, 100, 1)).swapaxes(0, 1), 0.98).swapaxes(0, 1)
        found.append(regression._coloured(random.standard_normal((1, 100)), slow / np.linalg.norm(slow))[0, 0])
    assert np.percentile(found, 98) < 2.6  # of a variance of one


@pytest.mark.parametrize(("slow", "lasting"), [(0.5, 0.5), (0.9, 0.8)])
def test_residuals_that_last_enlarge_the_standard_errors_as_much_as_the_errors(slow: float, lasting: float) -> None:
    stated, actual = variances(200, 2, slow, lasting)
    assert np.mean(stated) == pytest.approx(np.mean(actual), rel=0.25)


def test_residuals_that_are_larger_where_a_parameter_acts_enlarge_its_standard_error() -> None:
    stated, actual = variances(200, 4, 0.5, burst=10.0)
    assert np.mean(stated) == pytest.approx(np.mean(actual), rel=0.25)


def test_the_least_known_parameter_is_that_of_the_largest_error_for_its_value() -> None:
    names, values = ("mass", "damping", "needed"), np.array([1e5, 0.1, 1e-9])
    matrix = np.diag(np.square([2e5, 0.5, 1.0]))
    assert regression.least_known(names, values, matrix, {"needed"})[0] == "damping"
    assert regression.least_known(names, values, 1e-4 * matrix, {"needed"}) == ("", "")
