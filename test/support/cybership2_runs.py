"""Simulated runs of CyberShip II under a wrench that excites all of its parameters, with sensor noise."""

import numpy as np

from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.studies.identification.types import Measurements, simulated, vessel, windows

CYBERSHIP2 = {
    "surge_inertia": 25.8,
    "sway_inertia": 33.8,
    "yaw_inertia": 2.76,
    "sway_yaw_inertia": 1.0948,
    "surge_damping": 0.72253,
    "surge_damping_quadratic": 1.32742,
    "surge_damping_cubic": 5.86643,
    "sway_damping": 0.88965,
    "sway_damping_quadratic": 36.47287,
    "sway_damping_from_yaw": 7.250,
    "sway_damping_from_yaw_quadratic": 3.450,
    "sway_damping_from_yaw_at_sway": 0.845,
    "sway_damping_at_yaw": 0.805,
    "yaw_damping": 1.900,
    "yaw_damping_quadratic": 0.750,
    "yaw_damping_from_sway": -0.03130,
    "yaw_damping_from_sway_quadratic": -3.95645,
    "yaw_damping_from_sway_at_yaw": -0.130,
    "yaw_damping_at_sway": -0.080,
}
"""Skjetne, Smogeli and Fossen, Modeling, Identification and Control 25(1), 2004; minus their derivatives, as damping."""

NOISE = (5e-3, 5e-3, 3e-3, 1e-2, 1e-2, 5e-3)
"""Standard deviation of the sensors: m, m, rad, m/s, m/s, rad/s."""
LIMITS = (4.0, 3.0, 1.5)
"""Largest surge force [N], sway force [N] (bow thruster) and yaw moment [N·m] of the programme."""


def cybership2(seed: int, duration: float = 480.0, step: float = 0.2, noise: float = 1.0, gusts: float = 0.0) -> Measurements:
    """A run of CyberShip II as its sensors measure it.

    Args:
        seed: Of the noise.
        duration: Length of the run, s.
        step: Interval of the samples, s.
        noise: Factor on NOISE.
        gusts: Standard deviation of an unmeasured force with a correlation time of 3 s, relative to LIMITS.
    """
    random = np.random.default_rng(seed)
    time = np.arange(0.0, duration, step)
    wrench = programme(time, duration)
    disturbed = wrench + gust(random, len(time), step, gusts)
    whole = windows([Measurements(time, 0.0 * wrench, 0.0 * wrench, disturbed)], duration)
    states = simulated(whole, np.zeros((1, 6)), vessel(CYBERSHIP2), np.ones(3), np.zeros(3))[0]
    measured = states + noise * np.array(NOISE) * random.standard_normal(states.shape)
    return Measurements(time, measured[:, :3], measured[:, 3:], wrench, f"CyberShip II, seed {seed}")


def programme(time: Array, duration: float) -> Array:
    """The wrench that excites everything: speed steps, zig-zags, spirals, sideways steps, coasting; (n, 3)."""
    share = 4.0 * time / duration
    stage, within = np.floor(share), share % 1.0
    # Speeds from astern to full ahead, each held for an eighth of a stage, with coasting in between.
    speeds = np.array([0.3, 0.7, 0.0, 1.0, -0.6, 0.5, -0.3, 0.8])
    surge = speeds[(8.0 * within).astype(int)]
    zigzag = np.sign(np.sin(2.0 * np.pi * time / 11.0)) * (0.3 + 0.7 * within)
    spiral = 2.0 * np.abs(2.0 * within - 1.0) - 1.0
    steps = np.sign(np.sin(2.0 * np.pi * time / 7.3)) * np.sign(np.sin(2.0 * np.pi * time / 31.0))
    yaw = np.choose(stage.astype(int), [zigzag, spiral, 0.2 * steps, zigzag])
    sideways = np.sign(np.sin(2.0 * np.pi * time / 13.7)) * (1.0 - 0.6 * within)
    sway = np.choose(stage.astype(int), [0.0 * time, 0.3 * sideways, sideways, 0.8 * sideways])
    return np.column_stack([surge, sway, yaw]) * LIMITS


def gust(random: np.random.Generator, samples: int, step: float, size: float) -> Array:
    """First-order Gauss-Markov forces, (n, 3)."""
    kept = float(np.exp(-step / 3.0))
    force = np.zeros((samples, 3))
    for row in range(1, samples):
        force[row] = kept * force[row - 1] + np.sqrt(1.0 - kept * kept) * size * np.array(LIMITS) * random.standard_normal(3)
    return force
