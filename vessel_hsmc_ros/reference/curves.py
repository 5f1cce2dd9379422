"""Plane curves with continuous curvature, parametrised by their arc length: arc, figure eight, square with rounded corners.

| symbol | meaning | unit |
|---|---|---|
| s | arc length | m |
| p | position x + i·y, as a complex number | m |
| chi | course, the direction of the tangent | rad |
| kappa | curvature dchi/ds | 1/m |
| A, k | amplitude of the course and wavenumber of the figure eight | rad, 1/m |
| c | length of a corner of the square | m |

Every curve begins at p = 0 with chi = 0 and turns to port first, so kappa >= 0 there. A curve to starboard is its mirror image.
The position is the integral of exp(i·chi); where chi is a constant plus a harmonic, exp(i·chi) is a short Fourier series with
Bessel functions as coefficients (Jacobi and Anger) and is integrated in closed form.
"""

import math
from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

CLOSING = 2.404825557695773
"""A of the figure eight, the first zero of the Bessel function J0: the curve closes because the mean of exp(i·chi) is J0(A)."""

CORNER_EXTENT = 1.8359749799326934
"""Distance from the beginning of a rounded corner to the vertex of the square, in multiples of the smallest radius."""

MODES = 64
"""Number of samples per turn from which the Fourier coefficients of exp(i·chi) are computed: exact to rounding."""


class Series(NamedTuple):
    """A sum of complex exponentials of the arc length, sum(a·exp(i·w·s)).

    Attributes:
        w: Wavenumbers, shape (m,), 1/m.
        a: Amplitudes, shape (m,).
    """

    w: Array
    a: ComplexArray

    def at(self, s: float) -> complex:
        """The value at an arc length."""
        return complex(np.exp(1j * s * self.w) @ self.a)

    def derivative(self) -> "Series":
        """The derivative with respect to s."""
        return Series(self.w, 1j * self.w * self.a)

    def integral(self) -> "Series":
        """The antiderivative that has no constant; no wavenumber may be zero."""
        return Series(self.w, self.a / (1j * self.w))


class Curve(Protocol):
    """A plane curve whose curvature is a periodic function of the arc length."""

    @property
    def period(self) -> float:
        """Arc length after which the curvature repeats, m."""
        ...

    @property
    def shortest_bend(self) -> float:
        """Arc length over which the curvature rises and falls, m; infinite if it is constant."""
        ...

    def position(self, s: float) -> complex:
        """The position p, m."""
        ...

    def course(self, s: float) -> float:
        """The course chi, rad, not wrapped."""
        ...

    def curvature(self, s: ArrayLike) -> Array:
        """The curvature kappa, 1/m."""
        ...

    def curvature_slope(self, s: ArrayLike) -> Array:
        """The derivative of the curvature dkappa/ds, 1/m²."""
        ...


def _series_of(function: Callable[[Array], ComplexArray], wavenumber: float) -> Series:
    """The Fourier series of a smooth function of the angle theta = wavenumber·s, of period 2·pi."""
    theta = 2.0 * np.pi * np.arange(MODES) / MODES
    orders = np.fft.fftfreq(MODES, 1.0 / MODES).astype(float)
    return Series(wavenumber * orders, np.fft.fft(function(theta)) / MODES)


class Arc:
    """A circle to port, or a straight line if the curvature is zero.

    Args:
        curvature: kappa >= 0, 1/m.
    """

    def __init__(self, curvature: float) -> None:
        self._kappa = curvature
        self.period, self.shortest_bend = 1.0, math.inf  # a constant curvature has any period

    def position(self, s: float) -> complex:
        """The position p = (exp(i·kappa·s) - 1)/(i·kappa), m."""
        half = 0.5 * self._kappa * s
        # The chord in the direction of half the turn: the same without the division by a curvature of zero.
        return complex(s * np.sinc(half / np.pi) * np.exp(1j * half))

    def course(self, s: float) -> float:
        """The course chi = kappa·s, rad."""
        return self._kappa * s

    def curvature(self, s: ArrayLike) -> Array:
        """The constant curvature, 1/m."""
        return np.full(np.shape(s), self._kappa)

    def curvature_slope(self, s: ArrayLike) -> Array:
        """Zero."""
        return np.zeros(np.shape(s))


