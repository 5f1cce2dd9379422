"""The paper's law against its derivation: on the plant (7), with exact networks and no disturbance."""

import copy
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.control.interface.network import Estimates
from vessel_hsmc_ros.control.laws import make_controller
from vessel_hsmc_ros.control.laws.hierarchical_printed import Gains, HierarchicalPrintedParameters, adaptation, control, sign
from vessel_hsmc_ros.core.exceptions import ControlError, ParameterError
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, as_acceleration, as_motion
from vessel_hsmc_ros.core.schema import symbols
from vessel_hsmc_ros.plant.dynamics import derivative, unforced_acceleration
from vessel_hsmc_ros.plant.hull_parameters import VesselParameters

SHIP = VesselParameters().coefficients()
G = Gains(**symbols(HierarchicalPrintedParameters()), **symbols(KnownVessel()), T=0.01)
CALM = (0.0, 0.0, 0.0)

places = st.floats(-200.0, 200.0)
velocities = st.floats(-3.0, 3.0)
states = st.tuples(places, places, st.floats(-math.pi, math.pi), velocities, velocities, velocities).map(np.array)
inputs = st.tuples(st.floats(-2e5, 2e5), st.floats(-3e6, 3e6))
gains = st.builds(
    G._replace, a=st.sampled_from([0.001, 0.05, 0.5]), b=st.floats(50.0, 200.0), c1=st.floats(0.1, 1.0), k1=st.floats(1.0, 100.0)
)


def exact_networks(state):
    """Outputs of networks that approximate f_u, f_v, f_r without an error."""
    return Estimates(*unforced_acceleration(state[3], state[4], state[5], SHIP))


def surfaces(state, reference, g):
    """sigma and S from their definitions, by complex numbers instead of the module's own transformation."""
    z, z_d = (complex(s[0], s[1]) * np.exp(-1j * s[2]) for s in (state, reference))
    dz, dz_d = (complex(s[3], s[4]) - 1j * s[5] * q for s, q in ((state, z), (reference, z_d)))
    e, de = z - z_d, dz - dz_d
    turn = (state[2] - reference[2] + math.pi) % (2 * math.pi) - math.pi
    sigma1 = g.c1 * e.imag + de.imag
    sigma2 = g.c2 * turn + state[5] - reference[5]
    return g.a * sigma1 + g.b * sigma2, g.c3 * e.real + de.real


@given(states, states, inputs, gains)
def test_the_surfaces_obey_their_reaching_laws(state, reference, reference_input, g) -> None:
    """dS1 = -k1·S1 - eta1·sgn S1 and dS2 = -k2·S2 - eta2·sgn S2."""
    assume(abs(abs(state[2] - reference[2]) - math.pi) > 0.01)
    f = exact_networks(state)
    reference_rate = derivative(reference, reference_input, CALM, SHIP)
    wrench, terms = control(as_motion(state), as_motion(reference), as_acceleration(reference_rate[3:]), f, g)
    rate = derivative(state, wrench, CALM, SHIP)

    S1, S2 = surfaces(state, reference, g)
    scale1, scale2 = 1.0 + abs(g.k1 * S1), 1.0 + abs(g.k2 * S2)
    assert terms.yaw_surface == pytest.approx(S1, rel=1e-9, abs=1e-9)
    assert terms.surge_surface == pytest.approx(S2, rel=1e-9, abs=1e-9)

    dt = 1e-6 / (1.0 + np.max(np.abs(rate)))
    ahead = surfaces(state + dt * rate, reference + dt * reference_rate, g)
    behind = surfaces(state - dt * rate, reference - dt * reference_rate, g)
    dS1, dS2 = ((p - m) / (2 * dt) for p, m in zip(ahead, behind, strict=True))
    roundoff = 1e-13 * (abs(S1) + g.b + 400.0) / dt
    assert dS1 == pytest.approx(-g.k1 * S1 - g.eta1 * sign(terms.yaw_surface), abs=1e-4 * scale1 + roundoff)
    assert dS2 == pytest.approx(-g.k2 * S2 - g.eta2 * sign(terms.surge_surface), abs=1e-4 * scale2 + roundoff)


@given(states, states, inputs, st.tuples(velocities, velocities, velocities))
def test_adaptation_cancels_the_cross_terms_of_the_lyapunov_rate(state, reference, reference_input, missing) -> None:
    """Weight errors W~ add S1·(a·f~v + (b - a·z1)·f~r) + S2·(f~u + z2·f~r) to dV; the adaptation cancels these terms."""
    guess = Estimates(*(true - error for true, error in zip(exact_networks(state), missing, strict=True)))
    reference_acceleration = derivative(reference, reference_input, CALM, SHIP)[3:]
    _, terms = control(as_motion(state), as_motion(reference), as_acceleration(reference_acceleration), guess, G)
    S1, S2 = terms.yaw_surface, terms.surge_surface
    f_u, f_v, f_r = unforced_acceleration(state[3], state[4], state[5], SHIP)
    z = complex(state[0], state[1]) * np.exp(-1j * state[2])

    # What is left of dS1 and dS2 after the designed part: the law's estimates in place of the truth.
    left1 = G.a * (f_v - terms.sway_estimate) + (G.b - G.a * z.real) * (f_r - terms.yaw_estimate)
    left2 = (f_u - terms.surge_estimate) + z.imag * (f_r - terms.yaw_estimate)
    rates = adaptation(z.real, z.imag, S1, S2, G.a, G)  # of one neuron that is always fully active
    removed = sum(e * rate / gamma for e, rate, gamma in zip(missing, rates, (G.gamma3, G.gamma1, G.gamma2), strict=True))
    assert S1 * left1 + S2 * left2 == pytest.approx(removed, rel=1e-9, abs=1e-9 * (1.0 + abs(S1) + abs(S2)))


