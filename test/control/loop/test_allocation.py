"""The allocation of many random demands to every kind of layout, compiled, and against independent computations."""

import math
import os
from typing import Any

import numpy as np
import pytest
from allocating import SURGE_SPEED, Array, allocated, demands_of
from compiling import only_compiled, repeated
from durations import rest_long
from scipy.optimize import linprog
from thruster_layouts import LAYOUTS, layout_of

from vessel_hsmc_ros.control.loop.allocation import Allocation
from vessel_hsmc_ros.core.thruster_layout import AZIMUTH, FIXED, ThrusterLayout
from vessel_hsmc_ros.plant.thruster_plant import ThrusterState, hull_wrench, thrusters_of

COUNT = repeated(20_000)
STEPS = repeated(int(os.environ.get("ALLOCATION_STEPS", "10000")))
"""Demands with limited rates, which take longer; ALLOCATION_STEPS=100000 in the environment for as many as without."""


@pytest.mark.parametrize("name", LAYOUTS)
def test_an_attainable_wrench_is_reproduced(name: str) -> None:
    layout = layout_of(name)
    inside, _ = demands_of(layout, COUNT)
    wrench, thrust, angle = allocated(layout, inside)
    assert_within_limits(layout, thrust, angle)
    scale = np.abs(inside).max(axis=0)
    assert np.abs((wrench[:, [0, 2]] - inside) / scale).max() < 1e-9


def test_a_clock_that_is_set_back_gives_no_time_to_change_and_then_goes_on() -> None:
    made = Allocation(layout_of("twin", thrust_rate=[10.0]))
    thrusts = [made.step_at(round(1e9 * at), (200.0, 0.0), 0.0).thrust[0] for at in (50.0, 51.0, 52.0, 7.0, 7.5, 3.0, 4.0)]
    assert thrusts == pytest.approx([0.0, 10.0, 20.0, 20.0, 25.0, 25.0, 35.0])


@pytest.mark.parametrize("name", LAYOUTS)
def test_after_each_stop_every_thrust_begins_at_zero_and_every_angle_where_it_was(name: str) -> None:
    largest = max(LAYOUTS[name]["thrust_ahead"])
    layout = layout_of(name, thrust_rate=[2.0 * largest], angle_rate=[0.6])
    made, (force, moment) = Allocation(layout), layout.limits()
    for _ in range(2):
        for _ in range(12):
            before = made.step(0.5 * force, 0.3 * moment, 0.5, SURGE_SPEED)
        assert np.count_nonzero(before.thrust) > 1 or len(before.thrust) == 1
        made.stop()
        after = made.step(0.5 * force, 0.3 * moment, 0.05, SURGE_SPEED)
        assert np.abs(after.thrust).max() <= 0.1 * largest * (1.0 + 1e-12)
        turned = np.subtract(after.angle, before.angle)
        assert np.abs((turned + math.pi) % (2.0 * math.pi) - math.pi).max() <= 0.03 + 1e-12


def assert_within_limits(layout: ThrusterLayout, thrust: Array, angle: Array) -> None:
    for i, t in enumerate(layout.thrusters()):
        assert (thrust[:, i] <= t.thrust_ahead).all()
        assert (thrust[:, i] >= -t.thrust_astern).all()
        assert (np.abs(angle[:, i]) <= (abs(t.angle) if t.kind == FIXED else t.angle_limit)).all()


@pytest.mark.parametrize("name", LAYOUTS)
def test_limits_and_rates_are_never_exceeded(name: str) -> None:
    largest = max(LAYOUTS[name]["thrust_ahead"])
    layout = layout_of(name, thrust_rate=[2.0 * largest], angle_rate=[0.6])
    elapsed = 0.05
    _, thrust, angle = allocated(layout, demands_of(layout, STEPS)[1], elapsed)
    assert_within_limits(layout, thrust, angle)
    turns = np.diff(angle, axis=0)
    turns = (turns + math.pi) % (2.0 * math.pi) - math.pi
    assert np.abs(np.diff(thrust, axis=0)).max() <= 2.0 * largest * elapsed * (1.0 + 1e-12)
    assert np.abs(turns).max() <= 0.6 * elapsed + 1e-12
    assert np.abs(thrust[0]).max() <= 2.0 * largest * elapsed


