"""The reference that travels a curve: the motion along it, placed at the initial pose and mirrored for turns to starboard."""

import math
from typing import NamedTuple

from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion
from vessel_hsmc_ros.guidance.curve_motion import Pace, body_velocities, progress
from vessel_hsmc_ros.guidance.curves import CurveConstants, angle, course, curvature, position
from vessel_hsmc_ros.guidance.drift import DriftConstants, PeriodicDrift, drift_at
from vessel_hsmc_ros.guidance.kernel_reference import Array, KernelReference, write_row
from vessel_hsmc_ros.guidance.shapes import Shape
from vessel_hsmc_ros.plant.dynamics import Vessel


class TravelConstants(NamedTuple):
    """The curve and the drift angle along it, side of the first turn, pace, initial x, y, course, and length of a step, s."""

    curve: CurveConstants
    drift: DriftConstants
    side: float
    pace: Pace
    x: float
    y: float
    course: float
    period: float


class TravelMemory(NamedTuple):
    """Number of steps, whole ones but where the clock waits for the vessel: the motion is a function of time."""

    steps: float


@kernel
def move(m: TravelMemory, c: TravelConstants) -> TravelMemory:  # noqa: ARG001 - the form of all references
    """The reference one period later."""
    return TravelMemory(m.steps + 1)


@kernel
def read(m: TravelMemory, c: TravelConstants) -> tuple[Motion, Acceleration]:
    """State, and the derivatives of its velocities."""
    now = progress(m.steps * c.period, c.pace)
    turned = c.drift.w * (now.s % c.curve.period)
    drift = drift_at(complex(math.cos(turned), math.sin(turned)), c.drift)
    theta, beta = angle(now.s, c.curve), now.f * drift.beta
    bend = curvature(math.cos(theta), math.sin(theta), c.curve)
    v = body_velocities(bend, (math.cos(beta), math.sin(beta)), c.pace.speed, drift, now)
    # The model is symmetric: a turn to starboard is the mirror image of the turn to port.
    p, side = position(now.s, c.curve), c.side
    cosine, sine = math.cos(c.course), math.sin(c.course)
    x, y = c.x + (p.real * cosine - side * p.imag * sine), c.y + (p.real * sine + side * p.imag * cosine)
    psi = c.course + side * (course(now.s, c.curve) - beta)
    return Motion(x, y, psi, v.u, side * v.v, side * v.r), Acceleration(v.du, side * v.dv, side * v.dr)


@kernel
def follow(m: TravelMemory, c: TravelConstants, rows: Array) -> None:
    """Write the motion of each step into rows of shape (n, 9)."""
    for k in range(len(rows)):
        m = move(m, c) if k > 0 else m
        write_row(rows[k], read(m, c))


class CurveReference(KernelReference):
    """A motion along a curve at constant speed, after a start from rest, in discrete time.

    `shape`: the curve and the side to which it turns first. `pace`: speed along the curve and duration of the start. `start`:
    initial position x, y [m] and course. `period`: length of a step, s.
    """

    move, read, follow = staticmethod(move), staticmethod(read), staticmethod(follow)

    def __init__(self, shape: Shape, pace: Pace, vessel: Vessel, start: tuple[float, ...], period: float) -> None:
        drift = PeriodicDrift(shape.curve, pace.speed, vessel).constants
        x, y, course = map(float, start)
        self.constants = TravelConstants(shape.curve.constants, drift, shape.side, pace, x, y, course, period)
        # Interpreted, the series are faster as lists.
        curve, a = self.constants.curve, self.constants.drift.a
        listed = {"curve": curve._replace(a=curve.a.tolist()), "drift": DriftConstants(drift.w, a.tolist())}
        self._listed = self.constants._replace(**listed)
        self.reset()

    def _read(self) -> tuple[Motion, Acceleration]:
        return read(self.memory, self._listed)

    def reset(self) -> None:
        """Return to the start."""
        self.memory = TravelMemory(0)
