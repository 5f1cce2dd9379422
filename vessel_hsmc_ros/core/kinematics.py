"""Angles, headings and the transformation of the tracking problem, equations (9) to (11).

| symbol | meaning | unit | equation |
|---|---|---|---|
| psi | heading, counter-clockwise from x | rad | (6) |
| z1, z2, z3 | position seen along and across the ship, heading | m, m, rad | (9), (10) |
| dz1, dz2, dz3 | their first time derivatives | m/s, m/s, rad/s | (9) with (6) |
| ddz1, ddz2, ddz3 | their second time derivatives | m/s², m/s², rad/s² | (13), (18), (24) |

A state is x, y, psi, u, v, r; an acceleration is du, dv, dr, the derivatives of the body velocities.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

TURN = 2.0 * math.pi


class Transformed(NamedTuple):
    """z1, z2, z3 or their derivatives."""

    z1: float
    z2: float
    z3: float


def wrap(angle: float) -> float:
    """The same direction in (-pi, pi]; an angle that lies there is returned unchanged, to the last bit."""
    if -math.pi < angle <= math.pi:
        return angle
    return angle - TURN * math.ceil((angle - math.pi) / TURN)


def quaternion_from_heading(psi: float) -> tuple[float, float]:
    """The z and w components of the unit quaternion that turns by psi about the vertical."""
    return math.sin(0.5 * psi), math.cos(0.5 * psi)


def heading_from_quaternion(x: float, y: float, z: float, w: float) -> float:
    """The heading of any non-zero quaternion, roll and pitch disregarded, in [-pi, pi]."""
    return math.atan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z)


def as_published(state: Array) -> Array:
    """The state as a reader of its message sees it: the heading goes through a quaternion and comes back wrapped."""
    z, w = quaternion_from_heading(float(state[2]))
    published = state.copy()
    published[2] = heading_from_quaternion(0.0, 0.0, z, w)
    return published


def transform(state: Array | tuple[float, ...]) -> Transformed:
    """Z of (9): the position resolved along and across the hull, and the heading."""
    x, y, psi = float(state[0]), float(state[1]), float(state[2])
    c, s = math.cos(psi), math.sin(psi)
    return Transformed(x * c + y * s, -x * s + y * c, psi)


def transform_rate(z: Transformed, state: Array) -> Transformed:
    """dz, from (9) and (6): dz1 = u + z2·r, dz2 = v - z1·r, dz3 = r."""
    u, v, r = float(state[3]), float(state[4]), float(state[5])
    return Transformed(u + z.z2 * r, v - z.z1 * r, r)


def transform_acceleration(z: Transformed, state: Array, acceleration: Array) -> Transformed:
    """ddz, from (9) and (6): ddz1 = du + dz2·r + z2·dr, ddz2 = dv - dz1·r - z1·dr, ddz3 = dr."""
    u, v, r = float(state[3]), float(state[4]), float(state[5])
    du, dv, dr = float(acceleration[0]), float(acceleration[1]), float(acceleration[2])
    return Transformed(du + (v - z.z1 * r) * r + z.z2 * dr, dv - (u + z.z2 * r) * r - z.z1 * dr, dr)


def tracking_error(z: Transformed, z_d: Transformed) -> Transformed:
    """z_e of (11), with the heading error taken the short way round."""
    return Transformed(z.z1 - z_d.z1, z.z2 - z_d.z2, wrap(z.z3 - z_d.z3))


def extrapolate(state: Array, acceleration: Array, interval: float) -> Array:
    """A moving ship's state a short while later or earlier, its body acceleration held.

    The velocity is exact for a constant acceleration, the pose is advanced with the velocity of the interval's middle.

    Args:
        state: x, y, psi, u, v, r, shape (6,).
        acceleration: du, dv, dr, shape (3,).
        interval: Time to go, s; negative to go back; 0 returns the state unchanged.
    """
    if interval == 0.0:
        return state
    velocity = state[3:] + acceleration * interval
    u, v, r = 0.5 * (state[3:] + velocity)
    psi = state[2] + 0.5 * interval * r
    c, s = math.cos(psi), math.sin(psi)
    pose = state[:3] + interval * np.array([u * c - v * s, u * s + v * c, r])
    return np.concatenate((pose, velocity))
