"""The dynamics of surge force and yaw moment: as declared or assumed, in discrete time, and as identified from the turns.

What the actuators make of a law's commands: dead time, lag and rate limit as the law knows them, and the lead against the lag.

| symbol | meaning | unit |
|---|---|---|
| tau_c | commanded force or moment, within its limit | N, N·m |
| tau | modelled force or moment that acts on the hull during a period | N, N·m |
| tau_w | force or moment that the law wants to act | N, N·m |
| T, T_l, T_f | control period, lag, and the lag that remains with the lead | s |
| n | dead time in periods | - |

    tau(k) = tau(k-1) + clip((1 - exp(-T/T_l))·(tau_c(k-n) - tau(k-1)), rate·T)

With the command tau_c = tau + (1 - exp(-T/T_f))/(1 - exp(-T/T_l))·(tau_w - tau) the actuator approaches tau_w with the lag T_f
instead of T_l, as far as limit and rate allow.

The dynamics of surge force and yaw moment, as a law takes them: declared, or assumed where nothing is.

| symbol | meaning | unit |
|---|---|---|
| T | time of the ship's turns, sqrt(m33/tau_2max) | s |
| T_l, T_d | lag and dead time of an input | s |
| T_r | lag that remains with the lead against it | s |
| T_f | time from zero to the limit, limit/rate | s |

Identification of the actuators from the ship's own turns: which lag, dead time and rate explain how it turns.

| symbol | meaning | unit |
|---|---|---|
| T, h | unit of time of the ship's turns; interval of the identification, about T/20 | s |
| a_i | yaw acceleration by the commanded moment, as actuator model i delays it | rad/s² |
| x_i, y, z | a_i, measured yaw acceleration and yaw rate, all through the same band-pass filter | rad/s², rad/s², rad/s |
| b, d | declared divided by true yaw inertia; yaw damping | -, 1/s |
| J_i | mean square of what model i leaves unexplained, y - b·x_i + d·z, for its best b and d | rad²/s⁴ |
| theta | memory of the means | s |

A bank of models: every combination of a few lags, dead times and rates, and the declared one, is driven by the same command. The
mean squares and products of x_i, y and z over the time theta give b and d of every model by least squares, and with them J_i. The
declared model stays as long as it explains the motion: another one takes its place only if what it leaves unexplained is a
fraction of what the present one does. Only the yaw moment is identified, because only turns excite the ship all the time; the
surge force is taken to have the same delays.

Without turns nothing is known and nothing changes. A loop that wrong delays make unstable turns the ship, and thereby shows them.

Source of the method, a bank of models of which the best is used: K. S. Narendra and J. Balakrishnan, Adaptive control using
multiple models, IEEE Transactions on Automatic Control 42 (1997).
"""

import math
from dataclasses import replace
from itertools import product
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.core.kernel import Array, between, clip, kernel
from vessel_hsmc_ros.core.kinematics import TURN

LARGEST_CHANGE = 1e30
"""Change within a period of an actuator without a rate limit; finite, so that no product with it is undefined."""


class Channel(NamedTuple):
    """The known dynamics of one input in discrete time."""

    limit: float  # largest magnitude
    share: float  # 1 - exp(-T/T_l), the share of a step that is completed in a period
    boost: float  # (1 - exp(-T/T_f))/(1 - exp(-T/T_l)), at least 1
    change: float  # largest change in a period
    delay: int  # dead time in periods, n


def channel(limit: float, lag: float, remaining: float, rate: float, dead_time: float, period: float) -> Channel:
    """The constants of an input.

    `lag`, `remaining`: T_l and T_f <= T_l, s. `rate`: largest rate of change, per second; infinite for none. `dead_time`: dead
    time, s, which is rounded to whole periods. `period`: T, s.
    """
    share, fast = (1.0 if constant == 0.0 else -math.expm1(-period / constant) for constant in (lag, remaining))
    return Channel(limit, share, fast / share, min(rate * period, LARGEST_CHANGE), round(dead_time / period))


@kernel
def lead(tau: float, demand: float, c: Channel) -> float:
    """The command that drives the input from tau towards a demand faster than its lag."""
    if c.share == 1.0:
        return clip(demand, c.limit)
    return clip(tau + c.boost * (demand - tau), c.limit)


@kernel
def applied(tau: float, command: float, c: Channel) -> float:
    """The force or moment that acts in the next period, for the command that arrives at its beginning."""
    if c.share == 1.0 and abs(command - tau) <= c.change:
        return command
    return tau + clip(c.share * (command - tau), c.change)


