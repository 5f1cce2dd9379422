"""The centre of percussion: derived for the whole class of ships, and met by the plant and by what the laws know."""

import math
from typing import Any

import pytest
import sympy as sp

from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.plant.dynamics import acceleration, unforced_acceleration
from vessel_hsmc_ros.plant.hull_parameters import VesselParameters

m11, m22, m33, m23, m32 = sp.symbols("m11 m22 m33 m23 m32", real=True)
u, v, r, dv, dr = sp.symbols("u v r dv dr", real=True)
d_v, d_r, d_yr, d_nv, e, x, N = sp.symbols("d_v d_r d_yr d_nv e x N", real=True)

M = sp.Matrix([[m11, 0, 0], [0, m22, m23], [0, m32, m33]])
SYMMETRIC = {m32: m23}
X_P = (m23 - m33 * e) / (m22 - m32 * e)
M_P = m33 - X_P * m32

T = sp.Matrix([[1, 0, 0], [0, 1, -x], [0, 0, 1]])
"""From the velocities at a point x ahead to those of the origin: v = v_x - x·r."""


def coriolis(M, velocities):
    """C(nu) of the plant, with the mean of m23 and m32."""
    c13, c23 = -(M[1, 1] * velocities[1] + (M[1, 2] + M[2, 1]) / 2 * velocities[2]), M[0, 0] * velocities[0]
    return sp.Matrix([[0, 0, c13], [0, 0, c23], [-c13, -c23, 0]])


def is_zero(expression) -> bool:
    return sp.simplify(expression) in (0, sp.zeros(*getattr(expression, "shape", (0, 0))))


def test_a_yaw_moment_turns_the_ship_about_the_pivot() -> None:
    """The solution of M·(v', r') = (e·N, N) has v' = -x_p·r' and r' = N/m_p, for an asymmetric matrix and a rudder too."""
    found = M[1:, 1:].LUsolve(sp.Matrix([e * N, N]))
    assert is_zero(found[0] + X_P * found[1])
    assert is_zero(found[1] - N / M_P)
    assert is_zero(M_P - (m22 * m33 - m23 * m32) / (m22 - m32 * e))


def test_a_symmetric_inertia_matrix_is_diagonal_at_the_pivot() -> None:
    moved = (T.T * M * T).subs(SYMMETRIC).subs(x, m23 / m22)
    assert is_zero(moved - sp.diag(m11, m22, m33 - m23**2 / m22))


def test_of_an_asymmetric_matrix_the_other_coupling_remains_and_no_input_enters_the_sway() -> None:
    """T'MT keeps m32 - m23 below the diagonal; the moment, (0, 0, N) at every point, enters the sway equation nowhere."""
    moved = (T.T * M * T).subs(x, m23 / m22)
    assert moved[1, 2].equals(0)
    assert is_zero(moved[2, 1] - (m32 - m23))
    assert T.T * sp.Matrix([0, 0, N]) == sp.Matrix([0, 0, N])


def test_coriolis_forces_keep_their_form_at_the_pivot() -> None:
    """T'·C(nu)·T·nu_p is C of the diagonal matrix T'MT at nu_p: the Coriolis terms of m23 vanish with it."""
    at = sp.Matrix([u, v, r])
    moved = (T.T * coriolis(M, T * at) * T * at).subs(SYMMETRIC).subs(x, m23 / m22)
    diagonal = sp.diag(m11, m22, m33 - m23**2 / m22)
    assert is_zero(moved - coriolis(diagonal, at) * at)


def test_of_the_damping_cross_terms_remain_at_the_pivot() -> None:
    """T'DT: sway loses d_yr - x·d_v to the yaw rate, yaw d_nv - x·d_v to sway; both may be zero only by chance."""
    D = sp.Matrix([[0, 0, 0], [0, d_v, d_yr], [0, d_nv, d_r]])
    moved = T.T * D * T
    assert is_zero(
        moved - sp.Matrix([[0, 0, 0], [0, d_v, d_yr - x * d_v], [0, d_nv - x * d_v, d_r - x * (d_yr + d_nv) + x**2 * d_v]])
    )


