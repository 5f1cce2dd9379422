"""The code against the symbolic equations, both evaluated at random states."""

import math
from typing import Any

import numpy as np
import paper_symbols as p
import pytest
import sympy as sp

from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.control.laws import make_controller
from vessel_hsmc_ros.control.laws.hierarchical_printed import HierarchicalPrintedParameters
from vessel_hsmc_ros.core.kinematics import Acceleration, as_motion, transform, transform_acceleration, transform_rate
from vessel_hsmc_ros.core.schema import symbols
from vessel_hsmc_ros.plant.dynamics import derivative
from vessel_hsmc_ros.plant.hull_parameters import VesselParameters

SHIP = symbols(VesselParameters())
GAINS = {**symbols(KnownVessel()), **symbols(HierarchicalPrintedParameters())}
SIGN = {"sgn": lambda value: math.copysign(1.0, value)}


def number(expression, values):
    """The expression at values given by symbol or by name."""
    at = {q: values[q] if q in values else values[q.name] for q in expression.free_symbols}
    return float(sp.lambdify(list(at), expression, [SIGN, "math"])(*at.values()))


@pytest.fixture(params=range(15))
def motion(request):
    """States and accelerations of ship and virtual ship, wrench and disturbance, by their symbols."""
    random = np.random.default_rng(request.param)
    spread = np.array([200.0, 200.0, 1.5, 3.0, 1.0, 0.5])
    state, desired = random.uniform(-spread, spread), random.uniform(-spread, spread)
    inputs = random.uniform(-1.0, 1.0, 5) * [2e5, 3e6, 0.1, 0.1, 0.01]
    forces = (p.tau_1, p.tau_2, *p.DISTURBANCE)
    return {**dict(zip(p.STATE + p.DESIRED + forces, [*state, *desired, *inputs], strict=True)), **SHIP}


def state_of(motion, which=p.STATE):
    return np.array([motion[q] for q in which])


def test_the_plant_matches_equation_6(motion) -> None:
    """(6) with interpretation E1."""
    f = dict(zip((p.f_u, p.f_v, p.f_r), p.unforced(p.u, p.v, p.r), strict=True))
    expected = [number(p.RATES[q].subs(f), motion) for q in p.STATE]
    wrench, disturbance = (motion[p.tau_1], motion[p.tau_2]), state_of(motion, p.DISTURBANCE)
    rates = derivative(state_of(motion), wrench, disturbance, VesselParameters().coefficients())
    np.testing.assert_allclose(rates, expected, rtol=1e-12, atol=1e-14)


def test_the_transformation_and_its_derivatives_match_equation_9(motion) -> None:
    state = state_of(motion)
    accelerations = {p.f_u: 0.3, p.f_v: -0.2, p.f_r: 0.1, p.tau_1: 0.0, p.tau_2: 0.0, **dict.fromkeys(p.DISTURBANCE, 0.0)}
    z = [p.DEFINITIONS[q] for q in (p.z1, p.z2, p.z3)]
    dz = [p.rate(q) for q in z]
    ddz = [p.rate(q) for q in dz]
    transformed = transform(as_motion(state))
    np.testing.assert_allclose(transformed, [number(q, motion) for q in z], rtol=1e-12)
    np.testing.assert_allclose(
        transform_rate(transformed, as_motion(state)), [number(q, motion) for q in dz], rtol=1e-10, atol=1e-12
    )
    computed = transform_acceleration(transformed, as_motion(state), Acceleration(0.3, -0.2, 0.1))
    np.testing.assert_allclose(computed, [number(q, {**motion, **accelerations}) for q in ddz], rtol=1e-10, atol=1e-12)


def test_the_law_matches_equations_22_and_28(motion) -> None:
    """Surfaces and wrench of the controller with one constantly active neuron."""
    d_acceleration, estimates = np.array([0.2, -0.1, 0.01]), {p.fv_hat: 0.03, p.fr_hat: -0.02, p.fu_hat: 0.01}
    values = {**motion, **GAINS, **estimates, **dict(zip((p.f_ud, p.f_vd, p.f_rd), d_acceleration, strict=True))}
    values |= {p.tau_1d: 0.0, p.tau_2d: 0.0}
    for q, definition in p.DEFINITIONS.items():
        values[q] = number(definition, values)
    values[p.S1], values[p.S2] = number(p.YAW_SURFACE, values), number(p.SURGE_SURFACE, values)
    values[p.tau_2] = number(p.SUMMED_TAU_2, values)

    law: Any = make_controller("hierarchical_printed", 0.01, **{"network.centers_per_axis": 1, "network.width": 1000.0})
    at_centre = state_of(motion)
    law.memory.W[:, 0] = [estimates[q] / activation(at_centre) for q in (p.fu_hat, p.fv_hat, p.fr_hat)]
    wrench, terms = law.update(0.0, at_centre, state_of(motion, p.DESIRED), d_acceleration)
    assert terms.sway_surface == pytest.approx(number(p.sigma1, values), rel=1e-10)
    assert terms.heading_surface == pytest.approx(number(p.sigma2, values), rel=1e-10)
    assert (terms.yaw_surface, terms.surge_surface) == pytest.approx((values[p.S1], values[p.S2]), rel=1e-10)
    assert wrench == pytest.approx([number(p.LAW_TAU_1, values), values[p.tau_2]], rel=1e-9)


def activation(state):
    """(3) of a neuron at 0.5 whose width is 1000."""
    return math.exp(-float(np.sum((state[3:] - 0.5) ** 2)) / 2e6)
