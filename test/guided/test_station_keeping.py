"""Station keeping about a pivot ahead of the origin: known answers, stability of its parts."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from compiling import only_compiled
from hypothesis import given
from hypothesis import strategies as st

from vessel_hsmc_ros.core.metrics import position_error, rms
from vessel_hsmc_ros.guided.current_estimate import current_at_rest
from vessel_hsmc_ros.guided.parameters import Gains, GuidedParameters, gains
from vessel_hsmc_ros.guided.station_keeping import (
    NO_SPIN,
    SLOWEST_SPIN,
    TURNS,
    Spin,
    count_turns,
    keeps_station,
    lever_arm,
    patience,
    pivot_ahead,
    pivoting_rate,
    spin_damping,
)
from vessel_hsmc_ros.law.known_vessel import INSTANT, KnownVessel
from vessel_hsmc_ros.runs.offline import load_scenario, simulate

speeds = st.floats(-0.2, 0.2)


def known(**changes: Any) -> Gains:
    vessel = replace(KnownVessel(**INSTANT), **changes)
    return gains(GuidedParameters(), vessel.as_controlled(), 0.02)


COUPLED = known(sway_yaw_inertia=6e5)
SLOW = known(sway_damping_rate=0.188)


@given(speeds, speeds)
def test_the_point_behind_the_origin_moves_across_the_hull_as_commanded(w_n: float, v_p: float) -> None:
    r = pivoting_rate(w_n, v_p, COUPLED.x_p, COUPLED.rho, COUPLED)
    assert v_p - (COUPLED.x_p + COUPLED.rho) * r == pytest.approx(w_n, abs=1e-12)


def test_no_sway_velocity_demands_a_faster_turn_than_the_limit() -> None:
    assert pivoting_rate(0.0, 10.0, COUPLED.x_p, COUPLED.rho, COUPLED) == COUPLED.r_rest
    assert COUPLED.r_rest >= COUPLED.r_max


def test_the_pivot_is_ahead_of_the_controlled_point_at_rest_only() -> None:
    assert pivot_ahead(0.0, COUPLED) == COUPLED.x_p == pytest.approx(6e5 / 177.9e3)
    assert pivot_ahead(COUPLED.U_s**2, COUPLED) == 0.5 * COUPLED.x_p
    assert pivot_ahead(1.0, COUPLED) < 0.01 * COUPLED.x_p
    assert pivot_ahead(0.0, known()) == 0.0


def test_a_ship_that_keeps_station_goes_on_with_it_for_twice_the_threshold() -> None:
    square = COUPLED.W_0**2
    kept = [(keeps_station(near, share * square, 0.0, COUPLED)) for near in (False, True) for share in (0.4, 0.6, 1.9, 2.1)]
    assert kept == [True, False, False, False, True, True, True, False]
    assert not keeps_station(True, 0.0, 2.1 * COUPLED.U_s**2, COUPLED)


@given(speeds, speeds)
def test_the_surge_speed_of_a_spin_takes_energy_out_of_the_sway(v_p: float, r: float) -> None:
    """The Coriolis force -m11·u·r does the work -m11·u·r·v_p on it."""
    assert spin_damping(v_p, r, SLOW) * r * v_p >= 0.0
    assert spin_damping(v_p, r, COUPLED) == 0.0


@pytest.mark.parametrize("r", [0.2, 0.5, 1.0, 3.0])
def test_a_hull_that_hardly_damps_sway_spirals_out_without_that_surge_speed_and_in_with_it(r: float) -> None:
    """States e_t, e_n, v of a hull with m11 = m22 that spins at r·k_p, with u = -k_p·e_t and a decay rate of half of k_p."""
    k, d = SLOW.k_p, 0.5 * SLOW.k_p
    r *= k

    def growth(beta: float) -> float:
        matrix = [[-k, r, beta], [-r, 0.0, 1.0], [k * r, 0.0, -d - beta * r]]
        return float(np.linalg.eigvals(np.array(matrix)).real.max())

    assert growth(0.0) > 0.0 > growth(spin_damping(1.0, r, SLOW))


@pytest.mark.parametrize("coupling", [0.0, 6e5, -6e5])
def test_an_offset_of_half_a_thousandth_of_the_length_stops_the_turn_to_the_heading_of_the_reference(coupling: float) -> None:
    g = known(sway_yaw_inertia=coupling)
    lever = g.rho + abs(coupling) / 177.9e3
    assert math.isclose(g.r_h * lever / g.k_p, 0.0005 * 32.0)


def test_the_lever_arm_is_long_in_a_current_and_short_without_one_or_under_way() -> None:
    still, in_current = (
        current_at_rest((0.0, 0.0), 0.0, COUPLED),
        current_at_rest((6.0 * COUPLED.c_rest, 8.0 * COUPLED.c_rest), 10.0 * COUPLED.c_rest, COUPLED),
    )
    assert current_at_rest((3.0 * COUPLED.c_rest, 0.0), 10.0 * COUPLED.c_rest, COUPLED) == 0.0, "one that turns with the ship"
    assert lever_arm(still, 0.0, COUPLED) == COUPLED.rho
    assert lever_arm(in_current, 0.0, COUPLED) == pytest.approx(COUPLED.rho_l, rel=1e-3)
    assert lever_arm(in_current, 100.0, COUPLED) == pytest.approx(COUPLED.rho, rel=0.01)


def test_a_ship_that_turns_at_rest_without_coming_closer_turns_more_slowly_until_it_does() -> None:
    far, turn = 0.2 * 32.0, COUPLED.T * 1.0
    spin = count_turns(NO_SPIN, far, 1.0, True, COUPLED)
    assert spin == Spin(0.0, far)
    for _ in range(round(2.0 * math.pi * TURNS / turn)):
        spin = count_turns(spin, 0.9 * far, -1.0, True, COUPLED)
    assert spin.angle == pytest.approx(2.0 * math.pi * TURNS, rel=0.01)
    assert patience(spin) == pytest.approx(1.0, rel=0.01)
    assert patience(spin._replace(angle=2.0 * spin.angle)) == pytest.approx(0.5, rel=0.01)
    assert patience(spin._replace(angle=1e6)) == SLOWEST_SPIN
    assert count_turns(spin, 0.6 * far, 1.0, True, COUPLED) == Spin(0.0, 0.6 * far)
    assert count_turns(spin, far, 1.0, False, COUPLED).angle == 0.0
    assert count_turns(spin, 0.9 * COUPLED.e_spin, 1.0, True, COUPLED).angle == 0.0


@only_compiled
@pytest.mark.parametrize("coupling", [0.0, 6e5])
@pytest.mark.parametrize("speed", [0.1, 0.25])
@pytest.mark.parametrize("lag", [None, 2.0])
def test_a_ship_keeps_its_position_in_a_current_from_the_side(coupling: float, speed: float, lag: float | None) -> None:
    """0.1 and 0.25 m/s of current: 2 to 4 m before the lever arm followed the current."""
    changes: dict[str, object] = {f"{node}.rate_hz": 20.0 for node in ("vessel_sim", "reference_ship", "controller")}
    changes |= {"vessel_sim.disturbance.current.north": speed, "vessel_sim.duration": 900.0, "controller.law": "guided"}
    if coupling:
        changes |= {f"vessel_sim.vessel.{each}": 0.4 * coupling for each in ("sway_damping_from_yaw", "yaw_damping_from_sway")}
        changes |= {f"{node}.vessel.sway_yaw_inertia": coupling for node in ("vessel_sim", "controller")}
    if lag is not None:
        changes |= {f"controller.vessel.{name}": value for name, value in INSTANT.items()}
        changes |= {
            f"{node}.{each}_lag": lag for node in ("vessel_sim.actuators", "controller.vessel") for each in ("surge", "yaw")
        }
    run = simulate(load_scenario("case3_stabilisation", changes))
    last = run.time >= 600.0
    assert rms(position_error(run.state[last], run.reference[last])) < 0.1


@given(st.floats(-5.0, 5.0), st.floats(-5.0, 5.0), st.floats(0.0, 25.0), st.sampled_from([0.2, 1.0, 3.0]))
def test_the_lever_arm_is_never_below_that_of_calm_water(east: float, north: float, square: float, ratio: float) -> None:
    g = COUPLED._replace(rho_l=ratio * COUPLED.rho)
    assert COUPLED.rho <= lever_arm(current_at_rest((east, north), math.hypot(east, north), g), square, g) <= max(g.rho_l, g.rho)
