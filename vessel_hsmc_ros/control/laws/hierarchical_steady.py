"""Steady motions of a hull under mean loads: along a straight line, on a circle, and at rest with the bow in wind or current."""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.core.kinematics import Motion, to_body

Hull = Callable[[Motion, tuple[float, float, float], tuple[float, float]], tuple[float, float, float]]
"""The accelerations of u, v and r at the controlled point: of a motion, under surge force, sway force and yaw moment, in a
current in the hull's axes."""

HEADINGS = 36
"""Number of intervals in which a heading is looked for in which a vessel at rest stays."""


class Mean(NamedTuple):
    """Mean loads along and across the reference: earth-fixed force, with its lever, and current."""

    force: tuple[float, float] = (0.0, 0.0)
    lever: float = 0.0
    current: tuple[float, float] = (0.0, 0.0)


class Steady(NamedTuple):
    """A steady motion about which the law is linearised.

    Attributes:
        speed, turn: Speed over ground and yaw rate of the reference.
        motion: Of the vessel; the reference is at the origin with heading 0.
        mean: Loads.
        wrench: Surge force and yaw moment that it takes.
    """

    speed: float
    turn: float
    motion: Motion
    mean: Mean
    wrench: tuple[float, float]


def steady(hull: Hull, speed: float, turn: float, mean: Mean) -> Steady:
    """The steady motion of a hull along a straight line or circle; its drift angle by the secant method.

    `speed`, `turn`: of the reference.
    """

    def motion(v: float) -> Motion:
        u = math.sqrt(speed * speed - v * v)
        return Motion(0.0, 0.0, -math.atan2(v, u), u, v, turn)

    def excess(v: float) -> float:
        return accelerations(hull, motion(v), mean, (0.0, 0.0, 0.0))[1]

    before, v = 0.0, 1e-3 * speed
    for _ in range(50):
        slope = (excess(v) - excess(before)) / (v - before) if v != before else 0.0
        if slope == 0.0:
            break
        before, v = v, min(max(v - excess(v) / slope, -0.7 * speed), 0.7 * speed)
    return Steady(speed, turn, motion(v), mean, _balance(hull, motion(v), mean))


def at_rest(hull: Hull, mean: Mean) -> list[Steady]:
    """The vessel at the target, in each heading that the loads turn it back to: there the sway force grows with the heading.

    `mean`: loads, at least one of them.
    """

    def sway(psi: float) -> float:
        return accelerations(hull, Motion(0.0, 0.0, psi, 0.0, 0.0, 0.0), mean, (0.0, 0.0, 0.0))[1]

    grid = np.linspace(-math.pi, math.pi, HEADINGS + 1) + 1e-3
    values = [sway(float(psi)) for psi in grid]
    found = []
    for k in range(HEADINGS):
        if values[k] < 0.0 <= values[k + 1]:
            low, high = float(grid[k]), float(grid[k + 1])
            for _ in range(50):
                middle = 0.5 * (low + high)
                low, high = (middle, high) if sway(middle) < 0.0 else (low, middle)
            motion = Motion(0.0, 0.0, high, 0.0, 0.0, 0.0)
            found.append(Steady(0.0, 0.0, motion, mean, _balance(hull, motion, mean)))
    return found


def accelerations(hull: Hull, motion: Motion, mean: Mean, wrench: tuple[float, float, float]) -> tuple[float, float, float]:
    """The accelerations under a hull-fixed wrench and the mean loads."""
    X, Y = to_body(*mean.force, motion.psi)
    return hull(motion, (wrench[0] + X, wrench[1] + Y, wrench[2] + mean.lever * Y), to_body(*mean.current, motion.psi))


def _balance(hull: Hull, motion: Motion, mean: Mean) -> tuple[float, float]:
    """The surge force and yaw moment at which u and r do not change."""
    free, of_force, of_moment = (
        np.array(accelerations(hull, motion, mean, wrench))[[0, 2]]
        for wrench in ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    )
    tau = np.linalg.solve(np.column_stack((of_force - free, of_moment - free)), -free)
    return float(tau[0]), float(tau[1])
