"""The Otter, a catamaran of 2 m, from its equations to a picture: ship, reference, control law and simulation in one file.

    python examples/otter_in_one_file.py [PICTURE.png]

| symbol | meaning | unit |
|---|---|---|
| eta = x, y, psi | position east and north, heading counter-clockwise from x | m, rad |
| nu = u, v, r | surge, sway and yaw velocity over ground, along the hull | m/s, rad/s |
| nu_r | the same relative to the water | m/s, rad/s |
| M, C, D | inertia with added mass, Coriolis and centripetal matrix, damping | |
| tau = X, 0, N | surge force and yaw moment: two propellers make no sway force | N, N·m |
| S1, S2 | sliding surfaces: velocity error of a point ahead of the origin, across and along the hull | m/s |

The ship is M·dnu_r + C(nu_r)·nu_r + D(nu_r)·nu_r = tau, deta = R(psi)·nu. Names follow Fossen, Handbook of Marine Craft
Hydrodynamics and Motion Control (2021). The numbers are those of the library's Otter, which `vessel-hsmc vessels` lists with its
sources. The law is `hierarchical` without what a real boat also needs, such as lags and noise. docs/hierarchical.md derives it.
"""

import math
import sys

import numpy as np

# -- The ship -----------------------------------------------------------------------------------------------------------

L = 2.0
M = np.array([[60.28, 0.0, 0.0], [0.0, 137.5, 11.0], [0.0, 11.0, 39.325]])  # 55 kg, the centre of gravity 0.2 m ahead
X_MAX, N_MAX = 239.36, 52.7
CURRENT = np.array([0.15, -0.1])  # of the water, east and north


def R(psi):
    """Rotation from the hull to the earth."""
    c, s = math.cos(psi), math.sin(psi)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def C(nu):
    """Coriolis and centripetal matrix of M (m2c): skew-symmetric, so these forces do no work."""
    u, v, r = nu
    c13, c23 = -(M[1, 1] * v + M[1, 2] * r), M[0, 0] * u
    return np.array([[0.0, 0.0, c13], [0.0, 0.0, c23], [-c13, -c23, 0.0]])


def D(nu):
    """Damping: linear, and the cross-flow drag fitted by |v| and |r|."""
    _, v, r = np.abs(nu)
    return np.diag([77.554, 137.5 + 105.43 * v + 65.71 * r, 39.325 + 414.16 * r + 69.36 * v])


def derivative(state, tau):
    """The rates of eta and nu. The current is steady: seen from a hull that turns, it turns the other way."""
    psi, nu = state[2], state[3:]
    u_c, v_c = R(psi)[:2, :2].T @ CURRENT
    nu_r = nu - [u_c, v_c, 0.0]
    dnu_r = np.linalg.solve(M, tau - (C(nu_r) + D(nu_r)) @ nu_r)
    dnu_c = np.array([nu[2] * v_c, -nu[2] * u_c, 0.0])
    return np.concatenate([R(psi) @ nu, dnu_r + dnu_c])


def rk4(state, tau, h):
    """One step of Runge-Kutta, with the force and the moment held."""
    a = derivative(state, tau)
    b = derivative(state + 0.5 * h * a, tau)
    c = derivative(state + 0.5 * h * b, tau)
    d = derivative(state + h * c, tau)
    return state + h / 6.0 * (a + 2.0 * b + 2.0 * c + d)


# -- The reference: a survey of three legs ------------------------------------------------------------------------------

SPEED, LEG, LANE, RAMP = 1.0, 40.0, 10.0, 2.0  # m/s, m, m, and time in which the yaw rate of a turn rises, s
HALF_TURN = math.pi * 0.5 * LANE / SPEED  # duration of a half turn of the radius LANE/2 at once, s


def yaw_rate(t):
    """The yaw rate of the reference and its rate of change: a half turn to port and one to starboard, without a jump."""
    for start, way in ((LEG / SPEED, 1.0), (2.0 * LEG / SPEED + HALF_TURN, -1.0)):
        s = min(t - start, start + HALF_TURN + RAMP - t)  # time since the begin, or until the end
        if s > 0.0:
            x, side = min(s / RAMP, 1.0), 1.0 if t - start < 0.5 * (HALF_TURN + RAMP) else -1.0
            r = way * math.pi / HALF_TURN
            return r * x * x * (3.0 - 2.0 * x), side * r * 6.0 * x * (1.0 - x) / RAMP
    return 0.0, 0.0


# -- The law ------------------------------------------------------------------------------------------------------------

T = math.sqrt(M[2, 2] / N_MAX)  # time of the turns; all gains are in units of L and T
X_P = M[1, 2] / M[1, 1]  # the moment does not accelerate this point sideways (centre of percussion)
M_P = M[2, 2] - M[1, 2] * X_P  # inertia that the moment turns there
SLOPE, LEVER, LOOKAHEAD, REACHING, PREDICTION = 0.5 / T, 0.12 * L, 0.9 * T, 3.0 / T, 12.0 / T


