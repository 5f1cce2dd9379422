"""The measured motion of a connection, its rates by positions and by velocities, and how noisy it is."""

import math
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.preflight.connection import Connection
from vessel_hsmc_ros.preflight.stamp_rules import times_of

BLOCK = 1.0  # length of the blocks whose means are compared, s


class Samples(NamedTuple):
    """Measured motions: times (n,), s, and x, y, psi, u, v, r (n, 6)."""

    times: Array
    motions: Array


def motions_of(connection: Connection) -> Samples | None:
    """The measured motion of a connection, with velocities along the hull; None without one."""
    state, twist = connection.of("odometry", "pose"), connection.of("twist")
    if state is None or "x" not in state.columns or len(state.received) < 3:
        return None
    times = times_of(state)
    keep = np.concatenate(([True], np.diff(times) > 0.0))
    columns = [state.columns[name] for name in ("x", "y", "psi")]
    source = twist if twist is not None else state
    if "u" not in source.columns:
        return None
    at = times if source is state else times_of(source)
    columns += [np.interp(times, at, source.columns[name]) if source is not state else source.columns[name] for name in "uvr"]
    motions = np.column_stack(columns).astype(float)[keep]
    if not np.isfinite(motions).all():
        return None
    if connection.twist_frame == "parent":
        motions = along_hull(motions)
    return Samples(times[keep], motions)


def along_hull(motions: Array, back: bool = False) -> Array:
    """Motions whose u and v are along x and y, with those along the hull; the other way round if `back`."""
    c, s = np.cos(motions[:, 2]), np.sin(motions[:, 2]) * (-1.0 if back else 1.0)
    u, v = motions[:, 3], motions[:, 4]
    return np.column_stack((motions[:, :3], c * u + s * v, -s * u + c * v, motions[:, 5]))


def rates(samples: Samples) -> tuple[Array, Array]:
    """Velocities of x, y and psi block by block: by the positions, and as measured; each (m, 3)."""
    t, motions = samples
    c, s = np.cos(motions[:, 2]), np.sin(motions[:, 2])
    u, v, r = motions[:, 3:].T
    world = np.column_stack((c * u - s * v, s * u + c * v, r))
    steps = 0.5 * (world[1:] + world[:-1]) * np.diff(t)[:, None]
    integral = np.vstack((np.zeros(3), np.cumsum(steps, axis=0)))
    place = np.column_stack((motions[:, :2], np.unwrap(motions[:, 2])))
    # Means over blocks are even with unequal intervals if the times are averaged as well.
    each = means(t, np.column_stack((t, place, integral)))
    changes = np.diff(each, axis=0) / np.diff(each[:, :1], axis=0)
    return changes[:, 1:4], changes[:, 4:]


def means(times: Array, columns: Array, width: float = BLOCK) -> Array:
    """Means of columns over blocks of a width, s, that have samples."""
    block = ((times - times[0]) / width).astype(int)
    starts = np.flatnonzero(np.concatenate(([True], np.diff(block) > 0)))
    counts = np.diff(np.append(starts, len(times)))
    return np.asarray(np.add.reduceat(columns, starts, axis=0) / counts[:, None])


def headings(samples: Samples) -> Array:
    """Headings between the blocks of `rates`."""
    each = means(samples.times, np.unwrap(samples.motions[:, 2])[:, None])[:, 0]
    return np.asarray(0.5 * (each[1:] + each[:-1]))


def without_jumps(samples: Samples, least: float, jitter: float) -> tuple[Samples, Array]:
    """Samples whose positions do not jump, and the sizes of the jumps, m.

    A step of the positions is a jump where it differs from that of the velocities by some length and by much more than usual.
    Positions that are held, as between the fixes of a receiver that is slower than the odometry, have no usual difference.
    `least`: the least jump, m. `jitter`: how many times the median difference a jump is.
    """
    t, motions = samples
    dt = np.diff(t)
    c, s = np.cos(motions[1:, 2]), np.sin(motions[1:, 2])
    u, v = motions[1:, 3], motions[1:, 4]
    steps = np.diff(motions[:, :2], axis=0)
    error = steps - np.column_stack((c * u - s * v, s * u + c * v)) * dt[:, None]
    size = np.linalg.norm(error, axis=1)
    new = steps.any(axis=1)
    usual = float(np.median(size[new])) if new.any() else 0.0
    jumps = (size > least + jitter * usual) & (dt < 3.0 * float(np.median(dt)))
    smooth = motions.copy()
    smooth[1:, :2] -= np.cumsum(error * jumps[:, None], axis=0)
    return Samples(t, smooth), size[jumps]


def noises(samples: Samples, declared: tuple[float, float]) -> tuple[float, float]:
    """Standard deviation of a sample of the position, m, and of the heading, rad: as declared or, if that is larger, as measured.

    White noise of variance V makes third differences of 20·V, in which a motion hardly counts; the median does without jumps.
    """
    columns = *samples.motions[:, :2].T, np.unwrap(samples.motions[:, 2])
    found = [
        float(np.median(np.abs(np.diff(each, 3)))) / (0.6745 * math.sqrt(20.0)) if len(each) > 3 else 0.0 for each in columns
    ]
    return max(found[0], found[1], declared[0]), max(found[2], declared[1])


def sample_rate(samples: Samples) -> float:
    """Rate of the samples with a new position, Hz; a receiver may be slower than the odometry."""
    t, motions = samples
    return float(max(np.diff(motions[:, :2], axis=0).any(axis=1).sum(), 1)) / float(t[-1] - t[0])


CURRENT = 1.5  # speed with which wind and current may carry a boat, m/s


def carried(psi: Array) -> float:
    """The mean velocity in its own frame, m/s, that wind and current may give a boat with some headings: 0 in full circles."""
    return CURRENT * float(abs(np.exp(1j * psi).mean()))
