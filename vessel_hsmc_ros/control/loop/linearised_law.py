"""The loops of a law about a straight path: a control period, differentiated with respect to all that it remembers.

| symbol | meaning | unit |
|---|---|---|
| U | speed along the straight path | m/s |
| x, y, psi, u, v, r | deviations along and across the path, of the heading and of the velocities | m, rad, m/s, rad/s |
| tau | surge force and yaw moment that act | N, N·m |
| S, G | slopes of the accelerations over (u, v, r) and over tau | 1/s ..., 1/kg ... |
| z | all states: hull, actuators, wrenches on their way, the filter of the headings, the law | |
| c, d, w | command of the law, wrench that the actuators receive, error of the measured y | N, N·m, m |

    (du, dv, dr) = S·(u, v, r) + G·tau,   dx = u,   dy = U·psi + v,   dpsi = r,   tau by lag and dead time of d
    z(k+1) = F(z(k), d(k), w(k)),   c(k) = H(z(k), w(k)),   their derivatives by central differences

The law runs as it is until its estimates have settled on the path; a small deviation then shows how large each state becomes,
which is the step of its difference. States on which no command depends are left out. Limits of magnitude and rate are not
linear, and not in the loops.

A linear loop in discrete time, and its margins.

| symbol | meaning | unit |
|---|---|---|
| T | control period | s |
| L(z) | open loop: output divided by input, times -1, so that the closed loop is at its limit where L = -1 | - |
| z | exp(j·omega·T) | - |

    L(z) = -C·(zI - A)⁻¹·B
"""

import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.interface.law import KernelLaw
from vessel_hsmc_ros.control.loop.control_period import START, ControlledPoint, Heading, to_controlled_point
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion

FREQUENCIES = 500  # number of frequencies, on a logarithmic grid up to half the control rate


UNDRIVEN = 1e-7
"""Rounding of the poles at 1 of states that nothing drives, such as the weights of neurons that are not activated."""


class Margins(NamedTuple):
    """What a loop tolerates before it becomes unstable."""

    stable: bool  # whether the closed loop is stable; otherwise the rest has no meaning
    gain_db: float  # smallest factor on the gain, upwards or downwards, dB
    phase_deg: float  # smallest phase lag or lead, degrees
    delay: float  # smallest additional delay, s
    crossover: float  # largest frequency at which the loop has the gain 1, rad/s


class System(NamedTuple):
    """The broken loop, next state = A·state + B·input and output = C·state; single input and output."""

    A: Array
    B: Array
    C: Array


def exact_step(A: Array, B: Array, T: float) -> tuple[Array, Array]:
    """The step of dx = A·x + B·u over a period with u held: exp([A B; 0 0]·T) by its series, halved ten times and squared."""
    n = len(A)
    whole = np.zeros((n + 1, n + 1))
    whole[:n, :n], whole[:n, n] = A * T / 1024.0, B * T / 1024.0
    step = np.eye(n + 1) + whole @ (np.eye(n + 1) + whole @ (np.eye(n + 1) / 2.0 + whole / 6.0))
    for _ in range(10):
        step = step @ step
    return step[:n, :n], step[:n, n]


def open_loop(system: System, omega: Array, T: float) -> NDArray[np.complex128]:
    """L at the frequencies omega [rad/s] for the control period T [s]."""
    z = np.exp(1j * omega * T)
    resolvent = z[:, None, None] * np.eye(len(system.A)) - system.A
    states = np.linalg.solve(resolvent, np.broadcast_to(system.B[:, None].astype(complex), (len(z), len(system.B), 1)))
    return np.asarray(-(states[:, :, 0] @ system.C), dtype=np.complex128)


def margins(system: System, T: float) -> Margins:
    """The margins of a loop with the control period T [s]."""
    omega = np.geomspace(1e-5 / T, math.pi / T, FREQUENCIES)
    L = open_loop(system, omega, T)
    poles = np.linalg.eigvals(system.A + np.outer(system.B, system.C))
    stable = bool(np.max(np.abs(poles), initial=0.0) < 1.0 + UNDRIVEN)
    logarithm, phase = np.log(np.maximum(np.abs(L), 1e-300)), np.unwrap(np.angle(L))
    ones = _crossings(logarithm, logarithm, phase, np.log(omega))
    lag = np.array([_turned(angle) for _, angle, _ in ones])
    speed = np.exp([each for *_, each in ones])
    # A half turn of the phase is passed wherever the angle beyond it changes sign without a jump.
    beyond = np.array([_turned(angle) if abs(_turned(angle)) < 0.5 * math.pi else math.nan for angle in phase])
    halves = [abs(size) for size, _, _ in _crossings(beyond, logarithm, phase, np.log(omega))]
    if L[-1].real < 0.0:  # where the grid ends, half the control rate, the phase is a half turn or none
        halves.append(abs(float(logarithm[-1])))
    return Margins(
        stable,
        20.0 / math.log(10.0) * min(halves, default=math.inf),
        math.degrees(min(np.abs(lag), default=math.inf)),
        float(min(np.where(lag < 0.0, lag + 2.0 * math.pi, lag) / speed, default=math.inf)),
        float(max(speed, default=0.0)),
    )


