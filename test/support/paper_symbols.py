"""The paper's symbols for SymPy: ship, virtual ship, transformation and surfaces, each by its equation number.

The equations from (12) on are written in z1, z2, dz1e ... as the paper prints them; `DEFINITIONS` expresses those by
the states of the two ships, and `rate` differentiates an expression in the states along (7) and (8).
"""

import sympy as sp

x, y, psi, u, v, r = STATE = sp.symbols("x y psi u v r", real=True)
x_d, y_d, psi_d, u_d, v_d, r_d = DESIRED = sp.symbols("x_d y_d psi_d u_d v_d r_d", real=True)
f_u, f_v, f_r, f_ud, f_vd, f_rd = sp.symbols("f_u f_v f_r f_ud f_vd f_rd", real=True)
tau_1, tau_2, tau_1d, tau_2d = sp.symbols("tau_1 tau_2 tau_1d tau_2d", real=True)
tau_uw, tau_vw, tau_rw = DISTURBANCE = sp.symbols("tau_uw tau_vw tau_rw", real=True)
m11, m22, m33 = sp.symbols("m11 m22 m33", positive=True)
d_u, d_v, d_r, d_u2, d_u3, d_v2, d_v3, d_r2, d_r3 = sp.symbols("d_u d_v d_r d_u2 d_u3 d_v2 d_v3 d_r2 d_r3", real=True)

z1, z2, z3, z1d, z2d, z3d = sp.symbols("z1 z2 z3 z1d z2d z3d", real=True)
dz1e, dz2e, dz3e, ddz1d, ddz2d, ddz3d = sp.symbols("dz1e dz2e dz3e ddz1d ddz2d ddz3d", real=True)
a, b, c1, c2, c3, k1, k2, eta1, eta2 = sp.symbols("a b c1 c2 c3 k1 k2 eta1 eta2", positive=True)
S1, S2 = sp.symbols("S1 S2", real=True)
fv_hat, fr_hat, fu_hat = sp.symbols("fv_hat fr_hat fu_hat", real=True)
sgn = sp.Function("sgn")


def unforced(u, v, r, yaw_damping_divisor=m33):
    """f_u, f_v, f_r of (7); E1: print divides the higher-order yaw damping by m11."""
    return (
        m22 / m11 * v * r - d_u / m11 * u - d_u2 / m11 * abs(u) * u - d_u3 / m11 * u**3,
        -m11 / m22 * u * r - d_v / m22 * v - d_v2 / m22 * abs(v) * v - d_v3 / m22 * v**3,
        (m11 - m22) / m33 * u * v - d_r / m33 * r - (d_r2 * abs(r) * r + d_r3 * r**3) / yaw_damping_divisor,
    )


# (7) and (8): how the states of the ship and of the virtual ship move.
RATES = {
    x: u * sp.cos(psi) - v * sp.sin(psi),
    y: u * sp.sin(psi) + v * sp.cos(psi),
    psi: r,
    u: f_u + tau_1 / m11 + tau_uw,
    v: f_v + tau_vw,
    r: f_r + tau_2 / m33 + tau_rw,
    x_d: u_d * sp.cos(psi_d) - v_d * sp.sin(psi_d),
    y_d: u_d * sp.sin(psi_d) + v_d * sp.cos(psi_d),
    psi_d: r_d,
    u_d: f_ud + tau_1d / m11,
    v_d: f_vd,
    r_d: f_rd + tau_2d / m33,
}


def rate(expression):
    """The time derivative of an expression in the states, along (7) and (8)."""
    return sum(sp.diff(expression, q) * dq for q, dq in RATES.items())


def vanishes(expression):
    """Whether an expression is zero for all states."""
    return sp.trigsimp(sp.expand(expression)) == 0


# (9) and (10)
_z = {
    z1: x * sp.cos(psi) + y * sp.sin(psi),
    z2: -x * sp.sin(psi) + y * sp.cos(psi),
    z3: psi,
    z1d: x_d * sp.cos(psi_d) + y_d * sp.sin(psi_d),
    z2d: -x_d * sp.sin(psi_d) + y_d * sp.cos(psi_d),
    z3d: psi_d,
}
_pairs = ((dz1e, ddz1d, z1, z1d), (dz2e, ddz2d, z2, z2d), (dz3e, ddz3d, z3, z3d))
DEFINITIONS = {
    **_z,
    **{de: rate(_z[q]) - rate(_z[q_d]) for de, _, q, q_d in _pairs},
    **{dd: rate(rate(_z[q_d])) for _, dd, _, q_d in _pairs},
}


def in_states(expression):
    """The expression with z1, dz1e ... replaced by their definitions."""
    return expression.subs(DEFINITIONS)


# Surfaces (12), (17), (20), (23)
sigma1 = c1 * (z2 - z2d) + dz2e
sigma2 = c2 * (z3 - z3d) + dz3e
YAW_SURFACE = a * sigma1 + b * sigma2
SURGE_SURFACE = c3 * (z1 - z1d) + dz1e

# Their rates as printed: (13), (18), (24)
PRINTED_13 = c1 * dz2e + f_v + tau_vw - (u + z2 * r) * r - z1 * (f_r + tau_2 / m33 + tau_rw) - ddz2d
PRINTED_18 = c2 * dz3e + f_r + tau_rw + tau_2 / m33 - ddz3d
PRINTED_24 = c3 * dz1e + f_u + tau_1 / m11 + tau_uw + (v - z1 * r) * r + z2 * (f_r + tau_2 / m33 + tau_rw) - ddz1d

# The law: (16), (19), (21) as printed, then the same summed over the common denominator, (26), (27)
TAU_EQ21 = -m33 / z1 * (-c1 * dz2e - fv_hat + (u + z2 * r) * r + z1 * fr_hat + ddz2d)
TAU_EQ22 = m33 * (-c2 * dz3e - fr_hat + ddz3d)
_reaching = -eta1 * sgn(S1) - k1 * S1
TAU_SW2 = (_reaching + a * z1 / m33 * TAU_EQ22 - b / m33 * TAU_EQ21) / (b / m33 - a * z1 / m33)
SUMMED_TAU_2 = (b * TAU_EQ22 + a * m33 * (-c1 * dz2e - fv_hat + (u + z2 * r) * r + z1 * fr_hat + ddz2d) + m33 * _reaching) / (
    b - a * z1
)
TAU_EQ1 = m11 * (-c3 * dz1e - fu_hat - (v - z1 * r) * r - z2 * (fr_hat + tau_2 / m33) + ddz1d)
LAW_TAU_1 = TAU_EQ1 + m11 * (-eta2 * sgn(S2) - k2 * S2)
