"""Disturbances that act on the hull, as body-fixed wrenches.

| symbol | meaning | unit | equation |
|---|---|---|---|
| tau_uw, tau_vw, tau_rw | disturbance as accelerations | m/s², m/s², rad/s² | section 6.2 |
| F_u, F_v, N_r | mean disturbance as a wrench: 11e2, 26e2, 950e2 | N, N, N·m | section 6.2 |
| w | its frequency: 0.01 | rad/s | section 6.2 |
"""

import math
from dataclasses import dataclass

from vessel_hsmc_ros.schema import group, parameter
from vessel_sim_node.plant import Vessel


@dataclass(frozen=True)
class PeriodicParameters:
    """The paper's disturbance: a mean push that swells and fades; zeros switch it off."""

    surge_force: float = parameter(11e2, "Mean disturbing force in surge.", unit="N", low=-1e9, high=1e9)
    sway_force: float = parameter(26e2, "Mean disturbing force in sway.", unit="N", low=-1e9, high=1e9)
    yaw_moment: float = parameter(950e2, "Mean disturbing moment in yaw.", unit="N·m", low=-1e12, high=1e12)
    frequency: float = parameter(0.01, "Angular frequency of the swelling.", unit="rad/s", low=0.0, high=1e3, symbol="w")


@dataclass(frozen=True)
class DisturbanceParameters:
    """All disturbances of a plant; they add up."""

    periodic: PeriodicParameters = group(PeriodicParameters)


def periodic_wrench(time: float, parameters: PeriodicParameters) -> tuple[float, float, float]:
    """(F_u, F_v, N_r)(1 + sin(w·t)), the disturbance of section 6.2 before division by the inertia.

    Args:
        time: Time since the start, s.

    Returns:
        Surge force [N], sway force [N], yaw moment [N·m] in the body frame.
    """
    swell = 1.0 + math.sin(parameters.frequency * time)
    return parameters.surge_force * swell, parameters.sway_force * swell, parameters.yaw_moment * swell


def acceleration(wrench: tuple[float, float, float], vessel: Vessel) -> tuple[float, float, float]:
    """(tau_uw, tau_vw, tau_rw) of (6): a disturbing wrench divided by the inertia it moves."""
    return wrench[0] / vessel.m11, wrench[1] / vessel.m22, wrench[2] / vessel.m33
