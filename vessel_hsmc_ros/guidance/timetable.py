"""What references have in common, and a motion that is known ahead as a table.

A reference is a pair of kernels, pure functions of a memory, which the node steps and a batch of runs compiles.

The rows of a table are position and heading with their first and second derivatives. Between them stand polynomials of the fifth
degree, so that position, velocity and acceleration are continuous and those of one motion; they are derivatives, not integrated.
"""

import math
from collections.abc import Sequence
from typing import Any, ClassVar, NamedTuple

import numpy as np

from vessel_hsmc_ros.core.kernel import Array, kernel
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion

move: Any = None  # the kernels of a reference take the place of these two
read: Any = None


@kernel
def follow(memory: Any, constants: Any, rows: Array) -> None:
    """Write the motion of each step into rows of shape (n, 9)."""
    for k in range(len(rows)):
        memory = move(memory, constants) if k > 0 else memory
        motion, acceleration = read(memory, constants)
        for i in range(6):
            rows[k, i] = motion[i]
        for i in range(3):
            rows[k, 6 + i] = acceleration[i]


class KernelReference:
    """Holder of the memory of a reference; see `Reference` for the meaning of its methods."""

    move: ClassVar[Any]  # kernel (memory, constants) -> memory, one period later
    read: ClassVar[Any]  # kernel (memory, constants) -> state and accelerations
    constants: Any  # NamedTuple of what does not change during a run
    memory: Any  # NamedTuple of what does
    _read_from: Any = None
    _reading: tuple[Array, Array]

    @property
    def kernels(self) -> dict[str, Any]:
        """The kernels that `follow` calls."""
        return {"move": self.move, "read": self.read}

    @property
    def state(self) -> Array:
        """Pose x, y, psi and body velocities u, v, r of the present step, shape (6,)."""
        return self._present()[0]

    def acceleration(self) -> Array:
        """Derivatives du, dv, dr of the body velocities at the present step, shape (3,): m/s², m/s², rad/s²."""
        return self._present()[1]

    def advance(self) -> None:
        """Advance by one period."""
        self.memory = self.move(self.memory, self.constants)

    def _present(self) -> tuple[Array, Array]:
        # The memory is a new tuple after every change, so its reading is computed once.
        if self._read_from is not self.memory:
            motion, acceleration = self.read(self.memory, self.constants)
            self._reading, self._read_from = (np.array(motion), np.array(acceleration)), self.memory
        return self._reading


EARLY = 0.5e-9  # tolerance of half a nanosecond, s: a step takes effect at its instant in spite of rounded times


@kernel
def passed(times: Array, time: float) -> int:
    """How many of some increasing times have passed, by bisection."""
    low, high = 0, len(times)
    while low < high:
        middle = (low + high) // 2
        if time + EARLY < times[middle]:
            high = middle
        else:
            low = middle + 1
    return low


class Timetable(NamedTuple):
    """A motion over time."""

    times: Array  # increasing times, shape (n,), s
    rows: Array  # x, y, psi, their first and their second derivatives, shape (n, 9)


def joined(tables: Sequence[Timetable]) -> Timetable:
    """Tables one after the other, each of which begins at the time 0 where and as the last one ends."""
    times, rows, begin = [tables[0].times[:1]], [tables[0].rows[:1]], float(tables[0].times[0])
    for table in tables:
        times.append(begin + table.times[1:])
        rows.append(table.rows[1:])
        begin += float(table.times[-1])
    return Timetable(np.concatenate(times), np.concatenate(rows))


def blended(table: Timetable, row: Array, duration: float) -> Timetable:
    """A table that begins with a given row: the difference decays along a polynomial of the fifth degree.

    `row`: its first row as it must be, shape (9,). `duration`: time in which the difference decays, s.
    """
    offset, rows = row - table.rows[0], table.rows.copy()
    elapsed = table.times - table.times[0]
    for i in np.flatnonzero(elapsed < duration):
        for j in range(3):
            begin = float(offset[j]), float(offset[3 + j]), float(offset[6 + j])
            rows[i, j::3] += quintic(begin, (0.0, 0.0, 0.0), duration, float(elapsed[i]) / duration)
    return Timetable(table.times, rows)


