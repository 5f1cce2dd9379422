"""An independent implementation of the paper's law, from its text alone, in arithmetic of 40 digits.

It shares no code with the package: positions are complex numbers, weights are lists, tau_2 is the sum of (16), (19) and (21)
as printed. z1 = 0, where (16) is singular, is replaced by 1e-30 m, which does not affect the sum with 40 digits.
"""

import mpmath

mp = mpmath.mp.clone()
mp.dps = 40
exp, mpc, mpf, sqrt, tanh = mp.exp, mp.mpc, mp.mpf, mp.sqrt, mp.tanh
NEAR_ZERO = mpf(10) ** -30


def numbers(values):
    """The values as numbers of 40 digits, without rounding."""
    return [mpf(float(value)) for value in values]


def sgn(s, width):
    """The sign of (21) and (27)."""
    return mpf((s > 0) - (s < 0))


def saturation(s, width):
    """s/width inside the boundary layer, the sign outside."""
    return max(mpf(-1), min(mpf(1), s / width))


def smooth(s, width):
    """tanh(s/width)."""
    return tanh(s / width)


SWITCHING = {"sgn": sgn, "saturation": saturation, "tanh": smooth}


def wrapped(angle):
    """The angle in [-pi, pi]."""
    while angle > mp.pi:
        angle -= 2 * mp.pi
    while angle < -mp.pi:
        angle += 2 * mp.pi
    return angle


def neuron(Z, mu, delta, power):
    """(3): power 2 is the Gaussian, 1 the print."""
    distance = sqrt(sum((z - m) ** 2 for z, m in zip(Z, mu, strict=True)))
    return exp(-(distance**power) / (2 * delta**2))


def transformed(x, y, psi, u, v, r):
    """(9) as z1 + i·z2, a rotation by -psi, and its time derivative."""
    Z = mpc(x, y) * exp(mpc(0, -psi))
    return Z, mpc(u, v) - mpc(0, r) * Z


class IndependentLaw:
    """One period of the law.

    Args:
        gains: By the paper's symbols: a b c1 c2 c3 k1 k2 eta1 eta2 gamma1 gamma2 gamma3 m11 m33 delta.
        centers: Lists of three.
        power: Exponent of the distance in (3).
        layers: Boundary layers of S1 and S2.
        switching: One of SWITCHING.
        a_switched: Whether the sign of a is switched so that a·sigma1 and b·sigma2 agree in sign.
        printed_rates: Whether the weights adapt by (29) as printed.
    """

    def __init__(self, gains, centers, layers=(1.0, 1.0), power=2, switching="sgn", a_switched=False, printed_rates=False):
        self.g = {name: mpf(float(value)) for name, value in gains.items()}
        self.centers = [numbers(center) for center in centers]
        self.power, self.switching, self.layers = power, SWITCHING[switching], numbers(layers)
        self.a_switched, self.printed_rates = a_switched, printed_rates

    def surfaces(self, state, desired, d_acceleration):
        """Compute the terms of (9) to (24) that do not depend on the wrench, as attributes."""
        g = self.g
        self.x, self.y, self.psi, self.u, self.v, self.r = numbers(state)
        x_d, y_d, psi_d, u_d, v_d, r_d = numbers(desired)
        du_d, dv_d, dr_d = numbers(d_acceleration)
        Z, dZ = transformed(self.x, self.y, self.psi, self.u, self.v, self.r)
        Z_d, dZ_d = transformed(x_d, y_d, psi_d, u_d, v_d, r_d)
        ddZ_d = mpc(du_d, dv_d) - mpc(0, dr_d) * Z_d - mpc(0, r_d) * dZ_d
        self.z1, self.z2, self.ddz1d, self.ddz2d, self.ddz3d = Z.real, Z.imag, ddZ_d.real, ddZ_d.imag, dr_d
        if self.z1 == 0:
            self.z1 = NEAR_ZERO
        error, self.d_error, self.dz3e = Z - Z_d, dZ - dZ_d, self.r - r_d
        sigma1 = g["c1"] * error.imag + self.d_error.imag
        sigma2 = g["c2"] * wrapped(self.psi - psi_d) + self.dz3e
        self.a = -g["a"] if self.a_switched and sigma1 * sigma2 < 0 else g["a"]
        self.S1 = self.a * sigma1 + g["b"] * sigma2
        self.S2 = g["c3"] * error.real + self.d_error.real

    def update(self, state, desired, d_acceleration, W1, W2, W3):
        """The wrench of (22) and (28) and the three rates of (29).

        Args:
            state, desired, d_acceleration: Six, six and three numbers.
            W1, W2, W3: Weights for f_v, f_r, f_u as (14), (15), (25) name them.

        Returns:
            (tau_1, tau_2) and the rates of W1, W2, W3.
        """
        g = self.g
        self.surfaces(state, desired, d_acceleration)
        H = [neuron((self.u, self.v, self.r), mu, g["delta"], self.power) for mu in self.centers]
        f_v, f_r, f_u = (sum(w * h for w, h in zip(numbers(W), H, strict=True)) for W in (W1, W2, W3))
        tau_2 = self.yaw_moment(f_v, f_r)
        tau_1 = self.surge_force(f_u, f_r, tau_2)
        return (tau_1, tau_2), [[scale * h for h in H] for scale in self.rate_scales()]

    def yaw_moment(self, f_v, f_r):
        """(16), (19), (21), (22)."""
        g, m33, b, a, z1 = self.g, self.g["m33"], self.g["b"], self.a, self.z1
        inside = -g["c1"] * self.d_error.imag - f_v + (self.u + self.z2 * self.r) * self.r + z1 * f_r + self.ddz2d
        tau_eq21 = -m33 / z1 * inside
        tau_eq22 = m33 * (-g["c2"] * self.dz3e - f_r + self.ddz3d)
        switched = -g["eta1"] * self.switching(self.S1, self.layers[0]) - g["k1"] * self.S1
        tau_sw2 = (switched + a * z1 / m33 * tau_eq22 - b / m33 * tau_eq21) / (b / m33 - a * z1 / m33)
        return tau_eq21 + tau_eq22 + tau_sw2

    def surge_force(self, f_u, f_r, tau_2):
        """(26), (27), (28)."""
        g = self.g
        drift = (self.v - self.z1 * self.r) * self.r + self.z2 * (f_r + tau_2 / g["m33"])
        tau_eq1 = g["m11"] * (-g["c3"] * self.d_error.real - f_u - drift + self.ddz1d)
        tau_sw1 = g["m11"] * (-g["eta2"] * self.switching(self.S2, self.layers[1]) - g["k2"] * self.S2)
        return tau_eq1 + tau_sw1

    def rate_scales(self):
        """Factors of H in the rates of W1, W2, W3: derived from (32), or (29) as printed."""
        g, a, b, z1, z2, S1, S2 = self.g, self.a, self.g["b"], self.z1, self.z2, self.S1, self.S2
        if self.printed_rates:
            scales = S2, a * S1, b * z1 * S1 - a * z1 * S1 + z2 * S2
        else:
            scales = a * S1, b * S1 - a * z1 * S1 + z2 * S2, S2
        return [g[f"gamma{i}"] * scale for i, scale in enumerate(scales, 1)]
