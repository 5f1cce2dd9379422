"""The measured motion of a connection: places, x + i·y, and velocities along the hull, u + i·v, as complex numbers.

With the heading psi, (u + i·v)·exp(i·psi) is the velocity over ground. It follows from the positions as well.
"""

import math
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.safety.monitors import SLOW_SPEED
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.kinematics import GRAVITY
from vessel_hsmc_ros.preflight.clocks import times_of
from vessel_hsmc_ros.preflight.connection import Connection

Complex = NDArray[Any]  # of complex numbers
Mask = NDArray[np.bool_]

BLOCK = 1.0  # length of the blocks whose means are compared, s
GAP = 10.0  # time without odometry after which a motion is another one, s
CURRENT = 1.5  # speed with which wind and current may carry a boat, m/s


class Samples(NamedTuple):
    """Samples of a motion, (n,) each."""

    times: Array  # s
    place: Complex  # x + i·y, m
    psi: Array  # heading without steps of a turn, rad
    hull: Complex  # u + i·v, m/s
    r: Array  # yaw rate, rad/s

    @property
    def ground(self) -> Complex:
        """Measured velocity over ground, along x and y, m/s."""
        return np.asarray(self.hull * np.exp(1j * self.psi))


class Rates(NamedTuple):
    """A motion from block to block, (m,) each."""

    velocity: Complex  # over ground, along x and y, m/s
    r: Array  # yaw rate, rad/s
    psi: Array  # heading, rad


def motions_of(connection: Connection) -> Samples | None:
    """The measured motion of a connection: its longest part without a gap; None without one."""
    state, twist = connection.of("odometry", "pose"), connection.of("twist")
    if state is None or "x" not in state.columns or len(state.received) < 3:
        return None
    source, times = twist or state, times_of(state)
    if "u" not in source.columns:
        return None
    at = times_of(source)
    u, v, r = (source.columns[name] if source is state else np.interp(times, at, source.columns[name]) for name in "uvr")
    x, y, psi = (state.columns[name] for name in ("x", "y", "psi"))
    keep = longest_part(times)
    samples = Samples(times[keep], (x + 1j * y)[keep], psi[keep], (u + 1j * v)[keep], r[keep])
    if len(samples.times) < 3 or not all(np.isfinite(each).all() for each in samples):
        return None
    if connection.twist_frame == "parent":
        samples = samples._replace(hull=samples.hull * np.exp(-1j * samples.psi))
    return samples._replace(psi=np.unwrap(samples.psi))


def longest_part(times: Array) -> Mask:
    """Where the samples are of the longest part without a gap or a step of the clock, in the order of their times."""
    part = np.cumsum(np.abs(np.diff(times, prepend=times[0])) > GAP)
    inside = part == np.bincount(part).argmax()
    latest = np.maximum.accumulate(np.where(inside, times, -math.inf))
    return np.asarray(inside & (times > np.concatenate(([-math.inf], latest[:-1]))))


def rates(samples: Samples) -> tuple[Rates, Rates]:
    """The motion from block to block by the positions, and as measured."""
    t = samples.times

    def integral(values: Complex) -> Complex:
        return np.concatenate(([0.0], np.cumsum(0.5 * (values[1:] + values[:-1]) * np.diff(t))))

    columns = t, samples.place, samples.psi, integral(samples.ground), integral(samples.r)
    # Means over blocks are even with unequal intervals if the times are averaged as well.
    each = means(t, np.column_stack(columns))
    _, moved, turned, velocity, r = (np.diff(each, axis=0) / np.diff(each[:, :1], axis=0)).T
    psi = 0.5 * (each[1:, 2] + each[:-1, 2]).real
    return Rates(moved, turned.real, psi), Rates(velocity, r.real, psi)


def means(times: Array, columns: Array, width: float = BLOCK) -> Array:
    """Means of columns over blocks of a width, s, that have samples."""
    block = ((times - times[0]) / width).astype(int)
    starts = np.flatnonzero(np.concatenate(([True], np.diff(block) > 0)))
    counts = np.diff(np.append(starts, len(times)))
    return np.asarray(np.add.reduceat(columns, starts, axis=0) / counts[:, None])


def without_jumps(samples: Samples, least: float, jitter: float) -> tuple[Samples, Array]:
    """Samples whose positions do not jump, and the sizes of the jumps, m.

    A step of the positions is a jump where it differs from that of the velocities by some length and by much more than usual.
    Positions that are held, as between the fixes of a receiver that is slower than the odometry, have no usual difference.
    `least`: the least jump, m. `jitter`: how many times the median difference a jump is.
    """
    dt, steps = np.diff(samples.times), np.diff(samples.place)
    error = steps - samples.ground[1:] * dt
    size, new = np.abs(error), steps != 0.0
    usual = float(np.median(size[new])) if new.any() else 0.0
    jumps = (size > least + jitter * usual) & (dt < 3.0 * float(np.median(dt)))
    corrections = np.concatenate(([0.0], np.cumsum(error * jumps)))
    return samples._replace(place=samples.place - corrections), size[jumps]


def noises(samples: Samples, declared: tuple[float, float]) -> tuple[float, float]:
    """Standard deviation of a sample of the position, m, and of the heading, rad: as declared or, if that is larger, as measured.

    White noise of variance V makes third differences of 20·V, in which a motion hardly counts; the median does without jumps.
    """
    columns = samples.place.real, samples.place.imag, samples.psi
    x, y, psi = (
        float(np.median(np.abs(np.diff(each, 3)))) / (0.6745 * math.sqrt(20.0)) if len(each) > 3 else 0.0 for each in columns
    )
    return max(x, y, declared[0]), max(psi, declared[1])


def sample_rate(samples: Samples) -> float:
    """Rate of the samples with a new position, Hz; a receiver may be slower than the odometry."""
    return float(max((np.diff(samples.place) != 0.0).sum(), 1)) / float(samples.times[-1] - samples.times[0])


def slow(length: float) -> tuple[float, float]:
    """Speed, m/s, and yaw rate, rad/s, of a ship of a length, m, below which nothing is concluded."""
    speed = SLOW_SPEED * math.sqrt(GRAVITY * length)
    return speed, speed / length


def carried(psi: Array) -> float:
    """The mean velocity in its own frame, m/s, that wind and current may give a boat with some headings: 0 in full circles."""
    return CURRENT * float(abs(np.exp(1j * psi).mean()))


def parts(weights: Array, count: int = 2) -> list[slice]:
    """The whole of some evidence, and its parts of equal weight: a verdict must hold in each of them."""
    total = np.cumsum(weights)
    ends = [0, *np.searchsorted(total, total[-1] * np.arange(1, count) / count, side="right"), len(weights)]
    return [slice(None), *(slice(begin, end) for begin, end in pairwise(ends))]
