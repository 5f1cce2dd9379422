"""Environmental disturbances: the periodic load of the paper, wind with gusts, and current.

| symbol | meaning | unit | equation |
|---|---|---|---|
| tau_uw, tau_vw, tau_rw | disturbance as accelerations | m/s², m/s², rad/s² | section 6.2 |
| F_u, F_v, N_r | mean disturbance as a wrench: 11e2, 26e2, 950e2 | N, N, N·m | section 6.2 |
| w | frequency of the periodic disturbance: 0.01 | rad/s | section 6.2 |
| F_E, F_N | mean wind force, east and north | N, N | not in the paper |
| g_E, g_N | gusts: first-order Gauss-Markov processes | N, N | not in the paper |
| sigma, T_g | standard deviation and time constant of the gusts | N, s | not in the paper |
"""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.kinematics import to_body
from vessel_hsmc_ros.core.schema import parameter
from vessel_hsmc_ros.plant.dynamics import Wrench

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
        """The wind in discrete time.

        `period`: period of the plant, s. `blowing`: whether the wind has blown before, so that gusts are left.
        """
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
    """The disturbance of section 6.2 as a wrench: (F_u, F_v, N_r)·(1 + sin(w·t + phase)), in the body frame.

    `time`: time since the start, s.
    """
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