@pytest.mark.parametrize("name", LAYOUTS)
def test_the_allocated_wrench_is_that_of_the_plant(name: str) -> None:
    """The plant computes it on its own."""
    layout = layout_of(name)
    wrench, thrust, angle = allocated(layout, demands_of(layout, 300)[1])
    assert_within_limits(layout, thrust, angle)
    c = thrusters_of(layout, 1.0)
    for row in range(300):
        state = ThrusterState(thrust[row], angle[row])
        np.testing.assert_allclose(wrench[row], hull_wrench(state, SURGE_SPEED, c), rtol=1e-9, atol=1e-9)


def nearest(columns: Array, low: Array, high: Array, demand: Array) -> Array:
    """Moment before force, by two linear programmes: the nearest moment, then with it the nearest surge force.

    Args:
        columns: Surge force and yaw moment per variable, (2, m).
        low, high: Limits of the variables, (m,).
        demand: Surge force and yaw moment.
    """
    m = columns.shape[1]
    bounds = [*zip(low, high, strict=True), (0.0, None)]
    cost = np.r_[np.zeros(m), 1.0]
    found = np.empty(2)
    equal: dict[str, Any] = {}
    for axis in (1, 0):
        row = columns[axis]
        apart = np.array([[*row, -1.0], [*-row, -1.0]])
        solved = linprog(cost, apart, [demand[axis], -demand[axis]], bounds=bounds, **equal)
        found[axis] = row @ solved.x[:m]
        equal = {"A_eq": [[*row, 0.0]], "b_eq": [found[axis]]}
    return found


@pytest.mark.parametrize("name", rest_long(["twin", "bow_thruster", "four"], 2))
def test_beyond_the_attainable_set_the_wrench_is_nearest_moment_before_force(name: str) -> None:
    """Against linear programmes."""
    layout = layout_of(name)
    each = layout.thrusters()
    columns = np.array([(math.cos(t.angle), t.x * math.sin(t.angle) - t.y * math.cos(t.angle)) for t in each]).T
    low, high = np.array([-t.thrust_astern for t in each]), np.array([t.thrust_ahead for t in each])
    demands = demands_of(layout, 120, seed=1)[1]
    expected = np.array([nearest(columns, low, high, demand) for demand in demands])
    wrench, _, _ = allocated(layout, demands)
    beyond = np.abs(expected - demands).max(axis=1) > 1e-6
    assert 0 < beyond.sum() < len(beyond)
    np.testing.assert_allclose(wrench[:, [0, 2]], expected, atol=1e-7 * np.abs(expected).max())


def grid_of(layout: ThrusterLayout, count: int) -> Array:
    """Attainable wrenches of a grid of thrusts and angles of one thruster, (m, 2)."""
    (t,) = layout.thrusters()
    limit = t.largest_angle if t.kind != AZIMUTH else t.angle_limit
    c = thrusters_of(layout, 1.0)
    thrusts = np.unique(np.r_[np.linspace(-t.thrust_astern, t.thrust_ahead, count), 0.0])
    pairs = [(thrust, angle) for thrust in thrusts for angle in np.linspace(-limit, limit, count)]
    return np.array([hull_wrench(ThrusterState([p], [d]), SURGE_SPEED, c) for p, d in pairs])[:, [0, 2]]


@pytest.mark.parametrize("name", ["outboard", "rudder"])
def test_the_wrench_of_one_steered_thruster_is_nearest_moment_before_force(name: str) -> None:
    """Against a grid: no attainable wrench is nearer by the moment, and of those as near in moment none by the force."""
    layout = layout_of(name)
    grid = grid_of(layout, 301)
    demands = demands_of(layout, 300, seed=2)[1]
    wrench = allocated(layout, demands)[0][:, [0, 2]]
    scale = np.abs(grid).max(axis=0)
    for demand, given in zip(demands, wrench, strict=True):
        off, others = np.abs(given - demand) / scale, np.abs(grid - demand) / scale
        assert off[1] <= others[:, 1].min() + 1e-9
        as_near = others[others[:, 1] <= off[1] + 1e-9]
        assert not len(as_near) or off[0] <= as_near[:, 0].min() + 1e-9


