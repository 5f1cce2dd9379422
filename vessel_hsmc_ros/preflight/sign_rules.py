"""Rules for commands: a positive force drives ahead, a positive moment to port, both about as far as the ship's inertia has it.

Each verdict is one of three: right, wrong, or not shown yet. Who obeys a wrong one exchanges wires, so that it takes proof.
The rate of surge or yaw is fitted by the equation of motion, not by the command alone, as turning and damping change with it:

    du/dt = a·X + b1·u + b2·|u|u + b3·v·r + b4·r² + c,      dr/dt = a·N + b1·r + b2·|r|r + b3·u·v + b4·u·r + b5·X + c

with c = c0 + c1·cos(psi) + c2·sin(psi) of wind and current. Both sides are smoothed alike, which keeps a linear equation.
A sign is shown where the command explains a good part of what the other terms leave over, in each third of the evidence, and
every lag of the drives that fits as well shows the same, with a velocity that is damped. The deviation of an effect counts that
residuals are correlated (Newey and West, Econometrica 55, 1987).
"""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.preflight.clocks import times_of
from vessel_hsmc_ros.preflight.connection import OK, TODO, WRONG, Connection, Finding, Topic
from vessel_hsmc_ros.preflight.motion import Complex, Samples, carried, motions_of, noises, parts, sample_rate, slow

GRID = 0.1  # interval to which motion and commands are brought, s
WIDTHS = (2, 4, 8, 16, 32, 64)  # numbers of intervals over which they are smoothed, until noise does not count
LEAST_WIDTHS = 6  # least length of a record, in widths of smoothing
NOISE_SHARE = 0.35  # share of the measured accelerations that may be noise
LAGS = tuple((lag, dead) for lag in (0.0, 0.6, 1.5) for dead in (0.0, 0.5, 1.0))  # time constants and dead times of drives, s
SURE, SURE_PART = 6.0, 2.0  # deviations from which on an effect is certain, in all and in each third of the evidence
EXPLAINED = 0.5  # least share of what the equation leaves over that the command explains
CLOSE = 1.3  # lags whose residuals are larger by at most this factor fit as well as the best one
ACCURACY = 0.02  # share to which the terms of the equation are measured: what is smaller shows nothing
LEAST_FREE, LEAST_ROWS = 0.005, 20
"""Least share of the command's square that the other terms must leave, and least number of equations beyond that of the terms."""

ALIKE, LARGEST_GAIN = 0.6, 2.0
"""Least likeness, a cosine, of a velocity and its command, and the largest ratio of them in loops that work."""

BEYOND, LEAST_CHANGE = 0.5, 0.02
"""Least likeness of what a steady load leaves of both, and least share of the command's square that it has to leave."""

MOSTLY, LEAST_COMMAND = 0.8, 0.1
"""Share of the time with a command for which both have one sign, and the share of its root mean square from which it is one."""

CLOSE_BY = 0.5  # difference of velocity and command, relative to the velocity, below which no load explains it
ONE_SIDED, ALWAYS = 0.95, 0.9  # shares of a force that has one sign, and of the time for which a boat goes the same way

WRENCH, VELOCITY = {"force": "surge force", "moment": "yaw moment"}, {"u": "surge speed", "r": "yaw rate"}
"""Columns of the forms of command, and what they are."""

EFFECTS = (
    ("ahead", "astern", "the drives are reversed, or x points astern"),
    ("to port", "to starboard", "steering, port and starboard drives are exchanged, or the state is NED/FRD"),
)

SCALED, CLEAR = 8.0, 0.8
"""How many times the effect of the declared inertia is a mistake, as lag, limits and a current account for less; and the share of
the motion that a command must explain for that."""

INERTIAS = ("surge_inertia", "yaw_inertia")

DELAYS = (0.0, 0.5, 1.0, 2.0)  # times after which velocities follow their commands, s
STEPWISE = 0.9  # share of the time for which a command is constant that a person or a pulse gives, and no law


class Motion(NamedTuple):
    """A motion on the grid, smoothed; each (n,)."""

    hull: Complex  # velocity along the hull, u + i·v
    r: Array
    psi: Array
    rates: tuple[Array, Array]  # of u and of r
    width: int  # intervals of smoothing

    @property
    def velocities(self) -> tuple[Array, Array]:
        """Of surge and of yaw: u and r."""
        return self.hull.real, self.r


