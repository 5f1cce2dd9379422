"""The allocation of many demands at once, compiled, and random demands to a layout."""

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.loop.allocated_forces import THRUST, TURN, Allocator
from vessel_hsmc_ros.control.loop.allocation import allocate, allocated_wrench, allocator, new_state
from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.thruster_layout import AZIMUTH, FIXED, ThrusterLayout
from vessel_hsmc_ros.plant.thruster_plant import ThrusterState, hull_wrench, thrusters_of
from vessel_hsmc_ros.simulation.compilation import compiled

Array = NDArray[np.float64]

SURGE_SPEED = 1.5


@kernel
def allocate_all(demands: Array, elapsed: float, u: float, c: Allocator, s: Array, rows: Array) -> None:
    """Allocate demands one after the other; wrench, thrusts, angles a row."""
    k = len(c.rows)
    for i in range(len(demands)):
        allocate(demands[i, 0], demands[i, 1], elapsed, u, c, s)
        wrench = allocated_wrench(u, c, s)
        for j in range(3):
            rows[i, j] = wrench[j]
        for j in range(k):
            rows[i, 3 + j], rows[i, 3 + k + j] = s[j, THRUST], s[j, TURN]


def allocated(layout: ThrusterLayout, demands: Array, elapsed: float = 1.0) -> tuple[Array, Array, Array]:
    """Wrenches (n, 3), thrusts (n, k) and angles (n, k) of demands (n, 2)."""
    c = allocator(layout)
    k = len(c.rows)
    rows = np.empty((len(demands), 3 + 2 * k))
    compiled(allocate_all)(demands, elapsed, SURGE_SPEED, c, new_state(c), rows)
    return rows[:, :3], rows[:, 3 : 3 + k], rows[:, 3 + k :]


def attainable(layout: ThrusterLayout, random: np.random.Generator, count: int) -> Array:
    """Surge forces and yaw moments of random thrusts and angles inside the limits, by the plant's equations, (n, 2)."""
    c, found = thrusters_of(layout, 1.0), np.empty((count, 2))
    each = layout.thrusters()
    for k in range(count):
        thrust = np.array([random.uniform(-t.thrust_astern, t.thrust_ahead) for t in each])
        limits = [t.largest_angle if t.kind != AZIMUTH else t.angle_limit for t in each]
        angle = [t.angle if t.kind == FIXED else random.uniform(-d, d) for t, d in zip(each, limits, strict=True)]
        found[k] = np.array(hull_wrench(ThrusterState(thrust, angle), SURGE_SPEED, c))[[0, 2]]
    return found


def demands_of(layout: ThrusterLayout, count: int, seed: int = 0) -> tuple[Array, Array]:
    """Attainable demands, and others in a rectangle that is larger than the attainable set."""
    random = np.random.default_rng(seed)
    some = attainable(layout, random, 2000)
    inside = some[random.integers(0, len(some), count)]
    largest = np.abs(some).max(axis=0)
    return inside, random.uniform(-1.6, 1.6, (count, 2)) * largest
