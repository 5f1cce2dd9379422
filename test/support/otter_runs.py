"""Simulated runs of the Otter under much excitation or little, as a logger samples them."""

from collections.abc import Mapping

import numpy as np

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.scenario.own_ship import ship_of
from vessel_hsmc_ros.scenario.vessels import read_vessel
from vessel_hsmc_ros.studies.identification.types import HULL, Measurements, simulated, vessel, windows

_SHIP = schema.flatten(ship_of(read_vessel("otter").values))
OTTER = {name: float(str(_SHIP[name])) for name in HULL}
LIMITS = (float(str(_SHIP["surge_force_limit"])), 0.0, float(str(_SHIP["yaw_moment_limit"])))
NOISE = (0.02, 0.02, 0.003, 0.03, 0.03, 0.01)
"""Standard deviation of the sensors, as `vessel-hsmc excite` sets them for this ship: m, m, rad, m/s, m/s, rad/s."""
FINE, LAG = 0.01, 0.1
"""Interval of the simulation and lag of the propellers, s."""


def otter(
    seed: int,
    rate_hz: float,
    rich: bool,
    held: bool,
    duration: float = 60.0,
    current: tuple[float, float] = (0.0, 0.0),
    hull: Mapping[str, float] = OTTER,
) -> Measurements:
    """A run of the Otter as its sensors measure it.

    Args:
        seed: Of the noise and of the times of the programme.
        rate_hz: Rate of the samples, Hz; 100 is a multiple of it.
        rich: The programme with many reversals instead of one.
        held: The force keeps each sampled value until the next sample, instead of changing with the lag of the propellers.
        duration: Length of the run, s.
        current: Along x and y, m/s, steady.
        hull: Its data.
    """
    random = np.random.default_rng(seed)
    every, time = round(1.0 / (rate_hz * FINE)), np.arange(0.0, duration + 1.0 / rate_hz, FINE)
    force = lagged((much if rich else little)(time / duration, random) * LIMITS)
    acting = np.repeat(force[::every], every, axis=0)[: len(time)] if held else force
    whole = windows([Measurements(time, 0.0 * force, 0.0 * force, acting)], duration + 1.0)
    states = simulated(whole, np.zeros((1, 6)), vessel(hull), np.ones(3), np.zeros(3), currents=np.array([current]))[0]
    samples = slice(0, round(duration * rate_hz) * every, every)
    measured = states[samples] + np.array(NOISE) * random.standard_normal(states[samples].shape)
    return Measurements(time[samples], measured[:, :3], measured[:, 3:], force[samples], f"Otter, seed {seed}")


def little(share: Array, random: np.random.Generator) -> Array:
    """One speed step, and one turn to each side; shares of the limits at shares of the duration, (n, 3)."""
    first, second = random.uniform(0.2, 0.3), random.uniform(0.6, 0.7)
    surge = np.where(share < 0.5, 0.4, 0.6)
    yaw = np.select([share < first, share < second], [0.0, 0.3], -0.3)
    return np.column_stack([surge, np.zeros(len(share)), yaw])


def much(share: Array, random: np.random.Generator) -> Array:
    """Speed steps ahead and astern under zig-zags of growing amplitude and two periods; shares of the limits, (n, 3)."""
    surge = np.choose((8.0 * share).astype(int) % 8, [0.3, 0.6, 1.0, 0.0, -0.4, 0.5, 0.9, 0.2])
    half_periods = np.where(share < 0.5, 15.0, 30.0) * share + random.uniform(0.0, 0.5)
    yaw = np.sign(np.sin(np.pi * half_periods)) * (0.3 + 0.7 * (4.0 * share % 1.0))
    return np.column_stack([surge, np.zeros(len(share)), yaw])


def lagged(demand: Array) -> Array:
    """The force of propellers with a first-order lag, (n, 3)."""
    force = np.zeros_like(demand)
    for row in range(1, len(demand)):
        force[row] = force[row - 1] + (1.0 - np.exp(-FINE / LAG)) * (demand[row] - force[row - 1])
    return force
