"""The model knowledge of a control law: inertias, the limits and dynamics of the actuators, and the point that a law controls.

| symbol | meaning | unit |
|---|---|---|
| m11, m22, m33 | inertias in surge, sway and yaw | kg, kg, kg·m² |
| m23, m32 | coupling of sway and yaw in the inertia matrix | kg·m |
| e | sway force that comes with a unit of yaw moment | 1/m |
| x_p | distance of the centre of percussion ahead of the origin | m |
| m_p | inertia that the yaw moment accelerates | kg·m² |

A yaw moment N accelerates sway and yaw by M·(v', r') = (e·N, N). The centre of percussion, at the distance
x_p = -v'/r' = (m23 - m33·e)/(m22 - m32·e), has the sway velocity v + x_p·r, which N does not accelerate; and r' = N/m_p with
m_p = m33 - x_p·m32. The pivot point of ship handling, without sway velocity in a steady turn, is another.
docs/percussion.md derives both.
"""

import math
from dataclasses import dataclass
from typing import Any

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.hull import NamedVessel
from vessel_hsmc_ros.core.schema import parameter
from vessel_hsmc_ros.core.steering import Steering, steering, steering_loss, steering_speed


def limit(what: str, unit: str, default: float, high: float) -> float:
    """Declare the largest force or moment that a law commands."""
    used = "in either direction; not used by the paper's own laws."
    return parameter(default, f"Largest {what} to command, {used}", unit=unit, low=1e-3, high=high)


def coupling(description: str) -> float:
    """Declare an element of the inertia matrix outside its diagonal, zero by default."""
    return parameter(0.0, description, unit="kg·m", low=-1e15, high=1e15)


NOT_DECLARED = -1.0  # the value of what is not known of an actuator: laws then count it as slow, not as instantaneous


INSTANT: dict[str, Any] = {
    **dict.fromkeys(("surge_lag", "yaw_lag", "surge_dead_time", "yaw_dead_time"), 0.0),
    **dict.fromkeys(("surge_force_rate", "yaw_moment_rate"), math.inf),
}
"""The declaration of actuators that follow every command at once, by the names of parameters."""


def rate(what: str, unit: str) -> float:
    """Declare the largest rate of change of an actuator, not declared by default."""
    return parameter(
        NOT_DECLARED,
        f"Largest rate of change of the {what}; inf: no limit; negative: not declared.",
        unit=unit,
        low=NOT_DECLARED,
        high=math.inf,
    )


def delay(what: str) -> float:
    """Declare a time constant or a dead time of an actuator, not declared by default."""
    return parameter(NOT_DECLARED, f"{what}; 0: none; negative: not declared.", unit="s", low=NOT_DECLARED, high=1e3)


