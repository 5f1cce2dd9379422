"""Disturbances that act on the hull: the paper's, wind, and the current under it.

| symbol | meaning | unit | equation |
|---|---|---|---|
| tau_uw, tau_vw, tau_rw | disturbance as accelerations | m/s², m/s², rad/s² | section 6.2 |
| F_u, F_v, N_r | mean disturbance as a wrench: 11e2, 26e2, 950e2 | N, N, N·m | section 6.2 |
| w | its frequency: 0.01 | rad/s | section 6.2 |
| F_E, F_N | force of the wind, east and north | N, N | not in the paper |
"""

import math
from dataclasses import dataclass

from vessel_hsmc_ros.schema import group, parameter
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


@dataclass(frozen=True)
class CurrentParameters:
    """A steady, uniform current; the hull moves relative to the water."""

    east: float = parameter(0.0, "Current towards the east.", unit="m/s", low=-20.0, high=20.0)
    north: float = parameter(0.0, "Current towards the north.", unit="m/s", low=-20.0, high=20.0)


@dataclass(frozen=True)
class DisturbanceParameters:
    """All disturbances of a plant; they add up."""

    periodic: PeriodicParameters = group(PeriodicParameters)
    earth_fixed: EarthFixedParameters = group(EarthFixedParameters)
    current: CurrentParameters = group(CurrentParameters)


def periodic_wrench(time: float, parameters: PeriodicParameters) -> Wrench:
    """(F_u, F_v, N_r)(1 + sin(w·t)), the disturbance of section 6.2 before division by the inertia.

    Args:
        time: Time since the start, s.

    Returns:
        Surge force [N], sway force [N], yaw moment [N·m] in the body frame.
    """
    swell = 1.0 + math.sin(parameters.frequency * time)
    return parameters.surge_force * swell, parameters.sway_force * swell, parameters.yaw_moment * swell


def body_wrench(force: tuple[float, float], psi: float) -> Wrench:
    """An earth-fixed force seen from the ship; it acts midships, so it has no moment.

    Args:
        force: F_E, F_N, N.
        psi: Heading, rad.
    """
    c, s = math.cos(psi), math.sin(psi)
    return force[0] * c + force[1] * s, force[1] * c - force[0] * s, 0.0


def total(first: Wrench, second: Wrench) -> Wrench:
    """The sum of two wrenches."""
    return first[0] + second[0], first[1] + second[1], first[2] + second[2]


def acceleration(wrench: Wrench, vessel: Vessel) -> tuple[float, float, float]:
    """(tau_uw, tau_vw, tau_rw) of (6): a disturbing wrench divided by the inertia it moves."""
    return wrench[0] / vessel.m11, wrench[1] / vessel.m22, wrench[2] / vessel.m33
