"""Waves: a long-crested sea from a standard spectrum, its first-order motion of a slender hull, and its second-order drift force.

| symbol | meaning | unit |
|---|---|---|
| S | wave spectrum: JONSWAP; Pierson-Moskowitz (ITTC) for gamma = 1 | m²·s |
| H_s, omega_p, gamma | significant height, peak frequency, peak enhancement | m, rad/s, - |
| A, omega, k, epsilon | amplitude, frequency, wave number omega²/g and phase of a component | m, rad/s, 1/m, rad |
| theta | phase of a component at the ship, k·d·p - omega·t + epsilon; the elevation is the sum of A·cos theta | rad |
| p, d | position of the ship relative to the water, unit vector of the wave propagation | m, - |
| beta | angle of encounter: wave direction minus heading, 0 for following seas | rad |
| L, B, D | length, beam and draught of the hull | m |
| q | k·L·cos beta/2, the phase difference over half the hull's length | rad |

First-order motion: the hull follows the orbital motion of the water, averaged over draught and length. The mean over the length
gives the displacement of the hull, the slope of the least-squares line its rotation. For each component, with
a = A·(1 - exp(-k·D))/(k·D) and j1 the spherical Bessel function,

    displacement along d = -a·(sin q)/q·sin theta     rotation = -a·k·cos beta·sin beta·3·j1(q)/q·cos theta

Second-order drift force: the hull reflects the fraction 1 - exp(-2·k·D) of the wave energy, that above its keel. The mean force
is rho·g·L·A²/2 times this fraction in beam seas, and the same with B instead of L in head seas. Wave groups make the force vary
slowly; of the products of components only the difference frequencies are included (Newman's approximation).
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.kinematics import as_motion
from vessel_hsmc_ros.core.schema import parameter
from vessel_sim_node.disturbance import Wrench
from vessel_sim_node.plant import ShipParameters

Array = NDArray[np.float64]

GRAVITY, WATER_DENSITY = 9.81, 1025.0


def dimension(what: str, symbol: str, high: float) -> float:
    """Declare a dimension of the hull in waves, which is by default that of the ship."""
    return parameter(
        0.0, f"{what.capitalize()} of the hull in waves; 0 for vessel.{what}.", unit="m", low=0.0, high=high, symbol=symbol
    )


@dataclass(frozen=True)
class WaveParameters:
    """The sea state, and dimensions of the hull that differ from the ship's; a significant height of 0 switches the waves off."""

    significant_height: float = parameter(
        0.0, "Significant wave height; 0 for no waves.", unit="m", low=0.0, high=30.0, symbol="H_s"
    )
    peak_period: float = parameter(6.0, "Peak period of the spectrum.", unit="s", low=0.5, high=60.0)
    peak_enhancement: float = parameter(
        3.3, "Peak enhancement factor: 3.3 for JONSWAP, 1 for Pierson-Moskowitz.", low=1.0, high=7.0, symbol="gamma"
    )
    direction: float = parameter(
        0.0, "Direction of wave propagation, counter-clockwise from east.", unit="rad", low=-7.0, high=7.0
    )
    components: int = parameter(30, "Number of regular wave components.", low=1, high=1000)
    hull_length: float = dimension("length", "L", 1e3)
    hull_beam: float = dimension("beam", "B", 1e3)
    hull_draught: float = dimension("draught", "D", 1e2)


def spectrum(omega: Array, significant_height: float, peak: float, gamma: float) -> Array:
    """The JONSWAP spectrum S(omega) with the normalisation 1 - 0.287·ln gamma.

    Args:
        omega: Frequencies, rad/s, above 0.
        significant_height: H_s, m.
        peak: omega_p, rad/s.
        gamma: Peak enhancement factor; 1 gives the Pierson-Moskowitz spectrum.

    Returns:
        Spectral density, m²·s, of the shape of omega.
    """
    # Standard peak widths of JONSWAP below and above the peak.
    width = np.where(omega <= peak, 0.07, 0.09)
    enhancement = gamma ** np.exp(-0.5 * ((omega - peak) / (width * peak)) ** 2)
    pierson_moskowitz = 5.0 / 16.0 * significant_height**2 * peak**4 / omega**5 * np.exp(-1.25 * (peak / omega) ** 4)
    return np.asarray((1.0 - 0.287 * math.log(gamma)) * pierson_moskowitz * enhancement)


def frequencies(shares: Array, peak: float, gamma: float) -> Array:
    """Quantiles of the spectrum: the frequencies below which given shares of the energy lie, rad/s.

    Args:
        shares: Shares of the energy, in [0, 1].
        peak: omega_p, rad/s.
        gamma: Peak enhancement factor.

    Returns:
        Frequencies, rad/s, of the shape of shares.
    """
    # Practically all of the energy lies between 0.3 and 6 times the peak frequency.
    omega = peak * np.linspace(0.3, 6.0, 4000)
    energy = np.cumsum(spectrum(omega, 1.0, peak, gamma))
    return np.interp(shares, energy / energy[-1], omega)


