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


def moved(motion, rates, time):
    """x y psi u v r later, at constant rates of u v r: the mean velocities, at the heading in the middle."""
    x, y, psi, *velocities = motion
    u, v, r = (z + rate * time / 2 for z, rate in zip(velocities, rates, strict=True))
    place = mpc(x, y) + time * mpc(u, v) * mp.expj(psi + r * time / 2)
    return [place.real, place.imag, psi + r * time, *(z + rate * time for z, rate in zip(velocities, rates, strict=True))]


def driven(outputs, wrench, g):
    """The rates of u v r by the networks and a wrench."""
    return [outputs[0] + wrench[0] / g["m11"], outputs[1], outputs[2] + wrench[1] / g["m33"]]


class Actuator:
    """An input as the law models it: lag with lead, rate, dead time.

    Args:
        limit, rate, lag, remaining, dead_time: In SI units; the rate may be infinite.
        period: Of the control, s.
    """

    def __init__(self, limit, rate, lag, remaining, dead_time, period):
        def share(constant):
            return 1 - mp.exp(-mpf(period) / mpf(constant)) if constant else mpf(1)

        self.limit, self.share, self.boost = mpf(limit), share(lag), share(remaining) / share(lag)
        self.change, self.delay = mpf(rate) * mpf(period), round(dead_time / period)
        self.commands, self.acting = [], mpf(0)

    def after(self, acting, command):
        """What acts a period later."""
        return acting + limited(self.share * (command - acting), self.change)

    def command(self, ago):
        """The command of so many periods before the next one; 0 before the first."""
        return self.commands[-ago] if ago <= len(self.commands) else mpf(0)


