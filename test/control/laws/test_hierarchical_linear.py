"""The linear model of the hierarchical law against the law itself, with all its neurons, on a hull that is integrated finely."""

import copy
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from durations import rest_long

from vessel_hsmc_ros.control.interface.known_vessel import INSTANT, KnownVessel
from vessel_hsmc_ros.control.interface.network import NetworkParameters
from vessel_hsmc_ros.control.laws.hierarchical import HierarchicalController
from vessel_hsmc_ros.control.laws.hierarchical_linear import COMMANDS, Lag, Mean, covariance, linearise, poles, steady
from vessel_hsmc_ros.control.laws.hierarchical_parameters import HierarchicalParameters
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, extrapolate, to_body
from vessel_hsmc_ros.plant.hull_parameters import ShipParameters
from vessel_hsmc_ros.studies.certificate import hull_at

PERIOD, SPEED, SUBSTEPS = 0.1, 2.0, 10
HULL = hull_at(ShipParameters().coefficients(), 0.0)


class Loop:
    """Law, hull with actuators, and a reference on a straight line or circle."""

    def __init__(self, law: Any, lags: tuple[Lag, Lag], turn: float) -> None:
        self.law, self.lags = law, lags
        self.desired = Motion(0.0, 0.0, 0.0, SPEED, 0.0, turn)
        self.motion, self.tau = self.desired, [0.0, 0.0]
        self.commands = [(0.0, 0.0)] * (1 + max(round(each.dead_time / PERIOD) for each in lags))

    def go(self, error: Array) -> None:
        """A period in which the motion is measured with an error, in the axes of the reference."""
        still, turned = Acceleration(0.0, 0.0, 0.0), error.copy()
        turned[:2] = to_body(error[0], error[1], -self.desired.psi)
        wrench, _ = self.law.step(Motion(*(np.array(self.motion) + turned)), self.desired, still)
        self.commands = [wrench, *self.commands[:-1]]
        for _ in range(SUBSTEPS):
            h = PERIOD / SUBSTEPS
            for i, each in enumerate(self.lags):
                command = self.commands[round(each.dead_time / PERIOD)][i]
                self.tau[i] = command + (self.tau[i] - command) * (math.exp(-h / each.lag) if each.lag else 0.0)
            rates = Acceleration(*HULL(self.motion, (self.tau[0], 0.0, self.tau[1]), (0.0, 0.0)))
            middle = extrapolate(self.motion, rates, 0.5 * h)
            rates = Acceleration(*HULL(middle, (self.tau[0], 0.0, self.tau[1]), (0.0, 0.0)))
            self.motion = extrapolate(self.motion, rates, h)
        self.desired = extrapolate(self.desired, still, PERIOD)

    def deviation(self) -> Array:
        """Motion in the axes of the reference, and the last commands."""
        m, d = self.motion, self.desired
        pose = [*to_body(m.x - d.x, m.y - d.y, d.psi), m.psi - d.psi]
        return np.array([*pose, m.u, m.v, m.r, *self.commands[0]])


ACTUATORS = {
    "instant": (INSTANT, (Lag(0.0, 0.0), Lag(0.0, 0.0))),
    "as declared": (
        {**INSTANT, "surge_lag": 1.0, "yaw_lag": 0.6, "surge_dead_time": 0.2, "yaw_dead_time": 0.5},
        (Lag(1.0, 0.2), Lag(0.6, 0.5)),
    ),
    "not declared": ({}, (Lag(0.5, 0.3), Lag(0.4, 0.1))),
}


@pytest.mark.parametrize(("width", "within"), [(5.0, 0.2), (100.0, 0.02)])
@pytest.mark.parametrize("turn", rest_long([0.03, 0.0]))
@pytest.mark.parametrize("name", rest_long(ACTUATORS))
def test_the_linear_model_answers_an_error_of_measurement_as_the_law_on_its_hull_does(
    name: str, turn: float, width: float, within: float
) -> None:
    """Wide neurons make |H| constant, as the model has it; with the paper's width the networks also react to the velocities."""
    declared, lags = ACTUATORS[name]
    parameters = HierarchicalParameters(actuator_identification=False, network=NetworkParameters(width=width))
    law = HierarchicalController(parameters, replace(KnownVessel(), **declared), PERIOD)
    settled = Loop(law, lags, turn)
    for _ in range(3000):
        settled.go(np.zeros(6))
    found = linearise(law.constants.gains, HULL, steady(HULL, SPEED, turn, Mean()), lags, 20.0)
    assert poles(found).real.max() < 0.0
    scale = np.array([1.0, 1.0, 0.1, 0.3, 0.3, 0.03, 3e4, 3e5])
    for i, size in enumerate((1e-4, 1e-4, 1e-5, 1e-4, 1e-4, 1e-5)):
        one, other, x = copy.deepcopy(settled), copy.deepcopy(settled), size * found.noise[:, i]
        one.go(size * np.eye(6)[i])
        other.go(np.zeros(6))
        answers, expected = [], []
        for _ in range(200):
            answers.append((one.deviation() - other.deviation()) / scale)
            expected.append(x[[*range(6), COMMANDS, COMMANDS + 1]] / scale)
            one.go(np.zeros(6))
            other.go(np.zeros(6))
            x = found.A @ x
        np.testing.assert_allclose(answers, expected, rtol=0.0, atol=within * np.abs(expected).max())


def test_the_covariance_is_the_fixed_point_of_its_equation() -> None:
    random = np.random.default_rng(1)
    A, B = random.normal(size=(6, 6)), random.normal(size=(6, 2))
    A *= 0.999 / np.abs(np.linalg.eigvals(A)).max()
    P = covariance(A, B @ B.T)
    np.testing.assert_allclose(P, A @ P @ A.T + B @ B.T, rtol=1e-9, atol=1e-9 * np.abs(P).max())