def world_rows(motion: Motion | tuple[Any, ...], acceleration: Acceleration | tuple[Any, ...]) -> Array:
    """The rows of a table of states and the derivatives of their velocities: shape (9,) of numbers, (n, 9) of arrays."""
    x, y, psi, u, v, r = motion
    du, dv, dr = acceleration
    along = np.exp(1j * psi)
    velocity, change = (u + 1j * v) * along, (du - r * v + 1j * (dv + r * u)) * along
    return np.stack((x, y, psi, velocity.real, velocity.imag, r, change.real, change.imag, dr), axis=-1)


def at_rest(motion: Motion, *times: float) -> Timetable:
    """A table of a ship that stays where it is."""
    return Timetable(np.array(times), np.array([[*motion[:3], *[0.0] * 6]] * len(times)))


class TimetableConstants(NamedTuple):
    """The table, and the length of a step, s."""

    table: Timetable
    period: float


class TimetableMemory(NamedTuple):
    """Number of steps, whole ones but where the clock waits for the vessel: the motion is a function of time."""

    steps: float


@kernel
def quintic(a: tuple[float, float, float], b: tuple[float, float, float], h: float, z: float) -> tuple[float, float, float]:
    """The polynomial of the fifth degree between two points: value, first and second derivative.

    `a`, `b`: value, first and second derivative at its two ends. `h`: time between these, s. `z`: where, from 0 to 1.
    """
    v, w, k = a[1] * h, b[1] * h, 0.5 * a[2] * h * h
    # Rests at z = 1 of the Taylor polynomial at z = 0: of value, slope and half the second derivative.
    e0, e1, e2 = b[0] - a[0] - v - k, w - v - 2.0 * k, 0.5 * b[2] * h * h - k
    c3, c4, c5 = 10.0 * e0 - 4.0 * e1 + e2, -15.0 * e0 + 7.0 * e1 - 2.0 * e2, 6.0 * e0 - 3.0 * e1 + e2
    value = a[0] + z * (v + z * (k + z * (c3 + z * (c4 + z * c5))))
    slope = v + z * (2.0 * k + z * (3.0 * c3 + z * (4.0 * c4 + z * 5.0 * c5)))
    bend = 2.0 * k + z * (6.0 * c3 + z * (12.0 * c4 + z * 20.0 * c5))
    return value, slope / h, bend / (h * h)


@kernel
def column(rows: Array, i: int, j: int) -> tuple[float, float, float]:
    """Value, first and second derivative of x, y or psi in a row."""
    return float(rows[i, j]), float(rows[i, 3 + j]), float(rows[i, 6 + j])


@kernel
def motion_at(time: float, table: Timetable) -> tuple[Motion, Acceleration]:
    """State, and the derivatives of its velocities; before the first and after the last time the ship is at rest."""
    i, last = passed(table.times, time) - 1, len(table.times) - 1
    if i < 0 or i >= last:
        i = 0 if i < 0 else last
        pose = Motion(float(table.rows[i, 0]), float(table.rows[i, 1]), float(table.rows[i, 2]), 0.0, 0.0, 0.0)
        return pose, Acceleration(0.0, 0.0, 0.0)
    begin = float(table.times[i])
    h = float(table.times[i + 1]) - begin
    z = (time - begin) / h
    x, dx, ddx = quintic(column(table.rows, i, 0), column(table.rows, i + 1, 0), h, z)
    y, dy, ddy = quintic(column(table.rows, i, 1), column(table.rows, i + 1, 1), h, z)
    psi, r, dr = quintic(column(table.rows, i, 2), column(table.rows, i + 1, 2), h, z)
    c, s = math.cos(psi), math.sin(psi)
    u, v = c * dx + s * dy, -s * dx + c * dy
    return Motion(x, y, psi, u, v, r), Acceleration(c * ddx + s * ddy + r * v, -s * ddx + c * ddy - r * u, dr)


@kernel
def move_table(m: TimetableMemory, c: TimetableConstants) -> TimetableMemory:  # noqa: ARG001 - the form of all references
    """The reference one period later."""
    return TimetableMemory(m.steps + 1)


@kernel
def read_table(m: TimetableMemory, c: TimetableConstants) -> tuple[Motion, Acceleration]:
    """State, and the derivatives of its velocities."""
    return motion_at(m.steps * c.period, c.table)
