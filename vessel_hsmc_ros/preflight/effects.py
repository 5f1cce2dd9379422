"""What a command does to a velocity: its sign, its size and how certain they are, by the equation of motion.

The rate of surge or yaw is fitted by the equation of motion, not by the command alone, as turning and damping change with it:

    du/dt = a·X + b1·u + b2·|u|u + b3·v·r + b4·r² + c,      dr/dt = a·N + b1·r + b2·|r|r + b3·u·v + b4·u·r + b5·X + c

with c = c0 + c1·cos(psi) + c2·sin(psi) of wind and current. Both sides are smoothed alike, which keeps a linear equation.
A sign is shown where the command explains a good part of what the other terms leave over, in each third of the evidence, and
every lag of the drives that fits as well shows the same, with a velocity that is damped. The deviation of an effect counts that
residuals are correlated (Newey and West, Econometrica 55, 1987).
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.preflight.measured_motion import carried

GRID = 0.1  # interval to which motion and commands are brought, s
WIDTHS = (2, 4, 8, 16, 32, 64)  # numbers of intervals over which they are smoothed, until noise does not count
LEAST_WIDTHS = 6  # least length of a record, in widths of smoothing
NOISE_SHARE = 0.35  # share of the measured accelerations that may be noise
LAGS = tuple((lag, dead) for lag in (0.0, 0.6, 1.5) for dead in (0.0, 0.5, 1.0))  # time constants and dead times of drives, s
SURE, SURE_PART = 6.0, 2.0  # deviations from which on an effect is certain, in all and in each third of the evidence
EXPLAINED = 0.5  # least share of what the equation leaves over that the command explains
CLOSE = 1.3  # lags whose residuals are larger by at most this factor fit as well as the best one
ACCURACY = 0.02  # share to which the terms of the equation are measured: what is smaller shows nothing
LEAST_FREE = 0.005

LEAST_ROWS = 20


class Motion(NamedTuple):
    """A motion and its commands on a grid, smoothed alike; each (n,).

    Attributes:
        u, v, r: Velocities.
        du, dr: Their rates.
        psi: Heading.
        width: Intervals of smoothing.
    """

    u: Array
    v: Array
    r: Array
    du: Array
    dr: Array
    psi: Array
    width: int


class Effect(NamedTuple):
    """What a command does."""

    sign: int  # 0 where it is not shown
    slope: float = math.nan  # acceleration by a unit of the command
    deviation: float = math.inf  # standard deviation of the slope
    explained: float = 0.0  # share of what the other terms leave over that the command explains


def mean(values: Array, w: int) -> Array:
    """Means over w intervals, by the trapezoidal rule, along the first axis."""
    total = np.concatenate((np.zeros((1, *values.shape[1:])), np.cumsum(0.5 * (values[1:] + values[:-1]), axis=0)))
    return np.asarray((total[w:] - total[:-w]) / w)


def slope(values: Array, w: int) -> Array:
    """Rates over w intervals, at the same times as the means."""
    return np.asarray((values[w:] - values[:-w]) / (w * GRID))


def smoothed(poses: Array, w: int) -> Motion:
    """The motion of poses x, y, psi on the grid, (n, 3), smoothed over w intervals."""
    places = mean(poses, w)
    velocities, psi = slope(places, w), mean(places[:, 2], w)
    c, s = np.cos(psi), np.sin(psi)
    body = np.column_stack(
        (c * velocities[:, 0] + s * velocities[:, 1], c * velocities[:, 1] - s * velocities[:, 0], velocities[:, 2])
    )
    rates, means = slope(body, w), mean(body, w)
    return Motion(means[:, 0], means[:, 1], means[:, 2], rates[:, 0], rates[:, 2], mean(psi, w), w)


def least_smoothed(poses: Array, noise: float, rate: float, k: int) -> Motion | None:
    """The motion, smoothed until noise does not count; None if it always does.

    Second differences of means of m samples over a width W have the variance 6·noise²/(m·W⁴). `poses`: x, y, psi on the grid,
    (n, 3). `noise`: standard deviation of a sample, m or rad. `rate`: of the samples, Hz. `k`: 0 for the rate of surge, 1 for
    that of yaw.
    """
    for w in WIDTHS:
        width = w * GRID
        if len(poses) < LEAST_WIDTHS * w:
            return None
        if width * rate < 2.0:
            continue
        motion = smoothed(poses, w)
        size = float(np.std(motion.dr if k else motion.du))
        if math.sqrt(6.0 / (rate * width)) * noise / width**2 < NOISE_SHARE * size:
            return motion
    return None


def smoothed_command(command: Array, w: int) -> Array:
    """A command on the grid, smoothed as the rates of a motion are."""
    return mean(mean(mean(command, w), w), w)


def late(command: Array, lag: float, dead: float) -> Array:
    """A command on the grid as drives with a time constant and a dead time, s, carry it out."""
    shift = round(dead / GRID)
    moved = np.concatenate((np.repeat(command[:1], shift), command[: len(command) - shift]))
    if lag == 0.0:
        return np.asarray(moved)
    taps = np.exp(-np.arange(0.0, 5.0 * lag, GRID) / lag)
    taps /= taps.sum()
    before = np.repeat(moved[:1], len(taps) - 1)
    return np.asarray(np.convolve(np.concatenate((before, moved)), taps, "valid"))


def effect(commands: Sequence[Array], rate: Array, velocity: Array, rest: Array, width: int) -> Effect:
    """The effect of a command on a rate, by the lags with which the equation fits best.

    `commands`: the command, and others that may act on the rate as well, on the grid, (n,) each. `rate`: smoothed, (m,).
    `velocity`: that of the rate, which is damped, smoothed, (m,). `rest`: the other terms of the equation, smoothed, (m, k).
    `width`: number of intervals of smoothing.
    """
    tried = []
    y, fast = rate[::width], float(np.abs(velocity).mean())
    terms = np.column_stack((velocity, np.abs(velocity) * velocity, rest))[::width]
    for lag, dead in LAGS:
        x, *others = (smoothed_command(late(each, lag, dead), width)[::width] for each in commands)
        known = np.column_stack((terms, *others))
        left, found = partial(x, y, basis(known))
        if math.isnan(found.slope):  # with this lag, which may be the true one, nothing separates it from the other terms
            return Effect(0)
        whole = np.column_stack((x, known))
        scale = np.maximum(np.linalg.norm(whole, axis=0), 1e-300)
        fit = np.linalg.lstsq(whole / scale, y, rcond=ACCURACY)[0] / scale
        tried.append((left, found, bool(fit[1] + fast * fit[2] <= 0.0)))
    least = min(left for left, _, _ in tried)
    close = [(found, valid) for left, found, valid in sorted(tried, key=lambda each: each[0]) if left <= CLOSE * least]
    best = next((found for found, valid in close if valid), Effect(0))
    return best if {found.sign for found, _ in close} == {best.sign} else best._replace(sign=0)


def basis(columns: Array) -> Array:
    """Orthonormal columns that span the given ones."""
    scaled = columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    left, values, _ = np.linalg.svd(scaled, full_matrices=False)
    return np.asarray(left[:, values > ACCURACY * values[0]])


def partial(x: Array, y: Array, others: Array) -> tuple[float, Effect]:
    """The sum of squares that is left of y, and the effect of x beyond that of others, certain where both halves of it agree."""
    x_rest, y_rest = (each - others @ (others.T @ each) for each in (x, y))
    weight = x_rest * x_rest
    total, whole = float(weight.sum()), float(y_rest @ y_rest)
    if len(x) < others.shape[1] + LEAST_ROWS or total < LEAST_FREE * float(x @ x) or total == 0.0:
        return whole, Effect(0)
    a = float(x_rest @ y_rest) / total
    residual = y_rest - a * x_rest
    left = float(residual @ residual)
    scores = x_rest * residual
    free = len(x) / (len(x) - others.shape[1] - 1)
    ends = np.searchsorted(np.cumsum(weight), np.array([1.0, 2.0]) * total / 3.0)
    parts = [slice(0, ends[0]), slice(ends[0], ends[1]), slice(ends[1], None)]
    sure = [abs_ratio(a, deviation(scores, free) / total) > SURE]
    for part in parts:
        inside = float(weight[part].sum())
        a_part = float(x_rest[part] @ y_rest[part]) / max(inside, 1e-300)
        scores_part = x_rest[part] * (y_rest[part] - a * x_rest[part])
        sure.append(a_part * a > 0.0 and abs_ratio(a_part, deviation(scores_part, free) / max(inside, 1e-300)) > SURE_PART)
    explained = 1.0 - left / whole if whole > 0.0 else 0.0
    decided = all(sure) and explained > EXPLAINED
    return left, Effect(int(np.sign(a)) if decided else 0, a, deviation(scores, free) / total, explained)


def abs_ratio(value: float, by: float) -> float:
    """The size of a value in deviations."""
    return abs(value) / max(by, 1e-300)


def deviation(scores: Array, free: float) -> float:
    """Standard deviation of a sum of scores that are correlated over some lags (Newey and West)."""
    total = float(scores @ scores)
    lags = min(max(4, len(scores) // 8), len(scores) - 1)
    for lag in range(1, lags + 1):
        total += 2.0 * max((1.0 - lag / (lags + 1.0)) * float(scores[lag:] @ scores[:-lag]), 0.0)
    return math.sqrt(free * total)


def tracked(command: Array, measured: Array, steady: Array, lags: Sequence[int]) -> int:
    """The sign with which a velocity follows its command over some lags; 0 where one of them or half of the data disagree.

    A steady load, such as a current, moves a boat as well. It must not explain what the velocity has in common with the
    command, unless that is close to the command itself. `command`, `measured`: the command and the velocity, smoothed alike,
    (n,). `steady`: what a steady load adds to the velocity, by its components, (n, k). `lags`: numbers of intervals.
    """
    found = []
    for lag in lags:
        c, m, load = command[: len(command) - lag], measured[lag:], steady[lag:]
        half = np.searchsorted(np.cumsum(c * c), 0.5 * float(c @ c))
        found.append([likeness(c[part], m[part], load[part]) for part in (slice(None), slice(0, half), slice(half, None))])
    alike, gain, beyond, same, error = np.moveaxis(np.array(found), 2, 0)
    known = (error.max(axis=1) < CLOSE_BY).any()
    if (alike > ALIKE).all() and (gain < LARGEST_GAIN).all() and (same > MOSTLY).all() and ((beyond > BEYOND).all() or known):
        return 1
    return -1 if (alike < -ALIKE).all() and (same < 1.0 - MOSTLY).all() and (beyond < -BEYOND).all() else 0


def likeness(command: Array, measured: Array, steady: Array) -> tuple[float, float, float, float, float]:
    """How a velocity is like its command: see `tracked`.

    Returns:
        The cosine of both; their ratio; the cosine of what a steady load leaves of both; the share of the time with a command in
        which both have one sign; and the difference relative to the velocity.
    """
    if len(command) <= steady.shape[1] + 1:
        return 0.0, 0.0, 0.0, 0.5, math.inf
    basis_of_load = basis(steady)
    c_rest, m_rest = (each - basis_of_load @ (basis_of_load.T @ each) for each in (command, measured))
    power = float(command @ command)
    beyond = cosine(c_rest, m_rest) if float(c_rest @ c_rest) > LEAST_CHANGE * power else 0.0
    during = np.abs(command) > LEAST_COMMAND * math.sqrt(power / len(command))
    same = float((command[during] * measured[during] > 0.0).mean()) if during.any() else 0.5
    error = float(np.linalg.norm(command - measured)) / max(float(np.linalg.norm(measured)), 1e-300)
    return cosine(command, measured), float(command @ measured) / max(power, 1e-300), beyond, same, error


def cosine(one: Array, other: Array) -> float:
    """The cosine of two columns; 0 if one of them is 0."""
    return float(one @ other) / max(float(np.linalg.norm(one) * np.linalg.norm(other)), 1e-300)


def driven(force: Array, u: Array, psi: Array, slow: float) -> int:
    """The sign of a speed that a force of one sign keeps up on headings of which no current explains it; 0 without one."""
    amount = float(np.abs(force).sum())
    side = float(force.sum())
    if amount == 0.0 or abs(side) < ONE_SIDED * amount:
        return 0
    signs = []
    half = len(u) // 2
    for part in (slice(None), slice(0, half), slice(half, None)):
        speed = math.copysign(1.0, side) * float(u[part].mean())
        same = float((np.sign(u[part]) == np.sign(u[part].mean())).mean())
        signs.append(int(math.copysign(1, speed)) if abs(speed) > carried(psi) + slow and same > ALWAYS else 0)
    return signs[0] if len(set(signs)) == 1 else 0


ALIKE, LARGEST_GAIN = 0.6, 2.0
"""Least likeness, a cosine, of a velocity and its command, and the largest ratio of them in loops that work."""

BEYOND, LEAST_CHANGE = 0.5, 0.02
"""Least likeness of what a steady load leaves of both, and least share of the command's square that it has to leave."""

MOSTLY, LEAST_COMMAND = 0.8, 0.1
"""Share of the time with a command for which both have one sign, and the share of its root mean square from which it is one."""

CLOSE_BY = 0.5  # difference of velocity and command, relative to the velocity, below which no load explains it
ONE_SIDED, ALWAYS = 0.95, 0.9  # shares of a force that has one sign, and of the time for which a boat goes the same way
