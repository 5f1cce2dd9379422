"""Disturbances that act on the hull: the paper's, wind, and the current under it.

| symbol | meaning | unit | equation |
|---|---|---|---|
| tau_uw, tau_vw, tau_rw | disturbance as accelerations | m/s², m/s², rad/s² | section 6.2 |
| F_u, F_v, N_r | mean disturbance as a wrench: 11e2, 26e2, 950e2 | N, N, N·m | section 6.2 |
| w | its frequency: 0.01 | rad/s | section 6.2 |
| F_E, F_N | force of the wind, east and north | N, N | not in the paper |
| g_E, g_N | what gusts add to it: first-order Gauss-Markov processes | N, N | not in the paper |
| sigma, T_g | their standard deviation and time constant | N, s | not in the paper |
"""

import math
from dataclasses import dataclass

import numpy as np

from vessel_hsmc_ros.core.schema import parameter
from vessel_sim_node.plant import Vessel

Wrench = tuple[float, float, float]
"""Surge force [N], sway force [N], yaw moment [N·m] in the body frame."""


@dataclass(frozen=True)
class PeriodicParameters:
    """The paper's disturbance: a mean push that swells and fades; zeros switch it off."""

    surge_force: float = parameter(11e2, "Mean disturbing force in surge.", unit="N", low=-1e9, high=1e9)
    sway_force: float = parameter(26e2, "Mean disturbing force in sway.", unit="N", low=-1e9, high=1e9)
    yaw_moment: float = parameter(950e2, "Mean disturbing moment in yaw.", unit="N·m", low=-1e12, high=1e12)
    frequency: float = parameter(0.01, "Angular frequency of the swelling.", unit="rad/s", low=0.0, high=1e3, symbol="w")


@dataclass(frozen=True)
class EarthFixedParameters:
    """A force that keeps its direction whichever way the ship points, as wind does."""

    east_force: float = parameter(0.0, "Mean force towards the east.", unit="N", low=-1e9, high=1e9)
    north_force: float = parameter(0.0, "Mean force towards the north.", unit="N", low=-1e9, high=1e9)
    lever: float = parameter(0.0, "How far ahead of midships it acts, which gives it a moment.", unit="m", low=-1e3, high=1e3)
    gust_deviation: float = parameter(
        0.0, "Standard deviation of the gusts, the same towards the east and towards the north.", unit="N", low=0.0, high=1e9
    )
    gust_time_constant: float = parameter(20.0, "Time over which a gust dies away.", unit="s", low=1e-3, high=1e6)

    def blows(self) -> bool:
        """Whether there is any force at all."""
        return bool(self.east_force or self.north_force or self.gust_deviation)


@dataclass(frozen=True)
class CurrentParameters:
    """A steady, uniform current; the hull moves relative to the water."""

    east: float = parameter(0.0, "Current towards the east.", unit="m/s", low=-20.0, high=20.0)
    north: float = parameter(0.0, "Current towards the north.", unit="m/s", low=-20.0, high=20.0)


def periodic_wrench(time: float, parameters: PeriodicParameters, phase: float = 0.0) -> Wrench:
    """(F_u, F_v, N_r)(1 + sin(w·t + phase)), the disturbance of section 6.2 before division by the inertia.

    Args:
        time: Time since the start, s.
        parameters: Mean values and frequency.
        phase: 0 in the paper; other values keep the phase continuous where the frequency has been changed.

    Returns:
        Surge force [N], sway force [N], yaw moment [N·m] in the body frame.
    """
    swell = 1.0 + math.sin(parameters.frequency * time + phase)
    return parameters.surge_force * swell, parameters.sway_force * swell, parameters.yaw_moment * swell


class Wind:
    """An earth-fixed force with gusts, in steps of a period.

    Args:
        parameters: Mean, lever and gusts.
        period: Time between two steps, s.
        random: Where the gusts are drawn from.
    """

    def __init__(self, parameters: EarthFixedParameters, period: float, random: np.random.Generator) -> None:
        self._period = period
        self._random = random
        self.retune(parameters)
        self._gust = parameters.gust_deviation * random.standard_normal(2)

    def retune(self, parameters: EarthFixedParameters) -> None:
        """Take other parameters; the gusts go on from their present values."""
        p = parameters
        self._mean = np.array([p.east_force, p.north_force])
        self._lever = p.lever
        self._memory = math.exp(-self._period / p.gust_time_constant)
        self._fresh = p.gust_deviation * math.sqrt(1.0 - self._memory**2)

    def force(self) -> tuple[float, float]:
        """F_E + g_E and F_N + g_N of this period, N."""
        east, north = self._mean + self._gust
        return float(east), float(north)

    def wrench(self, psi: float) -> Wrench:
        """The force of this period seen from a ship of heading psi."""
        return body_wrench(self.force(), psi, self._lever)

    def advance(self) -> None:
        """Go to the next period: g = exp(-T/T_g)·g + sigma·sqrt(1 - exp(-2·T/T_g))·white noise, exact for any T."""
        self._gust = self._memory * self._gust + self._fresh * self._random.standard_normal(2)


def body_wrench(force: tuple[float, float], psi: float, lever: float = 0.0) -> Wrench:
    """An earth-fixed force seen from the ship.

    Args:
        force: Towards the east and towards the north, N.
        psi: Heading, rad.
        lever: How far ahead of midships it acts, m.
    """
    c, s = math.cos(psi), math.sin(psi)
    across = force[1] * c - force[0] * s
    return force[0] * c + force[1] * s, across, lever * across


def total(first: Wrench, second: Wrench) -> Wrench:
    """The sum of two wrenches."""
    return first[0] + second[0], first[1] + second[1], first[2] + second[2]


def acceleration(wrench: Wrench, vessel: Vessel) -> tuple[float, float, float]:
    """(tau_uw, tau_vw, tau_rw) of (6): a disturbing wrench divided by the inertia it moves."""
    return wrench[0] / vessel.m11, wrench[1] / vessel.m22, wrench[2] / vessel.m33
