"""The motion of a hull along a route: instants, drift angle, velocities, what they take, and the timetable.

| symbol | meaning | unit |
|---|---|---|
| W, kappa, beta | speed along the route, its curvature, drift angle | m/s, 1/m, rad |
| u, v, r | W·cos(beta), W·sin(beta), W·kappa - dbeta/dt | m/s, m/s, rad/s |
| tau_1, tau_2 | surge force and yaw moment of (6) with these velocities | N, N·m |
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.guidance.curve_motion import Velocities, inputs
from vessel_hsmc_ros.guidance.route import Route
from vessel_hsmc_ros.guidance.route_drift import TOLERANCE, DriftOverTime, Travel, drift_along, travel_at
from vessel_hsmc_ros.guidance.speed_profile import RISE, SpeedProfile
from vessel_hsmc_ros.guidance.timetable import Timetable
from vessel_hsmc_ros.plant.dynamics import Vessel

Array = NDArray[np.float64]

STEPS, GROWTH, LARGEST_TURN = 16, 0.15, 0.1
"""Instants of a transition; growth of the time between two on legs and arcs, away from their ends; and the largest change of the
course between two, rad."""


class RouteMotion(NamedTuple):
    """A motion along a route at some instants."""

    times: Array  # instants, shape (n,), s
    travel: Travel  # where the ship is, and how fast
    drift: DriftOverTime  # the drift angle
    velocities: Velocities  # body velocities and accelerations
    vessel: Vessel  # coefficients of the hull

    def inputs(self, current: float = 0.0) -> tuple[Array, Array]:
        """Surge force [N] and yaw moment [N·m] that the motion takes against a current from ahead, m/s."""
        return inputs(self.velocities._replace(u=self.velocities.u + current), self.vessel)


def motion_along(
    route: Route, profile: SpeedProfile, vessel: Vessel, start: float = 0.0, tolerance: float = TOLERANCE
) -> RouteMotion:
    """The motion of a hull.

    `start`: drift angle at the beginning, rad. `tolerance`: relative residual of the equation of the drift angle. Raises
    ParameterError if there is no drift angle with which the hull moves ahead.
    """
    times = _instants(route, profile)
    drift, travel = drift_along(route, profile, times, vessel, start, tolerance), travel_at(times, route, profile)
    return RouteMotion(times, travel, drift, _velocities(travel, drift), vessel)


def timetable(motion: RouteMotion, route: Route, begin: float) -> Timetable:
    """The motion as a table.

    `begin`: time at which it begins, s.
    """
    travel, drift = motion.travel, motion.drift
    p, chi = route.position(travel.s), route.course(travel.s)
    along = np.exp(1j * chi)
    velocity, acceleration = travel.W * along, (travel.W_rate + 1j * travel.W * travel.W * travel.kappa) * along
    columns = (p, chi - drift.beta, velocity, motion.velocities.r, acceleration, motion.velocities.dr)
    x, psi, dx, r, ddx, dr = columns
    rows = np.column_stack((x.real, x.imag, psi, dx.real, dx.imag, r, ddx.real, ddx.imag, dr))
    return Timetable(begin + motion.times, np.ascontiguousarray(rows, np.float64))


def _velocities(travel: Travel, drift: DriftOverTime) -> Velocities:
    W, dW, kappa = travel.W, travel.W_rate, travel.kappa
    c, s = np.cos(drift.beta), np.sin(drift.beta)
    u, v = W * c, W * s
    dr = dW * kappa + W * W * travel.slope - drift.rate_rate
    return Velocities(u, v, W * kappa - drift.rate, dW * c - v * drift.rate, dW * s + u * drift.rate, dr)


def _instants(route: Route, profile: SpeedProfile) -> Array:
    """Instants that resolve transitions, arcs and changes of speed; all at which a derivative jumps are among them."""
    joints = np.concatenate((profile.times, profile.time_at(route.ends[1:-1]), *_corners(profile)))
    joints = np.unique(joints)
    # Joints that coincide but for rounding.
    joints = joints[np.concatenate(([True], np.diff(joints) > 1e-9 * joints[-1]))]
    s, W, _ = profile.at(0.5 * (joints[:-1] + joints[1:]))
    kappa, slope = route.curvature(s)
    spans = np.diff(joints)
    bent = spans[slope != 0.0]
    finest = float(np.min(bent) if len(bent) else np.max(spans)) / STEPS
    parts = [joints[-1:]]
    for begin, span, rate, changing in zip(joints, spans, W * np.abs(kappa), slope != 0.0, strict=False):
        parts.append(begin + span * (np.arange(STEPS) / STEPS if changing else _graded(span, finest, rate)))
    return np.unique(np.concatenate(parts))


def _corners(profile: SpeedProfile) -> tuple[Array, Array]:
    """The corners of the trapezoids of acceleration."""
    spans = np.diff(profile.times)
    return profile.times[:-1] + RISE * spans, profile.times[1:] - RISE * spans


def _graded(span: float, finest: float, rate: float) -> Array:
    """Fractions of a span that is resolved finely at its two ends."""
    coarsest = LARGEST_TURN / rate if rate > 0.0 else math.inf
    times, t = [0.0], 0.0
    while t < 0.5 * span:
        t += min(finest + GROWTH * t, coarsest)
        times.append(t)
    half = np.array(times) / (2.0 * t)
    return np.concatenate((half, 1.0 - half[-2:0:-1]))