@kernel
def arriving(queue: Array, row: int, head: int, age: int) -> float:
    """The command of a number of periods ago.

    `queue`: the last commands, a row for each input, shape (2, n + 1). `head`: column of the present period. `age`: number of
    periods, at most n.
    """
    column = head - age
    return float(queue[row, column if column >= 0 else column + queue.shape[1]])


ASSUMED_LAG = 0.22  # the lag in the model of inputs of which nothing is declared, in units of T


class Input(NamedTuple):
    """What the law takes an input for."""

    lag: float  # T_l, s
    remaining: float  # T_r, s
    rate: float  # largest rate of change, N/s or N·m/s, or infinity
    dead_time: float  # T_d, s
    full: float  # T_f, s


class Dynamics(NamedTuple):
    """The dynamics of the two inputs."""

    # surge, yaw: of surge force and yaw moment
    surge: Input
    yaw: Input
    declared: bool  # whether lag, rate and dead time of both inputs are


def unit_time(vessel: KnownVessel) -> float:
    """T, s."""
    return math.sqrt(vessel.yaw_inertia / vessel.yaw_moment_limit)


def dynamics(vessel: KnownVessel) -> Dynamics:
    """The dynamics of the inputs as the model has them."""
    T = unit_time(vessel)
    of_surge = vessel.surge_lag, vessel.surge_force_rate, vessel.surge_dead_time
    of_yaw = vessel.yaw_lag, vessel.yaw_moment_rate, vessel.yaw_dead_time
    given = [value >= 0.0 for value in (*of_surge, *of_yaw)]
    assumed = 0.0 if any(given) else ASSUMED_LAG * T
    surge = _input(*of_surge, vessel.surge_force_limit, assumed, T)
    yaw = _input(*of_yaw, vessel.yaw_moment_limit, assumed, T)
    return Dynamics(surge, yaw, all(given))


def _input(lag: float, rate: float, dead_time: float, limit: float, assumed: float, T: float) -> Input:
    """What the law takes an input for."""
    if lag < 0.0:
        # A lag that is not known is not led against: what is missing may be a dead time, and lead against that oscillates.
        lag = remaining = assumed
    else:
        remaining = max(0.2 * lag, min(lag, 0.05 * T))
    fastest = rate if rate > 0.0 else math.inf
    return Input(lag, remaining, fastest, max(dead_time, 0.0), limit / fastest)


LAGS, DEAD_TIMES = (0.0, 0.06, 0.15, 0.3, 0.6), (0.0, 0.06, 0.14, 0.25, 0.4)
TIMES_TO_FULL = 0.0, 0.3, 0.7, 1.2, 1.8, 2.6  # the models of the bank, in units of T
INTERVAL = 0.05  # h in units of T
BAND = 0.5, 4.0  # lower and upper corner of the band-pass filter, in 1/T: below, disturbances turn the ship; above, noise does
MEMORY, FIRST = 15.0, 7.0  # theta, and the time from which RIGHT holds in full, in units of T
QUIET = 0.006  # root mean square of x_i in 1/T², the yaw acceleration by the full moment, below which nothing is decided
BETTER, WRONG, RIGHT = 0.7, 0.02, 0.4
"""Another model is taken if its J is below BETTER of the present one's, the present one's is above WRONG of the mean square of y,
and its own below RIGHT of that. Before FIRST nothing is taken, or `soon` with a share that is less by the square of the time: a
wide turn at the start shows a quick actuator at once, and what noise explains by chance takes longer. Where not all is declared,
`soon` also takes a model that leaves less than WRONG: however good the guess is, the law is slower as long as it is one."""

TRUSTED = 0.5, 0.03, 0.2  # the same where lag, rate and dead time of both inputs are declared
INERTIA, DAMPING = (0.6, 1.6), 3.0  # range of b, and largest d in 1/T


class Bank(NamedTuple):
    """The models and the constants of the identification."""

    share: Array  # share of the way to a command that model i goes in an interval, (n,)
    change: Array  # its largest change in an interval, rad/s², (n,)
    late: Array  # its dead time in intervals, (n,)
    instant: Array  # whether it follows a command at once, (n,)
    every: int  # control periods in an interval
    h: float  # length of an interval, s
    # low, high, forgotten: steps of the filters in an interval, 1 - exp(-w·h)
    low: float
    high: float
    forgotten: float
    unit: float  # T, s
    inertia: float  # declared yaw inertia, kg·m²
    # better, wrong, right: when another model is taken
    better: float
    wrong: float
    right: float
    guessed: bool  # whether model 0 is not all declared
    soon: bool  # whether a model may be taken before FIRST, and instead of a guess that explains as much
    used: int  # the model that the gains of the law are for; 0 is what is declared


