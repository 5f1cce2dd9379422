"""Motions of the hull itself near a point: a turn on the spot from rest to rest, and a halt from any motion.

Surge speed and yaw rate are given, the sway velocity and the position follow by integration of m22·dv + m23·dr = -m11·u·r - Y.
"""

import cmath
import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.kinematics import Motion, wrap
from vessel_hsmc_ros.guidance.curve_motion import Velocities, inputs
from vessel_hsmc_ros.guidance.speed_profile import FREE, RISE, Phase, Section, SpeedProfile, phases
from vessel_hsmc_ros.guidance.timetable import Timetable, blended, world_rows
from vessel_hsmc_ros.guidance.turning import LARGEST_SHARE, SLOWER, SLOWEST, TravelLimits
from vessel_hsmc_ros.plant.dynamics import Vessel, unforced_sway

Array = NDArray[np.float64]

STEPS, SUBSTEPS = 16, 4  # instants of each part of a change of speed, and steps of the integration of the sway between two
DECAY, DECAY_STEPS = 12.0, 128
"""Time after the turn or halt in which the sway decays, in terms of its time constant, and its instants."""

HALT_SHARE = 0.75  # share of the limits of the acceleration that a halt takes; the rest is for the transition to it
BLENDED = 0.4
"""Share of the braking of a halt in which the acceleration of the motion before it decays. On its way it reaches -0.37 of what it
was; that is over before the braking has reached HALT_SHARE, so that the sum stays within the limits."""

PASSES = 5  # passes that find the heading towards a point while the ship moves aside
NEGLIGIBLE = 1e-6
"""Angle that is not worth a turn, rad, and speed at which there is no drift, relative to what the sway takes to decay."""


class _Given(NamedTuple):
    """Surge speed and yaw rate with their rates, and the heading, at instants; arrays."""

    times: Array
    u: Array
    du: Array
    psi: Array
    r: Array
    dr: Array


def spot_turn(pose: tuple[float, float, float], target: complex, vessel: Vessel, limits: TravelLimits) -> Timetable | None:
    """Turn the bow towards a point.

    `pose`: x, y, psi at the beginning; at rest. `target`: the point, m. Returns the motion, from the time 0 on; None where the
    bow points there. Raises ParameterError if the yaw moment is too small for any turn.
    """
    x, y, psi = pose
    here, table = complex(x, y), None
    for _ in range(PASSES if vessel.coupled else 1):
        angle = wrap(cmath.phase(target - here) - psi)
        if abs(angle) < NEGLIGIBLE:
            return None
        table = _turned(pose, angle, vessel, limits)
        here = complex(table.rows[-1, 0], table.rows[-1, 1])
    return table


def halt(motion: Motion, row: Array, vessel: Vessel, limits: TravelLimits) -> Timetable:
    """Come to rest.

    `row`: the row of a table there, whose acceleration decays. Returns the motion, from the time 0 on.
    """
    x, y, psi, u, v, r = motion
    # A yaw rate that is just gathering would be halted in no time, and with no time for its acceleration to decay.
    gathering = RISE * min(1.0, abs(row[8]) / limits.yaw_acceleration) * limits.yaw_rate
    slowing = max(abs(u) / limits.acceleration, max(abs(r), gathering) / limits.yaw_acceleration)
    duration, sway_time = slowing / (HALT_SHARE * (1.0 - RISE)), vessel.m22 / vessel.d_v
    profile = SpeedProfile([Phase(max(duration, 1e-3 * sway_time), 1.0, 0.0)])
    times = _instants(profile, vessel, drifts=vessel.coupled or math.hypot(u, v) > NEGLIGIBLE * limits.acceleration * sway_time)
    integral, share, rate = profile.at(times)
    given = _Given(times, u * share, u * rate, psi + r * integral, r * share, r * rate)
    halted = _integrated(complex(x, y), v, given, vessel)[0]
    return blended(halted, row, BLENDED * float(profile.times[-1]))


def _turned(pose: tuple[float, float, float], angle: float, vessel: Vessel, limits: TravelLimits) -> Timetable:
    x, y, psi = pose
    share, side = 1.0, math.copysign(1.0, angle)
    while share > SLOWEST:
        profile = SpeedProfile(phases([Section(abs(angle), share * limits.yaw_rate, FREE)], share * limits.yaw_acceleration))
        times = _instants(profile, vessel, vessel.coupled)
        turned, r, dr = (side * column for column in profile.at(times))
        still = np.zeros_like(times)
        table, v, dv = _integrated(complex(x, y), 0.0, _Given(times, still, still, psi + turned, r, dr), vessel)
        if np.max(np.abs(inputs(Velocities(still, v, r, still, dv, dr), vessel)[1])) <= LARGEST_SHARE * limits.yaw_moment:
            return table
        share *= SLOWER
    raise ParameterError(
        f"reference_ship: a turn on the spot needs more than {LARGEST_SHARE:g} of vessel.yaw_moment_limit ="
        f" {limits.yaw_moment:g} N·m, even at {SLOWEST:g} of motion.yaw_acceleration; a smaller one would do"
    )


def _instants(profile: SpeedProfile, vessel: Vessel, drifts: bool) -> Array:
    corners = profile.corners
    parts = [np.linspace(begin, end, STEPS, endpoint=False) for begin, end in pairwise(corners)]
    decay = DECAY * vessel.m22 / vessel.d_v if drifts else 0.0
    if drifts:
        parts.append(corners[-1] + np.linspace(0.0, decay, DECAY_STEPS, endpoint=False))
    return np.append(np.concatenate(parts), corners[-1] + decay)


def _integrated(start: complex, v0: float, given: _Given, vessel: Vessel) -> tuple[Timetable, Array, Array]:
    """The table, the sway velocity and its rate."""
    times, u, du, psi, r, dr = given
    n = len(times)
    v, p = np.full(n, v0), np.full(n, start)
    if vessel.coupled or v0 or np.any(u):
        for i in range(n - 1):
            v[i + 1], p[i + 1] = _advanced(v[i], p[i], given, i, vessel)
    # At rest at the end, but for what is left of a decay.
    v[-1] = 0.0
    dv = np.array([unforced_sway(*row, vessel) for row in zip(u, v, r, dr, strict=True)])
    return Timetable(times, world_rows((p.real, p.imag, psi, u, v, r), (du, dv, dr))), v, dv


def _advanced(v: float, p: complex, given: _Given, i: int, vessel: Vessel) -> tuple[float, complex]:
    """Sway velocity and position at the next instant, by Heun's method between which the others are linear."""
    h = (given.times[i + 1] - given.times[i]) / SUBSTEPS
    ends = [(column[i], column[i + 1] - column[i]) for column in (given.u, given.psi, given.r, given.dr)]
    for k in range(SUBSTEPS):
        (u, psi, r, dr), after = ([a + j / SUBSTEPS * b for a, b in ends] for j in (k, k + 1))
        first = unforced_sway(u, v, r, dr, vessel)
        second = unforced_sway(after[0], v + h * first, after[2], after[3], vessel)
        w = v + 0.5 * h * (first + second)
        p += 0.5 * h * (complex(u, v) * cmath.exp(1j * psi) + complex(after[0], w) * cmath.exp(1j * after[1]))
        v = w
    return float(v), complex(p)
