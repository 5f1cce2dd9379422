"""Waves: a long-crested sea from a standard spectrum, the motion it gives a slender hull, and the slow force it leaves behind.

| symbol | meaning | unit |
|---|---|---|
| S | energy spectrum of the sea, JONSWAP; Pierson-Moskowitz (the ITTC's) for gamma = 1 | m²·s |
| H_s, omega_p, gamma | significant height, peak frequency, peak enhancement | m, rad/s, - |
| A, omega, k, epsilon | amplitude, frequency, wave number omega²/g and phase of a component | m, rad/s, 1/m, rad |
| theta | its phase at the ship, k·d·p - omega·t + epsilon; the elevation is the sum of A·cos theta | rad |
| p, d | ship's position in the water's frame, direction in which the waves run | m, - |
| beta | direction of the waves seen from the ship, 0 from astern | rad |
| L, B, D | length, beam and draught of the hull | m |
| q | k·L·cos beta/2: the hull's half length in phase | rad |

First-order motion: the hull follows the water it lies in, whose motion is averaged over draught and length. The mean is the
hull's shift, the slope of the best straight line its turn. Wave by wave, with a = A·(1 - exp(-k·D))/(k·D) and j1 the spherical
Bessel function,

    shift along d = -a·(sin q)/q·sin theta            turn = -a·k·cos beta·sin beta·3·j1(q)/q·cos theta

Second-order drift: the hull throws back the part 1 - exp(-2·k·D) of a wave's energy, that above its keel. A beam sea pushes with
half rho·g·L·A² times that part, a head sea with B instead of L. The beating of the components makes the force swell; of all their
combinations only difference frequencies are there (Newman's approximation).
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.schema import parameter
from vessel_sim_node.disturbance import Wrench

Array = NDArray[np.float64]

GRAVITY, WATER_DENSITY = 9.81, 1025.0


@dataclass(frozen=True)
class WaveParameters:
    """The sea and the hull that lies in it; a height of 0 is flat water. Length is that of the paper's kind of ship."""

    significant_height: float = parameter(0.0, "Significant height of the waves.", unit="m", low=0.0, high=30.0, symbol="H_s")
    peak_period: float = parameter(6.0, "Period of the spectrum's peak.", unit="s", low=0.5, high=60.0)
    peak_enhancement: float = parameter(
        3.3, "How steep the peak is: 3.3 for JONSWAP, 1 for Pierson-Moskowitz.", low=1.0, high=7.0, symbol="gamma"
    )
    direction: float = parameter(
        0.0, "Direction in which the waves run, counter-clockwise from east.", unit="rad", low=-7.0, high=7.0
    )
    components: int = parameter(30, "Regular waves that make up the sea.", low=1, high=1000)
    hull_length: float = parameter(32.0, "Length of the hull.", unit="m", low=0.1, high=1e3, symbol="L")
    hull_beam: float = parameter(6.4, "Beam of the hull.", unit="m", low=0.1, high=1e3, symbol="B")
    hull_draught: float = parameter(1.3, "Draught of the hull.", unit="m", low=0.01, high=1e2, symbol="D")


def spectrum(omega: Array, significant_height: float, peak: float, gamma: float) -> Array:
    """S(omega) of JONSWAP, m²·s, with the normalisation 1 - 0.287·ln gamma.

    Args:
        omega: Frequencies, rad/s, above 0.
        significant_height: H_s, m.
        peak: omega_p, rad/s.
        gamma: Peak enhancement; 1 gives Pierson-Moskowitz.
    """
    width = np.where(omega <= peak, 0.07, 0.09)
    enhancement = gamma ** np.exp(-0.5 * ((omega - peak) / (width * peak)) ** 2)
    pierson_moskowitz = 5.0 / 16.0 * significant_height**2 * peak**4 / omega**5 * np.exp(-1.25 * (peak / omega) ** 4)
    return np.asarray((1.0 - 0.287 * math.log(gamma)) * pierson_moskowitz * enhancement)


def frequencies(shares: Array, peak: float, gamma: float) -> Array:
    """The frequencies below which these shares of the spectrum's energy lie, rad/s."""
    omega = peak * np.linspace(0.3, 6.0, 4000)
    energy = np.cumsum(spectrum(omega, 1.0, peak, gamma))
    return np.interp(shares, energy / energy[-1], omega)


