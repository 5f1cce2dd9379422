"""The theorems on the repaired hierarchical law, docs/theory.md, derived with SymPy from its equations."""

import pytest
import sympy as sp

t = sp.symbols("t")
l0, T_a, c, a = sp.symbols("l0 T_a c a", positive=True)
k1, k2, eta1, eta2, phi1, phi2, lam, gamma1, gamma2, gamma3, m11, m33, H = sp.symbols(
    "k1 k2 eta1 eta2 phi1 phi2 lam gamma1 gamma2 gamma3 m11 m33 H", positive=True
)
x, y, psi, u, v, r, x_d, y_d, c_x, c_y, r_c, ahead = (
    sp.Function(name)(t) for name in ("x", "y", "psi", "u", "v", "r", "x_d", "y_d", "c_x", "c_y", "r_c", "ahead")
)
F_u, F_v, F_r, f_u, f_v, f_r, tau_1, tau_2, sat1, sat2 = sp.symbols("F_u F_v F_r f_u f_v f_r tau_1 tau_2 sat1 sat2")

BOW, BEAM = sp.Matrix([sp.cos(psi), sp.sin(psi)]), sp.Matrix([-sp.sin(psi), sp.cos(psi)])
DP = u * BOW + v * BEAM
PLANT = {
    sp.diff(x, t): DP[0],
    sp.diff(y, t): DP[1],
    sp.diff(psi, t): r,
    sp.diff(u, t): F_u + tau_1 / m11,
    sp.diff(v, t): F_v,
    sp.diff(r, t): F_r + tau_2 / m33,
}
W = sp.Matrix([sp.Function("w_x")(t), sp.Function("w_y")(t)])


def rate(expression):
    return sp.diff(expression, t).subs(PLANT)


SIGMA1, SIGMA2 = v - W.dot(BEAM), r - r_c
S1, S2 = SIGMA1 + ahead * SIGMA2, u - W.dot(BOW)
DW, DL, DR_C = W.diff(t), sp.diff(ahead, t), sp.diff(r_c, t)
MOMENT = m33 / ahead * (DW.dot(BEAM) - r * W.dot(BOW) + ahead * DR_C - DL * SIGMA2 - f_v - ahead * f_r - k1 * S1 - eta1 * sat1)
FORCE = m11 * (DW.dot(BOW) + r * W.dot(BEAM) - f_u - k2 * S2 - eta2 * sat2)


def test_the_surfaces_obey_their_reaching_laws_for_any_velocity_field_lever_and_turn() -> None:
    d1 = rate(S1).subs(tau_2, MOMENT) - ((F_v - f_v) + ahead * (F_r - f_r) - k1 * S1 - eta1 * sat1)
    d2 = rate(S2).subs(tau_1, FORCE) - ((F_u - f_u) - k2 * S2 - eta2 * sat2)
    assert sp.simplify(d1) == 0
    assert sp.simplify(d2) == 0


def test_the_point_ahead_follows_the_velocity_field() -> None:
    """dE = -f·e + S2·bow + S1·beam + dl·(h - h_d) + ahead·(r_c·beam - r_d·beam_d), for w = dp_d - f·e."""
    psi_d, f = sp.Function("psi_d")(t), sp.Function("f")(t)
    p_d = sp.Matrix([x_d, y_d])
    e = sp.Matrix([x, y]) - p_d
    h_d, beam_d = sp.Matrix([sp.cos(psi_d), sp.sin(psi_d)]), sp.Matrix([-sp.sin(psi_d), sp.cos(psi_d)])
    w = p_d.diff(t) - f * e
    s1, s2 = v - w.dot(BEAM) + ahead * (r - r_c), u - w.dot(BOW)
    E = e + ahead * (BOW - h_d)
    expected = -f * e + s2 * BOW + s1 * BEAM + sp.diff(ahead, t) * (BOW - h_d) + ahead * (r_c * BEAM - sp.diff(psi_d, t) * beam_d)
    assert sp.simplify(E.diff(t).subs(PLANT) - expected) == sp.zeros(2, 1)