class Effect(NamedTuple):
    """What a command does."""

    sign: int  # 0 where it is not shown
    slope: float = math.nan  # acceleration by a unit of the command
    deviation: float = math.inf  # standard deviation of the slope
    explained: float = 0.0  # share of what the other terms leave over that the command explains


def mean(values: Complex, w: int) -> Complex:
    """Means over w intervals, by the trapezoidal rule."""
    total = np.concatenate(([0.0], np.cumsum(0.5 * (values[1:] + values[:-1]))))
    return np.asarray((total[w:] - total[:-w]) / w)


def slope(values: Complex, w: int) -> Complex:
    """Rates over w intervals, at the same times as the means."""
    return np.asarray((values[w:] - values[:-w]) / (w * GRID))


def smoothed(place: Complex, psi: Array, w: int) -> Motion:
    """The motion of places x + i·y and headings on the grid, (n,) each, smoothed over w intervals."""
    velocity, r = slope(mean(place, w), w), slope(mean(psi, w), w)
    psi = mean(mean(psi, w), w)
    hull = velocity * np.exp(-1j * psi)
    return Motion(mean(hull, w), mean(r, w), mean(psi, w), (slope(hull, w).real, slope(r, w)), w)


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
    sure = [abs_ratio(a, deviation(scores, free) / total) > SURE]
    for part in parts(weight, 3)[1:]:
        inside = max(float(weight[part].sum()), 1e-300)
        a_part = float(x_rest[part] @ y_rest[part]) / inside
        scores_part = x_rest[part] * (y_rest[part] - a * x_rest[part])
        sure.append(a_part * a > 0.0 and abs_ratio(a_part, deviation(scores_part, free) / inside) > SURE_PART)
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
        found.append([likeness(c[part], m[part], load[part]) for part in parts(c * c)])
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
    for part in parts(np.ones(len(u))):
        speed = math.copysign(1.0, side) * float(u[part].mean())
        same = float((np.sign(u[part]) == np.sign(u[part].mean())).mean())
        signs.append(int(math.copysign(1, speed)) if abs(speed) > carried(psi) + slow and same > ALWAYS else 0)
    return signs[0] if len(set(signs)) == 1 else 0


def judge_signs(connection: Connection, doubted: str = "") -> Iterator[Finding]:
    """Whether force and moment, or speed and yaw rate where these are commanded, have moved the boat in their direction."""
    samples, output = motions_of(connection), connection.of("output")
    by_velocity = output is not None and "u" in output.columns
    command, names = (output, VELOCITY) if by_velocity else (connection.of("command", "applied"), WRENCH)
    if command is None or samples is None or not set(names) <= set(command.columns):
        return
    inertias = (math.nan, math.nan) if by_velocity else connection.inertias
    recorded = record(samples, command, [*names], connection)
    found = velocity_effect if by_velocity else wrench_effect
    for k, (what, (right, opposite, cause)) in enumerate(zip(names.values(), EFFECTS, strict=True)):
        about = f"sign of {what.split()[1]}"
        if doubted:
            yield Finding(TODO, about, f"not judged by a motion whose {doubted} is wrong: correct that first")
            continue
        motion = recorded.motion(k)
        seen = Effect(0) if motion is None else found(recorded, motion, k)
        if seen.sign > 0:
            yield Finding(OK, about, f"positive {what} drives {right}")
            yield from judge_size(what, seen, inertias[k], f"controller.vessel.{INERTIAS[k]}")
        elif seen.sign < 0:
            yield Finding(WRONG, about, f"positive {what} drives {opposite}: {cause}")
        else:
            yield Finding(TODO, about, f"not shown by what the {what} has done so far: {remedy(bool(k), by_velocity)}")


def remedy(turns: bool, by_velocity: bool) -> str:
    """What shows a sign that the motion so far does not show."""
    steps = "turns to both sides at a steady throttle" if turns else "steps of the throttle on a straight course"
    pulse = "0.5,0.2" if by_velocity else "30,20"
    return f"drive {steps}, each some seconds long, and check then or a bag of that; or `vessel-hsmc check --pulse {pulse}`"