class BankState(NamedTuple):
    """What the identification keeps, written in place."""

    models: Array  # a, the last mean of a, three states of the filter, and the means of x², x·y, x·z of each model, (n, 8)
    measured: Array  # three states of the filter of y and of z, and the means of y², z², y·z, (3, 3)
    commands: Array  # the last mean commands divided by the inertia, the newest at `place`, (k,)
    # last heading, last change of it, sum of commands, control periods, intervals, `place`, best model, shape (7,)
    numbers: Array


LAST, CHANGED, SUM, PERIODS, INTERVALS, PLACE, BEST = range(7)


def grid() -> list[tuple[float, float, float]]:
    """Lag, dead time and time to full of the models of the bank, in units of T."""
    return list(product(LAGS, DEAD_TIMES, TIMES_TO_FULL))


def with_model(vessel: KnownVessel, number: int) -> KnownVessel:
    """The vessel with the actuators of a model of the bank as declared; number 0 leaves it as it is."""
    if number == 0:
        return vessel
    T = unit_time(vessel)
    lag, dead_time, full = (T * each for each in grid()[number - 1])
    force, moment = (limit / full if full else math.inf for limit in (vessel.surge_force_limit, vessel.yaw_moment_limit))
    return replace(
        vessel, surge_lag=lag, yaw_lag=lag, surge_dead_time=dead_time, yaw_dead_time=dead_time,
        surge_force_rate=force, yaw_moment_rate=moment,
    )  # fmt: skip


def described(vessel: KnownVessel) -> str:
    """The actuators of the yaw moment in words."""
    full = vessel.yaw_moment_limit / vessel.yaw_moment_rate
    return f"a lag of {vessel.yaw_lag:.2g} s, a dead time of {vessel.yaw_dead_time:.2g} s and {full:.2g} s from zero to the limit"


def bank(vessel: KnownVessel, period: float, soon: bool = False) -> Bank:
    """The bank of a vessel, of which the declared model is used.

    `soon`: whether the law takes quicker actuators at once. One that learns wind and current first, as `guided` does, keeps its
    slow gains until then.
    """
    T = unit_time(vessel)
    every = max(1, round(INTERVAL * T / period))
    inputs = dynamics(vessel)
    h, declared = every * period, inputs.yaw
    better, wrong, right = TRUSTED if inputs.declared else (BETTER, WRONG, RIGHT)
    models = [(declared.lag, declared.dead_time, declared.full), *((lag * T, dead * T, full * T) for lag, dead, full in grid())]
    largest = vessel.yaw_moment_limit / vessel.yaw_inertia
    low, high, forgotten = (-math.expm1(-rate * h / T) for rate in (BAND[1], BAND[0], 1.0 / MEMORY))
    return Bank(
        share=np.array([-math.expm1(-h / lag) if lag else 1.0 for lag, _, _ in models]),
        change=np.array([largest * h / full if full else LARGEST_CHANGE for _, _, full in models]),
        late=np.array([round(dead_time / h) for _, dead_time, _ in models]),
        instant=np.array([lag == 0.0 and full == 0.0 for lag, _, full in models]),
        every=every,
        h=h,
        low=low,
        high=high,
        forgotten=forgotten,
        unit=T,
        inertia=vessel.yaw_inertia,
        better=better,
        wrong=wrong,
        right=right,
        guessed=not inputs.declared,
        soon=soon,
        used=0,
    )


def first_state(c: Bank, longest_age: float) -> BankState:
    """The state before the first step, with room for measurements up to an age, s."""
    places = int(c.late.max()) + math.ceil(longest_age / c.h) + 2
    numbers = np.zeros(7)
    numbers[BEST] = c.used
    return BankState(np.zeros((len(c.share), 8)), np.zeros((3, 3)), np.zeros(places), numbers)


@kernel
def identify(m: BankState, c: Bank, psi: float, age: float, command: float) -> None:
    """Go on by a control period, in place.

    `psi`: measured heading. `age`: how long ago it was so, s. `command`: the yaw moment that is commanded from now on, N·m.
    """
    n = m.numbers
    if int(n[PERIODS]) % c.every == 0:
        _interval(m, c, psi, age)
        n[SUM] = 0.0
    n[SUM] += command
    n[PERIODS] += 1.0
    if int(n[PERIODS]) % c.every == 0:
        place = (int(n[PLACE]) + 1) % len(m.commands)
        n[PLACE] = place
        m.commands[place] = n[SUM] / c.every / c.inertia


