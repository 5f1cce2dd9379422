"""The drift angle satisfies the sway equation of (6) for hulls of every kind."""

from typing import Any

import numpy as np
import pytest
from hulls import BOAT, BOAT_SYMBOLS, CYBERSHIP_2, MILLIAMPERE, hull

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.guidance.curve_motion import PeriodicDrift, at_speed, samples, velocities
from vessel_hsmc_ros.guidance.curves import Arc, FigureEight, Square
from vessel_hsmc_ros.guidance.route import Element, Phase, Route, SpeedProfile, straight, turn
from vessel_hsmc_ros.guidance.route_motion import drift_along
from vessel_hsmc_ros.plant.dynamics import Vessel, unforced_acceleration, unforced_sway
from vessel_hsmc_ros.plant.hull_parameters import VesselParameters

PAPER = VesselParameters().coefficients()
HULLS = {
    "the paper's ship": PAPER,
    "a 4 m boat": BOAT,
    "equal inertias": BOAT._replace(m22=525.0),
    "a smaller sway inertia": BOAT._replace(m22=300.0),
    "a large sway inertia": BOAT._replace(m22=2000.0, d_v=50.0),
    "quadratic damping only": BOAT._replace(d_v=0.0, d_v2=300.0),
}

hulls = pytest.mark.parametrize("vessel", HULLS.values(), ids=HULLS)


def sway_residual(curve: Any, speed: float, vessel: Vessel) -> float:
    """Largest deviation from dv = f_v(u, v, r) between the samples of the solution, m/s²."""
    s = np.random.default_rng(1).uniform(0.0, curve.period, 1000)
    solution = PeriodicDrift(curve, speed, vessel)
    u, v, r, _, dv, _ = velocities(curve, speed, solution.at(s), at_speed(s))
    return float(np.abs(dv - unforced_acceleration(u, v, r, vessel)[1]).max())


@hulls
def test_a_circle_is_a_steady_turn(vessel: Vessel) -> None:
    assert sway_residual(Arc(0.05), 1.0, vessel) < 1e-12
    drift = PeriodicDrift(Arc(0.05), 1.0, vessel).at(123.0)
    assert drift.beta < 0.0  # towards the outside of the turn
    assert drift[1:] == (0.0, 0.0)


@hulls
def test_figure_eight_and_square_satisfy_the_sway_equation(vessel: Vessel) -> None:
    assert sway_residual(FigureEight(60.0), 1.0, vessel) < 2e-5
    assert sway_residual(Square(40.0, 6.0), 1.0, vessel) < 2e-5


def test_on_a_line_there_is_no_drift_even_without_damping() -> None:
    assert PeriodicDrift(Arc(0.0), 1.0, BOAT._replace(d_v=0.0, d_v2=0.0)).at(7.0) == (0.0, 0.0, 0.0)


def test_the_samples_of_a_period_are_values_of_the_series() -> None:
    curve = Square(40.0, 6.0)
    solution = PeriodicDrift(curve, 1.0, BOAT)
    np.testing.assert_allclose(solution.at(samples(curve)), solution.sampled(), atol=1e-12)


COUPLED = {
    "CyberShip II": (hull(**CYBERSHIP_2), 0.3, 8.0),
    "milliAmpere": (hull(**MILLIAMPERE), 1.0, 60.0),
    "a boat with m23 < 0": (hull(**BOAT_SYMBOLS, m23=-120.0, d_y_r=40.0, d_n_v=30.0), 1.0, 60.0),
}


@pytest.mark.parametrize(("vessel", "speed", "size"), COUPLED.values(), ids=COUPLED)
def test_along_a_curve_a_coupled_hull_needs_no_sway_force(vessel: Vessel, speed: float, size: float) -> None:
    """m22·dv + m23·dr = -(C·nu + D·nu)_Y between the samples of the solution."""
    for curve in (Arc(2.0 / size), FigureEight(size), Square(size, 0.25 * size)):
        solution = PeriodicDrift(curve, speed, vessel)
        # Between the samples |v|r and |r|v have kinks where a velocity changes its sign.
        for s, tolerance in ((samples(curve), 1e-4), (np.random.default_rng(1).uniform(0.0, curve.period, 500), 1e-2)):
            motion = velocities(curve, speed, solution.at(s), at_speed(s))
            missing = [
                dv - unforced_sway(u, v, r, dr, vessel)
                for u, v, r, dv, dr in zip(motion.u, motion.v, motion.r, motion.dv, motion.dr, strict=True)
            ]
            assert np.abs(missing).max() < tolerance * np.abs(motion.r * motion.u).max()


@pytest.mark.long
def test_a_solution_that_takes_too_many_instants_is_refused_for_that_reason() -> None:
    route = Route([Element(straight(20.0), 0, turn=False), Element(turn(1.5, 10.0, 5.0), 0, turn=True)], (0.0, 0.0, 0.0))
    profile = SpeedProfile([Phase(route.length, 1.0, 1.0)])
    times = np.linspace(0.0, route.length, 50)
    with pytest.raises(ParameterError, match=r"the drift angle along this path needs more than 200000 instants; a shorter path"):
        drift_along(route, profile, times, BOAT, tolerance=2.3e-14)
