"""The plant of thrusters: the wrench of each kind, ahead and astern, and what limits each thruster by itself."""

import math
from typing import Any

import numpy as np
import pytest
from thruster_layouts import layout_of

from vessel_hsmc_ros.core.exceptions import SimulationError
from vessel_hsmc_ros.core.thruster_layout import ThrusterLayout
from vessel_hsmc_ros.plant.devices import ActuatorParameters
from vessel_hsmc_ros.plant.disturbance import CurrentParameters
from vessel_hsmc_ros.plant.hull_parameters import ShipParameters
from vessel_hsmc_ros.plant.simulator import DisturbanceParameters, PlantParameters
from vessel_hsmc_ros.plant.thruster_plant import (
    ThrusterPlant,
    Thrusters,
    ThrusterState,
    hull_wrench,
    idle,
    make_plant,
    respond,
    thrusters_of,
)

PERIOD = 0.1
THREE = ThrusterLayout(
    names=("bow", "pod", "screw"),
    kinds=("fixed", "azimuth", "rudder"),
    x=(3.0, -1.0, -4.0),
    y=(0.0, 0.7, -0.3),
    angle=(0.5 * math.pi, 0.0, 0.0),
    thrust_ahead=(100.0, 200.0, 400.0),
    thrust_astern=(90.0, 150.0, 250.0),
    thrust_rate=(math.inf, 500.0, 800.0),
    lag=(0.0, 0.0, 0.4),
    angle_limit=(math.pi, math.pi, 0.6),
    angle_rate=(math.inf, 2.0, 1.5),
    lift=(0.0, 0.0, 60.0),
    lift_quadratic=(0.0, 0.0, 30.0),
    slipstream=(0.0, 0.0, 0.003),
)


def plant(**changes: Any) -> ThrusterPlant:
    parameters = PlantParameters(
        vessel=ShipParameters(thrusters=THREE), actuators=ActuatorParameters(kind="thrusters"), **changes
    )
    made = make_plant(parameters, PERIOD)
    assert isinstance(made, ThrusterPlant)
    return made


@pytest.mark.parametrize("u", [2.0, 0.0, -1.5])
@pytest.mark.parametrize("thrust", [300.0, 0.0, -200.0])
@pytest.mark.parametrize("angle", [0.3, -0.5])
def test_a_rudder_lifts_with_the_flow_and_with_its_screw_ahead_only(u: float, thrust: float, angle: float) -> None:
    c = thrusters_of(layout_of("rudder"), PERIOD)
    lift = (60.0 * angle - 30.0 * abs(angle) * angle) * (u * abs(u) + 0.003 * max(thrust, 0.0))
    found = hull_wrench(ThrusterState([thrust], [angle]), u, c)
    assert found == pytest.approx((thrust, lift, -4.0 * lift))


@pytest.mark.parametrize("thrust", [80.0, -60.0])
@pytest.mark.parametrize("angle", [0.0, 2.5, -0.8])
def test_a_thrust_acts_in_its_direction_at_its_place(thrust: float, angle: float) -> None:
    c = thrusters_of(THREE, PERIOD)
    along, port = thrust * math.cos(angle), thrust * math.sin(angle)
    pod = hull_wrench(ThrusterState([0.0, thrust, 0.0], [0.5 * math.pi, angle, 0.0]), 1.3, c)
    assert pod == pytest.approx((along, port, -1.0 * port - 0.7 * along))
    bow = hull_wrench(ThrusterState([thrust, 0.0, 0.0], [0.5 * math.pi, angle, 0.0]), 1.3, c)
    assert bow == pytest.approx((0.0, thrust, 3.0 * thrust))


def steps(thrust: list[float], angle: list[float], count: int) -> tuple[np.ndarray, np.ndarray]:
    """Thrusts and angles from rest under constant demands, (count, 3) each."""
    state, c, found = idle(THREE), thrusters_of(THREE, PERIOD), []
    for _ in range(count):
        respond(state, thrust, angle, c)
        found.append((state.thrust.copy(), state.angle.copy()))
    thrusts, angles = zip(*found, strict=True)
    return np.array(thrusts), np.array(angles)