def _turned(angle: float) -> float:
    """The angle beyond a half turn, in [-pi, pi]: the phase lag that is left to it."""
    return math.remainder(angle + math.pi, 2.0 * math.pi)


def _crossings(of: Array, *columns: Array) -> list[tuple[float, ...]]:
    """The columns where `of` passes zero, interpolated; nan in `of` is passed over."""
    found = []
    for k in np.flatnonzero(of[:-1] * of[1:] < 0.0):
        share = of[k] / (of[k] - of[k + 1])
        found.append(tuple(float(each[k] + share * (each[k + 1] - each[k])) for each in columns))
    return found


SETTLING, SPREADING = 3000, 60
"""Periods until the estimates have settled, and over which, beyond the dead time, the deviation spreads."""

DEVIATION = 1e-4  # the deviation: of position, length and speed relative to these, and of the heading


class LinearShip(NamedTuple):
    """A ship about a straight path."""

    speed: float  # U, m/s
    length: float  # of the hull, m
    slopes: Array  # S, shape (3, 3)
    gains: Array  # G, shape (3, 2)
    # lags, dead_times: of surge force and yaw moment, s
    lags: tuple[float, float]
    dead_times: tuple[float, float]


class LoopState(NamedTuple):
    """The loop between two periods: (x, y, psi, u, v, r, tau), shape (8,); the wrenches on their way; the states of the law."""

    ship: Array
    sent: tuple[tuple[float, ...], tuple[float, ...]]
    heading: Heading
    memory: Any


Advance = Callable[..., tuple[LoopState, Array]]


def loops(law: KernelLaw[Any], point: ControlledPoint, ship: LinearShip, period: float) -> dict[str, System]:
    """The loops broken at the received surge force, at the received yaw moment, and at the measured position across the path.

    `law`: the law as constructed, whose constants must not change; its memory is left as it is. Returns each loop with the
    others closed, by name.
    """
    advance = _loop(law, point, ship, period)
    late = [round(each / period) for each in ship.dead_times]
    at = LoopState(np.zeros(8), ((0.0,) * late[0], (0.0,) * late[1]), START, _copied(law.memory))
    for k in range(SETTLING):  # the ship is held on the path, also where the loop is unstable
        at = advance(k, at)[0]._replace(ship=np.zeros(8))
    steps = _steps(advance, at, ship)
    whole = _differentiated(advance, at, steps, DEVIATION * ship.length, 1e-3 / np.abs(ship.gains).max(axis=0))
    moving = np.append(np.flatnonzero(steps), np.arange(len(steps), len(steps) + 3))
    slopes, n = whole[np.ix_(moving[:-1], moving)], len(moving) - 3
    A, C, (b_1, b_2, b_y) = slopes[:n, :n], slopes[n:, :n], slopes[:n, n:].T
    y, across = np.eye(n)[1], b_y + slopes[n, -1] * b_1 + slopes[n + 1, -1] * b_2
    force_closed, moment_closed = A + np.outer(b_1, C[0]), A + np.outer(b_2, C[1])
    return {
        "surge force": _reduced(moment_closed, b_1, C[0]),
        "yaw moment": _reduced(force_closed, b_2, C[1]),
        "position across": _reduced(force_closed + np.outer(b_2, C[1]) - np.outer(across, y), across, y),
    }


def _loop(law: KernelLaw[Any], point: ControlledPoint, ship: LinearShip, period: float) -> Advance:
    """A period of the loop: state and command by number of the period, state, received wrench (or the command), and w."""
    U, straight, step = ship.speed, Acceleration(0.0, 0.0, 0.0), law.kernel
    move, drive = _discretised(ship, period)

    def advance(
        k: int, at: LoopState, received: tuple[float, float] | None = None, error: float = 0.0
    ) -> tuple[LoopState, Array]:
        way, (x, y, psi, u, v, r) = U * period * k, at.ship[:6].tolist()
        measured, desired = Motion(way + x, y + error, psi, U + u, v, r), Motion(way, 0.0, 0.0, U, 0.0, 0.0)
        given = to_controlled_point(measured, desired, straight, at.heading, point)
        command, _, memory = step(given.motion, given.desired, given.acceleration, at.memory, law.constants)
        force, moment = ((*sent, float(new)) for sent, new in zip(at.sent, received or command, strict=True))
        moved = move @ at.ship + drive @ np.array([force[0], moment[0]])
        return LoopState(moved, (force[1:], moment[1:]), given.delta, memory), np.array(command)

    return advance


