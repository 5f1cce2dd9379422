"""The longest control period: derived for a surface over a double integrator, and met by the law on a ship that is one."""

from typing import Any

import numpy as np
import pytest
import sympy as sp

from vessel_hsmc_ros.control.laws import make_controller
from vessel_hsmc_ros.plant.dynamics import rk4
from vessel_hsmc_ros.plant.hull_parameters import VesselParameters

k, c, T, g = sp.symbols("k c T g", positive=True)
mode = sp.Symbol("lambda")

# e and de over one period T with dde = -(k + c)·de - k·c·e - w held: s = c·e + de falls by ds = -k·s where w = 0.
STEP = sp.Matrix([[1, T], [0, 1]])
HELD = sp.Matrix([T**2 / 2, T])
GAIN = sp.Matrix([[k * c, k + c]])
SURFACE = sp.Matrix([[c, 1]])


def polynomial(matrix):
    return (mode * sp.eye(matrix.rows) - matrix).det()


def test_the_loop_is_stable_exactly_when_the_gains_together_times_the_period_stay_below_2() -> None:
    """Jury's conditions for two modes: p(1) > 0, p(-1) > 0, |p(0)| < 1. The last two hold together when (k + c)·T < 2."""
    p = polynomial(STEP - HELD * GAIN)
    assert sp.simplify(p.subs(mode, 1) - k * c * T**2) == 0
    assert sp.simplify(p.subs(mode, -1) - 2 * (2 - (k + c) * T)) == 0
    assert sp.simplify(1 - p.subs(mode, 0) - T * (k + c - k * c * T / 2)) == 0
    # k·c·T/2 < k·c/(k + c) < k + c, so p(0) < 1; and p(0) > -1 is p(1) + p(-1) > 0
    assert sp.simplify(1 + p.subs(mode, 0) - (p.subs(mode, 1) + p.subs(mode, -1)) / 2) == 0


def test_the_surface_itself_does_not_shrink_by_1_minus_k_t() -> None:
    """ds = -k·s holds at the sample only: held over T, s(T) = (1 - k·T - c·k·T²/2)·s - (c·T)²/2·de."""
    e, de = sp.symbols("e de")
    ahead = (SURFACE * (STEP - HELD * GAIN) * sp.Matrix([e, de]))[0]
    s = c * e + de
    assert sp.expand(ahead - (1 - k * T - c * k * T**2 / 2) * s + (c * T) ** 2 / 2 * de) == 0


def test_the_adaptation_moves_the_limit_a_little() -> None:
    """Learning w by Euler steps of g·s, g = gamma2·b²·|H|² for yaw and gamma3·|H|² for surge, puts the root -1 at 2 + g·T²/2."""
    matrix = (STEP - HELD * GAIN).row_join(-HELD).col_join((T * g * SURFACE).row_join(sp.eye(1)))
    assert sp.simplify(-polynomial(matrix).subs(mode, -1) - 4 * (2 + g * T**2 / 2 - (k + c) * T)) == 0


def speeds_after(steps, period, slope):
    """Surge and yaw velocity at the end of a run on a ship without damping, with both reaching gains 50 1/s."""
    undamped: dict[str, Any] = {
        f"{axis}_damping{power}": 0.0 for axis in ("surge", "sway", "yaw") for power in ("", "_quadratic", "_cubic")
    }
    ship = VesselParameters(**undamped, sway_inertia=120e3).coefficients()
    gains = {f"{axis}_adaptation_gain": 0.0 for axis in ("surge", "sway", "yaw")}
    gains |= {"yaw_reaching_gain": 50.0, "surge_reaching_gain": 50.0, "yaw_switching_gain": 0.0, "surge_switching_gain": 0.0}
    gains |= {"heading_surface_slope": slope, "surge_surface_slope": slope, "sway_weight": 0.0}
    law = make_controller("hierarchical_printed", 0.001, **gains)  # learning nothing, it does not depend on its period
    state, still = np.array([1e-3, 0.0, 1e-3, 0.0, 0.0, 0.0]), np.zeros(6)
    for _ in range(steps):
        wrench, _ = law.update(0.0, state, still, np.zeros(3))
        state = rk4(state, wrench, (0.0, 0.0, 0.0), ship, period)
    return np.abs(state[[3, 5]])


@pytest.mark.parametrize("slope", [0.3, 30.0])
def test_the_law_has_the_derived_limit_on_an_undamped_ship(slope: float) -> None:
    """With a slope of 30 1/s the loop diverges at k·T = 1.3 already: k·T < 2 is not the condition."""
    limit = 2.0 / (50.0 + slope)
    assert np.all(speeds_after(1500, 0.98 * limit, slope) < 1e-6)
    start = speeds_after(1, 1.02 * limit, slope)
    assert np.all(speeds_after(200, 1.02 * limit, slope) > 10.0 * start)
