"""Thousands of random ships with passive damping: they never gain energy, and bounded inputs keep their motion finite."""

import math
from collections.abc import Iterator
from random import Random
from typing import Any

import numpy as np
import pytest
from compiling import repeated
from hulls import ship
from numpy.typing import NDArray

from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.kinematics import Motion
from vessel_hsmc_ros.plant.dynamics import Vessel, damping_force, rk4_step
from vessel_hsmc_ros.plant.hull_parameters import ShipParameters, check_hull, largest_gain
from vessel_hsmc_ros.simulation.compilation import compiled

Array = NDArray[np.float64]
Triple = tuple[float, float, float]

SHIPS, STEPS, STEP = repeated(4_000), 100, 0.01
"""The time of a step is that of a ship with inertia and length of the order of 1; units scale it."""

INPUTS = np.random.default_rng(7).uniform(-2.0, 2.0, (STEPS // 20, 3))
"""Wrenches that change every 20 steps."""


@kernel
def energy(motion: Motion, s: Vessel) -> float:
    """Kinetic energy, with the symmetric part of the inertia matrix."""
    u, v, r = motion.u, motion.v, motion.r
    return 0.5 * (s.m11 * u * u + s.m22 * v * v + s.m33 * r * r) + s.m_c * v * r


@kernel
def sail(start: Any, s: Vessel, inputs: Any, units: Any, current: tuple[float, float]) -> tuple[float, float, float]:
    """Largest relative gain of energy in a step without input, least relative power of damping, largest speed under input."""
    force, length, step = units
    free = driven = Motion(0.0, 0.0, 0.5, start[0], start[1], start[2])
    gain, least, fastest = -1.0, 1.0, 0.0
    for k in range(STEPS):
        before = energy(free, s)
        free = rk4_step(free, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), s, step, (0.0, 0.0))
        if before > 0.0:
            gain = max(gain, energy(free, s) / before - 1.0)
        tau = inputs[k // 20]
        wrench = force * tau[0], force * tau[1], force * length * tau[2]
        driven = rk4_step(driven, wrench, (0.0, 0.0, 0.0), s, step, current)
        u, v, r = driven.u, driven.v, driven.r
        X, Y, N = damping_force(u, v, r, s)
        power, size = u * X + v * Y + r * N, abs(u * X) + abs(v * Y) + abs(r * N)
        least = min(least, power / size if size > 0.0 else 0.0)
        fastest = max(fastest, abs(u) + abs(v) + length * abs(r)) if math.isfinite(u + v + r) else math.inf
    return gain, least, fastest


def drawn(random: Random, symmetric: bool = True) -> dict[str, float]:
    """Coefficients of the order of 1 whose cross terms the diagonal ones outweigh at all speeds."""

    def share(*limits: float) -> list[float]:
        """Numbers whose magnitudes add up to no more than the smallest limit, as many as limits."""
        return [min(limits) / len(limits) * random.uniform(-1.0, 1.0) for _ in limits]

    m11, m22, m33 = (random.uniform(0.3, 3.0) for _ in range(3))
    u1, v1, r1 = (random.uniform(0.02, 2.0) for _ in range(3))
    # Half of the other coefficients are zero.
    u2, v2, r2, u3, v3, r3, rv, vr, uv, ur = (max(0.0, random.uniform(-2.0, 2.0)) for _ in range(10))
    coupling = 0.7 * math.sqrt(m22 * m33) * random.uniform(-1.0, 1.0)
    # Each sum of cross terms in v·r times a power of a speed stays below the geometric mean of the two terms that damp.
    d_y_r, d_n_v = share(*[2.0 * math.sqrt(v1 * r1)] * 2)
    # Half of |r|v² and |v|r² outweighs the terms of |v|v·r and |r|v·r; half of |u|v² and |u|r² those of u·v·r.
    d_y_vr, d_n_vv, d_y_rr, d_n_rv = [*share(0.5 * rv, 0.5 * rv), *share(0.5 * vr, 0.5 * vr)]
    d_y_ur, d_n_uv, d_x_vr = share(*[math.sqrt(uv * ur)] * 3)
    return {
        **{
            "m11": m11,
            "m22": m22,
            "m33": m33,
            "m23": coupling,
            "m32": coupling * (1.0 if symmetric else random.uniform(-1.0, 1.0)),
        },
        **{"d_u": u1, "d_u2": u2, "d_u3": u3, "d_v": v1, "d_v2": v2, "d_v3": v3, "d_r": r1, "d_r2": r2, "d_r3": r3},
        **{"d_y_rv": rv, "d_n_vr": vr, "d_y_uv": uv, "d_n_ur": ur, "d_y_r": d_y_r, "d_n_v": d_n_v, "d_y_vr": d_y_vr},
        **{"d_n_vv": d_n_vv, "d_y_rr": d_y_rr, "d_n_rv": d_n_rv, "d_y_ur": d_y_ur, "d_n_uv": d_n_uv, "d_x_vr": d_x_vr},
        **{"d_x_vv": 0.5 * uv * random.uniform(-1.0, 1.0)},
    }


def scaled(symbols: dict[str, float], mass: float, length: float, time: float) -> ShipParameters:
    """The same ship in other units: a model of grams or a tanker of gigatonnes; m23 and m32 in kg·m, damping likewise."""
    found = {}
    for name, value in symbols.items():
        if name.startswith("m"):
            lengths = {"m11": 0, "m22": 0, "m23": 1, "m32": 1, "m33": 2}[name]
            found[name] = value * mass * length**lengths
            continue
        force, velocities = DIMENSIONS[name]
        # kg·m/s² or kg·m²/s² per velocity (m/s) or yaw rate (1/s).
        unit = mass * length**force / time**2
        for kind in velocities:
            unit /= (1.0 if kind == "r" else length) / time
        found[name] = value * unit
    return ship(**found)


def dimension(name: str) -> tuple[int, str]:
    """The power of length in the force (2 for a moment), and the velocities that the coefficient multiplies."""
    _, first, *rest = name.split("_")
    if rest:
        return (2 if first == "n" else 1), rest[0]
    return (2 if first[0] == "r" else 1), first[0] * int(first[1:] or 1)


DIMENSIONS = {name: dimension(name) for name in Vessel._fields if name.startswith("d_")}


def fleet(symmetric: bool, count: int) -> Iterator[tuple[ShipParameters, Triple, Triple, tuple[float, float]]]:
    """Hull data, initial velocities, units of force, length and step, and current of random ships."""
    random = Random(symmetric)  # noqa: S311 - reproducible, and faster than NumPy for single numbers
    for _ in range(count):
        mass, length, time = (
            10.0 ** random.uniform(-1.0, 5.0),
            10.0 ** random.uniform(-1.0, 1.5),
            10.0 ** random.uniform(-1.0, 1.5),
        )
        u, v, r, east, north = (random.uniform(-1.0, 1.0) * length / time for _ in range(5))
        parameters = scaled(drawn(random, symmetric), mass, length, time)
        yield parameters, (u, v, r / length), (mass * length / time**2, length, STEP * time), (east, north)


def results(symmetric: bool, count: int) -> Array:
    run = compiled(sail)
    rows = [
        (*run(start, parameters.coefficients(), INPUTS, units, current), units[1] / units[2] * STEP)
        for parameters, start, units, current in fleet(symmetric, count)
    ]
    return np.array(rows)


@pytest.mark.long
def test_random_ships_never_gain_energy_and_stay_finite_under_bounded_inputs() -> None:
    gain, least, fastest, speed = results(True, SHIPS).T
    assert gain.max() <= 1e-9
    assert least.min() >= -1e-12
    assert np.all(fastest / speed < 100.0)


def test_random_ships_with_an_unsymmetric_inertia_stay_finite_under_bounded_inputs() -> None:
    _, least, fastest, speed = results(False, SHIPS // 5).T
    assert least.min() >= -1e-12
    assert np.all(fastest / speed < 100.0)


@pytest.mark.parametrize("symmetric", [True, False])
def test_the_check_at_the_start_admits_the_random_ships(symmetric: bool) -> None:
    for parameters, *_ in fleet(symmetric, 25):
        check_hull(parameters)
        assert largest_gain(parameters) is None