@pytest.mark.parametrize(("side", "limits"), [(1.0, (100.0, 200.0, 400.0)), (-1.0, (90.0, 150.0, 250.0))])
def test_each_thrust_follows_with_its_own_limit_rate_and_lag_ahead_and_astern(side: float, limits: tuple[float, ...]) -> None:
    thrust, _ = steps([side * 1e4] * 3, [0.0] * 3, 60)
    time = PERIOD * np.arange(1, 61)
    np.testing.assert_allclose(thrust[:, 0], side * limits[0])
    np.testing.assert_allclose(thrust[:, 1], side * np.minimum(500.0 * time, limits[1]))
    changes = np.abs(np.diff(thrust[:, 2], prepend=0.0))
    assert changes.max() <= 80.0 + 1e-9
    # After the rate limit, the exact response of the lag.
    left = limits[2] - side * thrust[:, 2]
    np.testing.assert_allclose(left[11:40] / left[10:39], math.exp(-PERIOD / 0.4), rtol=1e-9)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_an_azimuth_turns_the_shorter_way_round_and_a_rudder_up_to_its_limit(side: float) -> None:
    state, c = idle(THREE), thrusters_of(THREE, PERIOD)
    found = []
    for wanted in (2.9, -2.9):  # 0.48 rad across the stern, not 5.8 back
        for _ in range(20):
            respond(state, [0.0] * 3, [9.0, side * wanted, side * wanted], c)
            found.append(state.angle.copy())
    angles = np.array(found)
    assert np.all(angles[:, 0] == 0.5 * math.pi)
    np.testing.assert_allclose(side * angles[:15, 1], np.minimum(0.2 * np.arange(1, 16), 2.9))
    assert np.all(np.cos(angles[20:, 1]) < -0.9)
    assert angles[-1, 1] == pytest.approx(-2.9 * side)
    np.testing.assert_allclose(side * angles[:20, 2], np.minimum(0.15 * np.arange(1, 21), 0.6))
    assert angles[-1, 2] == pytest.approx(-0.6 * side)


def test_the_flow_at_a_rudder_is_that_through_the_water() -> None:
    """A ship that drifts with the current has no flow at its rudder, whatever its heading."""
    for psi in (0.0, 2.0, -1.1):
        east, north = 1.5 * math.cos(psi), 1.5 * math.sin(psi)
        with_current = {
            "disturbance": DisturbanceParameters(current=CurrentParameters(east, north)),
            "initial_pose": (0.0, 0.0, psi),
        }
        drifting, lying = (plant(**with_current, initial_velocity=(u, 0.0, 0.0)) for u in (1.5, 0.0))
        for made, flow in ((drifting, 0.0), (lying, -2.25)):
            for _ in range(10):
                _, sway, _ = made.applied_thrusts([0.0] * 3, [0.0, 0.0, 0.4])
            assert sway == pytest.approx((60.0 * 0.4 - 30.0 * 0.16) * flow, abs=1e-9)


def test_after_each_reset_the_thrusters_are_idle_again() -> None:
    made = plant()
    demands = [50.0, -80.0, 300.0], [0.0, 1.0, -0.3]
    first = [made.applied_thrusts(*demands) for _ in range(7)]
    assert first[0] != first[-1]
    for _ in range(2):
        made.reset()
        assert [made.applied_thrusts(*demands) for _ in range(7)] == first


@pytest.mark.parametrize(("index", "name"), enumerate(THREE.names))
@pytest.mark.parametrize("wrong", [math.nan, math.inf, -math.inf])
def test_a_demand_that_is_not_finite_is_refused_with_its_thruster_and_changes_nothing(
    index: int, name: str, wrong: float
) -> None:
    made, other = plant(), plant()
    for part in range(2):
        demands = [[10.0] * 3, [0.1] * 3]
        demands[part][index] = wrong
        with pytest.raises(SimulationError, match=f"demand of thruster {name} must be finite numbers .*{wrong}"):
            made.applied_thrusts(*demands)
    assert made.applied_thrusts([10.0] * 3, [0.1] * 3) == other.applied_thrusts([10.0] * 3, [0.1] * 3)


def test_every_datum_of_a_thruster_stands_in_its_own_place() -> None:
    c = thrusters_of(THREE, PERIOD)
    expected = Thrusters(
        (0.0, 1.0, 2.0),
        THREE.x,
        THREE.y,
        THREE.thrust_ahead,
        THREE.thrust_astern,
        (math.inf, 50.0, 80.0),
        (1.0, 1.0, 1.0 - math.exp(-0.25)),
        THREE.angle_limit,
        (math.inf, 0.2, 0.15),
        THREE.lift,
        THREE.lift_quadratic,
        THREE.slipstream,
    )
    for name, values in expected._asdict().items():
        assert getattr(c, name) == pytest.approx(values), name
