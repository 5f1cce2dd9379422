"""Numbers that follow from the printed equations and values, and that docs/paper.md quotes."""

import math
from typing import Any

import numpy as np
import pytest

from vessel_hsmc_ros.control.interface.network import NetworkParameters, activations
from vessel_hsmc_ros.control.laws import make_controller
from vessel_hsmc_ros.control.laws.hierarchical_printed import HierarchicalPrintedParameters
from vessel_hsmc_ros.core.metrics import position_error
from vessel_hsmc_ros.core.schema import symbols
from vessel_hsmc_ros.plant.disturbance import PeriodicParameters, periodic_wrench
from vessel_hsmc_ros.plant.dynamics import acceleration, unforced_acceleration
from vessel_hsmc_ros.plant.hull_parameters import VesselParameters
from vessel_hsmc_ros.simulation.offline import load_scenario, simulate

SHIP = VesselParameters().coefficients()
GAINS = symbols(HierarchicalPrintedParameters())
PEAK = 0.5 * math.pi / PeriodicParameters().frequency  # s, when the disturbance of section 6.2 is at its largest
INITIAL_STATE = np.array([5.0, 1.0, math.pi / 4, 0.0, 0.0, 0.0])
INITIAL_REFERENCE = np.array([15.0, 15.0, 0.0, 0.0, 0.0, 0.0])


def test_the_printed_switching_gains_are_299_and_18_times_too_small() -> None:
    """Before (35): eta1 > a·(d2 + |z1|·d3) + b·d3, eta2 > d1 + |z2|·d3, at the origin and with perfect networks."""
    d1, d2, d3 = acceleration(periodic_wrench(PEAK, PeriodicParameters().constants()), SHIP)
    assert (d1, d2, d3) == pytest.approx((0.01833, 0.02923, 0.002987), rel=1e-3)
    assert (GAINS["a"] * d2 + GAINS["b"] * d3) / GAINS["eta1"] == pytest.approx(298.8, abs=0.1)
    assert d1 / GAINS["eta2"] == pytest.approx(18.33, abs=0.01)
    assert (d1 + 15.0 * d3) / GAINS["eta2"] == pytest.approx(63.1, abs=0.1)  # where the reference starts, z2 = 15 m


def test_the_printed_yaw_damping_is_530_times_the_one_of_the_equation() -> None:
    """E1, at 0.1 rad/s: the quadratic term is 2 % of the linear one; divided by m11, 10.6 times it."""
    as_printed = VesselParameters(as_printed=True).coefficients()
    assert SHIP.m33 / SHIP.m11 == pytest.approx(530.0)
    assert SHIP.d_r2 * 0.1 / SHIP.d_r == pytest.approx(0.02)
    assert as_printed.d_r2 * 0.1 / as_printed.d_r == pytest.approx(10.6)
    ratio = unforced_acceleration(0.0, 0.0, 0.1, as_printed)[2] / unforced_acceleration(0.0, 0.0, 0.1, SHIP)[2]
    assert ratio == pytest.approx(12.0, rel=0.03)


@pytest.mark.parametrize(("as_printed", "lowest"), [(False, 0.715), (True, 0.921)])
def test_with_the_printed_width_a_network_is_nearly_constant(as_printed: bool, lowest: float) -> None:
    """One neuron at 0.5 with width 5: its activation is lowest in a corner of |u| <= 3 m/s, |v|, |r| <= 1, and never above 1."""
    mu = NetworkParameters(centers_per_axis=1).centers()
    assert activations(np.array([-3.0, -1.0, -1.0]), mu, 5.0, as_printed) == pytest.approx([lowest], abs=1e-3)
    assert activations(mu[0], mu, 5.0, as_printed) == pytest.approx([1.0])


def test_with_a_of_1_a_straight_run_ends_at_z1_of_b_over_a() -> None:
    """E6: a0 = 1 reduces the error to 3 cm at 38 s; at 100 m from the origin the law is singular."""
    straight = {"reference_ship.yaw_moment": 0.0, "controller.hierarchical_printed.sway_weight": 1.0}
    run = simulate(load_scenario("case2_tracking", {**straight, "vessel_sim.duration": 39.0}))
    distance, along = position_error(run.state, run.reference), run.reference[:, 0]
    at = np.searchsorted(run.time, 38.0)
    assert distance[at] < 0.1
    assert along[at] == pytest.approx(98.3, abs=0.1)
    assert distance[-1] > 10.0
    assert run.time[np.argmax((distance > 1.0) & (run.time > 30.0))] == pytest.approx(38.6, abs=0.1)


def initial_wrench(distance: float) -> tuple[Any, Any]:
    """Command and terms of the law at the start of case 2, with both ships moved along x away from the origin."""
    shift = np.array([distance, 0.0, 0.0, 0.0, 0.0, 0.0])
    law = make_controller("hierarchical_printed", 0.01)
    inputs = np.array([1e5 / SHIP.m11, 0.0, 1e6 / SHIP.m33])
    return law.update(0.0, INITIAL_STATE + shift, INITIAL_REFERENCE + shift, inputs)


def test_the_law_depends_on_the_choice_of_the_origin() -> None:
    """z_e of (11) is not the distance of two ships: with a heading error it grows with the distance from the origin."""
    (near, _), terms = initial_wrench(0.0)
    (far, _), far_terms = initial_wrench(1000.0)
    assert (near, far) == pytest.approx((3.09e7, -9.08e8), rel=0.01)
    assert (terms.surge_error, far_terms.surge_error) == pytest.approx((-10.8, -303.7), rel=0.01)
