"""The selectable interpretations of the paper, by their effect."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vessel_hsmc_ros.control.laws import make_controller
from vessel_hsmc_ros.control.laws.hierarchical_printed import SWITCHING, HierarchicalPrintedParameters, switch
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.plant.dynamics import rk4
from vessel_hsmc_ros.plant.hull_parameters import VesselParameters
from vessel_hsmc_ros.simulation.offline import load_scenario, simulate

MIRROR = np.array([1.0, -1.0, -1.0, 1.0, -1.0, -1.0])

places, velocities = st.floats(-50.0, 50.0), st.floats(-3.0, 3.0)
states = st.tuples(places, places, st.floats(-3.0, 3.0), velocities, velocities, velocities).map(np.array)


@pytest.mark.parametrize(
    ("kind", "expected"),
    [
        ("sgn", [-1.0, -1.0, 0.0, 1.0, 1.0]),
        ("saturation", [-1.0, -0.5, 0.0, 0.5, 1.0]),
        ("tanh", np.tanh([-3.0, -0.5, 0.0, 0.5, 3.0])),
    ],
)
def test_the_switching_functions_match_values_by_hand(kind: str, expected) -> None:
    assert [switch(S, 0.02, SWITCHING.index(kind)) for S in (-0.06, -0.01, 0.0, 0.01, 0.06)] == pytest.approx(list(expected))


@pytest.mark.parametrize(("switching", "chatters"), [("sgn", True), ("saturation", False), ("tanh", False)])
def test_sgn_chatters_at_rest_and_a_boundary_layer_does_not(switching: str, chatters: bool) -> None:
    """With k2·T = 1 and without disturbance, sgn makes S2 oscillate between ±eta2·T, with force steps of ±2·eta2·m11 = 240 N."""
    changes = {"vessel_sim.duration": 40.0, "controller.hierarchical_printed.switching": switching}
    force = simulate(load_scenario("case3_calm", changes)).wrench[-101:, 0]
    steps = np.abs(np.diff(force))
    if chatters:
        assert steps == pytest.approx(4.0 * 0.001 * 120e3, rel=0.01)
    else:
        assert np.max(steps) < 1.0


@given(states, states)
def test_a_switched_weight_gives_both_terms_of_the_yaw_surface_one_sign(state, reference) -> None:
    terms = {
        kind: make_controller("hierarchical_printed", 0.01, sway_weight_sign=kind).update(0.0, state, reference, np.zeros(3))[1]
        for kind in ("constant", "switched")
    }
    sway, heading = 0.001 * terms["switched"].sway_surface, 100.0 * terms["switched"].heading_surface
    assert terms["constant"].yaw_surface == pytest.approx(sway + heading)
    assert abs(terms["switched"].yaw_surface) == pytest.approx(abs(sway) + abs(heading))


def test_with_the_printed_damping_a_steady_turn_solves_its_polynomial() -> None:
    printed = VesselParameters(as_printed=True).coefficients()
    state = np.zeros(6)
    for _ in range(4000):
        state = rk4(state, (0.0, 1e6), (0.0, 0.0, 0.0), printed, 0.01)
    share = 636e5 / 120e3
    roots = np.roots([share * 80.2e4, share * 160.4e4, 802e4, -1e6])
    assert state[5] == pytest.approx(float(roots.real[roots.real > 0.0][0]), rel=1e-9)
    assert state[5] < 0.3 * 1e6 / 802e4


@given(states, states)
def test_with_zero_weights_the_law_is_symmetric_to_port_and_starboard(state, reference) -> None:
    wrenches = [
        make_controller("hierarchical_printed", 0.01).update(0.0, side * state, side * reference, np.zeros(3))[0]
        for side in (1.0, MIRROR)
    ]
    assert wrenches[1] == pytest.approx(wrenches[0] * [1.0, -1.0], rel=1e-9, abs=1e-3)


def test_the_yaw_moment_is_continuous_at_z1_zero() -> None:
    """On the circle the origin comes abeam twice a turn; its moment bends no more there than elsewhere."""
    run = simulate(load_scenario("case2_tracking", {"vessel_sim.duration": 60.0}))
    x, y, psi = run.state[2000:, :3].T
    z1 = x * np.cos(psi) + y * np.sin(psi)
    bends = np.abs(np.diff(run.wrench[2000:, 1], n=2))
    crossings = np.flatnonzero(z1[1:-2] * z1[2:-1] <= 0.0)
    assert len(crossings) >= 2
    assert np.max(bends[crossings]) < 1.0  # N·m, beside a moment of 1e6; where S1 changes its sign, sgn makes 5000


def test_an_unstable_gain_is_rejected_while_the_law_runs_and_changes_nothing() -> None:
    law = make_controller("hierarchical_printed", 0.01)
    motion = np.array([1.0, 2.0, 0.2, 0.0, 0.0, 0.0]), np.zeros(6), np.zeros(3)
    with pytest.raises(ParameterError, match=r"surge_reaching_gain = 250 1/s is unstable .* below 199\.7 1/s"):
        law.retune(HierarchicalPrintedParameters(surge_reaching_gain=250.0))
    untouched = make_controller("hierarchical_printed", 0.01).update(0.0, *motion)[0]
    np.testing.assert_array_equal(law.update(0.0, *motion)[0], untouched)
    assert math.isfinite(untouched[0])
