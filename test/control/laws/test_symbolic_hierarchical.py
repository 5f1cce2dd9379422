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
MOTION = (x, y, psi, u, v, r)
ERRORS = sp.symbols("e_x e_y e_psi e_u e_v e_r")


def predicted_rate(expression):
    """Along the motion that networks and wrench predict, which its errors correct."""
    network = dict(zip((F_u, F_v, F_r), (f_u, f_v, f_r), strict=True))
    along = {sp.diff(q, t): PLANT[sp.diff(q, t)].subs(network) + lam * e for q, e in zip(MOTION, ERRORS, strict=True)}
    return sp.diff(expression, t).subs(along)


def test_the_surfaces_of_the_predicted_motion_obey_their_reaching_laws_for_any_velocity_field_lever_and_turn() -> None:
    """dS = -k·S - eta·sat + lam·(gradient of S)·(prediction errors), for w of place and time, and l of heading and v too."""
    w = sp.Matrix([sp.Function(name)(x, y, t) for name in ("w_x", "w_y")])
    lever = sp.Function("l")(x, y, psi, v, t)
    sigma1, sigma2 = v - w.dot(BEAM), r - r_c
    s1, s2 = sigma1 + lever * sigma2, u - w.dot(BOW)
    # The law's rates are those of the prediction without its corrections.
    uncorrected = dict.fromkeys(ERRORS, 0)
    dw, dl = (predicted_rate(each).subs(uncorrected) for each in (w, lever))
    equivalent = dw.dot(BEAM) - r * w.dot(BOW) + lever * sp.diff(r_c, t) - dl * sigma2 - f_v - lever * f_r
    moment = m33 / lever * (equivalent - k1 * s1 - eta1 * sat1)
    thrust = m11 * (dw.dot(BOW) + r * w.dot(BEAM) - f_u - k2 * s2 - eta2 * sat2)
    for surface, reaching in ((s1, -k1 * s1 - eta1 * sat1), (s2, -k2 * s2 - eta2 * sat2)):
        corrections = lam * sum(surface.diff(q) * e for q, e in zip(MOTION, ERRORS, strict=True))
        found = predicted_rate(surface).subs({tau_1: thrust, tau_2: moment})
        assert sp.simplify(sp.expand((found - reaching - corrections).doit())) == 0


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


def test_a_prediction_error_follows_the_rate_of_its_function_and_its_surface_with_a_double_pole() -> None:
    """De = F - f - lam·e and df = lam²/4·e + gamma·S give e = (s·F - gamma·S)/(s + lam/2)²."""
    s, F, S, gamma = sp.symbols("s F S gamma")
    f, e = sp.symbols("f e")
    found = sp.solve([s * e - (F - f - lam * e), s * f - lam**2 / 4 * e - gamma * S], [f, e])
    assert sp.simplify(found[e] - (s * F - gamma * S) / (s + lam / 2) ** 2) == 0
    assert sp.simplify((F - found[f].subs(S, 0)) / F - s * (s + lam) / (s + lam / 2) ** 2) == 0


@pytest.mark.parametrize(
    ("function", "impulse", "zero", "expected"),
    [
        ("s/(s+lam/2)**2", "(1-lam*q/2)*exp(-lam*q/2)", "2/lam", "4/(E*lam)"),
        ("1/(s+lam/2)**2", "q*exp(-lam*q/2)", "0", "4/lam**2"),
    ],
)
def test_prediction_errors_are_bounded_by_their_function_and_by_its_rate(function, impulse, zero, expected) -> None:
    """The L1 norms of F -> e and dF -> e: the integral of the impulse response's magnitude."""
    s, q = sp.symbols("s q", positive=True)
    G, g, change, size = (sp.sympify(each, locals={"s": s, "q": q, "lam": lam}) for each in (function, impulse, zero, expected))
    assert sp.simplify(sp.laplace_transform(g, q, s, noconds=True) - G) == 0
    found = sp.integrate(g, (q, 0, change)) - sp.integrate(g, (q, change, sp.oo))
    assert sp.simplify(sp.Abs(found) - size) == 0


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