def test_beyond_their_thrust_azimuths_give_the_nearest_wrench_moment_before_force() -> None:
    """Against linear programmes with polygons of 360 sides in the place of the discs."""
    layout = layout_of("azimuths")
    angles = np.linspace(0.0, 2.0 * math.pi, 361)[:-1]
    each = layout.thrusters()
    # A force in the polygon is a mixture of its corners; a weight for each, of a sum of at most 1, bounded by scaling.
    demands = demands_of(layout, 60, seed=3)[1]
    corners = [np.array([np.cos(angles), t.x * np.sin(angles)]) * t.thrust_ahead for t in each]
    columns = np.hstack(corners)
    sums = np.kron(np.eye(2), np.ones(len(angles)))
    wrench = allocated(layout, demands)[0][:, [0, 2]]
    for demand, given in zip(demands, wrench, strict=True):
        expected, equal, right = np.empty(2), np.empty((0, columns.shape[1] + 1)), []
        for axis in (1, 0):
            row = columns[axis]
            apart = np.array([[*row, -1.0], [*-row, -1.0], *np.column_stack((sums, np.zeros(2)))])
            solved = linprog(
                np.r_[np.zeros(len(row)), 1.0],
                apart,
                [demand[axis], -demand[axis], 1.0, 1.0],
                A_eq=equal if len(right) else None,
                b_eq=right or None,
            )
            expected[axis] = row @ solved.x[:-1]
            equal, right = np.array([[*row, 0.0]]), [expected[axis]]
        assert given[1] == pytest.approx(expected[1], abs=1e-4 * 1600.0)
        # Near the largest moment the surge force changes with the root of the moment, and the polygon is inside of the disc.
        assert abs(given[0] - demand[0]) <= abs(expected[0] - demand[0]) + 0.02 * 900.0


def test_inside_the_limits_the_forces_are_those_of_least_squares() -> None:
    layout = layout_of("four")
    each = layout.thrusters()
    columns = np.array([(math.cos(t.angle), t.x * math.sin(t.angle) - t.y * math.cos(t.angle)) for t in each]).T
    largest = np.array([t.thrust_ahead for t in each])
    # The pseudo-inverse, with each thrust in units of its limit.
    expected = largest * (np.linalg.pinv(columns * largest) @ (20.0, -15.0))
    given = Allocation(layout).step(20.0, -15.0, 1.0)
    np.testing.assert_allclose(given.thrust, expected, rtol=1e-9)
    assert not given.saturated


def test_a_demand_that_cannot_be_met_is_saturated_and_keeps_the_moment() -> None:
    given = Allocation(layout_of("twin")).step(1e4, 40.0, 1.0)
    assert given.saturated
    assert given.wrench[2] == pytest.approx(40.0)
    assert given.thrust[1] == pytest.approx(119.7)


def test_an_azimuth_reverses_its_thrust_instead_of_turning_round() -> None:
    allocation = Allocation(layout_of("azimuths", thrust_astern=[300.0]))
    assert allocation.step(100.0, 0.0, 1.0).angle == [0.0, 0.0]
    backwards = allocation.step(-100.0, 0.0, 1.0)
    assert backwards.angle == [0.0, 0.0]
    assert sum(backwards.thrust) == pytest.approx(-100.0)
    allocation.step(0.0, 0.0, 1.0)
    assert allocation.step(0.0, 0.0, 1.0).angle == [0.0, 0.0]


