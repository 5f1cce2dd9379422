"""The stability proof (30) to (35) with two neurons per network: the adaptation law it requires, and the printed (29)."""

import paper_symbols as p
import pytest
import sympy as sp

S1, S2, z1, z2, a, b = p.S1, p.S2, p.z1, p.z2, p.a, p.b
gamma_v, gamma_r, gamma_u = GAMMA = sp.symbols("gamma_v gamma_r gamma_u", positive=True)
H_v, H_r, H_u = H = [sp.Matrix(sp.symbols(f"h_{n}:2", real=True)) for n in "vru"]  # activations
E_v, E_r, E_u = E = [sp.Matrix(sp.symbols(f"w_{n}:2", real=True)) for n in "vru"]  # W~ = W* - W^, what the weights are off by
eps_v, eps_r, eps_u = sp.symbols("eps_v eps_r eps_u", real=True)
tau_uw, tau_vw, tau_rw = p.DISTURBANCE

MISSED_V, MISSED_R, MISSED_U = (e.dot(h) for e, h in zip(E, H, strict=True))  # f~ = W~'H
DESIGNED = -p.k1 * S1**2 - p.k2 * S2**2 - p.eta1 * S1 * p.sgn(S1) - p.eta2 * S2 * p.sgn(S2)  # (35), before eta is used up

CONSISTENT = (gamma_v * a * S1 * H_v, gamma_r * ((b - a * z1) * S1 + z2 * S2) * H_r, gamma_u * S2 * H_u)
FIRST, SECOND, THIRD = S2, a * S1, b * z1 * S1 - a * z1 * S1 + z2 * S2  # what (29) multiplies H1, H2, H3 by
PRINTED = (gamma_v * FIRST * H_v, gamma_r * SECOND * H_r, gamma_u * THIRD * H_u)  # names of (14), (15), (25): v, r, u
PRINTED_FOR_33 = (gamma_v * SECOND * H_v, gamma_r * THIRD * H_r, gamma_u * FIRST * H_u)  # names of (33): u, v, r


def lyapunov_rate(adaptation, errors=0, disturbed=0):
    """dV of (30) under the law, in the order v, r, u; dW~ = -dW^. The printed (31) omits that sign."""
    known = {p.f_v: p.fv_hat + MISSED_V + errors * eps_v, p.f_r: p.fr_hat + MISSED_R + errors * eps_r}
    known[p.f_u] = p.fu_hat + MISSED_U + errors * eps_u
    dS1, dS2 = a * p.PRINTED_13 + b * p.PRINTED_18, p.PRINTED_24
    dV = (S1 * dS1 + S2 * dS2).subs(p.tau_1, p.LAW_TAU_1).subs(p.tau_2, p.SUMMED_TAU_2).subs(known)
    dV = dV.subs({tau: disturbed * tau for tau in p.DISTURBANCE})
    return dV - sum(e.dot(rate) / gamma for e, rate, gamma in zip(E, adaptation, GAMMA, strict=True))


def test_the_consistent_adaptation_cancels_the_cross_terms_of_32() -> None:
    assert sp.simplify(lyapunov_rate(CONSISTENT) - DESIGNED) == 0


def test_no_other_adaptation_cancels_the_cross_terms() -> None:
    """dV is linear in the weights' errors, so each rate follows from its coefficient: (29) has no freedom but the gammas."""
    rates = [sp.Matrix(sp.symbols(f"dw_{n}:2", real=True)) for n in "vru"]
    dV = sp.expand(sp.simplify(lyapunov_rate(rates)))
    unknown = [q for rate in rates for q in rate]
    (solution,) = sp.solve([dV.diff(w) for e in E for w in e], unknown, dict=True)
    expected = [q for rate in CONSISTENT for q in rate]
    assert all(sp.simplify(solution[q] - value) == 0 for q, value in zip(unknown, expected, strict=True))


@pytest.mark.parametrize(
    ("printed", "residue"),
    [
        (
            PRINTED,
            (a * S1 - S2) * MISSED_V
            + ((b - a * z1 - a) * S1 + z2 * S2) * MISSED_R
            + (S2 - (b - a) * z1 * S1 - z2 * S2) * MISSED_U,
        ),
        (PRINTED_FOR_33, b * (1 - z1) * S1 * MISSED_R),
    ],
    ids=["names of (14), (15), (25)", "names of (33)"],
)
def test_the_printed_adaptation_leaves_cross_terms(printed, residue) -> None:
    """Linear in the weights' errors, so of either sign: V may grow. With the names of (33) only one z1 is superfluous."""
    assert residue != 0
    assert sp.simplify(lyapunov_rate(printed) - DESIGNED - residue) == 0


def test_the_terms_that_the_switching_gains_must_exceed() -> None:
    """The exact terms behind (34): b - a·z1 weighs both tau_rw and the error of f_r; the printed |b - a| has lost z1."""
    weighs_on_1 = a * (tau_vw + eps_v) + (b - a * z1) * (tau_rw + eps_r)
    weighs_on_2 = (tau_uw + eps_u) + z2 * (tau_rw + eps_r)
    left = lyapunov_rate(CONSISTENT, errors=1, disturbed=1) - DESIGNED
    assert sp.simplify(left - S1 * weighs_on_1 - S2 * weighs_on_2) == 0
