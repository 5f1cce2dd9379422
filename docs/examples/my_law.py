"""A control law of your own: line-of-sight guidance, PI control of the speed, PD control of the heading.

    vessel-hsmc run my_scenario.yaml --law-file my_law.py

docs/own_law.md explains it line by line.
"""

import math
from dataclasses import dataclass

from vessel_hsmc_ros import Acceleration, Law, Motion, Terms, clip, parameter, wrap


@dataclass(frozen=True)
class MyParameters:
    """Gains, each with its default, unit and range."""

    lookahead: float = parameter(12.0, "Lookahead distance.", unit="m", low=0.1, high=1e3, tunable=True)
    position_gain: float = parameter(
        0.3, "From the along-track error to the speed.", unit="1/s", low=0.0, high=10.0, tunable=True
    )
    surge_gain: float = parameter(1.0, "From the speed error to the acceleration.", unit="1/s", low=0.0, high=100.0, tunable=True)
    yaw_bandwidth: float = parameter(0.8, "Bandwidth of the heading.", unit="rad/s", low=0.0, high=10.0, tunable=True)


class MyLaw(Law[MyParameters]):
    """Steers along the course of the reference, from the side towards it."""

    name = "my_law"

    def reset(self) -> None:
        """Set the integral of the speed error to zero."""
        self.integral = 0.0

    def step(self, motion: Motion, desired: Motion, acceleration: Acceleration) -> tuple[tuple[float, float], Terms]:
        """Compute surge force and yaw moment for the next control period."""
        p, ship = self.parameters, self.vessel
        course = desired.psi + math.atan2(desired.v, desired.u)
        x, y = motion.x - desired.x, motion.y - desired.y
        along, across = x * math.cos(course) + y * math.sin(course), y * math.cos(course) - x * math.sin(course)
        heading = desired.psi - math.atan2(across, p.lookahead)
        speed_error = motion.u - desired.u + clip(p.position_gain * along, 2.0)
        heading_error, yaw_rate_error = wrap(motion.psi - heading), motion.r - desired.r
        surge = acceleration.du - p.surge_gain * speed_error - self.integral
        yaw = acceleration.dr - p.yaw_bandwidth * (2.0 * yaw_rate_error + p.yaw_bandwidth * heading_error)
        force = clip(ship.surge_inertia * surge, ship.surge_force_limit)
        moment = clip(ship.yaw_inertia * yaw, ship.yaw_moment_limit)
        if abs(force) < ship.surge_force_limit:  # integrate only while the limit is not reached
            self.integral += self.period * 0.1 * p.surge_gain * speed_error
        return (force, moment), Terms(heading_error=heading_error, commanded_heading=wrap(heading))
