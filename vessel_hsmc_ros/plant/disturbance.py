"""Environmental disturbances: the periodic load of the paper, wind with gusts, and current.

| symbol | meaning | unit | equation |
|---|---|---|---|
| tau_uw, tau_vw, tau_rw | disturbance as accelerations | m/s², m/s², rad/s² | section 6.2 |
| F_u, F_v, N_r | mean disturbance as a wrench: 11e2, 26e2, 950e2 | N, N, N·m | section 6.2 |
| w | frequency of the periodic disturbance: 0.01 | rad/s | section 6.2 |
| F_E, F_N | mean wind force, east and north | N, N | not in the paper |
| g_E, g_N | gusts: first-order Gauss-Markov processes | N, N | not in the paper |
| sigma, T_g | standard deviation and time constant of the gusts | N, s | not in the paper |

Waves: a long-crested sea from a standard spectrum, its first-order motion of a slender hull, and its second-order drift force.

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
from typing import Any, NamedTuple

import numpy as np

from vessel_hsmc_ros.core.kernel import Array, kernel
from vessel_hsmc_ros.core.kinematics import GRAVITY, Motion, to_body
from vessel_hsmc_ros.core.schema import parameter
from vessel_hsmc_ros.plant.dynamics import Wrench
from vessel_hsmc_ros.plant.hull_parameters import ShipParameters

Components = Array | list[tuple[float, ...]]

WATER_DENSITY = 1025.0


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


class Sea(NamedTuple):
    """One realisation of the sea and its effect on the hull."""

    # direction, east, north: wave direction, and its unit vector d
    direction: float
    east: float
    north: float
    # a row for each component: k, omega, epsilon, a (averaged over the draught), and the amplitude whose squared envelope is
    # the drift force on a metre of the hull; (n, 5)
    components: Components
    # length, beam: L, B
    length: float
    beam: float
    rough: bool  # whether there are waves

    def with_current(self, change: tuple[float, float], time: float) -> "Sea":
        """The sea with its phases continuous where the current that the waves ride on changes.

        The phase theta holds -k·d·c·time, so it would jump by -k·d·change·time. `change`: change of the current towards east
        and north, m/s. `time`: time of the change since the start, s.
        """
        along = self.east * change[0] + self.north * change[1]
        return self._replace(
            components=[(k, omega, epsilon + k * along * time, *rest) for k, omega, epsilon, *rest in self.components]
        )

    def as_arrays(self) -> "Sea":
        """The same with an array, for compiled kernels; interpreted ones are faster with tuples."""
        return self._replace(components=np.array(self.components, float).reshape(-1, 5))


def make_sea(parameters: WaveParameters, random: np.random.Generator, ship: ShipParameters) -> Sea:
    """Components of equal energy with random frequencies and phases, as tuples.

    The spectrum is divided into slices of equal energy with one random frequency in each, so that the sea does not repeat itself
    as one of equally spaced frequencies would.
    """
    p, rough = parameters, parameters.significant_height > 0.0
    n = p.components if rough else 0
    # From H_s = 4·sqrt(m0) with the spectral moment m0 = n·A²/2.
    amplitude = p.significant_height / math.sqrt(8.0 * n) if rough else 0.0
    shares = (np.arange(n) + random.random(n)) / n if rough else np.empty(0)
    omega = frequencies(shares, 2.0 * math.pi / p.peak_period, p.peak_enhancement) if rough else np.empty(0)
    epsilon = 2.0 * math.pi * random.random(n)
    k = omega**2 / GRAVITY
    # Deep water: the orbital motion decays with exp(-k·depth), and its mean over the draught is (1 - exp(-k·D))/(k·D).
    depth = k * (p.hull_draught or ship.draught)
    orbit = amplitude * -np.expm1(-depth) / depth
    drift = amplitude * np.sqrt(0.5 * WATER_DENSITY * GRAVITY * -np.expm1(-2.0 * depth))
    components = [tuple(row) for row in np.column_stack((k, omega, epsilon, orbit, drift)).tolist()]
    length, beam = p.hull_length or ship.length, p.hull_beam or ship.beam
    return Sea(p.direction, math.cos(p.direction), math.sin(p.direction), components, length, beam, rough)


@kernel
def advanced(time: float, motion: Motion, current: tuple[float, float], sea: Sea) -> float:
    """d·p: the position of the ship along the waves, relative to the water, m."""
    return sea.east * (motion.x - current[0] * time) + sea.north * (motion.y - current[1] * time)


@kernel
def drift_force(time: float, motion: Motion, current: tuple[float, float], sea: Sea) -> Wrench:
    """The slowly varying second-order drift force in the body frame; its moment is neglected.

    `time`: time since the start, s. `current`: east and north, m/s; the waves are carried by it.
    """
    distance = advanced(time, motion, current, sea)
    a = b = 0.0
    for row in sea.components:
        theta = row[0] * distance - row[1] * time + row[2]
        a += row[4] * math.cos(theta)
        b += row[4] * math.sin(theta)
    # The squared envelope of the components holds their difference frequencies only, and is never negative.
    envelope = a * a + b * b
    along, across = math.cos(sea.direction - motion.psi), math.sin(sea.direction - motion.psi)
    return sea.beam * along * abs(along) * envelope, sea.length * across * abs(across) * envelope, 0.0


@kernel
def with_waves(time: float, motion: Motion, current: tuple[float, float], sea: Sea) -> Motion:
    """A motion with the first-order wave motion added.

    `motion`: motion without waves. `current`: east and north, m/s; the waves are carried by it.
    """
    psi = motion.psi
    along, across = math.cos(sea.direction - psi), math.sin(sea.direction - psi)
    c, s = math.cos(psi), math.sin(psi)
    v_x, v_y = motion.u * c - motion.v * s, motion.u * s + motion.v * c
    speed = sea.east * (v_x - current[0]) + sea.north * (v_y - current[1])
    surge, surge_rate, turn, turn_rate = hull_motion(time, advanced(time, motion, current, sea), speed, along, sea)
    psi -= across * along * turn
    v_x, v_y = v_x + surge_rate * sea.east, v_y + surge_rate * sea.north
    c, s = math.cos(psi), math.sin(psi)
    x, y = motion.x + surge * sea.east, motion.y + surge * sea.north
    return Motion(x, y, psi, v_x * c + v_y * s, v_y * c - v_x * s, motion.r + across * along * turn_rate)


@kernel
def hull_motion(time: float, distance: float, speed: float, along: float, sea: Sea) -> tuple[float, float, float, float]:
    """Sums over the components of the first-order motion.

    `time`: time since the start, s. `distance`, `speed`: d·p and its rate, m, m/s. `along`: cos beta. Returns displacement
    along d and its rate, rotation and its rate over cos beta·sin beta, m, m/s, rad, rad/s.
    """
    surge = surge_rate = turn = turn_rate = 0.0
    half = 0.5 * sea.length * along
    for row in sea.components:
        k, omega, epsilon, orbit = row[0], row[1], row[2], row[3]
        theta, q = k * distance - omega * time + epsilon, half * k
        # Frequency of encounter, with its sign. The ship's own turning is slow beside the waves, so q counts as constant.
        rate = k * speed - omega
        sine, cosine = math.sin(theta), math.cos(theta)
        if abs(q) < 1e-2:  # the quotients lose their digits near 0, where their series take over
            displacement, rotation = 1.0 - q * q / 6.0, 1.0 - 0.1 * q * q
        else:
            sin_q = math.sin(q)
            displacement, rotation = sin_q / q, 3.0 * (sin_q - q * math.cos(q)) / (q * q * q)
        displacement, slope = orbit * displacement, k * orbit * rotation
        surge -= displacement * sine
        surge_rate -= displacement * cosine * rate
        turn += slope * cosine
        turn_rate += slope * sine * rate
    return surge, surge_rate, turn, turn_rate


def spectrum(omega: Array, significant_height: float, peak: float, gamma: float) -> Array:
    """The JONSWAP spectrum S(omega) with the normalisation 1 - 0.287·ln gamma.

    `omega`: frequencies, rad/s, above 0. `significant_height`: H_s, m. `peak`: omega_p, rad/s. `gamma`: peak enhancement
    factor; 1 gives the Pierson-Moskowitz spectrum. Returns spectral density, m²·s, of the shape of omega.
    """
    # Standard peak widths of JONSWAP below and above the peak.
    width = np.where(omega <= peak, 0.07, 0.09)
    enhancement = gamma ** np.exp(-0.5 * ((omega - peak) / (width * peak)) ** 2)
    pierson_moskowitz = 5.0 / 16.0 * significant_height**2 * peak**4 / omega**5 * np.exp(-1.25 * (peak / omega) ** 4)
    return np.asarray((1.0 - 0.287 * math.log(gamma)) * pierson_moskowitz * enhancement)


def frequencies(shares: Array, peak: float, gamma: float) -> Array:
    """Quantiles of the spectrum: the frequencies below which given shares of the energy lie, rad/s.

    `shares`: shares of the energy, in [0, 1]. `peak`: omega_p, rad/s. Returns frequencies, rad/s, of the shape of shares.
    """
    # Practically all of the energy lies between 0.3 and 6 times the peak frequency.
    omega = peak * np.linspace(0.3, 6.0, 4000)
    energy = np.cumsum(spectrum(omega, 1.0, peak, gamma))
    return np.interp(shares, energy / energy[-1], omega)


Gust = tuple[float, float]  # g_E, g_N, N


@dataclass(frozen=True)
class PeriodicParameters:
    """The paper's disturbance: a wrench that oscillates between zero and twice its mean; zero means switch it off."""

    surge_force: float = parameter(11e2, "Mean disturbing force in surge.", unit="N", low=-1e9, high=1e9)
    sway_force: float = parameter(26e2, "Mean disturbing force in sway.", unit="N", low=-1e9, high=1e9)
    yaw_moment: float = parameter(950e2, "Mean disturbing moment in yaw.", unit="N·m", low=-1e12, high=1e12)
    frequency: float = parameter(0.01, "Angular frequency of the oscillation.", unit="rad/s", low=0.0, high=1e3, symbol="w")

    def constants(self, phase: float = 0.0) -> "Periodic":
        """What the wrench needs, with a phase."""
        return Periodic(self.surge_force, self.sway_force, self.yaw_moment, self.frequency, phase)


