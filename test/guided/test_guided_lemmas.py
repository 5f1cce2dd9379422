"""The lemmas of docs/guided.md: what is known for sure of the cascade, by algebra or by exact arithmetic."""

import math

import numpy as np
import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st

from vessel_hsmc_ros.core.kinematics import Acceleration, Motion
from vessel_hsmc_ros.guided.current_estimate import STILL_WATER
from vessel_hsmc_ros.guided.guidance import heading_error, resolve, velocity_command
from vessel_hsmc_ros.guided.parameters import GuidedParameters, gains
from vessel_hsmc_ros.guided.rule import RULES, derived_gains, unit_time
from vessel_hsmc_ros.law.applied_wrench import applied, arriving, channel, lead
from vessel_hsmc_ros.law.known_vessel import INSTANT, KnownVessel

T = 0.02
G = gains(GuidedParameters(), KnownVessel(**INSTANT), T)


def test_lemma_1_predictor_and_network_have_both_poles_at_z() -> None:
    """Innovation e and error of the network's output g: (e, g) -> A·(e, g) with the characteristic polynomial (lambda - z)²."""
    z, period, pole = sp.symbols("z T lambda")
    # f grows by (1 - z)²/T·e before the prediction uses it; the correction leaves z² of e.
    growth = (1 - z) ** 2 / period
    A = sp.Matrix([[z**2 - period * growth, period], [-growth, 1]])
    assert sp.expand(A.charpoly(pole).as_expr() - (pole - z) ** 2) == 0


@given(st.floats(1e-3, 10.0), st.floats(1e-3, 1.0))
def test_lemma_2_a_surface_decays_exactly_by_its_reaching_gain(k: float, period: float) -> None:
    """S(t + T) = S - T·(1 - exp(-k·T))/T·S = exp(-k·T)·S for an acceleration that is held over the period."""
    held = -math.expm1(-k * period) / period
    assert 1.0 - period * held == pytest.approx(math.exp(-k * period), rel=1e-12)


@given(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(0.05, 5.0), st.floats(0.01, 1.0))
def test_lemma_3_with_the_lead_an_input_approaches_what_is_wanted_with_the_shorter_lag(
    tau: float, wanted: float, lag: float, share: float
) -> None:
    c = channel(1e6, lag, share * lag, math.inf, 0.0, T)
    after = applied(tau, lead(tau, wanted, c), c)
    expected = tau + -math.expm1(-T / (share * lag)) * (wanted - tau)
    assert after == pytest.approx(expected, rel=1e-9, abs=1e-12)


def test_lemma_3_a_command_arrives_after_its_dead_time() -> None:
    queue = np.array([[5.0, 6.0, 7.0, 8.0], [0.0, 0.0, 0.0, 0.0]])
    assert [arriving(queue, 0, 1, age) for age in range(4)] == [6.0, 5.0, 8.0, 7.0]


@given(st.floats(-50.0, 50.0), st.floats(-50.0, 50.0), st.floats(-3.0, 3.0), st.floats(-0.3, 0.3))
def test_lemma_4_a_ship_with_the_commanded_velocity_approaches_its_reference(x: float, y: float, psi: float, u_d: float) -> None:
    """With the velocity w and xi = 0, e·de = -k_p·|e|²/sqrt(1 + (k_p·|e|/v_max)²): the distance falls."""
    motion, desired = Motion(x, y, psi, 0.0, 0.0, 0.0), Motion(0.0, 0.0, 0.0, u_d, 0.0, 0.0)
    w = velocity_command(motion, desired, Acceleration(0.0, 0.0, 0.0), (0.0, 0.0), G)
    falling = x * (w.wx - u_d) + y * w.wy
    square = x * x + y * y
    assert falling == pytest.approx(-G.k_p * square / math.sqrt(1.0 + G.k_p**2 * square / G.v_max**2), abs=1e-9)


@given(st.floats(-1.5, 1.5), st.floats(0.5, 3.0))
def test_lemma_4_at_the_commanded_heading_the_hull_has_the_commanded_velocity(psi: float, speed: float) -> None:
    """Where epsilon vanishes, w_n = v: surge alone then gives the ship the velocity w."""
    far = Motion(0.0, 0.0, psi, 0.0, 0.0, 0.0)
    w = resolve(
        velocity_command(far, Motion(0.0, 0.0, 0.0, speed, 0.0, 0.0), Acceleration(0.0, 0.0, 0.0), (0.0, 0.0), G),
        STILL_WATER,
        psi,
    )
    assert heading_error(w, w.w_n, 1.0, G.rho, G) == 0.0


def test_lemma_5_the_heading_of_a_straight_path_is_stable_up_to_kappa_1_plus_d_over_c() -> None:
    """r = -c·(psi + v/U) - eta/U·dv, dv = -kappa·U·r - d·v; with D = 1 - eta·kappa the determinant is c·d/D."""
    c, d, kappa, eta, psi, v, r = sp.symbols("c d kappa eta psi v r")  # v in units of U
    turning = sp.solve(sp.Eq(r, -c * (psi + v) - eta * (-kappa * r - d * v)), r)[0]
    A = sp.Matrix([turning, -kappa * turning - d * v]).jacobian([psi, v])
    D = 1 - eta * kappa
    assert sp.simplify(A.trace() + (c * (1 - kappa) + d) / D) == 0
    assert sp.simplify(A.det() - c * d / D) == 0


@given(st.floats(0.1, 100.0), st.floats(1e-3, 1e3), st.floats(0.0, 3.0))
def test_the_gains_of_geometrically_similar_ships_are_similar(scale: float, density: float, lag: float) -> None:
    """Froude's law: lengths scale by k, times by sqrt(k); every gain keeps its number in the units of the ship."""
    small = KnownVessel(surge_lag=lag, yaw_lag=lag)
    time = math.sqrt(scale)
    large = KnownVessel(
        length=scale * small.length,
        yaw_inertia=density * scale**5 * small.yaw_inertia,
        yaw_moment_limit=density * scale**4 * small.yaw_moment_limit,
        surge_lag=time * lag,
        yaw_lag=time * lag,
    )
    assert unit_time(large) == pytest.approx(time * unit_time(small))
    ours, theirs = derived_gains(small), derived_gains(large)
    for name, rule in RULES.items():
        assert theirs[name] == pytest.approx(ours[name] * scale**rule.length * time**rule.time, rel=1e-9), name