def test_the_law_is_continuous_at_z1_zero_where_the_printed_one_is_singular() -> None:
    reference = Motion(1.0, 2.0, 0.1, 1.0, 0.0, 0.1)
    f = exact_networks(reference)

    def tau_2(x):
        return control(Motion(x, 0.0, 0.0, 1.0, 0.2, 0.1), reference, Acceleration(0.0, 0.0, 0.0), f, G)[0][1]

    assert tau_2(0.0) == pytest.approx(0.5 * (tau_2(-1e-6) + tau_2(1e-6)), rel=1e-9)
    assert math.isfinite(tau_2(0.0))


def test_the_remaining_singularity_is_reported() -> None:
    controller: Any = make_controller("hierarchical_printed", 0.01)
    place = np.array([1e5, 0.0, 0.0, 0.0, 0.0, 0.0])
    with pytest.raises(ControlError, match=r"z1 = 100000 m"):
        controller.update(0.0, place, np.zeros(6), np.zeros(3))


def at(x):
    return np.array([x, 0.0, 0.0, 0.0, 0.0, 0.0])


def test_crossing_the_singularity_is_an_error() -> None:
    controller: Any = make_controller("hierarchical_printed", 0.01)
    controller.update(0.0, at(99_999.0), np.zeros(6), np.zeros(3))
    with pytest.raises(ControlError, match=r"b = a·z1: a = 0.001, b = 100, and the ship is at z1 = 100001 m"):
        controller.update(0.01, at(100_001.0), np.zeros(6), np.zeros(3))
    controller.update(0.02, at(99_999.0), np.zeros(6), np.zeros(3))  # back on its side
    controller.reset()
    controller.update(0.03, at(100_001.0), np.zeros(6), np.zeros(3))  # it may start there


def test_new_gains_move_the_singularity() -> None:
    controller: Any = make_controller("hierarchical_printed", 0.01)
    controller.update(0.0, at(50.0), np.zeros(6), np.zeros(3))
    controller.retune(HierarchicalPrintedParameters(sway_weight=10.0))
    controller.update(0.01, at(50.0), np.zeros(6), np.zeros(3))
    with pytest.raises(ControlError, match="the ship is at z1 = 9 m"):
        controller.update(0.02, at(9.0), np.zeros(6), np.zeros(3))


def test_the_first_wrench_of_case_2_has_the_peaks_of_the_errata() -> None:
    controller: Any = make_controller("hierarchical_printed", 0.01)
    state = np.array([5.0, 1.0, math.pi / 4, 0.0, 0.0, 0.0])
    reference = np.array([15.0, 15.0, 0.0, 0.0, 0.0, 0.0])
    acceleration = np.array([1e5 / 120e3, 0.0, 1e6 / 636e5])
    (tau_1, tau_2), _ = controller.update(0.0, state, reference, acceleration)
    assert tau_1 == pytest.approx(3.1e7, rel=0.05)
    assert tau_2 == pytest.approx(-1.5e9, rel=0.05)


def test_weights_are_integrated_not_assigned() -> None:
    controller: Any = make_controller("hierarchical_printed", 0.01)
    state, reference = np.array([0.0, 0.0, 0.2, 0.0, 0.0, 0.0]), np.zeros(6)
    _, first = controller.update(0.0, state, reference, np.zeros(3))
    _, second = controller.update(0.01, state, reference, np.zeros(3))
    _, third = controller.update(0.02, state, reference, np.zeros(3))
    assert not first.yaw_weights.any()
    np.testing.assert_allclose(third.yaw_weights, 2.0 * second.yaw_weights)
    assert second.yaw_weights.any()
    controller.reset()
    _, fresh = controller.update(0.0, state, reference, np.zeros(3))
    assert not fresh.yaw_weights.any()


def test_new_gains_keep_the_weights() -> None:
    controller: Any = make_controller("hierarchical_printed", 0.01)
    state = np.array([0.0, 0.0, 0.2, 0.0, 0.0, 0.0])
    controller.update(0.0, state, np.zeros(6), np.zeros(3))
    twin: Any = copy.deepcopy(controller)
    controller.retune(HierarchicalPrintedParameters(yaw_reaching_gain=50.0))
    learnt, expected = (law.update(0.01, state, np.zeros(6), np.zeros(3))[1].yaw_weights for law in (controller, twin))
    np.testing.assert_array_equal(learnt, expected)
    assert learnt.any()


@pytest.mark.parametrize(("gain", "other"), [("yaw", "surge"), ("surge", "yaw")])
def test_a_gain_too_high_for_the_period_is_rejected_with_the_remedy(gain: str, other: str) -> None:
    low = {f"{other}_reaching_gain": 10.0}
    message = rf"{gain}_reaching_gain = 100 1/s is unstable.*50 Hz.*2\.006 .*below 99\.7 1/s or a rate above 50\.15 Hz"
    with pytest.raises(ParameterError, match=message):
        make_controller("hierarchical_printed", 0.02, **low)
    make_controller("hierarchical_printed", 0.0199, **low)


def test_parameters_have_the_names_of_the_yaml() -> None:
    make_controller("hierarchical_printed", 0.01, surge_inertia=1e5, heading_weight=50.0, **{"network.width": 2.0})
    with pytest.raises(ParameterError, match="did you mean heading_weight"):
        make_controller("hierarchical_printed", 0.01, heading_wait=50.0)
    with pytest.raises(ParameterError, match="one of hierarchical"):
        make_controller("nothing", 0.01)