def judge_size(what: str, found: Effect, inertia: float, name: str) -> Iterator[Finding]:
    """Whether the effect of a command is about that of the declared inertia; what is not known is nan."""
    times, spread = found.slope * inertia, 3.0 * found.deviation * inertia
    if found.explained > CLEAR and (times - spread > SCALED or times + spread < 1.0 / SCALED):
        cause = f"is it scaled or limited on its way to the drives, or {name} of another ship?"
        yield Finding(WRONG, f"size of {what.split()[1]}", f"the {what} has {times:.2g} times the effect of its number: {cause}")


class Record(NamedTuple):
    """Motion and commands on one grid."""

    place: Complex  # x + i·y, (n,)
    psi: Array  # (n,)
    commands: tuple[Array, Array]  # of surge and of yaw, (n,) each
    noises: tuple[float, float]  # standard deviations of a sample of the position, m, and of the heading, rad
    rate: float  # of the samples, Hz
    slow: tuple[float, float]  # speed and yaw rate below which nothing is concluded, m/s and rad/s

    def motion(self, k: int) -> Motion | None:
        """The motion, smoothed until the noise of surge (0) or yaw (1) does not count; None if it always does.

        Second differences of means of m samples over a width W have the variance 6·noise²/(m·W⁴).
        """
        for w in WIDTHS:
            width = w * GRID
            if len(self.psi) < LEAST_WIDTHS * w:
                return None
            if width * self.rate < 2.0:
                continue
            motion = smoothed(self.place, self.psi, w)
            noise = math.sqrt(6.0 / (self.rate * width)) * self.noises[k] / width**2
            if noise < NOISE_SHARE * float(np.std(motion.rates[k])):
                return motion
        return None


def record(samples: Samples, command: Topic, names: Sequence[str], connection: Connection) -> Record:
    """The motion and the commands of two names of a connection."""
    t = samples.times
    grid = np.arange(t[0], t[-1], GRID)
    return Record(
        np.interp(grid, t, samples.place),
        np.interp(grid, t, samples.psi),
        (held(command, names[0], grid), held(command, names[1], grid)),
        noises(samples, connection.noise),
        sample_rate(samples),
        slow(connection.length),
    )


def held(command: Topic, name: str, grid: Array) -> Array:
    """A command at some times: the last value before each, and 0 before the first and from a second after the last."""
    times = times_of(command)
    index = np.searchsorted(times, grid, side="right") - 1
    fresh = (index >= 0) & (grid - times[np.maximum(index, 0)] < 1.0)
    return np.where(fresh, command.columns[name][np.maximum(index, 0)], 0.0)


def velocity_effect(recorded: Record, motion: Motion, k: int) -> Effect:
    """Whether surge speed (0) or yaw rate (1) follow their commands, or, of commands in steps, what these do."""
    velocity, command = motion.velocities[k], recorded.commands[k]
    lags = [round(delay / GRID) for delay in DELAYS]
    if len(velocity) < 2 * lags[-1] or math.sqrt(float((velocity**2).mean())) < recorded.slow[k]:
        return Effect(0)
    constant = np.ones(len(velocity))
    current = np.cos(motion.psi), np.sin(motion.psi)  # along the hull
    load = np.column_stack((constant,) if k else current)
    found = tracked(smoothed_command(command, motion.width), velocity, load, lags)
    if found or float((np.diff(command) == 0.0).mean()) < STEPWISE:  # else it may follow from the motion
        return Effect(found)
    rest = np.column_stack((constant,) if k else (constant, *current))
    return Effect(effect([command], motion.rates[k], velocity, rest, motion.width).sign)


def wrench_effect(recorded: Record, motion: Motion, k: int) -> Effect:
    """The effect of the surge force (0) or of the yaw moment (1)."""
    u, v, r, psi = motion.hull.real, motion.hull.imag, motion.r, motion.psi
    rest = np.column_stack((np.ones(len(r)), np.cos(psi), np.sin(psi), *((u * v, u * r) if k else (v * r, r * r))))
    force, moment = recorded.commands
    commands = (moment, force) if k else (force,)
    found = effect(commands, motion.rates[k], motion.velocities[k], rest, motion.width)
    steady = 0 if k else driven(smoothed_command(force, motion.width), u, psi, recorded.slow[0])
    if not steady:
        return found
    return found._replace(sign=steady if found.sign in (0, steady) else 0)
