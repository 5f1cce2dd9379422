"""An independent implementation of the repaired hierarchical law, from docs/theory.md alone, in arithmetic of 30 digits.

It shares no code with the package: vectors of the plane are complex numbers, and every derivative with respect to time is a
numerical one of 30 digits along the motion, instead of the formulae of the package.
"""

import mpmath

mp = mpmath.mp.clone()
mp.dps = 30
mpc, mpf, sqrt = mp.mpc, mp.mpf, mp.sqrt


def numbers(values):
    return [mpf(float(value)) for value in values]


def dot(a, b):
    return (a * mp.conj(b)).real


def limited(value, limit):
    return max(-limit, min(limit, value))


class IndependentHierarchical:
    """The law with its memory.

    Args:
        gains: By the symbols of the pages, in SI units: c a l0 T_a k1 .. m33, tau_1max, tau_2max, T_c, U_c, T.
        centers: Of the neurons, lists of three.
        width: Of every neuron.
        lasting: Share at which the lasting sway velocity is learned.
    """

    def __init__(self, gains, centers, width, lasting):
        self.g = {name: mpf(float(value)) for name, value in gains.items()}
        self.centers, self.width, self.lasting_share = [numbers(each) for each in centers], mpf(float(width)), mpf(lasting)
        n = len(centers)
        self.W, self.growth, self.H = [[mpf(0)] * n for _ in range(3)], [mpf(0)] * 3, [mpf(0)] * n
        self.predicted, self.current, self.lasting = None, mpc(0), mpf(0)

    def step(self, state, desired, acceleration):
        """The wrench of a period, for x y psi u v r of vessel and reference and du_d dv_d dr_d."""
        g = self.g
        x, y, psi, u, v, r = numbers(state)
        self.W = [
            [w + growth * h for w, h in zip(row, self.H, strict=True)] for row, growth in zip(self.W, self.growth, strict=True)
        ]
        self.H = [
            mp.exp(-sum((z - m) ** 2 for z, m in zip((u, v, r), mu, strict=True)) / (2 * self.width**2)) for mu in self.centers
        ]
        fu, fv, fr = (sum(w * h for w, h in zip(row, self.H, strict=True)) for row in self.W)
        bow = mp.expj(psi)
        beam = mpc(0, 1) * bow
        where, way = mpc(x, y), u * bow + v * beam
        field, turn, lever = self.functions(where, way, desired, acceleration)
        w, dw, r_c, dr_c, ahead, dahead = field(0), mp.diff(field, 0), turn(0), mp.diff(turn, 0), lever(0), mp.diff(lever, 0)
        sigma2 = r - r_c
        S1, S2 = v - dot(w, beam) + ahead * sigma2, u - dot(w, bow)
        tau_2 = dot(dw, beam) - r * dot(w, bow) + ahead * dr_c - dahead * sigma2 - fv - ahead * fr
        tau_2 = g["m33"] / ahead * (tau_2 - g["k1"] * S1 - g["eta1"] * limited(S1 / g["phi1"], 1))
        tau_1 = g["m11"] * (dot(dw, bow) + r * dot(w, beam) - fu - g["k2"] * S2 - g["eta2"] * limited(S2 / g["phi2"], 1))
        applied = limited(tau_1, g["tau_1max"]), limited(tau_2, g["tau_2max"])
        free = [mpf(applied[0] == tau_1), mpf(applied[1] == tau_2)]
        self.learn((u, v, r), (fu, fv, fr), applied, (free[0] * S2, free[1] * S1, free[1] * ahead * S1))
        self.estimate(v, desired, bow)
        return applied

    def functions(self, where, way, desired, acceleration):
        """w, r_c and l as functions of the time from now on, along a motion of constant velocity."""
        g = self.g
        x_d, y_d, psi_d, u_d, v_d, r_d = numbers(desired)
        du, dv, dr = numbers(acceleration)
        h_d = mp.expj(psi_d)
        dp_d = mpc(u_d, v_d) * h_d
        ddp_d = (mpc(du, dv) + mpc(0, r_d) * mpc(u_d, v_d)) * h_d

        def field(t):
            e = where - mpc(x_d, y_d) + t * (way - dp_d)
            f = 2 * g["c"] / (1 + sqrt(1 + 2 * g["c"] ** 2 * sqrt(dot(e, e)) / g["a"]))
            return dp_d + t * ddp_d - f * e

        def turn(t):
            reference = dp_d + t * ddp_d
            water, least = reference - self.current, g["U_c"] ** 2
            return (r_d + t * dr) * (dot(reference, water) + least) / (dot(water, water) + least)

        def lever(t):
            water = field(t) - self.current
            size = sqrt(g["l0"] ** 2 + g["T_a"] ** 2 * dot(water, water))
            return size if u_d >= 0 else -size

        return field, turn, lever

    def learn(self, velocities, outputs, wrench, surfaces):
        """Predictions, and the growth of the weights that the next period adds."""
        g = self.g
        before = self.predicted or velocities
        errors = [a - b for a, b in zip(velocities, before, strict=True)]
        driven = wrench[0] / g["m11"], mpf(0), wrench[1] / g["m33"]
        self.predicted = [
            z + g["T"] * (f + force + g["lam"] * e) for z, f, force, e in zip(before, outputs, driven, errors, strict=True)
        ]
        power = sum(h * h for h in self.H)
        gammas = g["gamma3"], g["gamma1"], g["gamma2"]
        self.growth = [
            g["T"] / power * (gamma * S + g["lam"] ** 2 / 4 * e) for gamma, S, e in zip(gammas, surfaces, errors, strict=True)
        ]

    def estimate(self, v, desired, bow):
        """The current and the lasting sway velocity."""
        g, beam = self.g, mpc(0, 1) * bow
        beyond = v - mpf(float(desired[4])) - dot(self.current, beam) - self.lasting
        growth = g["T"] / g["T_c"] * limited(beyond, g["U_c"])
        self.current += growth * beam
        self.lasting += self.lasting_share * growth