def test_the_adaptation_cancels_every_cross_term_of_the_lyapunov_function() -> None:
    """V = S²/2 + sum (p·e² + |H|²·W~²)/(2·gamma) with one weight a network: dV has no product of a weight error."""
    p = lam**2 / 4
    s1, s2, ahead, eu, ev, er, wu, wv, wr = sp.symbols("s1 s2 ahead e_u e_v e_r w_u w_v w_r")
    # A network's error is H·w; its weight obeys dw = -(gamma·S + p·e)/H, since dW = (gamma·S + p·e)·H/|H|², and f = H·W.
    d_s1, d_s2 = H * wv + ahead * H * wr - k1 * s1 - eta1 * sat1, H * wu - k2 * s2 - eta2 * sat2
    d_e = {eu: H * wu - lam * eu, ev: H * wv - lam * ev, er: H * wr - lam * er}
    d_w = {
        wu: -(gamma3 * s2 + p * eu) / H,
        wv: -(gamma1 * s1 + p * ev) / H,
        wr: -(gamma2 * ahead * s1 + p * er) / H,
    }
    V = (s1**2 + s2**2) / 2
    for error, weight, gamma in ((eu, wu, gamma3), (ev, wv, gamma1), (er, wr, gamma2)):
        V += (p * error**2 + H**2 * weight**2) / (2 * gamma)
    dV = sp.diff(V, s1) * d_s1 + sp.diff(V, s2) * d_s2
    dV += sum(sp.diff(V, q) * rate_of for q, rate_of in (*d_e.items(), *d_w.items()))
    left = -k1 * s1**2 - eta1 * sat1 * s1 - k2 * s2**2 - eta2 * sat2 * s2
    left -= p * lam * (eu**2 / gamma3 + ev**2 / gamma1 + er**2 / gamma2)
    assert sp.expand(dV - left) == 0


def test_a_network_follows_its_function_with_a_double_pole_at_half_the_prediction_gain() -> None:
    s, F = sp.symbols("s F")
    f, e = sp.symbols("f e")
    found = sp.solve([s * e - (F - f - lam * e), s * f - lam**2 / 4 * e], [f, e])
    assert sp.simplify((F - found[f]) / F - s * (s + lam) / (s + lam / 2) ** 2) == 0


@pytest.mark.parametrize(("function", "expected"), [("s*(s+lam)/(s+lam/2)**2", 2), ("(s+lam)/(s+lam/2)**2", 4 / lam)])
def test_the_errors_of_the_networks_are_at_most_twice_the_function_and_four_times_its_rate_by_lam(function, expected) -> None:
    """The L1 norms of F -> F - f and dF -> F - f are below 2 and 4/lam."""
    s, q = sp.symbols("s q", positive=True)
    G = sp.sympify(function, locals={"s": s, "lam": lam})
    at_once = sp.limit(G, s, sp.oo)
    g = sp.inverse_laplace_transform(sp.apart(sp.simplify(G - at_once), s), s, q)
    size = at_once + sp.integrate(sp.Abs(g).subs(lam, 2).rewrite(sp.Piecewise), (q, 0, sp.oo))
    assert float(size) <= float(sp.sympify(expected).subs(lam, 2)) + 1e-9


D, K, ratio, U, force, m22 = sp.symbols("D K lam U F m22", positive=True)


def hurwitz(polynomial, s):
    """The condition a1·a2 - a0·a3 of a cubic, and its other coefficients."""
    a3, a2, a1, a0 = sp.Poly(polynomial, s).all_coeffs()
    return sp.expand(a1 * a2 - a0 * a3), (a3, a2, a1, a0)


def test_the_path_error_on_a_straight_line_has_the_polynomial_and_the_routh_ratio_of_the_code() -> None:
    """De2 = v + U·psi, dpsi = r, dv = -D·v - K·U·r, and S1 = v + U·psi + c·e2 + ahead·r = 0."""
    s = sp.symbols("s")
    length = ratio * U
    r_of = lambda e2, heading, sway: -(sway + U * heading + c * e2) / length  # noqa: E731
    e2, heading, sway = sp.symbols("e2 psi v")
    states = sp.Matrix([e2, heading, sway])
    rates = sp.Matrix([sway + U * heading, r_of(e2, heading, sway), -D * sway - K * U * r_of(e2, heading, sway)])
    polynomial = (s * sp.eye(3) - rates.jacobian(states)).det() * ratio
    expected = ratio * s**3 + (ratio * D + 1 - K) * s**2 + (D + c * (1 - K)) * s + c * D
    assert sp.expand(polynomial - expected) == 0
    condition, _ = hurwitz(expected, s)
    expanded = D / c + (1 - K) * (1 + 1 / (c * ratio)) + (1 - K) ** 2 / (ratio * D)
    assert sp.simplify(condition / (c * ratio * D) - (expanded - 1)) == 0