def test_an_azimuth_that_cannot_reverse_turns_round() -> None:
    allocation = Allocation(layout_of("azimuths"))
    allocation.step(100.0, 0.0, 1.0)
    given = allocation.step(-100.0, 0.0, 1.0)
    assert np.cos(given.angle) == pytest.approx([-1.0, -1.0])
    assert given.wrench[0] == pytest.approx(-100.0)


def test_a_slow_azimuth_gives_the_part_of_its_force_that_points_its_way() -> None:
    allocation = Allocation(layout_of("azimuths", angle_rate=[0.2]))
    turned = [allocation.step(0.0, 600.0, 1.0) for _ in range(12)]
    assert turned[0].angle == pytest.approx([0.2, -0.2])
    # At first hardly any of the force: the thrust does not grow to make up for the direction.
    assert turned[0].thrust == pytest.approx([t * math.sin(0.2) for t in turned[-1].thrust])
    assert not turned[-1].saturated
    assert turned[-1].wrench[2] == pytest.approx(600.0)


def test_after_a_stop_thrusts_grow_from_zero_and_azimuths_turn_on_from_where_they_are() -> None:
    layout = {"angle_rate": [0.2], "thrust_rate": [50.0]}
    allocation = Allocation(layout_of("azimuths", **layout))
    for _ in range(6):
        before = allocation.step(0.0, 600.0, 1.0)
    allocation.stop()
    after = allocation.step(0.0, 600.0, 1.0)
    assert after.angle == pytest.approx([before.angle[0] + 0.2, before.angle[1] - 0.2])
    assert after.thrust == pytest.approx([50.0, 50.0])
    assert min(before.thrust) > 100.0


def test_fixed_thrusters_make_up_for_a_slow_rudder() -> None:
    allocation = Allocation(layout_of("rudder_and_bow_thruster", angle_rate=[0.02]))
    first = allocation.step(500.0, 250.0, 1.0, SURGE_SPEED)
    assert abs(first.angle[0]) == pytest.approx(0.02)
    assert first.wrench[2] == pytest.approx(250.0)


@pytest.mark.parametrize("surge_speed", [3.0, 0.5, -0.5, -3.0])
def test_a_rudder_that_is_still_turned_gives_the_wrench_of_the_plant_ahead_and_astern(surge_speed: float) -> None:
    layout = layout_of("rudder", angle_rate=[0.1])
    allocation = Allocation(layout)
    for _ in range(10):
        allocation.step(500.0, 900.0, 0.5, 3.0)
    given = allocation.step(-300.0, 0.0, 0.5, surge_speed)
    assert abs(given.angle[0]) > 0.1
    expected = hull_wrench(ThrusterState(given.thrust, given.angle), surge_speed, thrusters_of(layout, 1.0))
    assert given.wrench == pytest.approx(expected)
    assert abs(expected[2]) > 1.0


def test_no_time_allows_no_change_where_rates_are_limited() -> None:
    allocation = Allocation(layout_of("twin", thrust_rate=[10.0]))
    assert allocation.step(50.0, 0.0, 0.0).thrust == [0.0, 0.0]
    assert allocation.step(50.0, 0.0, 0.5).thrust == [5.0, 5.0]
    allocation.reset()
    assert allocation.step(50.0, 0.0, 0.0).thrust == [0.0, 0.0]
    assert Allocation(layout_of("twin")).step(50.0, 0.0, 0.0).thrust == pytest.approx([25.0, 25.0])


@only_compiled
@pytest.mark.parametrize("name", LAYOUTS)
def test_the_compiled_allocation_is_bit_identical_to_the_interpreted_one(name: str) -> None:
    layout = layout_of(name, angle_rate=[0.5])
    demands = np.concatenate([part[:40] for part in demands_of(layout, 100, seed=4)])
    wrench, thrust, angle = allocated(layout, demands, 0.2)
    allocation = Allocation(layout)
    for k, demand in enumerate(demands):
        given = allocation.step(float(demand[0]), float(demand[1]), 0.2, SURGE_SPEED)
        assert given.thrust == thrust[k].tolist()
        assert given.angle == angle[k].tolist()
        assert given.wrench == tuple(wrench[k].tolist())