def _discretised(ship: LinearShip, period: float) -> tuple[Array, Array]:
    """The step of (x, y, psi, u, v, r, tau) over a period, shape (8, 8), and by what the actuators receive, shape (8, 2)."""
    A, B = np.zeros((8, 8)), np.zeros((8, 2))
    A[0, 3], A[1, 2], A[1, 4], A[2, 5] = 1.0, ship.speed, 1.0, 1.0
    A[3:6, 3:6] = ship.slopes
    for i, lag in enumerate(ship.lags):
        if lag > 0.0:
            A[3:6, 6 + i], A[6 + i, 6 + i], B[6 + i, i] = ship.gains[:, i], -1.0 / lag, 1.0 / lag
        else:
            B[3:6, i] = ship.gains[:, i]
    steps = [exact_step(A, B[:, i], period) for i in range(2)]
    return steps[0][0], np.column_stack([drive for _, drive in steps])


def _steps(advance: Advance, at: LoopState, ship: LinearShip) -> Array:
    """The largest deviation of each state after a small one of the ship; zero where none is."""
    L, U = ship.length, ship.speed
    deviation = DEVIATION * np.array([L, L, 1.0, U, U, U / L, 0.0, 0.0])
    near, other, largest = _copied(at), _copied(at)._replace(ship=at.ship + deviation), np.zeros(len(_numbers(at)))
    late = max(len(sent) for sent in at.sent)
    for k in range(SETTLING, SETTLING + late + SPREADING):
        (near, _), (other, _) = advance(k, near), advance(k, other)
        largest = np.maximum(largest, np.abs(_numbers(other) - _numbers(near)))
    return largest


def _differentiated(advance: Advance, at: LoopState, steps: Array, error: float, wrench: Array) -> Array:
    """The derivatives of (F, H) with respect to (z, d, w), shape (n + 2, n + 3)."""
    n, command = len(steps), advance(SETTLING, _copied(at))[1]

    def period(z: Array) -> Array:
        later, commanded = advance(SETTLING, _with(at, z[:n]), tuple(z[n : n + 2].tolist()), float(z[-1]))
        return np.concatenate((_numbers(_in_place(later, at)), commanded))

    z, every = np.concatenate((_numbers(at), command, [0.0])), np.concatenate((steps, wrench, [error]))
    slopes = np.zeros((n + 2, n + 3))
    for i in np.flatnonzero(every):
        more, less = z.copy(), z.copy()
        more[i], less[i] = z[i] + every[i], z[i] - every[i]
        slopes[:, i] = (period(more) - period(less)) / (2.0 * every[i])
    return slopes


def _in_place(later: LoopState, at: LoopState) -> LoopState:
    """The queue of a law, which is written all round, with its elements moved by a place instead of its head."""
    memory = later.memory
    if not hasattr(memory, "queue"):
        return later
    return later._replace(memory=memory._replace(queue=np.roll(memory.queue, at.memory.head - memory.head, axis=1)))


def _reduced(A: Array, B: Array, C: Array) -> System:
    """A broken loop of the states on which its output depends."""
    matters = C != 0.0
    while True:
        more = matters | (A[matters] != 0.0).any(axis=0)
        if (more == matters).all():
            return System(A[np.ix_(matters, matters)], B[matters], C[matters])
        matters = more


def _numbers(tree: Any) -> Array:
    """The floating-point numbers of nested tuples and arrays, in their order."""
    return np.concatenate(list(_parts(tree)))


def _parts(tree: Any) -> Iterator[Array]:
    if isinstance(tree, tuple):
        for each in tree:
            yield from _parts(each)
    elif isinstance(tree, float) or (isinstance(tree, np.ndarray) and tree.dtype.kind == "f"):
        yield np.ravel(tree)


def _with_numbers(tree: Any, numbers: Iterator[Array]) -> Any:
    """A copy of nested tuples and arrays with other floating-point numbers, in the parts of `_parts`."""
    if isinstance(tree, tuple):
        parts = [_with_numbers(each, numbers) for each in tree]
        return type(tree)(*parts) if hasattr(tree, "_fields") else tuple(parts)
    if isinstance(tree, float):
        return float(next(numbers)[0])
    if isinstance(tree, np.ndarray):
        return next(numbers).reshape(tree.shape).copy() if tree.dtype.kind == "f" else tree.copy()
    return tree


def _with(tree: Any, numbers: Array) -> Any:
    """A copy of nested tuples and arrays with other floating-point numbers."""
    ends = np.cumsum([part.size for part in _parts(tree)])
    return _with_numbers(tree, iter(np.split(numbers, ends[:-1])))


def _copied(tree: Any) -> Any:
    """A copy of nested tuples and arrays."""
    return _with_numbers(tree, _parts(tree))