@dataclass(frozen=True)
class KnownVessel(NamedVessel):
    """What a law knows of the ship; the defaults are the ship of the paper's section 6.2."""

    surge_inertia: float = parameter(120e3, "Mass with added mass in surge.", unit="kg", low=1e-3, high=1e12, symbol="m11")
    yaw_inertia: float = parameter(
        636e5, "Moment of inertia with added inertia in yaw.", unit="kg·m²", low=1e-3, high=1e15, symbol="m33"
    )
    surge_force_limit: float = limit("surge force", "N", 2e5, 1e12)
    yaw_moment_limit: float = limit("yaw moment", "N·m", 3e6, 1e15)
    # The parameters below have no symbols: laws build their gains from those of the vessel.
    length: float = parameter(32.0, "Length of the hull, the unit of length of the guided law.", unit="m", low=1e-3, high=1e4)
    sway_inertia: float = parameter(
        177.9e3, "Mass with added mass in sway, m22, for the centre of percussion.", unit="kg", low=1e-3, high=1e12
    )
    sway_yaw_inertia: float = coupling("Sway force per yaw acceleration, m23, for the centre of percussion.")
    yaw_sway_inertia: float = coupling(
        "Yaw moment per sway acceleration, m32, for the centre of percussion; 0: equal to sway_yaw_inertia."
    )
    sway_force_per_yaw_moment: float = parameter(
        0.0,
        "Sway force that comes with a unit of yaw moment, as that of a rudder, for the centre of percussion.",
        unit="1/m",
        low=-1e3,
        high=1e3,
    )
    controlled_point: str = parameter(
        "ahead",
        "The point that a law steers along a moving reference: the centre of percussion, where the yaw moment does not enter the"
        " sway; the origin; or, by default, the one of them that is further ahead.",
        choices=("ahead", "percussion", "origin"),
    )
    surge_lag: float = delay("Time constant of the first-order lag of the surge force")
    yaw_lag: float = delay("Time constant of the first-order lag of the yaw moment")
    surge_force_rate: float = rate("surge force", "N/s")
    yaw_moment_rate: float = rate("yaw moment", "N·m/s")
    surge_dead_time: float = delay("Dead time of the surge force")
    yaw_dead_time: float = delay("Dead time of the yaw moment")
    sway_damping_rate: float = parameter(
        NOT_DECLARED,
        "Decay rate of the sway velocity, for a hull with low sway damping, whose course follows its heading late; the guided law"
        " expects it. Negative: not declared, so that the law learns it.",
        unit="1/s",
        low=NOT_DECLARED,
        high=1e3,
    )
    coriolis_ratio: float = parameter(
        NOT_DECLARED,
        "Sway acceleration of such a hull per surge velocity times yaw rate. Negative: surge_inertia/sway_inertia, at most 1.",
        low=NOT_DECLARED,
        high=10.0,
    )
    steering_loss: float = steering_loss()
    steering_speed: float = steering_speed()

    @property
    def steering(self) -> Steering:
        """How the yaw moment depends on thrust and speed."""
        return steering(self.steering_loss, self.steering_speed, self.surge_force_limit, self.yaw_moment_limit)

    @property
    def percussion_point(self) -> float:
        """The distance x_p of the centre of percussion ahead of the origin, m.

        Raises ParameterError if the inertia matrix is not positive, or the sway force turns the ship against the yaw moment.
        """
        m22, m33, m23, e = self.sway_inertia, self.yaw_inertia, self.sway_yaw_inertia, self.sway_force_per_yaw_moment
        m32 = self.yaw_sway_inertia or m23
        if m22 * m33 <= m23 * m32:
            raise ParameterError(
                "controller.vessel.sway_yaw_inertia·yaw_sway_inertia must be below sway_inertia·yaw_inertia ="
                f" {m22 * m33:g} kg²·m² (got {m23:g}·{m32:g})"
            )
        if m32 * e >= m22:
            raise ParameterError(
                "controller.vessel.sway_force_per_yaw_moment·yaw_sway_inertia must be below sway_inertia ="
                f" {m22:g} kg (got {e:g}·{m32:g})"
            )
        return (m23 - m33 * e) / (m22 - m32 * e)

    @property
    def controlled(self) -> float:
        """The distance of the controlled point ahead of the origin, m: x_p, or 0 for the origin.

        Raises ParameterError as `percussion_point`.
        """
        x_p = self.percussion_point
        # One behind the origin is no better: then the moment accelerates the origin to the side to which the ship turns.
        at_origin = self.controlled_point == "origin" or (self.controlled_point == "ahead" and x_p < 0.0)
        return 0.0 if at_origin else x_p

    def as_controlled(self) -> "ControlledVessel":
        """The same vessel as a law knows it: its yaw inertia is m_p; uncoupled where the centre of percussion is controlled.

        Raises ParameterError as `percussion_point`.
        """
        x_p, m32 = self.percussion_point, self.yaw_sway_inertia or self.sway_yaw_inertia
        known = {**vars(self), "yaw_inertia": self.yaw_inertia - x_p * m32}
        if self.controlled:
            known |= {"sway_yaw_inertia": 0.0, "yaw_sway_inertia": 0.0, "sway_force_per_yaw_moment": 0.0}
        return ControlledVessel(**known, ahead=self.controlled)


@dataclass(frozen=True)
class ControlledVessel(KnownVessel):
    """A vessel as a law knows it at the point that it controls."""

    ahead: float = 0.0  # distance of that point ahead of the origin, m
