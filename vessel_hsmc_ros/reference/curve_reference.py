"""The reference that travels a curve: the motion along it, placed at the initial pose and mirrored for turns to starboard."""

import cmath

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.reference.curve_motion import Pace, velocities
from vessel_hsmc_ros.reference.drift import PeriodicDrift
from vessel_hsmc_ros.reference.shapes import Shape
from vessel_sim_node.plant import Vessel

Array = NDArray[np.float64]


class CurveReference:
    """A motion along a curve at constant speed, after a start from rest, in discrete time.

    Args:
        shape: The curve and the side to which it turns first.
        pace: Speed along the curve and duration of the start.
        vessel: Coefficients of the hull.
        start: Initial position x, y [m] and course.
        period: Length of a step, s.

    Attributes:
        state: x, y, psi, u, v, r, shape (6,).
    """

    def __init__(self, shape: Shape, pace: Pace, vessel: Vessel, start: tuple[float, ...], period: float) -> None:
        self._curve, self._side = shape.curve, shape.side
        self._drift = PeriodicDrift(shape.curve, pace.speed, vessel)
        self._pace = pace
        self._start = start
        self._period = period
        self.reset()

    def reset(self) -> None:
        """Return to the start."""
        self._steps = 0
        self._read()

    def acceleration(self) -> Array:
        """Derivatives du, dv, dr of the body velocities, shape (3,): m/s², m/s², rad/s²."""
        return self._acceleration

    def advance(self) -> None:
        """Advance by one period along the curve."""
        self._steps += 1
        self._read()

    def _read(self) -> None:
        progress = self._pace.at(self._steps * self._period)
        s = float(progress.s)
        drift, p = self._drift.at(s), self._curve.position(s)
        u, v, r, du, dv, dr = map(float, velocities(self._curve, self._pace.speed, drift, progress))
        x, y, course = self._start
        # The model is symmetric: a turn to starboard is the mirror image of the turn to port.
        side = self._side
        placed = complex(p.real, side * p.imag) * cmath.exp(1j * course)
        psi = course + side * (self._curve.course(s) - float(progress.f * drift.beta))
        self.state: Array = np.array([x + placed.real, y + placed.imag, psi, u, side * v, side * r])
        self._acceleration: Array = np.array([du, side * dv, side * dr])