@dataclass(frozen=True)
class EarthFixedParameters:
    """An earth-fixed force, such as that of the wind, independent of the ship's heading."""

    east_force: float = parameter(0.0, "Mean force towards the east.", unit="N", low=-1e9, high=1e9)
    north_force: float = parameter(0.0, "Mean force towards the north.", unit="N", low=-1e9, high=1e9)
    lever: float = parameter(
        0.0, "Lever arm: distance ahead of midships at which the force acts, which causes a moment.", unit="m", low=-1e3, high=1e3
    )
    gust_deviation: float = parameter(
        0.0, "Standard deviation of the gusts, equal in both directions.", unit="N", low=0.0, high=1e9
    )
    gust_time_constant: float = parameter(20.0, "Correlation time of the gusts.", unit="s", low=1e-3, high=1e6)

    def active(self) -> bool:
        """Whether any of the forces is not zero."""
        return bool(self.east_force or self.north_force or self.gust_deviation)

    def constants(self, period: float, blowing: bool = False) -> "Wind":
        """The wind in discrete time. `blowing`: whether the wind has blown before, so that gusts are left."""
        memory = math.exp(-period / self.gust_time_constant)
        innovation = self.gust_deviation * math.sqrt(1.0 - memory**2)
        return Wind(self.east_force, self.north_force, self.lever, memory, innovation, blowing or self.active())