class FigureEight:
    """A figure eight whose curvature is a sine of the arc length, the sine-generated curve that crosses itself.

    chi = A·(1 - cos(k·s)) and kappa = A·k·sin(k·s). It begins at the crossing; the long axis lies A - pi/2 = 47.8 degrees to
    port of the initial course.

    Args:
        length: Distance between the ends of the two loops, m.
    """

    def __init__(self, length: float) -> None:
        tangent = _series_of(lambda theta: np.exp(1j * CLOSING * (1.0 - np.cos(theta))), 1.0)
        # The mean, J0(A), is zero but for rounding; without it the series has an integral, and the curve closes exactly.
        unit = Series(tangent.w[1:], tangent.a[1:]).integral()
        self._k = abs(unit.at(1.5 * math.pi) - unit.at(0.5 * math.pi)) / length
        self._position = Series(unit.w * self._k, unit.a / self._k)
        self._start = self._position.at(0.0)
        self.period = self.shortest_bend = 2.0 * math.pi / self._k

    def position(self, s: float) -> complex:
        """The position p, m."""
        return self._position.at(s % self.period) - self._start

    def course(self, s: float) -> float:
        """The course chi = A·(1 - cos(k·s)), rad."""
        return CLOSING * (1.0 - math.cos(self._k * s))

    def curvature(self, s: ArrayLike) -> Array:
        """The curvature kappa = A·k·sin(k·s), 1/m."""
        return CLOSING * self._k * np.sin(self._k * np.asarray(s))

    def curvature_slope(self, s: ArrayLike) -> Array:
        """The derivative A·k²·cos(k·s), 1/m²."""
        return CLOSING * self._k**2 * np.cos(self._k * np.asarray(s))


class Square:
    """A square with rounded corners, begun in the middle of a side.

    In a corner kappa = pi/(2·c)·(1 - cos(2·pi·q/c)) with the arc length q since its beginning, so curvature and its derivative
    are continuous and the smallest radius is c/pi.

    Args:
        side: Length of a side between the vertices of the square, m.
        corner_radius: Smallest radius of a corner, m; a corner takes CORNER_EXTENT times that of both its sides.
    """

    def __init__(self, side: float, corner_radius: float) -> None:
        self._c = self.shortest_bend = math.pi * corner_radius
        self._wavenumber = 2.0 * math.pi / self._c
        tangent = _series_of(lambda theta: np.exp(-0.25j * np.sin(theta)), self._wavenumber)
        # exp(i·chi) is that series times exp(i·theta/4), so no wavenumber of the product is zero.
        self._corner = Series(tangent.w + 0.25 * self._wavenumber, tangent.a).integral()
        self._corner_start, self._corner_end = self._corner.at(0.0), self._corner.at(self._c)
        self._straight = 0.5 * side - (self._corner_end - self._corner_start).real
        self._half_diagonal = 0.5 * side * (1.0 + 1.0j)
        self.period = 2.0 * self._straight + self._c

    def position(self, s: float) -> complex:
        """The position p, m."""
        corners, rest = divmod(s, self.period)
        turn = 1j ** (int(corners) % 4)
        # The sum of a half diagonal and its quarter turns so far: a geometric series.
        return self._half_diagonal * (1.0 - turn) / (1.0 - 1.0j) + turn * self._from_side(rest)

    def _from_side(self, s: float) -> complex:
        """The position relative to the middle of the present side, in its direction."""
        q = s - self._straight
        if q <= 0.0:
            return complex(s)
        rounded = self._corner.at(min(q, self._c)) - self._corner_start
        return self._straight + rounded + 1j * max(q - self._c, 0.0)

    def course(self, s: float) -> float:
        """The course chi, in a corner that of its beginning + pi/2·(q/c - sin(2·pi·q/c)/(2·pi)), rad."""
        corners, rest = divmod(s, self.period)
        theta = self._wavenumber * min(max(rest - self._straight, 0.0), self._c)
        return 0.5 * math.pi * corners + 0.25 * (theta - math.sin(theta))

    def _theta(self, s: ArrayLike) -> Array:
        """The angle 2·pi·q/c, limited to [0, 2·pi]: on the sides it is at one of the two ends."""
        q = np.mod(s, self.period) - self._straight
        return self._wavenumber * np.clip(q, 0.0, self._c)

    def curvature(self, s: ArrayLike) -> Array:
        """The curvature kappa, 1/m."""
        return 0.25 * self._wavenumber * (1.0 - np.cos(self._theta(s)))

    def curvature_slope(self, s: ArrayLike) -> Array:
        """The derivative of the curvature, 1/m²."""
        return 0.25 * self._wavenumber**2 * np.sin(self._theta(s))