@kernel
def _interval(m: BankState, c: Bank, psi: float, age: float) -> None:
    """Go on by an interval: a measured heading, and the commands until then."""
    n = m.numbers
    turned = math.remainder(psi - n[LAST], TURN)
    before = n[CHANGED]
    n[LAST], n[CHANGED] = psi, turned
    n[INTERVALS] += 1.0
    # The second difference of the heading is the mean acceleration of two intervals; so is x of each model.
    y, z = (turned - before) / (c.h * c.h), (turned + before) / (2.0 * c.h)
    known = 0.0 if n[INTERVALS] < 4.0 else 1.0  # the first differences have no meaning, and what they answer is left out too
    y, z = known * y, known * z
    y, z = _filtered(m.measured[0], 0, y, c), _filtered(m.measured[1], 0, z, c)
    mean = m.measured[2]
    mean[0] += c.forgotten * (y * y - mean[0])
    mean[1] += c.forgotten * (z * z - mean[1])
    mean[2] += c.forgotten * (y * z - mean[2])
    newest = int(n[PLACE]) - int(age / c.h + 0.5)
    commands, share, change, late, instant = (
        m.commands.tolist(), c.share.tolist(), c.change.tolist(), c.late.tolist(), c.instant.tolist()
    )  # fmt: skip
    for i in range(len(m.models)):
        arriving = commands[(newest - int(late[i])) % len(commands)]
        _advance(m.models[i], arriving, share[i], change[i], instant[i], known, y, z, c)
    _decide(m, c)


@kernel
def _advance(
    row: Array, arriving: float, share: float, change: float, instant: bool, known: float, y: float, z: float, c: Bank
) -> None:
    """Advance a model by an interval."""
    before = row.tolist()
    last, mean_before, xx, xy, xz = before[0], before[1], before[5], before[6], before[7]
    a = last + clip(share * (arriving - last), change)
    mean = arriving if instant else 0.5 * (last + a)
    x = _filtered(row, 2, known * 0.5 * (mean + mean_before), c)
    row[0], row[1] = a, mean
    row[5] = xx + c.forgotten * (x * x - xx)
    row[6] = xy + c.forgotten * (x * y - xy)
    row[7] = xz + c.forgotten * (x * z - xz)


@kernel
def _filtered(row: Array, first: int, value: float, c: Bank) -> float:
    """The band-pass filter: two lags, and a high-pass. `row`: array with its states, in place."""
    states = row.tolist()
    one = states[first] + c.low * (value - states[first])
    two = states[first + 1] + c.low * (one - states[first + 1])
    slow = states[first + 2] + c.high * (two - states[first + 2])
    row[first], row[first + 1], row[first + 2] = one, two, slow
    return float(two - slow)


@kernel
def unexplained(row: Array, measured: Array, unit: float) -> float:
    """J of a model with its best b and d. `measured`: means of y², z², y·z."""
    means, products = measured.tolist(), row.tolist()
    yy, zz, yz = means[0], means[1], means[2]
    xx, xy, xz = products[5] + 1e-30, products[6], products[7]
    b = between((xy * zz - yz * xz) / (xx * zz - xz * xz + 1e-30), INERTIA[0], INERTIA[1])
    d = between((b * xz - yz) / (zz + 1e-30), 0.0, DAMPING / unit)
    b = between((xy + d * xz) / xx, INERTIA[0], INERTIA[1])
    return float(yy + b * b * xx + d * d * zz - 2.0 * b * xy + 2.0 * d * yz - 2.0 * b * d * xz)


@kernel
def _decide(m: BankState, c: Bank) -> None:
    """Take another model if it explains the motion so much better."""
    n, yy = m.numbers, m.measured[2, 0]
    present = m.models[c.used]
    excitation = present[5] * c.unit * c.unit * c.unit * c.unit
    early = min(n[INTERVALS] * c.h / (FIRST * c.unit), 1.0)
    if excitation < QUIET * QUIET or (early < 1.0 and not c.soon):
        return
    residual, guess = unexplained(present, m.measured[2], c.unit), c.soon and c.guessed and c.used == 0
    if residual < c.wrong * yy and not guess:
        return
    fraction = max(c.better * residual, c.wrong * yy) if guess else c.better * residual
    least, best = min(fraction, early * early * c.right * yy), c.used
    for i in range(int(c.soon and c.guessed), len(m.models)):
        J = unexplained(m.models[i], m.measured[2], c.unit)
        if least > J:
            least, best = J, i
    n[BEST] = best