@dataclass(frozen=True)
class CurrentParameters:
    """A steady, uniform current; hydrodynamic forces depend on the velocity relative to the water."""

    east: float = parameter(0.0, "Current towards the east.", unit="m/s", low=-20.0, high=20.0)
    north: float = parameter(0.0, "Current towards the north.", unit="m/s", low=-20.0, high=20.0)


class Periodic(NamedTuple):
    """The periodic disturbance, and its phase, which is not 0 where the frequency has been changed."""

    surge_force: float
    sway_force: float
    yaw_moment: float
    frequency: float
    phase: float


@kernel
def periodic_wrench(time: float, p: Periodic) -> Wrench:
    """The disturbance of section 6.2 as a wrench: (F_u, F_v, N_r)·(1 + sin(w·t + phase)), in the body frame."""
    factor = 1.0 + math.sin(p.frequency * time + p.phase)
    return p.surge_force * factor, p.sway_force * factor, p.yaw_moment * factor


class Wind(NamedTuple):
    """An earth-fixed force with gusts in discrete time, period T."""

    # east, north: mean force, N
    east: float
    north: float
    lever: float  # lever arm, m
    memory: float  # exp(-T/T_g)
    innovation: float  # sigma·sqrt(1 - exp(-2·T/T_g)), which keeps the variance of the gusts at sigma² for any period
    blows: bool  # whether there is any; once it blows, its gusts go on


@kernel
def wind_wrench(gust: Gust, psi: float, wind: Wind) -> Wrench:
    """The wrench of F_E + g_E and F_N + g_N in the body frame of a ship with heading psi."""
    return body_wrench((wind.east + gust[0], wind.north + gust[1]), psi, wind.lever)


@kernel
def next_gust(gust: Gust, normal: Any, wind: Wind) -> Gust:
    """The gusts one period later: g = exp(-T/T_g)·g + sigma·sqrt(1 - exp(-2·T/T_g))·white noise, exact for any T.

    `normal`: independent standard normal numbers, shape (2,). `gust`: g_E, g_N.
    """
    return wind.memory * gust[0] + wind.innovation * normal[0], wind.memory * gust[1] + wind.innovation * normal[1]


@kernel
def body_wrench(force: tuple[float, float], psi: float, lever: float = 0.0) -> Wrench:
    """Resolve an earth-fixed force in the body frame.

    `force`: components towards the east and the north, N. `psi`: heading of the ship, rad. `lever`: lever arm: distance ahead
    of midships at which the force acts, m. Returns surge force [N], sway force [N], yaw moment [N·m].
    """
    along, across = to_body(force[0], force[1], psi)
    return along, across, lever * across  # a sway force ahead of midships causes a positive (counter-clockwise) moment


@kernel
def total(first: Wrench, second: Wrench) -> Wrench:
    """The sum of two wrenches."""
    return first[0] + second[0], first[1] + second[1], first[2] + second[2]