def test_the_bow_stays_in_the_wind_at_rest_where_sway_is_damped_faster_than_errors_decay() -> None:
    """Dz2 = v, dv = -D·v + (F/m22)·psi, l0·r = -(v + c·z2): Hurwitz if and only if D > c, whatever wind and lever."""
    s = sp.symbols("s")
    z2, heading, sway = sp.symbols("z2 psi v")
    rates = sp.Matrix([sway, -(sway + c * z2) / l0, -D * sway + force / m22 * heading])
    polynomial = (s * sp.eye(3) - rates.jacobian([z2, heading, sway])).det() * l0
    condition, _ = hurwitz(polynomial, s)
    assert sp.simplify(condition - l0 * force / m22 * (D - c)) == 0


def test_under_a_hull_fixed_sway_force_the_vessel_circles_at_the_root_of_a_cubic() -> None:
    """With S1 = S2 = 0 at rest, dz1 = -c·z1 + r·z2 = 0 and dz2 = v - r·z1 = 0 z2 on the other side."""
    z1, z2, speed = sp.symbols("z1 z2 v", positive=True)
    turn = (c * z2 + speed) / l0
    found = sp.solve(turn * z1 - speed, z1)[0]
    cubic = sp.fraction(sp.together(c * found - turn * z2))[0]
    assert (
        sp.expand(cubic * sp.sign(sp.Poly(cubic, z2).LC()) + (z2 * (c * z2 + speed) ** 2 - c * l0**2 * speed)) == 0
        or sp.expand(cubic - (c * l0**2 * speed - z2 * (c * z2 + speed) ** 2)) == 0
    )


def test_the_share_of_the_turn_is_the_rate_of_the_heading_through_the_water() -> None:
    """d/dt atan2(v_d - c) = r_d·v_d·(v_d - c)/|v_d - c|² for a reference that turns at constant speed."""
    speed, turn, east, north = sp.symbols("U r c_x c_y", positive=True)
    way = sp.Matrix([speed * sp.cos(turn * t), speed * sp.sin(turn * t)])
    water = way - sp.Matrix([east, north])
    of_heading = sp.diff(sp.atan2(water[1], water[0]), t)
    assert sp.simplify(of_heading - turn * way.dot(water) / water.dot(water)) == 0


def test_the_printed_ratio_of_the_slopes_has_a_strict_lyapunov_function_of_heading_and_sway() -> None:
    """With c2 = c: dpsi_e = -((1 - K)·g + xi)/l, dxi = -D·(xi - K·g), V = K·D·l·(integral of g) + xi²/2."""
    g, xi, lever = sp.symbols("g xi l", positive=True)
    d_heading, d_xi = -((1 - K) * g + xi) / lever, -D * (xi - K * g)
    dV = K * D * lever * g * d_heading + xi * d_xi
    assert sp.expand(dV + K * (1 - K) * D * g**2 + D * xi**2) == 0


def test_with_that_ratio_the_heading_is_cascaded_with_the_point_ahead() -> None:
    """S1 = v + g + c·e_beam + l·(r + c·sin psi_e) = 0 gives r = -(v + g + c·E_beam)/l with E_beam = e_beam + l·sin psi_e."""
    sway, g, e_beam, lever, heading, yaw = sp.symbols("v g e l psi r")
    (found,) = sp.solve(sway + g + c * e_beam + lever * (yaw + c * sp.sin(heading)), yaw)
    assert sp.simplify(found + (sway + g + c * (e_beam + lever * sp.sin(heading))) / lever) == 0