class Law:
    """Two levels of sliding surfaces about a point ahead of the origin. What acts on the hull besides, f, is learned."""

    def __init__(self, nu):
        self.f, self.predicted = np.zeros(3), nu.copy()

    def step(self, state, desired, nu_d, dnu_d, h):
        """The force and the moment. `desired`: eta of the reference; `nu_d`, `dnu_d`: its velocities and their rates."""
        psi, nu = state[2], state[3:]
        to_hull = R(psi)[:2, :2].T
        e = to_hull @ (state[:2] - desired[:2])
        v_d = R(desired[2] - psi)[:2, :2] @ nu_d[:2]
        turned = dnu_d[:2] + nu_d[2] * np.array([-nu_d[1], nu_d[0]])  # acceleration of the reference, in its own axes
        a_d = R(desired[2] - psi)[:2, :2] @ turned
        w, dw = v_d - SLOPE * e, a_d - SLOPE * (nu[:2] - v_d)  # wanted velocity (12)
        ahead = math.hypot(LEVER, LOOKAHEAD * np.linalg.norm(w))
        S1 = nu[1] - w[1] + ahead * (nu[2] - nu_d[2])  # (20)
        S2 = nu[0] - w[0]  # (23)
        f, r = self.f, nu[2]
        alpha = dw[1] - r * w[0] - f[1] + ahead * (dnu_d[2] - f[2]) - REACHING * S1
        N = M_P / (ahead - X_P) * alpha  # (22)
        X = M[0, 0] * (dw[0] + r * w[1] - f[0] - REACHING * S2)  # (28)
        tau = np.array([np.clip(X, -X_MAX, X_MAX), 0.0, np.clip(N, -N_MAX, N_MAX)])
        self.learn(nu, tau, h)
        return tau

    def learn(self, nu, tau, h):
        """Predict the velocities, and learn f from the errors of the prediction, as the paper's networks do (29)."""
        error = nu - self.predicted
        by_wrench = np.array([tau[0] / M[0, 0], -X_P * tau[2] / M_P, tau[2] / M_P])
        self.predicted = self.predicted + h * (self.f + by_wrench + PREDICTION * error)
        self.f = self.f + h * 0.25 * PREDICTION**2 * error


# -- The closed loop ----------------------------------------------------------------------------------------------------


def simulate(h=0.02):
    """Times, states of the ship (eta, nu), reference (eta) and wrench of a survey that begins 2 m off."""
    steps = round((3.0 * LEG / SPEED + 2.0 * HALF_TURN) / h)
    state, desired = np.array([0.0, -2.0, 0.0, 0.0, 0.0, 0.0]), np.zeros(3)
    law, rows = Law(state[3:]), []
    for k in range(steps):
        r_d, dr_d = yaw_rate(k * h)
        nu_d, dnu_d = np.array([SPEED, 0.0, r_d]), np.array([0.0, 0.0, dr_d])
        tau = law.step(state, desired, nu_d, dnu_d, h)
        rows.append((k * h, *state, *desired, tau[0], tau[2]))
        state = rk4(state, tau, h)
        middle = R(desired[2] + 0.5 * h * r_d)
        desired = desired + h * middle @ nu_d
    found = np.array(rows)
    return found[:, 0], found[:, 1:7], found[:, 7:10], found[:, 10:]


def draw(path):
    """The track, the error and the wrench, in one picture."""
    import matplotlib.pyplot as plt

    t, state, desired, wrench = simulate()
    error = np.hypot(*(state[:, :2] - desired[:, :2]).T)
    figure, (track, below, last) = plt.subplots(3, 1, figsize=(8.0, 9.0), height_ratios=(2.0, 1.0, 1.0), layout="constrained")
    track.plot(*desired[:, :2].T, label="reference", linewidth=4.0, alpha=0.4)
    track.plot(*state[:, :2].T, label="Otter")
    track.set(xlabel="x east [m]", ylabel="y north [m]", aspect="equal")
    track.legend()
    below.semilogy(t, error)
    below.set(ylabel="position error [m]", ylim=(1e-4, 5.0))
    last.plot(t, wrench[:, 0], label="surge force [N]")
    last.plot(t, wrench[:, 1], label="yaw moment [N·m]")
    last.set(xlabel="time [s]")
    last.legend()
    figure.savefig(path, dpi=120)
    late = error[t > 20.0]
    print(f"{path}: after 20 s the error is {np.sqrt(np.mean(late**2)):.3f} m rms, {late.max():.3f} m at most")


if __name__ == "__main__":
    draw(sys.argv[1] if len(sys.argv) > 1 else "otter.png")