def test_the_heading_is_stable_while_a_point_behind_the_pivot_is_not_steered_ahead() -> None:
    """Linearised about a straight course at the speed U, a point l ahead of the centre of percussion is kept on it: y = 0.

    With y' = U·delta + v_p + l·delta' and v_p' = -k·v_p - mu·U·delta', mu = (m11 + (d_yr - x_p·d_v)/U)/m22, the heading obeys
    l·delta'' + (U·(1 - mu) + k·l)·delta' + k·U·delta = 0: for l = 0 it decays where mu < 1; for l < 0 it grows.
    """
    U, k, mu, length, s, delta = sp.symbols("U k mu l s delta")
    v_p = sp.Symbol("v_p")
    kept = sp.solve(U * delta + v_p + length * s * delta, v_p)[0]
    heading = sp.expand(-(s * kept + k * kept + mu * U * s * delta) / delta)
    assert is_zero(heading - (length * s**2 + (U * (1 - mu) + k * length) * s + k * U))
    root = sp.solve(heading.subs(length, 0), s)[0]
    assert is_zero(root + k / (1 - mu))
    # Descartes: with l < 0 first and last coefficient differ in sign, so one root is positive.
    assert sp.Poly(heading, s).coeffs()[0] == length
    assert is_zero(sp.Poly(heading, s).coeffs()[-1] - k * U)


def test_a_filter_slower_than_the_heading_keeps_the_loop_stable() -> None:
    """The point of the reference at x·delta_f, delta_f' = omega·(delta - delta_f) + b, b' = q·omega²·(delta - delta_f), is kept.

    With p = x·omega, the loop is A·s³ + B·s² + C·s + D. Where p < U·(1 - mu), mu >= 0 and q <= 1/2, all of A, D, B - A·omega and
    omega·C - D are positive, hence B·C > A·D and all roots are negative (Routh-Hurwitz).
    """
    U, k, mu, omega, q, p, s, delta = sp.symbols("U k mu omega q p s delta", positive=True)
    closing = s**2 + omega * s + q * omega**2
    filtered = (omega * s + q * omega**2) / closing * delta
    kept = p / omega * s * filtered - U * delta
    loop = sp.Poly(sp.expand(sp.simplify(-(s * kept + k * kept + mu * U * s * delta) / delta * closing)), s)
    A, B, C, D = loop.all_coeffs()
    assert is_zero(A - (U * (1 - mu) - p))
    assert is_zero(D - U * k * q * omega**2)
    # p < U·(1 - mu) <= U makes each term on the right positive.
    assert is_zero(B - A * omega - ((U - p) * k + (1 - q) * p * omega))
    assert is_zero(omega * C - D - omega**2 * ((U * (1 - 2 * q) + q * (U - p)) * k + U * (1 - mu) * q * omega))


@pytest.mark.parametrize(
    "coupling", [{"sway_yaw_inertia": 6e5}, {"sway_yaw_inertia": -4e5, "yaw_sway_inertia": -7e5}, {"e": -0.07}]
)
def test_on_the_plant_the_yaw_moment_does_not_move_the_pivot_sideways(coupling: dict[str, Any]) -> None:
    inertia = {name: value for name, value in coupling.items() if name != "e"}
    side = coupling.get("e", 0.0)
    known = KnownVessel(**inertia, sway_force_per_yaw_moment=side)
    moment = 2e6
    _, sway, yaw = acceleration((0.0, side * moment, moment), VesselParameters(**inertia).coefficients())
    assert abs(sway + known.percussion_point * yaw) < 1e-14
    assert yaw == pytest.approx(moment / known.as_controlled().yaw_inertia, rel=1e-14)


def test_at_the_pivot_the_plant_without_damping_is_one_without_coupling() -> None:
    undamped: dict[str, Any] = dict.fromkeys(("surge_damping", "sway_damping", "yaw_damping"), 0.0)
    undamped |= {f"{name}_{power}": 0.0 for name in undamped for power in ("quadratic", "cubic")}
    coupled = VesselParameters(**undamped, sway_yaw_inertia=6e5).coefficients()
    known = KnownVessel(sway_yaw_inertia=6e5)
    plain = VesselParameters(**undamped, yaw_inertia=known.as_controlled().yaw_inertia).coefficients()
    x_p, (surge, sway, yaw) = known.percussion_point, (3.0, 0.4, -0.2)
    f = unforced_acceleration(surge, sway - x_p * yaw, yaw, coupled)
    at = unforced_acceleration(surge, sway, yaw, plain)
    assert (f[0], f[1] + x_p * f[2], f[2]) == pytest.approx(at, rel=1e-13)
    assert math.isclose(x_p, 6e5 / 177.9e3)