class Waves:
    """One realisation of the sea: components of equal energy, their frequencies and phases drawn.

    Args:
        parameters: The sea and the hull.
        random: Where the frequencies, one in each slice of equal energy, and the phases are drawn from.
    """

    def __init__(self, parameters: WaveParameters, random: np.random.Generator) -> None:
        p, n = parameters, parameters.components
        self.amplitude = p.significant_height / math.sqrt(8.0 * n)
        self.omega = frequencies((np.arange(n) + random.random(n)) / n, 2.0 * math.pi / p.peak_period, p.peak_enhancement)
        self._epsilon = 2.0 * math.pi * random.random(n)
        self._k = self.omega**2 / GRAVITY
        self._direction = p.direction
        self._d = math.cos(p.direction), math.sin(p.direction)
        depth = self._k * p.hull_draught
        self._follows = self.amplitude * -np.expm1(-depth) / depth
        self._pushes = self.amplitude * np.sqrt(0.5 * WATER_DENSITY * GRAVITY * -np.expm1(-2.0 * depth))
        self._length, self._beam = p.hull_length, p.hull_beam

    def change_current(self, old: tuple[float, float], new: tuple[float, float], time: float) -> None:
        """Keep every phase continuous where the current that the waves ride on changes.

        The phase holds -k·d·c·time, so it would jump by -k·d·(new - old)·time.

        Args:
            old, new: Current towards east and north, m/s.
            time: Time of the change since the start, s.
        """
        along = self._d[0] * (new[0] - old[0]) + self._d[1] * (new[1] - old[1])
        self._epsilon = self._epsilon + self._k * along * time

    def phases(self, time: float, state: Array, current: tuple[float, float]) -> Array:
        """The phase theta of every component at the ship, (n,)."""
        along = self._d[0] * (float(state[0]) - current[0] * time) + self._d[1] * (float(state[1]) - current[1] * time)
        return self._k * along - self.omega * time + self._epsilon

    def elevation(self, time: float, state: Array, current: tuple[float, float]) -> float:
        """The water's height at the ship, m."""
        return float(self.amplitude * np.sum(np.cos(self.phases(time, state, current))))

    def moved(self, time: float, state: Array, current: tuple[float, float]) -> Array:
        """The state with the waves' first-order motion on top, shape (6,).

        Args:
            time: Time since the start, s.
            state: x, y, psi, u, v, r without waves, shape (6,).
            current: East and north, m/s; the waves ride on it.
        """
        theta, psi, r = self.phases(time, state, current), float(state[2]), float(state[5])
        along, across = math.cos(self._direction - psi), math.sin(self._direction - psi)
        c, s = math.cos(psi), math.sin(psi)
        v_x, v_y = float(state[3]) * c - float(state[4]) * s, float(state[3]) * s + float(state[4]) * c
        speed = self._d[0] * (v_x - current[0]) + self._d[1] * (v_y - current[1])
        theta_rate = self._k * speed - self.omega
        shift, turn = self._hull_factors(0.5 * self._length * along * self._k)
        sine, cosine = np.sin(theta), np.cos(theta)
        slope = across * along * self._k * turn
        moved, drifting = -float(shift @ sine), -float(shift @ (cosine * theta_rate))
        psi -= float(slope @ cosine)
        r += float(slope @ (sine * theta_rate))
        v_x, v_y = v_x + drifting * self._d[0], v_y + drifting * self._d[1]
        c, s = math.cos(psi), math.sin(psi)
        x, y = float(state[0]) + moved * self._d[0], float(state[1]) + moved * self._d[1]
        return np.array([x, y, psi, v_x * c + v_y * s, v_y * c - v_x * s, r])

    def _hull_factors(self, q: Array) -> tuple[Array, Array]:
        """Amplitudes of what the hull's length lets through of shift, sin(q)/q, and of turn, 3·j1(q)/q, both (n,)."""
        safe = np.where(np.abs(q) < 1e-2, 1.0, q)
        turn = np.where(safe == q, 3.0 * (np.sin(safe) - safe * np.cos(safe)) / safe**3, 1.0 - 0.1 * q * q)
        return self._follows * np.sinc(q / math.pi), self._follows * turn

    def drift(self, time: float, state: Array, current: tuple[float, float]) -> Wrench:
        """The slowly swelling force of second order; it has no moment."""
        theta, beta = self.phases(time, state, current), self._direction - float(state[2])
        swell = float(self._pushes @ np.cos(theta)) ** 2 + float(self._pushes @ np.sin(theta)) ** 2
        along, across = math.cos(beta), math.sin(beta)
        return self._beam * along * abs(along) * swell, self._length * across * abs(across) * swell, 0.0
