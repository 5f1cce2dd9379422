"""The filter of the guided law: its Jacobian, its covariance, and what it learns of a ship in a current."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vessel_hsmc_ros.control.guided.guidance import (
    B_RANGE,
    CE,
    CN,
    FU,
    FV,
    KAPPA,
    KAPPA_RANGE,
    LN_A,
    LN_A_RANGE,
    STATES,
    B,
    R,
    U,
    V,
    correct,
    measure,
    predict,
    unforced,
)
from vessel_hsmc_ros.control.guided.parameters import GuidedParameters, gains
from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel

PERIOD = 0.1
G = gains(GuidedParameters(), KnownVessel(), PERIOD)
STATE = np.array([0.3, -0.05, 0.4, -0.5, 0.02, -0.1, 0.4, 0.7, 0.4, 0.05, -0.08])


def after(x, psi=0.7, g=G):
    x = x.copy()
    predict(x, np.zeros((STATES, STATES)), psi, 0.3, -0.2, np.zeros((20, 15)), g)
    return x


def test_the_covariance_goes_on_by_the_derivative_of_the_states():
    still = G._replace(w_0=0.0, Q=np.zeros(STATES))
    F = np.column_stack([(after(STATE + d, g=still) - after(STATE - d, g=still)) / 2e-6 for d in 1e-6 * np.eye(STATES)])
    root = np.random.default_rng(1).normal(size=(STATES, STATES))
    P = root @ root.T
    expected = F @ P @ F.T
    predict(STATE.copy(), P, 0.7, 0.3, -0.2, np.zeros((20, 15)), still)
    # u, v and r change within a period; the Jacobian is of first order in its length.
    assert pytest.approx(expected, rel=2e-3, abs=2e-3) == P
    assert pytest.approx(P.T) == P


@settings(max_examples=20)
@given(st.lists(st.tuples(*[st.floats(-3.0, 3.0)] * 4), min_size=1, max_size=60))
def test_the_covariance_stays_positive_and_the_states_finite_whatever_is_measured(series):
    x, P, S, noise = G.x_0.copy(), np.diag(G.P_0), np.zeros((20, 15)), np.array([G.R_u, G.R_r])
    for u, v, r, psi in series:
        correct(x, P, noise, (u, v, r), S, G)
        predict(x, P, psi, 0.5, -0.5, S, G)
    assert np.isfinite(x).all()
    assert np.linalg.eigvalsh(P).min() > -1e-12


def test_unobserved_states_return_to_what_was_expected():
    x, P, S = G.x_0.copy(), np.diag(G.P_0), np.zeros((20, 15))
    x[LN_A], x[CE] = x[LN_A] + 1.0, 0.2
    for _ in range(round(200.0 / G.h)):
        predict(x, P, 0.0, 0.0, 0.0, S, G)
    assert x[LN_A:] == pytest.approx(G.x_0[LN_A:], abs=0.02)
    assert np.diag(P)[LN_A:] == pytest.approx(G.Q[LN_A:] / (2.0 * G.w_0), rel=0.02)


@pytest.mark.parametrize(("state", "bounds"), [(LN_A, LN_A_RANGE), (KAPPA, KAPPA_RANGE), (B, B_RANGE)])
@pytest.mark.parametrize("side", [0, 1])
def test_what_is_learned_of_the_ship_stays_within_its_range(state, bounds, side):
    x, P, S, noise = G.x_0.copy(), np.diag(G.P_0), np.zeros((20, 15)), np.array([G.R_u, G.R_r])
    x[state] = bounds[side] + (-0.1, 0.1)[side]
    correct(x, P, noise, (0.0, 0.0, 0.0), S, G)
    assert x[state] == bounds[side]
    x[state] = 0.5 * sum(bounds)
    correct(x, P, noise, (0.0, 0.0, 0.0), S, G)
    assert x[state] == pytest.approx(0.5 * sum(bounds), abs=0.05)


def test_an_outlier_counts_as_four_deviations():
    changes = []
    for beyond in (4.0, 400.0):
        x, P = G.x_0.copy(), np.diag(G.P_0)
        measure(x, P, U, beyond * math.sqrt(P[U, U] + G.R_u), G.R_u, np.zeros((20, 15)))
        changes.append(x[U])
    assert changes[0] == pytest.approx(changes[1])
    assert changes[0] > 0.0


def test_the_covariance_stays_symmetric_to_the_last_bit_because_nothing_would_correct_the_difference():
    x, P, S, noise = G.x_0.copy(), np.diag(G.P_0), np.zeros((20, 15)), np.array([G.R_u, G.R_r])
    for k in range(300):
        correct(x, P, noise, (0.3, 0.01 * math.sin(0.1 * k), 0.1 * math.cos(0.07 * k)), S, G)
        predict(x, P, 0.01 * k, 0.1, 0.0, S, G)
    assert np.array_equal(P, P.T)


def test_the_variance_of_the_measurements_follows_their_noise_and_falls_again_when_it_ends():
    x, P, S, noise = G.x_0.copy(), np.diag(G.P_0), np.zeros((20, 15)), np.array([G.R_u, G.R_r])
    rng, found = np.random.default_rng(3), []
    for deviation in (np.array([0.2, 0.2, 0.5]), np.zeros(3)):
        for k in range(round(60.0 / G.h)):
            correct(x, P, noise, tuple(deviation * rng.normal(size=3)), S, G)
            predict(x, P, 0.02 * k * G.h, 0.0, 0.0, S, G)
        found.append(noise.copy())
    assert found[0] == pytest.approx([0.04, 0.25], rel=0.5)
    assert found[1] == pytest.approx([G.R_u, G.R_r])


def test_a_ship_that_turns_in_a_current_shows_the_current_and_the_decay_of_her_sway():
    decay, kappa, current = 0.8, 0.6, (0.09, -0.06)
    truth = G.x_0.copy()
    truth[LN_A], truth[KAPPA], truth[CE], truth[CN] = math.log(decay), kappa, *current
    g = G._replace(m=1.0 / kappa)
    x, P, S, psi, noise = g.x_0.copy(), np.diag(g.P_0), np.zeros((20, 15)), 0.0, np.array([g.R_u, g.R_r])
    for k in range(round(100.0 / g.h)):
        turn, thrust = 0.8 * math.cos(0.5 * k * g.h), 0.3 - float(truth[U])
        predict_truth(truth, psi, thrust, 2.0 * (turn - float(truth[R])), g)
        predict(x, P, psi, thrust, 2.0 * (turn - float(truth[R])), S, g)
        psi += g.h * float(truth[R])
        correct(x, P, noise, (float(truth[U]), float(truth[V]), float(truth[R])), S, g)
    assert (x[CE], x[CN]) == pytest.approx(current, abs=0.02)
    assert math.exp(x[LN_A]) == pytest.approx(decay, rel=0.25)
    assert abs(x[FU]) + abs(x[FV]) < 0.05


def predict_truth(x, psi, a_1, a_2, g):
    """The ship itself, by small Euler steps of the equations of motion."""
    for _ in range(10):
        du, dv, dr = unforced(float(x[U]), float(x[V]), float(x[R]), psi, x, g)
        x[U], x[V], x[R] = x[U] + 0.1 * g.h * (du + a_1), x[V] + 0.1 * g.h * dv, x[R] + 0.1 * g.h * (dr + a_2)
        psi += 0.1 * g.h * float(x[R])