class IndependentHierarchical:
    """The law with its memory.

    Args:
        gains: By the symbols of the pages, in SI units: c a l0 T_a a_r k1 .. m33, tau_1max, tau_2max, j, T_c, U_c, T.
        actuators: Lag, remaining lag, rate and dead time of surge force and yaw moment.
        centers: Of the neurons, lists of three.
        width: Of every neuron.
        lasting: Share at which the lasting sway velocity is learned.
    """

    def __init__(self, gains, actuators, centers, width, lasting):
        self.g = {name: mpf(float(value)) for name, value in gains.items()}
        self.inputs = [
            Actuator(gains[limit], rate, lag, remaining, dead_time, gains["T"])
            for limit, (lag, remaining, rate, dead_time) in zip(("tau_1max", "tau_2max"), actuators, strict=True)
        ]
        self.centers, self.width, self.lasting_share = [numbers(each) for each in centers], mpf(float(width)), mpf(lasting)
        n = len(centers)
        self.W, self.growth, self.H = [[mpf(0)] * n for _ in range(3)], [mpf(0)] * 3, [mpf(0)] * n
        self.predicted, self.current, self.lasting = None, mpc(0), mpf(0)

    def step(self, measured, desired, acceleration, late=0):
        """The wrench of a period, for x y psi u v r of vessel and reference, du_d dv_d dr_d, and their age in periods."""
        measured = numbers(measured)
        estimate = self.predicted or measured
        self.W = [
            [w + growth * h for w, h in zip(row, self.H, strict=True)] for row, growth in zip(self.W, self.growth, strict=True)
        ]
        self.H = [
            mp.exp(-sum((z - m) ** 2 for z, m in zip(estimate[3:], mu, strict=True)) / (2 * self.width**2)) for mu in self.centers
        ]
        outputs = [sum(w * h for w, h in zip(row, self.H, strict=True)) for row in self.W]
        vessel, acting, until = self.arrival(estimate, outputs, late)
        demands, surfaces = self.demands(vessel, moved(numbers(desired), numbers(acceleration), until), acceleration, outputs)
        wrench = []
        for each, tau, demand in zip(self.inputs, acting, demands, strict=True):
            wrench.append(limited(tau + each.boost * (limited(demand, each.limit) - tau), each.limit))
            each.commands.append(wrench[-1])
            each.acting = each.after(each.acting, each.command(1 + each.delay + late))
        self.learn(measured, estimate, outputs, surfaces)
        self.drift(estimate, desired)
        return wrench

    def arrival(self, estimate, outputs, late):
        """The motion when the later command of this period arrives, what acts before each arrives, and the time until then."""
        g = self.g
        periods = [each.delay + late for each in self.inputs]
        n = max(periods)
        stretch, acting, sums, count = 1 + n // 12, [each.acting for each in self.inputs], [mpf(0), mpf(0)], 0
        before = acting
        for i in range(n):
            acting = [
                each.after(tau, each.command(max(own - i, 1)))
                for each, tau, own in zip(self.inputs, acting, periods, strict=True)
            ]
            before = [tau if i < own else b for tau, own, b in zip(acting, periods, before, strict=True)]
            sums, count = [a + b for a, b in zip(sums, acting, strict=True)], count + 1
            if count == stretch or i == n - 1:
                estimate = moved(estimate, driven(outputs, [each / count for each in sums], g), count * g["T"])
                sums, count = [mpf(0), mpf(0)], 0
        return estimate, before, n * g["T"]

    def demands(self, vessel, desired, acceleration, outputs):
        """The force and moment that are to act, without limits, and the surfaces that adapt the networks."""
        g, (fu, fv, fr) = self.g, outputs
        x, y, psi, u, v, r = vessel
        bow = mp.expj(psi)
        beam = mpc(0, 1) * bow
        field, turn, lever = self.functions(mpc(x, y), u * bow + v * beam, desired, acceleration)
        w, dw, r_c, dr_c = field(0), mp.diff(field, 0), turn(0), mp.diff(turn, 0)
        sigma1, sigma2 = v - dot(w, beam), r - r_c
        dsigma1 = fv - dot(dw, beam) + r * dot(w, bow)
        ahead, of_sigma1 = lever(0, sigma1), mp.diff(lever, (0, sigma1), (0, 1))
        dahead = mp.diff(lever, (0, sigma1), (1, 0)) + of_sigma1 * dsigma1
        S1, S2 = sigma1 + ahead * sigma2, u - dot(w, bow)
        tau_2 = dot(dw, beam) - r * dot(w, bow) + ahead * dr_c - dahead * sigma2 - fv - ahead * fr
        reaching = g["k1"] * S1 + g["eta1"] * limited(S1 / g["phi1"], 1)
        # A yaw acceleration that changes by j per second stops this rate of the surface on its way to zero.
        tau_2 = g["m33"] / ahead * (tau_2 - limited(reaching, mp.sqrt(2 * g["j"] * abs(ahead * S1))))
        tau_1 = g["m11"] * (dot(dw, bow) + r * dot(w, beam) - fu - g["k2"] * S2 - g["eta2"] * limited(S2 / g["phi2"], 1))
        free_1, free_2 = mpf(abs(tau_1) <= g["tau_1max"]), mpf(abs(tau_2) <= g["tau_2max"])
        return (tau_1, tau_2), (free_1 * S2, free_2 * (1 + of_sigma1 * sigma2) * S1, free_2 * ahead * S1)

    def functions(self, where, way, desired, acceleration):
        """w, r_c and l as functions of the time from now on, along a motion of constant velocity; l of sigma1 too."""
        g = self.g
        x_d, y_d, psi_d, u_d, v_d, r_d = desired
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

        def lever(t, sigma1):
            water = field(t) - self.current
            near, far = g["l0"] ** 2 + g["T_a"] ** 2 * dot(water, water), sqrt(dot(water, water)) * sigma1 / (2 * g["a_r"])
            size = mp.root(near**2 + far**2, 4)
            return size if u_d >= 0 else -size

        return field, turn, lever

    def learn(self, measured, estimate, outputs, surfaces):
        """The next predictions, and the growth of the weights that the next period adds."""
        g = self.g
        errors = [a - b for a, b in zip(measured, estimate, strict=True)]
        errors[2] = mp.arg(mp.expj(errors[2]))
        later = moved(estimate, driven(outputs, [each.acting for each in self.inputs], g), g["T"])
        self.predicted = [z + g["T"] * g["lam"] * e for z, e in zip(later, errors, strict=True)]
        power = sum(h * h for h in self.H)
        gammas = g["gamma3"], g["gamma1"], g["gamma2"]
        self.growth = [
            g["T"] / power * (gamma * S + g["lam"] ** 2 / 4 * e) for gamma, S, e in zip(gammas, surfaces, errors[3:], strict=True)
        ]

    def drift(self, estimate, desired):
        """The current and the lasting sway velocity."""
        g, beam = self.g, mpc(0, 1) * mp.expj(estimate[2])
        beyond = estimate[4] - mpf(float(desired[4])) - dot(self.current, beam) - self.lasting
        growth = g["T"] / g["T_c"] * limited(beyond, g["U_c"])
        self.current += growth * beam
        self.lasting += self.lasting_share * growth
