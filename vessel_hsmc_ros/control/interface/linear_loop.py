"""A linear loop in discrete time, and its margins.

| symbol | meaning | unit |
|---|---|---|
| T | control period | s |
| L(z) | open loop: output divided by input, times -1, so that the closed loop is at its limit where L = -1 | - |
| z | exp(j·omega·T) | - |

    L(z) = -C·(zI - A)⁻¹·B
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.arrays import Array

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


def closed_poles(system: System) -> NDArray[np.complex128]:
    """The poles of the closed loop in the z plane."""
    closed = system.A + np.outer(system.B, system.C)
    return np.asarray(np.linalg.eigvals(closed), dtype=np.complex128)


def margins(system: System, T: float) -> Margins:
    """The margins of a loop with the control period T [s]."""
    omega = np.geomspace(1e-5 / T, math.pi / T, FREQUENCIES)
    L = open_loop(system, omega, T)
    stable = bool(np.max(np.abs(closed_poles(system)), initial=0.0) < 1.0 + UNDRIVEN)
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