class Waves:
    """One realisation of the sea: components of equal energy with random frequencies and phases.

    The spectrum is divided into slices of equal energy with one random frequency in each, so that the sea does not repeat itself
    as one of equally spaced frequencies would.

    Args:
        parameters: The sea state.
        random: Random-number generator of frequencies and phases.
        ship: The ship, for its dimensions.
    """

    def __init__(self, parameters: WaveParameters, random: np.random.Generator, ship: ShipParameters | None = None) -> None:
        p, n, ship = parameters, parameters.components, ship or ShipParameters()
        # From H_s = 4·sqrt(m0) with the spectral moment m0 = n·A²/2.
        self.amplitude = p.significant_height / math.sqrt(8.0 * n)
        self.omega = frequencies((np.arange(n) + random.random(n)) / n, 2.0 * math.pi / p.peak_period, p.peak_enhancement)
        self._epsilon = 2.0 * math.pi * random.random(n)
        self._k = self.omega**2 / GRAVITY
        self._direction = p.direction
        self._d = math.cos(p.direction), math.sin(p.direction)
        # Deep water: the orbital motion decays with exp(-k·depth), and its mean over the draught is (1 - exp(-k·D))/(k·D).
        depth = self._k * (p.hull_draught or ship.draught)
        self._orbit = self.amplitude * -np.expm1(-depth) / depth
        self._drift_amplitude = self.amplitude * np.sqrt(0.5 * WATER_DENSITY * GRAVITY * -np.expm1(-2.0 * depth))
        self._length, self._beam = p.hull_length or ship.length, p.hull_beam or ship.beam

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
        """The phase theta of every component at the ship, (n,).

        Args:
            time: Time since the start, s.
            state: x, y, psi, u, v, r, shape (6,).
            current: East and north, m/s; the waves are carried by it.

        Returns:
            Phases, rad, not wrapped, (n,).
        """
        along = self._d[0] * (float(state[0]) - current[0] * time) + self._d[1] * (float(state[1]) - current[1] * time)
        return self._k * along - self.omega * time + self._epsilon

    def elevation(self, time: float, state: Array, current: tuple[float, float]) -> float:
        """The surface elevation at the ship, m.

        Args:
            time: Time since the start, s.
            state: x, y, psi, u, v, r, shape (6,).
            current: East and north, m/s; the waves are carried by it.

        Returns:
            Elevation above the mean water level, m.
        """
        return float(self.amplitude * np.sum(np.cos(self.phases(time, state, current))))

    def moved(self, time: float, state: Array, current: tuple[float, float]) -> Array:
        """The state with the first-order wave motion added.

        Args:
            time: Time since the start, s.
            state: x, y, psi, u, v, r without waves, shape (6,).
            current: East and north, m/s; the waves are carried by it.

        Returns:
            x, y, psi, u, v, r with wave motion, shape (6,).
        """
        theta, (x, y, psi, u, v, r) = self.phases(time, state, current), as_motion(state)
        along, across = math.cos(self._direction - psi), math.sin(self._direction - psi)
        c, s = math.cos(psi), math.sin(psi)
        v_x, v_y = u * c - v * s, u * s + v * c
        speed = self._d[0] * (v_x - current[0]) + self._d[1] * (v_y - current[1])
        # Frequency of encounter, with its sign.
        theta_rate = self._k * speed - self.omega
        displacement, rotation = self._hull_factors(0.5 * self._length * along * self._k)
        sine, cosine = np.sin(theta), np.cos(theta)
        slope = across * along * self._k * rotation
        surge, surge_rate = -float(displacement @ sine), -float(displacement @ (cosine * theta_rate))
        psi -= float(slope @ cosine)
        # The rates of the slope factors by the ship's own turning are neglected: it is slow beside the waves.
        r += float(slope @ (sine * theta_rate))
        v_x, v_y = v_x + surge_rate * self._d[0], v_y + surge_rate * self._d[1]
        c, s = math.cos(psi), math.sin(psi)
        x, y = x + surge * self._d[0], y + surge * self._d[1]
        return np.array([x, y, psi, v_x * c + v_y * s, v_y * c - v_x * s, r])

    def _hull_factors(self, q: Array) -> tuple[Array, Array]:
        """Amplitudes of displacement and rotation: a·sin(q)/q and a·3·j1(q)/q, both (n,)."""
        safe = np.where(np.abs(q) < 1e-2, 1.0, q)
        # 3·j1(q)/q loses its digits near 0, where its series 1 - q²/10 takes over.
        rotation = np.where(safe == q, 3.0 * (np.sin(safe) - safe * np.cos(safe)) / safe**3, 1.0 - 0.1 * q * q)
        return self._orbit * np.sinc(q / math.pi), self._orbit * rotation

    def drift(self, time: float, state: Array, current: tuple[float, float]) -> Wrench:
        """The slowly varying second-order drift force, N, N; its moment is neglected.

        Args:
            time: Time since the start, s.
            state: x, y, psi, u, v, r, shape (6,).
            current: East and north, m/s; the waves are carried by it.

        Returns:
            Surge force [N], sway force [N] and a zero yaw moment in the body frame.
        """
        theta, beta = self.phases(time, state, current), self._direction - float(state[2])
        # The squared envelope of the components holds their difference frequencies only, and is never negative.
        envelope = float(self._drift_amplitude @ np.cos(theta)) ** 2 + float(self._drift_amplitude @ np.sin(theta)) ** 2
        along, across = math.cos(beta), math.sin(beta)
        return self._beam * along * abs(along) * envelope, self._length * across * abs(across) * envelope, 0.0
