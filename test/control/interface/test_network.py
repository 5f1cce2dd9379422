import math

import numpy as np
import pytest

from vessel_hsmc_ros.control.interface.network import NetworkParameters, activate, activations, output, outputs
from vessel_hsmc_ros.core.exceptions import ParameterError


def test_a_neuron_is_a_gaussian_about_its_centre() -> None:
    mu = np.array([[0.5, 0.5, 0.5]])
    assert activations(np.array([0.5, 0.5, 0.5]), mu, 5.0) == pytest.approx([1.0])
    assert activations(np.array([0.5, 3.5, 4.5]), mu, 5.0) == pytest.approx([math.exp(-25.0 / 50.0)])


def test_grid_of_centres() -> None:
    centers = NetworkParameters(center=0.5, spacing=0.5, centers_per_axis=3).centers()
    assert centers.shape == (27, 3)
    np.testing.assert_allclose(np.unique(centers), [0.0, 0.5, 1.0])
    np.testing.assert_array_equal(NetworkParameters(centers_per_axis=1).centers(), [[0.5, 0.5, 0.5]])


@pytest.mark.parametrize("neurons", [*range(1, 70), 125, 343, 729])
def test_every_neuron_counts_once_however_many_there_are(neurons: int) -> None:
    random = np.random.default_rng(neurons)
    W, H = random.normal(size=(3, neurons)), random.uniform(size=neurons)
    assert outputs(W, H, np.empty((3, neurons))) == pytest.approx(tuple(W @ H))
    assert output(W[1], H, np.empty((1, neurons))) == pytest.approx(float(W[1] @ H))


def test_gradient_descent_fits_a_damping_curve_with_125_neurons() -> None:
    neurons = NetworkParameters(center=0.0, spacing=0.6, centers_per_axis=5, width=0.4).neurons()
    random = np.random.default_rng(1)
    W, H, scratch = (np.zeros(shape) for shape in (125, 125, (1, 125)))

    def damping(Z):
        return -0.18 * Z[0] - 0.036 * abs(Z[0]) * Z[0] + 1.5 * Z[1] * Z[2]

    def error(Z):
        activate(Z[0], Z[1], Z[2], neurons, H)
        return damping(Z) - output(W, H, scratch)

    def error_rms():
        return np.sqrt(np.mean([error(Z) ** 2 for Z in random.uniform(-1.0, 1.0, (500, 3))]))

    untaught = error_rms()
    for Z in random.uniform(-1.0, 1.0, (20_000, 3)):
        W += error(Z) * H / (H @ H)
    assert error_rms() < 0.05 * untaught


def test_the_printed_basis_has_the_distance_in_its_exponent() -> None:
    mu = np.array([[0.5, 0.5, 0.5]])
    assert activations(np.array([0.5, 3.5, 4.5]), mu, 5.0, as_printed=True) == pytest.approx([math.exp(-5.0 / 50.0)])
    assert NetworkParameters(basis="as_printed").neurons().as_printed
    assert not NetworkParameters().neurons().as_printed


def test_listed_centres_are_taken_in_triples() -> None:
    listed = NetworkParameters(layout="listed", listed_centers=(0.0, 0.1, 0.2, 1.0, 1.1, 1.2))
    np.testing.assert_array_equal(listed.centers(), [[0.0, 0.1, 0.2], [1.0, 1.1, 1.2]])
    for wrong in ((), (1.0, 2.0), (1.0, 2.0, 3.0, 4.0)):
        with pytest.raises(ParameterError, match="three finite numbers for each centre"):
            NetworkParameters(layout="listed", listed_centers=wrong).centers()
